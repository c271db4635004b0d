"""The turning pins of a machine by the names that a study file may give them."""

from __future__ import annotations

from typing import Any

from ...core.errors import meant


def turning_pins(model: Any) -> list[str]:
    """The titles of the pins of a machine that turn."""
    return [title for title, output in model.pins.items() if output in model.joints]


def first_word(title: str) -> str:
    """The short name of a pin."""
    return title.partition(" ")[0]


def pins_named(name: str, titles: list[str]) -> list[str]:
    """The pins of these `titles` with a name: a whole title, or its first words. A name that several pins begin with
    stands for each of them."""
    return [title for title in titles if title == name or title.startswith(f"{name} ")]


def no_pin(name: str, titles: list[str]) -> str:
    """The words on a name that no pin has."""
    names = [*dict.fromkeys(spelling for title in titles for spelling in (first_word(title), title))]
    return f"is no turning pin{meant(name, names)} there are {', '.join(titles) or 'none'}"
