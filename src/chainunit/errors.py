"""Errors that speak to an engineer: the quantity, its value, the allowed range, what to do."""

from __future__ import annotations

from typing import Any


class InputError(ValueError):
    """A value given by the user is outside what is allowed; the message is one line."""


class GeometryError(InputError):
    """The lengths do not make a machine that turns a full crank revolution."""


class RunError(RuntimeError):
    """A run stopped half-way; `partial` holds what was computed before, if anything was."""

    partial: Any = None


class InterruptedRunError(RunError):
    """The run was stopped from outside (Ctrl-C, SIGTERM)."""


class WriteError(RunError):
    """A file could not be written, such as on a full disk; the message names it."""
