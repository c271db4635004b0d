"""The parts of the line between motor and machine: each is a module of this package, and its entry point in
pyproject.toml registers it."""
