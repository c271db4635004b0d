"""The linear model with frequency responses of chosen pairs: their computation, and the files in JSON and NPZ."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ... import __version__
from ...core.errors import InputError, shown
from ...core.files import atomic_file
from ...core.quantities import quotient
from ...reading.results import OWN, as_data, part, result
from ...study.linear import linear_point
from ...system.linear import LinearModel, place
from ...work.progress import TaskProgress

NPZ = "linear.npz"
_PLACES = 400
_DECADE, _WIDEST = 10.0, 1e5
"""Distance of the ends from the poles, and largest ratio of the ends."""
_USUAL = 0.1, 1000.0
"""Range of frequencies of a model without a pole beside those at 0 [rad/s]."""


class LinearQuestion(NamedTuple):
    """A linear model that is asked for: the file or name of its model, its point (see `chainunit.linearize`), pairs
    INPUT:OUTPUT, and the study file that gives the values of a model."""

    name: str
    at: str | None = None
    pairs: str | None = None
    config: Path | None = None
    inverse: bool = False


@result
class FrequencyResponse:
    """The frequency response of an output to an input."""

    to: str = part("the input")
    of: str = part("the output")
    unit: str = part("the unit of the gain: that of the output by that of the input")
    frequency: np.ndarray = part("frequencies", unit="rad/s")
    gain: np.ndarray = part("size of the response", unit=OWN)
    phase: np.ndarray = part("phase of the response, without jumps of a turn", unit="rad")


@result
class LinearResult:
    """A linear model, and the responses of the chosen pairs."""

    source: str = part("the file or the name of the model")
    linear: LinearModel = part(inline=True)
    responses: tuple[FrequencyResponse, ...] = part("frequency responses of the chosen pairs")


def find(question: LinearQuestion, progress: TaskProgress) -> LinearResult:
    """The linear model with the responses of the pairs.

    Raises
    ------
    InputError, RunError
        see `chainunit.linearize`, and for a pair that the model has not.
    """
    pairs = _pairs(question.pairs)
    point = linear_point(
        question.name,
        question.at,
        question.config,
        inverse=question.inverse,
        progress=lambda what: progress(what, 0.0, 1.0),
    )
    progress("derivatives", 0.5, 1.0)
    linear = point.linear()
    frequency = frequencies(linear)
    return LinearResult(
        question.name, linear, tuple(_response(linear, to, output, frequency) for to, output in pairs)
    )


def _pairs(text: str | None) -> list[tuple[str, str]]:
    """The pairs (input, output) of the option --pairs; none without it."""
    if text is None:
        return []
    pairs = []
    for pair in text.split(","):
        to, sign, output = (name.strip() for name in pair.partition(":"))
        if not (sign and to and output):
            raise InputError(f'--pairs {shown(pair.strip())}: must be INPUT:OUTPUT, such as "w_ref:w"')
        pairs.append((to, output))
    return pairs


def frequencies(linear: LinearModel) -> np.ndarray:
    """Frequencies [rad/s] from a decade below the slowest pole that is not 0 to one above the fastest, the last five
    decades of it at most, with both sides of each natural frequency, shape (n,)."""
    natural = [pole.natural_frequency for pole in linear.poles if pole.natural_frequency > 0.0]
    low, high = (min(natural) / _DECADE, max(natural) * _DECADE) if natural else _USUAL
    low = max(low, high / _WIDEST)
    near = [pole * (1.0 + by) for pole in natural for by in (-1e-3, 1e-3) if pole > 2.0 * low]
    return np.unique([*np.geomspace(low, high, _PLACES), *near])


def _response(linear: LinearModel, to: str, output: str, frequency: np.ndarray) -> FrequencyResponse:
    """The frequency response of an `output` to the input `to`."""
    above = linear.outputs[place("output", output, linear.outputs)].unit
    below = linear.inputs[place("input", to, linear.inputs)].unit
    values = linear.response(to, output, frequency)
    return FrequencyResponse(
        to, output, quotient(above, below), frequency, np.abs(values), np.unwrap(np.angle(values))
    )


def data(findings: LinearResult) -> dict[str, Any]:
    """The content of linear.json."""
    return {"chainunit": __version__, **as_data(findings)}


def write_npz(findings: LinearResult, folder: Path) -> list[Path]:
    """Write linear.npz: the matrices A, B, C, D, and of states, inputs and outputs (x, u, y) the values x, u, y and
    the rates dx at the point with ``_names`` and ``_units``. Returns the file."""
    linear = findings.linear
    arrays: dict[str, Any] = {name: getattr(linear, name) for name in "ABCD"}
    for letter, signals in (("x", linear.states), ("u", linear.inputs), ("y", linear.outputs)):
        arrays[letter] = np.array([signal.value for signal in signals], float)
        arrays[f"{letter}_names"] = np.array([signal.name for signal in signals], str)
        arrays[f"{letter}_units"] = np.array([signal.unit for signal in signals], str)
    arrays["dx"] = np.array([state.rate.value for state in linear.states], float)
    file = folder / NPZ
    with atomic_file(file) as draft, draft.open("wb") as stream:
        np.savez(stream, **arrays)
    return [file]
