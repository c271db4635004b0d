"""Capabilities: each folder answers one question, and its name in this list registers it."""

NAMES = (
    "chains",
    "sides",
    "blade",
    "random_overloads",
    "flywheels",
    "torsion",
    "optimize",
    "identification",
    "sweep",
    "comparison",
)
"""The folders of the capabilities, in the order in which their tables, results and sections come."""
