"""A linkage at rest: its equilibria, the torque that holds it elsewhere, and its potential, for page and data."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..machines.equilibria import INDIFFERENT, SADDLE, STABLE, STOP, UNSTABLE, Equilibrium
from ..study.linkage_turn import LinkageAtRest, LinkageFindings
from . import blocks as b
from . import figure as fig
from . import machine_picture
from .cited import as_name, number, quantity_rows, table
from .lines import Line, filled, join, line

_KINDS = {
    STABLE: "stable",
    UNSTABLE: "unstable",
    SADDLE: "unstable to one side",
    INDIFFERENT: "indifferent",
    STOP: "rests on its stop",
}
_MARKERS = {STABLE: "o", STOP: "s", UNSTABLE: "x", SADDLE: "+"}


def at_rest(f: LinkageFindings, x: LinkageAtRest, file: str) -> Iterator[b.Block]:
    """The section of the report; `file` is the name of its picture."""
    equilibria = f.rest
    effort, _ = machine_picture.driver_nouns(f.machine)
    if equilibria.indifferent:
        yield b.Text(f"No load has a {effort} at the driver: at rest the machine stays wherever it is.")
        return
    if bool(np.all(np.abs(equilibria.rest.holding) <= equilibria.rest.friction)):
        text = "At rest the machine stays wherever it is: friction of the joints holds more, at most {}, than the "
        text += f"holding {effort}, at most {{}}."
        yield b.Text(filled(text, number(x.summary.friction), number(x.summary.peak)))
        return
    yield b.Text(
        f"Where the holding {effort} is zero, the machine is in equilibrium. It is stable where the potential has a "
        "minimum; about it a small swing has the natural frequency, at the driver and undamped.",
        "lead",
        "long",
    )
    yield from _equilibria(f, x, effort)
    yield b.Table(quantity_rows(x.summary), title=f"Holding {effort} over the way of the driver")
    yield from _notes(f, x, effort)
    yield _figure(f, effort, file)


def _equilibria(f: LinkageFindings, x: LinkageAtRest, effort: str) -> Iterator[b.Table]:
    """The table with a row for each equilibrium in the cited `x`; `effort` is "torque" or "force", by what holds the
    driver."""

    def place(equilibrium: Equilibrium) -> Line:
        """The place of an equilibrium, or the ends of its range."""
        begin = number(equilibrium.place)
        is_range = equilibrium.kind == INDIFFERENT
        return filled("{} to {}", begin, number(equilibrium.end)) if is_range else begin

    _, inertia = machine_picture.driver_nouns(f.machine)
    return table(
        enumerate(x.equilibria, 1),
        ("equilibrium", lambda row: f"{row[0]}: {_KINDS[row[1].kind]}"),
        ("at", lambda row: place(row[1])),
        ("stiffness", lambda row: number(row[1].stiffness)),
        ("natural frequency", lambda row: number(row[1].natural_frequency)),
        (b.Column(inertia, form="long"), lambda row: number(row[1].inertia)),
        ("potential", lambda row: number(row[1].potential)),
        (b.Column(f"friction holds a {effort} of", form="long"), lambda row: number(row[1].friction)),
        title="Equilibria",
    )


def _notes(f: LinkageFindings, x: LinkageAtRest, effort: str) -> Iterator[b.Block]:
    """What the numbers do not say by themselves."""
    equilibria = f.rest
    for equilibrium in x.equilibria:
        if equilibrium.kind == STOP:
            stop = "On its stop at {} the driver rests with {} on it."
            yield b.Text(filled(stop, number(equilibrium.place), number(equilibrium.holding)))
    if x.by_speed:
        depend = "depends" if len(x.by_speed) == 1 else "depend"
        yield b.Text(
            line(
                join(map(as_name, x.by_speed)),
                f" {depend} on the speed: here with the value at the speed 0; a step by the speed has half its size "
                "there.",
            ),
            "note",
        )
    if x.without_potential:
        yield b.Text(
            line(
                "The potential is the energy of weights and springs and, of ",
                join(map(as_name, x.without_potential)),
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
            filled(
                "A turn takes {} from the driver, without friction: no potential belongs to a place.",
                number(x.summary.work),
            ),
            "note",
        )
    if equilibria.summary.friction:
        yield b.Text(
            filled(
                f"The holding {effort} is without friction. Where friction of the joints holds more, at most "
                "{}, the machine stands still, too. The smoothed friction of the models is zero at rest and holds "
                "nothing.",
                number(x.summary.friction),
            ),
            "note",
            "long",
        )
    else:
        yield b.Text("The file has no friction.", "note", "long")


def _figure(f: LinkageFindings, effort: str, file: str) -> fig.Figure:
    """Holding effort and potential over the way of the driver, with the equilibria."""
    unit, rest = f.machine.model.driver_port.unit, f.rest.rest
    place = machine_picture.driver_axis(f.machine, float(rest.q[0]), float(rest.q[-1]))
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
