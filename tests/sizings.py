"""Sizing in its steps, for tests: its task, its duty, and its findings for a study."""

from __future__ import annotations

from chainunit.capabilities.sizing.duty import duty_of
from chainunit.capabilities.sizing.motor_trials import MotorTrials
from chainunit.capabilities.sizing.task import SizingTask


def task_of(config):
    return SizingTask(config.plans["sizing"], config.drive, config.machine, config.operation, config.events)


def trials_of(config, duty):
    return MotorTrials(task_of(config), duty)


def duty_by(config, folder):
    return duty_of(task_of(config), config.organs, config.values, folder, None)


def sized_by(config, folder, progress=lambda *said: None, backend=None):
    """The findings of sizing; see `chainunit.study.run.run_study`."""
    return config.plans["sizing"].proposal(config.drive_request, folder, progress, backend).findings
