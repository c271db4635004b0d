"""The division of operations into functions.

Groups of results share operations. They are divided into parts, each with the operations that the same groups need,
so that a call for some groups carries out the parts that these need. Values that one part passes to another lie in
memory. The length of a part is limited, as the time of a compiler grows faster than the length.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from .operations import Operation


class Division:
    """Parts of `items`, each of `longest` operations at most.

    `parts` are the places of the operations by part, without numbers and arguments, in an order in which each part
    stands after the parts on which it depends; `needed_by` has for each part a bit for each of the groups `results`
    that need it; `slots` are the places in memory of values that pass from one part to another or are results.
    """

    def __init__(self, items: Sequence[Operation], results: Sequence[Sequence[int]], longest: int) -> None:
        users = [0] * len(items)
        for bit, places in enumerate(results):
            for place in places:
                users[place] |= 1 << bit
        for place in reversed(range(len(users))):
            for operand in items[place].operands:
                users[operand] |= users[place]
        alike: dict[int, list[int]] = {}
        for place, groups in enumerate(users):
            if items[place].operands:
                alike.setdefault(groups, []).append(place)
        self.parts: list[list[int]] = []
        self.needed_by: list[int] = []
        # parts that more groups need come first: they do not depend on parts that fewer groups need
        for groups in sorted(alike, key=lambda g: (-g.bit_count(), g)):
            places = alike[groups]
            count = -(-len(places) // longest)
            cuts = [n * len(places) // count for n in range(count + 1)]
            self.parts += [places[begin:end] for begin, end in pairwise(cuts)]
            self.needed_by += [groups] * count
        part_of = {place: k for k, part in enumerate(self.parts) for place in part}
        crossing = {place for places in results for place in places if items[place].operands}
        for place, k in part_of.items():
            crossing.update(i for i in items[place].operands if part_of.get(i, k) != k)
        self.slots = {place: slot for slot, place in enumerate(sorted(crossing))}
