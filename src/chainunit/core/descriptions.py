"""Texts with a slot for the driver of a machine: the link that the motor turns, whose noun each machine names."""

from __future__ import annotations

USUAL_DRIVER = "crank"
"""The noun of the driver, in the texts of a machine that names no other."""


def of_driver(text: str, driver: str = USUAL_DRIVER) -> str:
    """The `text` with the noun of the driver in its slots ``{driver}`` and, with an article, ``{a driver}``."""
    article = "an" if driver[:1] in "aeiou" else "a"
    return text.replace("{driver}", driver).replace("{a driver}", f"{article} {driver}")


class Described:
    """A quantity with the `template` of its description, a text with slots."""

    __slots__ = ()
    template: str

    @property
    def description(self) -> str:
        """The description, of a machine with a crank."""
        return of_driver(self.template)

    def described(self, driver: str) -> str:
        """The description, of a machine with that noun for its driver."""
        return of_driver(self.template, driver)
