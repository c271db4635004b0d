"""A linkage at rest: its equilibria, the torque that holds it elsewhere, and its potential, for page and data."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from ..machines.equilibria import INDIFFERENT, SADDLE, STABLE, STOP, UNSTABLE, Holding
from ..machines.linkages.loads import loads_by_speed
from ..reading.results import as_data
from ..reading.text import array_entry
from ..study.linkage_turn import LinkageFindings
from . import blocks as b
from . import figure as fig
from .lines import Line, Name, join, line

_KINDS = {
    STABLE: "stable",
    UNSTABLE: "unstable",
    SADDLE: "unstable to one side",
    INDIFFERENT: "indifferent",
    STOP: "rests on its stop",
}
_MARKERS = {STABLE: "o", STOP: "s", UNSTABLE: "x", SADDLE: "+"}
_AT_DRIVER = frozenset(("place", "end", "holding", "stiffness", "inertia", "friction", "peak", "peak_at"))
"""The quantities in the units of the driver."""


def rest_data(f: LinkageFindings) -> dict[str, Any]:
    """The data of a linkage at rest."""
    equilibria, unit = f.rest, f.machine.model.driver_port.unit

    def data(x: Any) -> dict[str, Any]:
        return {
            name: entry | {"unit": unit(entry["unit"])} if name in _AT_DRIVER else entry
            for name, entry in as_data(x).items()
        }

    rest = equilibria.rest
    columns = (
        ("driver", rest.q, "rad"),
        ("holding", rest.holding, "N.m"),
        ("friction", rest.friction, "N.m"),
    )
    potential = {} if rest.potential is None else {"potential": array_entry(rest.potential, "J")}
    return {
        "equilibria": [data(equilibrium) for equilibrium in equilibria.places],
        "summary": data(equilibria.summary),
        "indifferent": equilibria.indifferent,
        "repeats": equilibria.repeats,
        "without_potential": [name.removeprefix("loads.") for name in equilibria.driven],
        "by_speed": loads_by_speed(f.description.data["loads"]),
        "over_the_way": {name: array_entry(x, unit(rotary_unit)) for name, x, rotary_unit in columns}
        | potential,
    }


def at_rest(s: b.Source, f: LinkageFindings, file: str) -> Iterator[b.Block]:
    """The section of the report; `file` is the name of its picture."""
    equilibria = f.rest
    effort = "force" if f.machine.model.slides else "torque"
    if equilibria.indifferent:
        yield b.Text(f"No load has a {effort} at the driver: at rest the machine stays wherever it is.")
        return
    if bool(np.all(np.abs(equilibria.rest.holding) <= equilibria.rest.friction)):
        text = "At rest the machine stays wherever it is: friction of pins and guides holds more, at most {most}, "
        text += f"than the holding {effort}, at most {{holding}}."
        most = {"most": s.number("rest.summary.friction"), "holding": s.number("rest.summary.peak")}
        yield b.Text(s.line(text, **most))
        return
    yield b.Text(
        f"Where the holding {effort} is zero, the machine is in equilibrium. It is stable where the potential has a "
        "minimum; about it a small swing has the natural frequency, at the driver and undamped.",
        "lead",
        "long",
    )
    yield _table(s, f, effort)
    yield b.Table(s.rows(Holding, "rest.summary"), title=f"Holding {effort} over the way of the driver")
    yield from _notes(s, f, effort)
    yield _figure(f, effort, file)


def _table(s: b.Source, f: LinkageFindings, effort: str) -> b.Table:
    rows = []
    for k, equilibrium in enumerate(f.rest.places):
        path = f"rest.equilibria.{k}"
        place: Line = s.number(f"{path}.place")
        if equilibrium.kind == INDIFFERENT:
            place = line(place, " to ", s.number(f"{path}.end"))
        keys = ("stiffness", "natural_frequency", "inertia", "potential", "friction")
        name = f"{k + 1}: {_KINDS[equilibrium.kind]}"
        rows.append(b.TableRow((name, place, *(s.number(f"{path}.{key}") for key in keys))))
    columns = (
        *b.heads("equilibrium", "at", "stiffness", "natural frequency"),
        b.Column("mass" if f.machine.model.slides else "inertia", form="long"),
        b.Column("potential"),
        b.Column(f"friction holds a {effort} of", form="long"),
    )
    return b.Table(tuple(rows), columns, title="Equilibria")


def _names(names: Collection[str]) -> Line:
    return join(map(Name, names))


def _notes(s: b.Source, f: LinkageFindings, effort: str) -> Iterator[b.Block]:
    """What the numbers do not say by themselves."""
    data, equilibria = s.result["rest"], f.rest
    for k, equilibrium in enumerate(equilibria.places):
        if equilibrium.kind == STOP:
            path = f"rest.equilibria.{k}"
            yield b.Text(
                s.line(f"On its stop at {{{path}.place}} the driver rests with {{{path}.holding}} on it.")
            )
    if data["by_speed"]:
        depend = "depends" if len(data["by_speed"]) == 1 else "depend"
        yield b.Text(
            line(
                _names(data["by_speed"]),
                f" {depend} on the speed: here with the value at the speed 0; a step by the speed has half its size "
                "there.",
            ),
            "note",
        )
    if data["without_potential"]:
        yield b.Text(
            line(
                "The potential is the energy of weights and springs and, of ",
                _names(data["without_potential"]),
                f", the integral of the holding {effort} over the way.",
            ),
            "note",
            "long",
        )
    if not equilibria.repeats:
        yield b.Text(
            "The loads are not the same after a turn: the way is half a turn to either side of the start.",
            "note",
        )
    elif equilibria.rest.potential is None:
        yield b.Text(
            s.line(
                "A turn takes {rest.summary.work} from the driver, without friction: no potential belongs to a place."
            ),
            "note",
        )
    if equilibria.summary.friction:
        yield b.Text(
            s.line(
                f"The holding {effort} is without friction. Where friction of pins and guides holds more, at most "
                "{rest.summary.friction}, the machine stands still, too. The smoothed friction of the models is zero "
                "at rest and holds nothing."
            ),
            "note",
            "long",
        )
    else:
        yield b.Text("The file has no friction.", "note", "long")


def _figure(f: LinkageFindings, effort: str, file: str) -> fig.Figure:
    model, unit, rest = f.machine.model, f.machine.model.driver_port.unit, f.rest.rest
    place = fig.Axis(
        "way of the driver" if model.slides else "angle of the driver",
        unit("rad"),
        low=float(rest.q[0]),
        high=float(rest.q[-1]),
        step=45.0 if model.turns else None,
    )
    panels = [(fig.Axis(f"holding {effort}", unit("N.m")), rest.holding)]
    if rest.potential is not None:
        panels.append((fig.Axis("potential", "J"), rest.potential))
    items: list[tuple[fig.Axis, tuple[fig.Item, ...]]] = []
    for k, (axis, values) in enumerate(panels):
        band: tuple[fig.Item, ...] = ()
        if k == 0 and f.rest.summary.friction:
            band = (fig.Between("held by friction", rest.q, -rest.friction, rest.friction, "pale"),)
        curve = fig.Curve(axis.label, rest.q, values, in_legend=False)
        items.append((axis, (*band, curve, *_marks(f, values, k == 0))))
    return fig.Figure(
        "linkage-rest",
        f"Holding {effort} and equilibria over the way of the driver",
        f"The {effort} that holds the driver at rest over its way, with the equilibria; below it the potential.",
        fig.stacked(place, items),
        file=file,
    )


def _marks(f: LinkageFindings, values: Any, named: bool) -> Iterator[fig.Item]:
    """The equilibria on a curve, a kind at a time."""
    rest = f.rest.rest
    low, high = float(rest.q[0]), float(rest.q[-1])
    for look, kind in enumerate(_MARKERS, 1):
        places = [equilibrium.place for equilibrium in f.rest.places if equilibrium.kind == kind]
        if f.machine.model.turns:  # on the turn that is drawn
            places = [low + (x - low) % (high - low) for x in places]
        if places:
            yield fig.Curve(
                _KINDS[kind],
                np.array(places),
                np.interp(places, rest.q, values),
                look,
                marker=_MARKERS[kind],
                has_line=False,
                in_legend=named,
            )
    for equilibrium in f.rest.places:
        if equilibrium.kind == INDIFFERENT:
            yield fig.Shade(equilibrium.place, equilibrium.end, _KINDS[INDIFFERENT] if named else "")
