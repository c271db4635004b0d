"""The findings on a linkage as data: the content of linkage.json."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .. import __version__
from ..machines.equilibria import Equilibrium, Holding
from ..machines.linkages.loads import loads_by_speed
from ..reading.results import InUnit, part, result
from ..reading.tables import UnusualValue, slips_of
from .linkage_turn import GroupTurn, JointTurn, LinkageFindings, LinkageTurn, Stroke, Swing


@result
class WayForces:
    """Effort at the driver and reactions, in one direction of the driver."""

    turn: LinkageTurn = part("effort and inertia at the driver")
    joints: Mapping[str, JointTurn] = part("reactions, by joint")


@result
class WayBack:
    """The way back of a driver that swings."""

    forces: WayForces = part(inline=True)
    over_the_way: Mapping[str, InUnit] = part("effort and inertia at each place of the driver")


@result
class LinkageAtRest:
    """A linkage at rest."""

    equilibria: tuple[Equilibrium, ...] = part("the equilibria in rising order")
    summary: Holding = part("the effort that holds the driver")
    indifferent: bool = part(
        "whether the machine stays wherever it is, as no load has an effort at the driver"
    )
    repeats: bool = part("whether the loads of a driver that turns are the same again after a turn")
    without_potential: Sequence[str] = part("loads without a potential of their own")
    by_speed: Sequence[str] = part("loads that depend on the speed")
    over_the_way: Mapping[str, InUnit] = part(
        "holding effort, friction and potential at each place of the driver"
    )


@result
class LinkageData:
    """A linkage over the way of its driver, and at rest."""

    chainunit: str = part("version of chainunit")
    source: str = part("the linkage file")
    title: str = part("title of the linkage")
    sentence: str = part("its groups in one line", name="groups_in_words")
    degrees_of_freedom: int = part("its degrees of freedom")
    speed: InUnit = part("speed of the driver")
    forces: WayForces = part(inline=True)
    groups: Mapping[str, GroupTurn] = part("margins, by group")
    strokes: Mapping[str, Stroke] = part("motion of each sliding joint")
    swings: Mapping[str, Swing] = part("motion of each link that swings")
    dead_centres: Mapping[str, InUnit] = part("places of the driver at which a joint or link turns back")
    angles: Mapping[str, InUnit] = part("least and largest angle of each link")
    points: Mapping[str, Mapping[str, InUnit]] = part("least and largest x and y of each point")
    over_the_way: Mapping[str, InUnit] = part("effort and inertia at each place of the driver")
    rest: LinkageAtRest = part("the linkage at rest")
    back: WayBack | None = part("the way back of a driver that swings", optional=True)
    drivers: Mapping[str, Mapping[str, InUnit]] | None = part(
        "largest effort and mean power of each driver besides the first one", optional=True
    )
    drawn: list[str] = part("sentences on a linkage from a drawing of another program")
    slips: list[str] = part("values of the file without a unit that are of an unusual size, in words")
    notes: list[str] = part("values of the file of an unusual size, in words")


def linkage_data(
    f: LinkageFindings, source: str, unusual: Iterable[UnusualValue], remarks: Iterable[str] = ()
) -> LinkageData:
    """The findings on a linkage of the file `source`, which has these values of an unusual size, as data; with
    `remarks` on a drawing."""
    description, unit = f.description, f.machine.model.driver_port.unit

    def limits(variable: str, limit_unit: str) -> InUnit:
        return InUnit(f.limits[variable], limit_unit)

    return LinkageData(
        __version__,
        source,
        f.machine.model.description,
        f.sentence,
        1 + len(description.further.free),
        InUnit(f.speed, unit("rad/s")),
        WayForces(f.turn, f.joints),
        f.groups,
        f.strokes,
        f.swings,
        {name: InUnit(places, unit("rad")) for name, places in f.dead_centres.items()},
        {
            link: limits(f"{description.variable('link', link)}.angle", "rad")
            for link in description.structure.links
        },
        {
            f"{link}.{point}": {
                axis: limits(f"{description.variable('link', link)}.{point}.{axis}", "m")
                for axis in ("x", "y")
            }
            for link, entry in description.structure.links.items()
            for point in entry.points
        },
        {"driver": InUnit(f.q, unit("rad")), **_over_the_way(f)},
        _at_rest(f),
        WayBack(WayForces(f.back.turn, f.back.joints), _over_the_way(f.back)) if f.back else None,
        {
            name: {
                "peak": InUnit(turn.peak, "N" if turn.linear else "N.m"),
                "power_mean": InUnit(turn.power_mean, "W"),
            }
            for name, turn in f.drivers.items()
        }
        or None,
        [*remarks],
        [str(value) for value in slips_of(tuple(unusual))],
        [value.sentence for value in unusual if value.with_unit],
    )


def _over_the_way(f: LinkageFindings) -> dict[str, InUnit]:
    unit = f.machine.model.driver_port.unit
    return {name: InUnit(f.outputs[name], unit(rotary)) for name, rotary in (("tau", "N.m"), ("J", "kg.m2"))}


def _at_rest(f: LinkageFindings) -> LinkageAtRest:
    equilibria, unit = f.rest, f.machine.model.driver_port.unit
    rest = equilibria.rest
    columns: dict[str, Any] = {
        "driver": InUnit(rest.q, unit("rad")),
        "holding": InUnit(rest.holding, unit("N.m")),
        "friction": InUnit(rest.friction, unit("N.m")),
    }
    return LinkageAtRest(
        equilibria.places,
        equilibria.summary,
        equilibria.indifferent,
        equilibria.repeats,
        [name.removeprefix("loads.") for name in equilibria.driven],
        loads_by_speed(f.description.data["loads"]),
        columns if rest.potential is None else columns | {"potential": InUnit(rest.potential, "J")},
    )
