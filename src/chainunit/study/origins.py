"""The origins of the values of a study."""

from __future__ import annotations

from pathlib import Path

from .catalogue_drive import BOOST, SLIP
from .config import FileContents
from .parts import LENGTHS
from .record import StudyRecord

_CHOSEN = ("gear.efficiency", BOOST, SLIP)
"""Values that follow from a proposed drive where the file leaves them out, see `chainunit.study.choice.as_chosen`."""


def origin_of(study: StudyRecord, name: str) -> str:
    """The origin of the value of a quantity, by its name in a study file ("motor.rotor.J"): "file", "linkage" (the
    file of the machine), "example", "tuned", "catalogue" (by the motor that the file names), the name of a proposal,
    or "declared"."""
    config, (section, _, parameter) = study.config, name.partition(".")
    if name in _CHOSEN and study.proposal is not None and _of(config.file, name) == "declared":
        return study.proposal.name
    if name == SLIP and config.drive.start == "inverter" and _of(config.file, name) == "declared":
        return "catalogue"
    if section == "motor" and (tuning := study.drive.tuning) and parameter in tuning.parameters:
        return "file" if name in config.file.given else "tuned"
    if section == "machine" and parameter in LENGTHS and config.file.gives("ratios"):
        return "file"
    if section == "machine" and parameter in LENGTHS and "ratios.rho" in config.file.of_example:
        return "example"
    if config.of_catalogue and (name == "machine.ratio" or section == "motor"):
        name_in_file = _name_in_file(study, parameter)
        if not name_in_file:
            return "catalogue" if study.proposal is None else study.proposal.name
        name = name_in_file
    return _of(config.file, name)


def place_of(study: StudyRecord, name: str) -> str:
    """The file and the line that give the value of a quantity ("jaw.toml, line 23"); empty where no file does."""
    file, origin = study.config.file, origin_of(study, name)
    if origin == "file" and (line := file.lines.get(name)):
        return f"{Path(file.source).name}, line {line}"
    return f"{file.linkage}, line {_linkage_line(file, name)}" if origin == "linkage" else ""


def _of(file: FileContents, name: str) -> str:
    """The origin of a value that only a file or the example can give."""
    if name in file.given:
        return "file"
    if _linkage_line(file, name):
        return "linkage"
    return "example" if name in file.of_example else "declared"


def _linkage_line(file: FileContents, name: str) -> int:
    """The line of the linkage file that gives the value of a quantity; 0 where it does not."""
    table, _, key = name.partition(".")
    # a link whose name has another meaning, too, has its kind in the name of its quantities
    links = (f"links.{key}", f"links.{key.replace('_link.', '.', 1)}")
    keys = {"feed": (f"inputs.{key}",), "machine": (_GRAVITY.get(key, key), f"parameters.{key}", *links)}
    return next(
        (file.linkage_lines[line_key] for line_key in keys.get(table, ()) if line_key in file.linkage_lines),
        0,
    )


_GRAVITY = {"g": "gravity"}


def _name_in_file(study: StudyRecord, parameter: str) -> str:
    """The name in a study file of a motor's `parameter`; empty for one that the catalogue sets."""
    config, proposal = study.config, study.proposal
    if proposal is not None and parameter in proposal.keys:
        return proposal.keys[parameter]
    if parameter == "ratio":
        return "gear.ratio" if _of(config.file, "gear.ratio") != "declared" else ""
    group = parameter.partition(".")[0]
    if parameter == "inverter.on":
        return "start"
    if parameter == "inverter.slip" and config.drive.start == "inverter" and SLIP not in config.file.given:
        return ""
    if parameter == "switching.preferred" and config.drive.start == "star-delta":
        return "starter.star_delta.preferred"
    if group in ("soft_start", "inverter"):
        return f"starter.{parameter}"
    is_own = parameter in ("phi_start", "w_start", "ambient.T") or group in ("solver", "switching")
    return f"motor.{parameter}" if is_own else ""
