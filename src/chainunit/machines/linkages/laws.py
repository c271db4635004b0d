"""Laws of one angle or way, as expressions and tables: the course of a driver, and the radius of a cam."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from ...core.jets import Jet, jet, variable
from ...groups.driver import Course
from ...mechanism.curves import TableCurve
from ...mechanism.expressions import expression, value_of


class LawCourse(NamedTuple):
    """A course by a `law`: an expression of ``phi``, of quantities with `values`, and of `tables` over ``phi``."""

    law: float | str
    values: Mapping[str, Any]
    tables: Mapping[str, TableCurve]

    def __call__(self, xp: Any, q: Any) -> Course:
        """The place and its derivatives at the place `q` of the first driver."""
        engine, phi = jet(xp), variable(q)
        names = expression(self.law).names if isinstance(self.law, str) else ()
        over_phi = {name: table.value(engine, phi) for name, table in self.tables.items() if name in names}
        place = value_of(engine, self.law, {**self.values, **over_phi, "phi": phi})
        return Course(place.parts[0], place.parts[1:]) if isinstance(place, Jet) else held(place)


def held(place: Any) -> Course:
    """The course of a driver that stands at a place."""
    return Course(place, (0.0, 0.0, 0.0))


def splines(tables: Mapping[str, Mapping[str, Any]], turns: bool) -> dict[str, TableCurve]:
    """The tables over the place of the first driver, which may turn round, as laws take them."""
    return {
        name: TableCurve(table["places"], table["values"], turns, spline=True)
        for name, table in tables.items()
        if table["over"] == "phi"
    }
