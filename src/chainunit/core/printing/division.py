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

    `results` are the places of the results by group. `parts` are the places of the operations by part, without
    numbers and arguments, in an order in which each part stands after the parts on which it depends. `needed_by` has
    for each part a number with a bit for each group that needs it. `slots` has, by the place of a value that passes
    from one part to another or is a result, its place in memory.
    """

    def __init__(self, items: Sequence[Operation], results: Sequence[Sequence[int]], longest: int) -> None:
        # by operation, the bits of the groups that need it
        needed_by = [0] * len(items)
        for bit, places in enumerate(results):
            for place in places:
                needed_by[place] |= 1 << bit
        for place in reversed(range(len(items))):
            for operand in items[place].operands:
                needed_by[operand] |= needed_by[place]
        alike: dict[int, list[int]] = {}
        for place, bits in enumerate(needed_by):
            if items[place].operands:
                alike.setdefault(bits, []).append(place)
        self.parts: list[list[int]] = []
        self.needed_by: list[int] = []
        # parts that more groups need come first: they do not depend on parts that fewer groups need
        for bits in sorted(alike, key=lambda bits: (-bits.bit_count(), bits)):
            places = alike[bits]
            count = -(-len(places) // longest)
            cuts = [n * len(places) // count for n in range(count + 1)]
            self.parts += [places[begin:end] for begin, end in pairwise(cuts)]
            self.needed_by += [bits] * count
        part_of = {place: k for k, part in enumerate(self.parts) for place in part}
        crossing = {place for places in results for place in places if items[place].operands}
        for place, k in part_of.items():
            crossing.update(i for i in items[place].operands if part_of.get(i, k) != k)
        self.slots = {place: slot for slot, place in enumerate(sorted(crossing))}
