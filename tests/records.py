"""The record of a study before its runs, records with changes, and stand-ins for records, for tests."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

from chainunit.study.cycle import turns_by_load
from chainunit.study.record import StudyFindings, StudyRecord, StudyRuns, StudySetup
from chainunit.study.statics import statics


def record_of(config, drive, proposal=None):
    turns = turns_by_load(config.machine, config.run.crank_speed, config.feed)
    return StudyRecord(StudySetup(config, drive, statics(drive, turns, config.run.step), proposal))


def changed(study, **changes):
    """A copy of a record with other values of fields of its parts; the other fields are those of the record."""
    if "config" in changes:
        changes |= {"operation": changes["config"].operation, "events": changes["config"].events}
    parts = {}
    for name in ("setup", "runs", "findings"):
        part = getattr(study, name)
        own = {field.name for field in dataclasses.fields(part)}
        parts[name] = dataclasses.replace(part, **{key: x for key, x in changes.items() if key in own})
    assert changes.keys() <= {field.name for part in parts.values() for field in dataclasses.fields(part)}
    other = StudyRecord(parts["setup"])
    other.runs, other.findings = parts["runs"], parts["findings"]
    return other


def like(**values):
    """A stand-in for a record that has these values alone: each in the parts with such a field or property."""
    parts = {"setup": StudySetup, "runs": StudyRuns, "findings": StudyFindings}
    names = {part: {*dir(kind), *(f.name for f in dataclasses.fields(kind))} for part, kind in parts.items()}
    assert values.keys() <= set().union(*names.values())
    return SimpleNamespace(
        **{part: SimpleNamespace(**{n: values[n] for n in values.keys() & names[part]}) for part in parts}
    )
