"""The given values of a study, by the sections of a study file: only values that the study uses, each with its
origin."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..core.quantities import variables
from ..reading.results import as_data
from ..reading.text import entry
from .catalogue_drive import BOOST, SLIP
from .config import FileContents
from .event_table import random_runs
from .parts import LENGTHS
from .record import StudyRecord, StudySetup
from .rules import all_rules
from .sections import SystemTable, all_choices, all_sections


@dataclass(frozen=True)
class GivenSection:
    """A table of the file; the one with an empty name holds the keys before all tables."""

    name: str
    title: str
    values: Any = None
    """an instance of the declared quantities, or None"""
    choices: Mapping[str, Any] = field(default_factory=dict)
    """words, switches and lists, by key"""
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """ranges of the quantities that are drawn at random"""
    unused_names: frozenset[str] = frozenset()
    """quantities in whose place the study uses something else"""

    @property
    def place(self) -> str:
        """Its place in the result; it is under `asked` where the result has other things of the same names."""
        table, _, inner = self.name.partition(".")
        sections = all_sections()
        if table not in sections or not sections[table].apart:
            return self.name
        return f"{table}.asked.{inner}" if inner else f"{table}.asked"

    @property
    def names(self) -> list[str]:
        """Full names of all its values, as in a study file."""
        prefix = f"{self.name}." if self.name else ""
        quantities = [v.name for v in variables(type(self.values))] if self.values is not None else []
        names = [name for name in quantities if name not in self.unused_names]
        return [*(prefix + name for name in names), *(prefix + key for key in self.choices)]

    @property
    def data(self) -> dict[str, Any]:
        """The values as a result has them."""
        values = {} if self.values is None else as_data(self.values)
        values = {name: x for name, x in values.items() if name not in self.unused_names}
        ranges = {name: {**values[name], "value": list(ends)} for name, ends in self.ranges.items()}
        return values | ranges | {key: _choice(value) for key, value in self.choices.items()}


def _choice(value: Any) -> Any:
    """A choice ready for JSON."""
    if isinstance(value, float):
        return entry(value, "1")
    return list(value) if isinstance(value, tuple) else value


def given_sections(study: StudyRecord) -> list[GivenSection]:
    """All given values of a study; with them the study can be repeated."""
    setup, config, runs = study.setup, study.setup.config, study.runs
    sections = [
        GivenSection("", "Study", None, _of_study(config.file)),
        GivenSection("system", "System", None, _system(config.file.choices, is_chosen=config.motor is None)),
        GivenSection("machine", "Machine", setup.drive.machine.p),
        GivenSection("feed", "Feed in normal running", config.feed),
        *(
            GivenSection(f"event.{name}", runs.title_of(name)[:1].upper() + runs.title_of(name)[1:], event.p)
            for name, event in config.events.items()
        ),
        *_tables(study),
        GivenSection("motor", "Motor", setup.drive.parameters),
    ]
    return [section for section in sections if section.values is not None or section.choices]


def _of_study(file: FileContents) -> dict[str, Any]:
    """The choices of no table, such as the kind of start, that a file of this kind may have."""
    # a key that a file of this kind may not have is not used either
    refused = {rule.key for rule in all_rules() if rule.refused is None and rule.on.holds(file.tables)}
    used = all_choices().keys() - refused
    return {name: x for name, x in file.choices.items() if name in used and x != ""}


def _system(choices: Mapping[str, Any], *, is_chosen: bool) -> dict[str, Any]:
    """Names of machine and motor, and the names of our variables in their FMUs; without the motor where it
    `is_chosen`."""
    system_choices = {
        name.removeprefix("system."): x for name, x in choices.items() if name.startswith("system.")
    }
    return {name: x for name, x in system_choices.items() if x and (name != "motor" or not is_chosen)}


def _tables(study: StudyRecord) -> Iterator[GivenSection]:
    """The declared tables that the study uses, with their values, and their random overloads as sections of their
    own."""
    config = study.setup.config
    randoms = {runs.key: runs.event for runs in random_runs(config.plans)}
    for name, section in all_sections().items():
        placed = study.setup.drive.line.part(name)
        values = config.table(name) if placed is None or placed.table is None else placed.table
        if values is None or not section.is_used(study):
            continue
        choices = {}
        for full, x in config.file.choices.items():
            table, _, key = full.partition(".")
            # the findings have the entries of a list of tables, and random events are sections of their own
            if table == name and x and key not in {*section.lists.entries, *section.random_events}:
                choices[key] = x
        # without its own ratio the gear has that of the machine, which follows from the motor's speed
        follows = frozenset({"ratio"} if name == "gear" and "gear.ratio" not in config.file.given else ())
        yield GivenSection(name, section.title, values, choices, unused_names=follows)
        for key in (
            key for key in section.random_events if config.file.choices.get(f"{name}.{key}") is not None
        ):
            random = randoms[f"{name}.{key}"]
            side = {"side": random.side} if random.side else {}
            title = f"Overload at random: {random.heading}"
            yield GivenSection(
                f"{name}.{key}", title, random.p, {"type": random.of.kind} | side, random.ranges
            )


def description(name: str) -> str:
    """The description of a key that is no quantity, by its name in a study file."""
    table, _, key = name.partition(".")
    if name in all_choices():
        return str(all_choices()[name][1].description)
    if table == "system":
        field = SystemTable.model_fields.get(key)
        return str(field.description) if field else "name of it in the FMU"
    section = all_sections().get(table)
    if section is not None and key in section.keys:
        return str(section.keys[key][1].description)
    others = variables(section.form.instead) if section is not None and section.form.instead else ()
    return next((v.description for v in others if v.name == key), "")


_CHOSEN = ("gear.efficiency", BOOST, SLIP)
"""Values that follow from a proposed drive where the file leaves them out, see `as_used` of `catalogue_drive`."""


def origin_of(setup: StudySetup, name: str) -> str:
    """The origin of the value of a quantity, by its name in a study file ("motor.rotor.J"): "file", "linkage" (the
    file of the machine), "example", "tuned", "catalogue" (by the motor that the file names), the name of a proposal,
    or "declared"."""
    config, proposal, (section, _, parameter) = setup.config, setup.proposal, name.partition(".")
    file, is_declared = config.file, _of(config.file, name) == "declared"
    if is_declared and proposal is not None and name in _CHOSEN:
        return proposal.name
    if is_declared and name == SLIP and config.drive.start == "inverter":
        return "catalogue"
    if section == "motor" and (tuning := setup.drive.tuning) and parameter in tuning.parameters:
        return "file" if name in file.given else "tuned"
    # the papers' ratios stand for the lengths
    if section == "machine" and parameter in LENGTHS and file.gives("ratios"):
        return "file"
    if section == "machine" and parameter in LENGTHS and "ratios.rho" in file.of_example:
        return "example"
    if config.of_catalogue and (name == "machine.ratio" or section == "motor"):
        if name_in_file := _name_in_file(setup, parameter):
            return _of(file, name_in_file)
        return "catalogue" if proposal is None else proposal.name
    return _of(file, name)


def place_of(setup: StudySetup, name: str) -> str:
    """The file and the line that give the value of a quantity ("jaw.toml, line 23"); empty where no file does."""
    file, origin = setup.config.file, origin_of(setup, name)
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


def _name_in_file(setup: StudySetup, parameter: str) -> str:
    """The name in a study file of a motor's `parameter`; empty for one that the catalogue sets."""
    config, proposal = setup.config, setup.proposal
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
