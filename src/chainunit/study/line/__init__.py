"""The parts of the line between motor and machine: each is a module of this package, and its name in this list
registers it."""

NAMES = ("driveline",)
"""The modules, in the order of the parts from the motor to the machine."""
