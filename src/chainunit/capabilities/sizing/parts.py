"""The parts of a drive that are ordered from a catalogue, with their order numbers and prices."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from ...core.quantities import quantity
from ...drives.catalogue import CatalogueMotor
from ...drives.catalogue_couplings import CatalogueCoupling
from ...drives.catalogue_gears import CatalogueGear
from ...reading.results import derived, part, result


@result
class OrderedPart:
    """A part that is ordered from a catalogue."""

    kind: str = part("motor, gear or torque limiter", name="part")
    designation: str = part("its designation")
    order_number: str = part("its order number; empty where the catalogue gives none")
    price: float | None = quantity("1", "its price; none where the catalogue gives none")
    source: str = part("the source of its values")

    @staticmethod
    def of(kind: str, item: CatalogueMotor | CatalogueGear | CatalogueCoupling) -> OrderedPart:
        """The part that is this row of a catalogue."""
        return OrderedPart(kind, item.designation, item.order_number, item.price, item.source)


@result
class PartsList:
    """The parts of the drive that are ordered from catalogues."""

    items: Sequence[OrderedPart] = part("the parts", name="parts")
    open: Sequence[str] = part("sentences on what the catalogues leave open")

    @derived("1")
    def total(self) -> float | None:
        """The sum of the prices; none where a part has no price."""
        return total_price(self.items)


def total_price(items: Iterable[OrderedPart]) -> float | None:
    """The sum of the prices; None where one is unknown."""
    total = 0.0
    for item in items:
        if item.price is None:
            return None
        total += item.price
    return total


def price_words(price: float) -> str:
    """A price with all its digits."""
    return f"{price:.10g}"


def parts_list(
    items: Sequence[OrderedPart], unknown: Sequence[str], flywheel: str, coupling: str
) -> PartsList:
    """The list of parts to order, and what it leaves open.

    Parameters
    ----------
    unknown : limits of the gear that its catalogue does not give, in words
    flywheel, coupling : words on a flywheel and a torque limiter that no catalogue has; empty where none is needed
    """
    lacking = {
        "an order number": [item.kind for item in items if not item.order_number],
        "a price": [item.kind for item in items if item.price is None],
    }
    sentences = [f"Without {what}: {', '.join(kinds)}." for what, kinds in lacking.items() if kinds]
    if unknown:
        sentences.append(
            f"Left out of the choice, as the catalogue of gears does not give it: {', '.join(unknown)}."
        )
    sentences += [f"In no catalogue: {remark}." for remark in (flywheel, coupling) if remark]
    return PartsList(items, sentences)


def coupling_for(
    couplings: Iterable[CatalogueCoupling], torque: float, speed: float
) -> CatalogueCoupling | None:
    """The cheapest of the torque limiters that can be set to this `torque` [N m] and may turn at this `speed`
    [rad/s]; of those without a price, which come last, the one with the smallest range. None where there is none."""
    fitting = [coupling for coupling in couplings if coupling.can_be_set(torque, speed)]
    return min(
        fitting,
        key=lambda coupling: (coupling.price or math.inf, coupling.data.setting_most, coupling.designation),
        default=None,
    )
