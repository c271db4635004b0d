"""The TOML table of a shaft line: bends, stiffness and damping; stiffness is a number or follows from the geometry.

`form` gives the pydantic model of the table, `line_values` its numbers::

    [driveline]
    alpha1 = "12 deg"
    shaft2 = { section = "hollow", outer = "90 mm", inner = "70 mm", length = "1.2 m" }
    c3 = 8e4
    damping_ratio = 0.02
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, Field

from ..core.errors import Faults, InputError, refusal_prefix
from ..core.quantities import Quantity, Value, Variable, declaration, quantity, variables
from ..reading.tables import number, schema, to_number
from .cardan import ShaftLine
from .shafts import SECTIONS, Shaft, stiffness_of

SHAFTS = {"shaft2": "c2", "shaft3": "c3"}

CORNER = Variable("outline", "coordinate of a corner", Quantity("m", "", None, -10.0, 10.0))
"""A coordinate in the outline of a polygon."""


@declaration
class Damping:
    """The damping of both shafts as one number."""

    damping_ratio: Value = quantity(
        "1",
        "damping ratio of the torsional vibration at i23 = 1; sets d2 and d3, in proportion to c2 and c3",
        default=0.02,
        min=0.0,
        max=0.5,
    )


def form(declared: type[ShaftLine], title: str, prefix: str, **others: Any) -> type[BaseModel]:
    """The pydantic model of the table: the fields of `declared`, tables `shaft2`, `shaft3`, `damping_ratio`,
    `others`.

    `prefix` stands before a name in messages, such as "driveline.".
    """
    more: dict[str, Any] = {
        v.name.removeprefix(prefix): number(v) for v in variables(Damping, prefix)
    } | others
    for name in SHAFTS:
        inner = _shaft(name, prefix + name + ".")
        more[name] = (inner, Field(default_factory=inner))
    return schema(declared, title, prefix, **more)


def _shaft(title: str, prefix: str) -> type[BaseModel]:
    """The form of the table of a shaft by its geometry."""
    corner = replace(CORNER, name=prefix + CORNER.name)
    coordinate = Annotated[float, BeforeValidator(lambda entry: to_number(corner, entry))]
    outline = list[tuple[coordinate, coordinate]]
    return schema(
        Shaft,
        title,
        prefix,
        section=(Literal[*SECTIONS], None),
        outline=(outline, None),
        holes=(list[outline], None),
    )


def line_values(table: BaseModel, prefix: str) -> dict[str, Any]:
    """The values of the table by name, with the stiffness computed from the geometry of the shafts. A `damping_ratio`
    is returned unchanged, since it refers to inertias that the table may not have.

    Raises
    ------
    InputError
        in one line: for a stiffness or a damping that is given twice, and see `shafts.stiffness_of`.
    """
    numbers = {name: getattr(table, name) for name in table.model_fields_set}
    faults = Faults()
    twice = [(stiffness, shaft) for shaft, stiffness in SHAFTS.items()]
    for name, other in (*twice, ("d2", "damping_ratio"), ("d3", "damping_ratio")):
        if name in numbers and other in numbers:
            message = f"given beside {prefix}{other}, which sets it; leave out one of the two"
            faults.add([InputError(f"{prefix}{name}: {message}", prefix + name)])
    for shaft, stiffness in SHAFTS.items():
        shaft_table = numbers.pop(shaft, None)
        if shaft_table is not None:
            keys = {name: getattr(shaft_table, name) for name in shaft_table.model_fields_set}
            with faults.collected(), refusal_prefix(f"{prefix}{shaft}.", prefix + shaft):
                numbers[stiffness] = stiffness_of(keys)
    faults.refuse()
    return numbers
