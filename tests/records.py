"""The record of a study before its runs, for tests."""

from __future__ import annotations

from chainunit.study.cycle import turns_by_load
from chainunit.study.record import StudyRecord
from chainunit.study.statics import statics


def record_of(config, drive, proposal=None):
    turns = turns_by_load(config.machine, config.run.crank_speed, config.feed)
    return StudyRecord(config, drive, statics(drive, turns, config.run.step), proposal)
