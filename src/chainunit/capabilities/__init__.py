"""Capabilities: each folder answers one question, and its entry point in pyproject.toml registers it."""
