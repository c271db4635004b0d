"""The words in which a value, a machine or a step is refused.

Python formats these texts. The native code of FMUs has them as macros
(`chainunit.fmu.native.generate.rules`), where the fields of a text are arguments in the order of the text. A
`unit` has a blank before it; a pure number has no unit and no blank. Python FMUs carry this file.
"""

from __future__ import annotations

VALUE = "{name} = {value:g}{unit}: must be {allowed}"
NUMBER, FINITE = "a finite number", "finite, {allowed}"
"""what must be in place of a value that is not finite: without bounds, and with bounds"""

REQUIREMENT = "{subject} = {value:g}{unit}: {why}{parameters}; {limits}"
FIRST_PARAMETER, NEXT_PARAMETER = " with {name} = {value:g}", ", {name} = {value:g}"
ABOVE, BELOW, BETWEEN = (
    "must be > {low:g}{unit}",
    "must be < {high:g}{unit}",
    "must be > {low:g} and < {high:g}{unit}",
)
NO_VALUE = "no value fits; {remedy}"

FIXED = "{name} is fixed: set it before initialization or after reset"
NO_REFERENCE = "value reference {reference:d} does not exist"
OUTPUT_SET = "value reference {reference:d} is an output and cannot be set"
OTHER_TYPE = "value reference {reference:d} is no variable of the type {type}"
NO_OUTPUT = "an output of {model} is not a finite number at t = {time:g} s: the inputs are beyond any machine"

TIME = "{which} = {time:g} s: must be a finite number"
STOP = "stop time = {stop:g} s: must be >= {start:g} s, the start time"
STEP_SIZE = "step of {size:g} s from t = {time:g} s: must be finite and not negative"
STEP_BEGIN = "step from t = {time:g} s: the FMU is at t = {now:g} s"
STEP_END = "step of {size:g} s from t = {time:g} s: must end at {stop:g} s, the stop time, or before"
OVER_BUDGET = (
    "step of {size:g} s from t = {time:g} s: takes more than {name} = {most:g} steps of its own; shorten the step, "
    "or raise {name}"
)
ASTRAY = "the states left all bounds in the step from t = {time:g} s"

STATE = "saved state: {why}"
STATE_DAMAGED = "it is damaged"
STATE_OF_ANOTHER = "it belongs to another model, another version or kind of simulation"


def unit_behind(unit: str) -> str:
    """The unit with its blank, to follow a number: ``N.m`` -> N m."""
    return "" if unit == "1" else " " + unit.replace(".", " ")
