"""The record of a study before its runs, records with changes, and stand-ins for records, for tests."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

from chainunit.study.cycle import turns_by_load
from chainunit.study.record import StudyFindings, StudyRecord, StudyRuns, StudySetup
from chainunit.study.statics import statics

PARTS = {"setup": StudySetup, "runs": StudyRuns, "findings": StudyFindings}


def record_of(config, drive, proposal=None):
    turns = turns_by_load(config.machine, config.run.crank_speed, config.feed)
    setup = StudySetup(config, drive, statics(drive, turns, config.run.step), proposal)
    return StudyRecord(
        setup, StudyRuns(drive, config.operation, config.events), StudyFindings(drive.driver_noun)
    )


def changed(study, **changes):
    """A copy of a record with other values of fields of its parts; the other fields are those of the record."""
    if "config" in changes:
        changes |= {"operation": changes["config"].operation, "events": changes["config"].events}
    parts = {}
    for name, kind in PARTS.items():
        names = {field.name for field in dataclasses.fields(kind)} & changes.keys()
        parts[name] = dataclasses.replace(getattr(study, name), **{key: changes[key] for key in names})
    assert changes.keys() <= {field.name for kind in PARTS.values() for field in dataclasses.fields(kind)}
    return StudyRecord(**parts)


def like(**values):
    """A stand-in for a record that has these values alone: each in the parts with such a field or property."""
    names = {part: {*dir(kind), *(f.name for f in dataclasses.fields(kind))} for part, kind in PARTS.items()}
    assert values.keys() <= set().union(*names.values())
    return SimpleNamespace(
        **{part: SimpleNamespace(**{n: values[n] for n in values.keys() & names[part]}) for part in PARTS}
    )
