"""A crusher's accelerator behind a cardan shaft, by itself: the driveline file and the answers of `torsion`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from .. import __version__
from ..drives.cardan import Cardan, check, frequency_band, frozen_frequency
from ..drives.line_table import SHAFTS, Damping, form, values
from ..engines import numpy_
from ..errors import InputError
from ..quantities import Layout, variables
from ..reading import (
    file_form,
    given_values,
    instance,
    merged,
    packaged,
    read,
    read_table,
    schema,
    to_number,
    toml,
)
from . import torsion_answers
from .torsion import JOINTS, LineAnalysis, Report, Rotation, StabilityGrid, analyse

_RATIO = next(
    dataclasses.replace(v, name="stability.damping_ratios")
    for v in variables(Damping)
    if v.name == "damping_ratio"
)
_Line = form(Cardan, "driveline", "driveline.")
_Rotation = schema(Rotation, "running", "running.")
_Stability = schema(
    StabilityGrid,
    "stability",
    "stability.",
    joint=(Literal[*JOINTS], "alpha1"),
    damping_ratios=(
        Annotated[
            list[Annotated[float, BeforeValidator(lambda entry: to_number(_RATIO, entry))]],
            Field(min_length=1, max_length=4),
        ],
        [0.02],
    ),
)
_File = file_form("Driveline", {"driveline": _Line, "running": _Rotation, "stability": _Stability})


@dataclasses.dataclass(frozen=True)
class DrivelineConfig:
    """A driveline file, checked."""

    title: str
    line: Cardan
    rotation: Rotation
    grid: StabilityGrid
    joint: str
    damping_ratios: tuple[float, ...]


def load(file: Path | None = None) -> DrivelineConfig:
    """Read and check a driveline file; without one, the packaged example.

    Raises
    ------
    InputError
        in one line: the file, the field, its value and the allowed range.
    """
    return read(file, example, parse)


def example() -> str:
    """The packaged driveline file."""
    return packaged("driveline.toml")


def _over_example(data: Mapping[str, Any]) -> dict[str, Any]:
    """A driveline file laid over the packaged example: a value that is not named is the example's. Its shafts and
    its damping give way whole to the user's own."""
    base = toml(example())
    base["title"] = ""
    mine = data.get("driveline", {})
    for shaft, stiffness in SHAFTS.items():
        if shaft in mine or stiffness in mine:
            del base["driveline"][shaft]
    if "d2" in mine or "d3" in mine:
        del base["driveline"]["damping_ratio"]
    return merged(base, data)


def parse(text: str, source: str = "driveline") -> DrivelineConfig:
    """A driveline from TOML text.

    Raises
    ------
    InputError
        see `load`.
    """
    data = toml(text)
    read_table(_File, data)
    checked = read_table(_File, _over_example(data))
    line = instance(Cardan, values(checked.driveline, "driveline."))
    try:
        check(line)
    except InputError as error:
        raise InputError(f"driveline.{error}") from error
    rotation = instance(Rotation, given_values(checked.running))
    grid = given_values(checked.stability)
    config = DrivelineConfig(
        title=checked.title,
        line=line,
        rotation=rotation,
        grid=instance(
            StabilityGrid, {name: x for name, x in grid.items() if name in Layout(StabilityGrid).names}
        ),
        joint=checked.stability.joint,
        damping_ratios=tuple(sorted(set(checked.stability.damping_ratios))),
    )
    _consistent(config)
    return config


def _consistent(config: DrivelineConfig) -> None:
    rotation, grid = config.rotation, config.grid
    for low, high, name, unit in (
        (rotation.speed_low, rotation.speed_high, "running.speed_high", "rad/s"),
        (grid.bend_low, grid.bend_high, "stability.bend_high", "rad"),
    ):
        if not high > low:
            raise InputError(f"{name} = {high:g} {unit}: must be > {low:g} {unit}, the least")
    for name, count in (
        ("running.points", rotation.points),
        ("stability.speeds", grid.speeds),
        ("stability.bends", grid.bends),
    ):
        if count != int(count):
            raise InputError(f"{name} = {count:g}: must be a whole number")
    k = frozen_frequency(numpy_(), config.line, 1.0)
    if not 0.01 <= k <= 1e6:
        raise InputError(
            f"natural frequency of the driveline = {k:.3g} rad/s: must be >= 0.01 and <= 1e+06 rad/s; check c2, c3, "
            "J1, J4"
        )
    slowest = frequency_band(config.line).largest / 50.0
    for name in ("speed", "speed_low"):
        speed = getattr(rotation, name)
        if speed < slowest:
            raise InputError(
                f"running.{name} = {speed:g} rad/s: must be >= {slowest:.4g} rad/s, a fiftieth of the natural "
                "frequency; below that nothing resonates with orders 2 and 4"
            )


@dataclasses.dataclass(frozen=True)
class DrivelineStudy:
    """A driveline file and the analysis of its line."""

    title: str
    analysis: LineAnalysis


def run_driveline(config: DrivelineConfig, report: Report = lambda task, done, whole: None) -> DrivelineStudy:
    """Compute everything; `report` gets the present task, and how much of it is done."""
    analysis = analyse(config.line, config.rotation, config.grid, config.joint, config.damping_ratios, report)
    return DrivelineStudy(config.title, analysis)


def as_dict(study: DrivelineStudy) -> dict[str, Any]:
    """Ready for JSON, each number with its unit."""
    return {"chainunit": __version__, "title": study.title, **torsion_answers.as_dict(study.analysis)}
