"""The report on a linkage at rest: its equilibria, and the effort that holds it elsewhere."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from ..core.quantities import Layout
from ..reading.text import array_entry
from ..study.linkage_turn import LinkageFindings
from . import blocks as b
from . import figure as fig
from .lines import Name, join, line

PICTURE = "linkage_rest.png"
_AT_DRIVER = ("at", "torque_peak", "torque_peak_at", "stiffness", "inertia", "end_stop")


def with_unit(value: Any, unit: str) -> dict[str, Any]:
    """A value with its unit, as a result has it."""
    return {"value": value, "unit": unit}


def values_of(f: LinkageFindings, instance: Any, at_driver: Collection[str]) -> dict[str, Any]:
    """The values of an instance; those with a name in `at_driver` are in the units of the driver."""
    layout, unit = Layout(type(instance)), f.machine.model.driver_port.unit
    return {
        v.name: with_unit(x, unit(v.unit) if v.name in at_driver else v.unit)
        for v, x in zip(layout.variables, layout.values(instance), strict=True)
    }


def entries(f: LinkageFindings) -> dict[str, Any]:
    """What the result of a linkage has on its rest; equilibria are numbered from 1 on."""
    rest, unit = f.rest, f.machine.model.driver_port.unit
    numbered = enumerate(zip(rest.kinds, rest.equilibria, strict=True), 1)
    return {
        "holding": values_of(f, rest.holding, _AT_DRIVER),
        "equilibria": {str(k): {"kind": kind, **values_of(f, each, _AT_DRIVER)} for k, (kind, each) in numbered},
        "balanced": {
            str(k): with_unit(list(ends), unit("rad")) for k, ends in enumerate(rest.balanced, 1)
        },
        "holding_over_the_way": {
            "driver": array_entry(rest.q, unit("rad")), "torque": array_entry(rest.torque, unit("N.m"))
        },
    }  # fmt: skip


def blocks_of(s: b.Source, f: LinkageFindings) -> Iterator[b.Block]:
    """Sentences, the table of the equilibria, and the figure of the holding effort."""
    rest, slides = f.rest, f.machine.model.slides
    effort = "force" if slides else "torque"
    everywhere = bool(rest.balanced) and rest.balanced[0] == (rest.q[0], rest.q[-1])
    lead = "At rest, with the loads of normal running and without friction"
    if everywhere:
        yield b.Text(
            line(f"{lead}, the loads balance over the whole way: the linkage rests anywhere."), "lead"
        )
    else:
        yield b.Text(
            s.line(
                f"{lead}, the {effort} that holds the driver is {{holding.torque_peak}} at most, at "
                "{holding.torque_peak_at}."
            ),
            "lead",
        )
        for k in s.result["balanced"]:
            yield b.Text(
                line("From ", s.number(f"balanced.{k}", 0), " to ", s.number(f"balanced.{k}", 1),
                     " the loads balance: the linkage rests anywhere there.")
            )  # fmt: skip
        yield from _table(s, f)
    if rest.holding.work:
        yield b.Text(
            s.line(
                "Over a whole turn at rest the loads take {holding.work}, so that no place has an energy of its own."
            ),
        )
    if rest.by_speed:
        names = join(Name(name.removeprefix("loads.")) for name in rest.by_speed)
        yield b.Text(
            line("A load that depends on the speed has its value at speed 0 here, half of it where ", Name("step"),
                 " switches it: ", names, ".")
        )  # fmt: skip
    if not everywhere:
        yield _figure(f, effort)


def _table(s: b.Source, f: LinkageFindings) -> Iterator[b.Block]:
    rest = f.rest
    if not rest.equilibria:
        if not rest.balanced:
            yield b.Text("Without effort the linkage rests nowhere.")
        return
    columns = [
        (b.Column("stiffness"), "stiffness"),
        (b.Column("inertia", form="long"), "inertia"),
        (b.Column("natural frequency"), "frequency"),
        (b.Column("energy above the lowest"), "energy"),
        (b.Column(f"{'force' if f.machine.model.slides else 'torque'} against the stop"), "end_stop"),
    ]
    shown = [
        (head, name)
        for head, name in columns
        if any(getattr(each, name) is not None for each in rest.equilibria)
        and (name != "energy" or len(rest.equilibria) > 1)
    ]
    rows = (
        b.TableRow((k, s.number(f"equilibria.{k}.at"), kind,
                    *(s.number(f"equilibria.{k}.{name}") for _, name in shown)))
        for k, kind in zip(s.result["equilibria"], rest.kinds, strict=True)
    )  # fmt: skip
    yield b.Table(
        tuple(rows),
        (
            *b.heads("no.", "place of the driver"),
            b.Column("equilibrium", of_text=True),
            *(head for head, _ in shown),
        ),
        title="Equilibria of the driver without effort",
    )
    if any(each.frequency for each in rest.equilibria):
        yield b.Text(
            "Natural frequency: of small motion without losses, with the shaft free.", "note", "long"
        )


def _figure(f: LinkageFindings, effort: str) -> fig.Figure:
    """The holding effort over the way, with the equilibria."""
    model, rest = f.machine.model, f.rest
    unit = model.driver_port.unit
    angle = fig.Axis(
        "way of the driver" if model.slides else "angle of the driver",
        unit("rad"),
        step=45.0 if model.turns else None,
    )
    low, high = model.span
    points = []
    for kind, marker, look in (("stable", "o", 1), ("unstable", "x", 2), ("on its stop", "s", 3)):
        places = [e.at for e, k in zip(rest.equilibria, rest.kinds, strict=True) if k == kind]
        if places:
            # a turn may begin at another angle than 0
            places = [low + (q - low) % (high - low) if model.turns else q for q in places]
            heights = np.interp(places, rest.q, rest.torque)
            points.append(fig.Curve(kind, np.array(places), heights, look, marker=marker, has_line=False))
    curve = fig.Curve(f"holding {effort}", rest.q, rest.torque)
    axis = fig.Axis(f"{effort} that holds the driver", unit("N.m"))
    return fig.Figure(
        "linkage-rest",
        f"Holding {effort} over the way of the driver",
        f"The {effort} that holds the driver at rest over its way, and the equilibria.",
        fig.stacked(angle, ((axis, (curve, fig.Mark(0.0, axis="y"), *points)),)),
        file=PICTURE,
    )
