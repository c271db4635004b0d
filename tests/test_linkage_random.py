"""Random linkages of 4 to 10 bars: every output against an independent solution, torque by two routes, power, groups
from shuffled lists, and refusals that are right. A hundred in each run; a thousand with ``-m slow``."""

from __future__ import annotations

import itertools
import math
from collections import Counter

import numpy as np
import pytest
from multibody import Multibody
from random_linkages import DYADS, random_linkage

from chainunit.core.engines import MATH, Dual, dual, slope
from chainunit.core.errors import InputError
from chainunit.core.symbolic_trace import outputs_of
from chainunit.machines.linkages import model as linkage_model
from chainunit.machines.linkages.file import description_of
from chainunit.machines.linkages.model import machine_of

pytestmark = pytest.mark.second

COUNTS = [50, pytest.param(1000, marks=pytest.mark.slow)]
FORCES = ("tau", "fx", "fy", "normal", "moment", "load_power")


def closing(count):
    """Linkages that close all the way round, with a random state of each, in a fixed order of seeds."""
    found = 0
    for seed in itertools.count():
        data, groups = random_linkage(seed)
        text = description_of(data, f"random_{seed}")
        try:
            model = machine_of(text)
        except InputError as error:
            words = ("cannot close", "dead position", "does not close all the way round")
            assert any(each in str(error) for each in words), (seed, str(error))
            continue
        rng = np.random.default_rng(seed + 10**6)
        q, w, a = data["start"]["phi"] + rng.uniform(-4, 4), rng.uniform(-5, 5), rng.uniform(-20, 20)
        yield seed, data, groups, text, model, (q, w, a)
        found += 1
        if found == count:
            return


def told(model):
    return Counter((group.kind, frozenset(group.links)) for group in model.described_by.structure.groups)


def by_the_machine(model, q, w, a):
    """All outputs by name, and the state."""
    p = model.with_derived(MATH, model.Parameters())
    u = model.input_layout.from_names({"phi": q, "w": w, "a": a})
    parts = zip(model.parts, model.evaluate(MATH, p, u), strict=True)
    return {name: value for part, out in parts for name, value in part.layout.by_name(out).items()}, p, u


def deviations(found, wanted):
    """By output: relative to its size, forces to the greatest of all."""
    most = max(abs(value) for name, value in wanted.items() if name.endswith(FORCES))
    for name, value in wanted.items():
        gap = found[name] - value
        if name.endswith(".angle"):
            gap = math.remainder(gap, 2.0 * math.pi)
        yield name, abs(gap) / (abs(value) + (most if name.endswith(FORCES) else 1.0))


@pytest.mark.slow
@pytest.mark.parametrize("count", COUNTS)
def test_against_an_independent_solution(count):
    """Motion of every link and point, every reaction and guide moment, torque and energies to 1e-9; torque by two
    routes and the balance of power, both to 1e-9 of their largest part."""
    kinds = Counter()
    for seed, _, groups, text, model, (q, w, a) in closing(count):
        assert told(model) == Counter(groups), seed
        kinds.update(kind for kind, _ in groups)
        found, p, u = by_the_machine(model, q, w, a)
        body = Multibody(text)
        wanted = body.solution(body.followed(q), q, w, a)
        name, worst = max(deviations(found, wanted), key=lambda pair: pair[1])
        assert worst < 1e-9, (seed, name, worst)
        assert len(wanted) > 40

        state = model.shared(MATH, p, u, None)
        size = abs(state.J * a) + abs(state.bias) + 1.0
        assert abs(state.torque_by_reactions(a) - state.torque(a)) < 1e-9 * size, seed
        engine = dual(MATH)
        moving = model.input_layout.from_names({"phi": Dual(q, w), "w": Dual(w, a)}, u)
        stored = model.parts[0].equations(engine, p, moving, None, model.shared(engine, p, moving, None))
        grows = [slope(stored.kinetic_energy), slope(stored.potential_energy)]
        size = abs(found["power"]) + sum(map(abs, grows)) + abs(found["dissipated_power"])
        assert abs(found["power"] - sum(grows) - found["dissipated_power"]) <= 1e-9 * size + 1e-12, seed
    assert all(kinds[kind] > 0.05 * count for kind in (*DYADS, "triad")), kinds


def shuffled(data, rng):
    """The same file with links, joints and points in another order."""

    def mixed(table):
        return {name: table[name] for name in rng.permutation([*table])}

    links = {name: {**link, "points": mixed(link["points"])} for name, link in mixed(data["links"]).items()}
    return {**data, "ground": mixed(data["ground"]), "links": links, "joints": mixed(data["joints"])}


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.slow
def test_shuffled_lists_give_the_same_groups(count):
    for seed, data, groups, _, model, state in closing(count):
        rng = np.random.default_rng(seed)
        other = machine_of(description_of(shuffled(data, rng), f"random_{seed}"))
        assert told(other) == Counter(groups), seed
        one, two = by_the_machine(model, *state)[0], by_the_machine(other, *state)[0]
        for name in ("tau", "J", "tau_bias", "dJ_dphi", "tau_bias_dphi", "tau_bias_dw", "kinetic_energy"):
            assert two[name] == pytest.approx(one[name], rel=1e-9, abs=1e-9), (seed, name)


def backwards(data):
    """The same data with the entries of all tables in the opposite order."""
    if isinstance(data, dict):
        return {name: backwards(data[name]) for name in reversed(data)}
    return [backwards(each) for each in data] if isinstance(data, list | tuple) else data


def test_the_order_of_entries_changes_nothing_of_a_model():
    """Not either by the file of the two that this process reads first."""
    (_, _, _, _, model, _), *_ = closing(1)
    (data,) = model.made[1]
    assert list(backwards(data)) != list(data)
    outputs = []
    for given in (backwards(data), data):
        linkage_model._machine_of.cache_clear()
        machine = machine_of(given)
        outputs.append(repr((machine.made[1], [v.name for v in outputs_of(machine)])))
    assert outputs[0] == outputs[1]


def turns_well(body, places=96, least=1e-3):
    """Whether the independent solution follows a linkage once around, clear of dead positions."""
    x, first = body.closed(body.start, body.rough), None
    for k in range(places + 1):
        if x is None:
            return False
        _, rows = body.equations(x, 0.0)
        sign, _ = np.linalg.slogdet(rows)
        first = first or sign
        if sign != first or np.linalg.cond(rows) > 1.0 / least:
            return False
        try:
            after = body.closed(body.start + 2.0 * math.pi * (k + 1) / places, x, 12)
        except np.linalg.LinAlgError:
            return False
        # a leap is another assembly mode
        x = after if after is not None and np.max(np.abs(after - x)) < 0.5 else None
    return True


@pytest.mark.slow
def test_refusals_are_right():
    """A linkage that is said not to close, or to come to a dead position, does not go round in the independent
    solution, either; nearly all others do."""
    well = {True: [], False: []}
    for seed in range(100):
        data, _ = random_linkage(seed)
        text = description_of(data, f"random_{seed}")
        try:
            machine_of(text)
        except InputError:
            well[False].append((turns_well(Multibody(text)), seed))
        else:
            if len(well[True]) < 30:
                well[True].append((turns_well(Multibody(text)), seed))
    assert len(well[False]) > 15
    assert [seed for turns, seed in well[False] if turns] == []
    assert sum(turns for turns, _ in well[True]) > 0.9 * len(well[True])


def four_bar(order):
    """A crank-rocker with a slider on the pin of coupler and rocker; links in an order of their own."""
    links = {
        "crank": {"points": {"O1": [0, 0], "A": [0.1, 0]}, "mass": 2.0, "inertia": 0.01},
        "coupler": {"points": {"A": [0, 0], "B": [0.5, 0]}, "mass": 3.0, "inertia": 0.05},
        "rocker": {"points": {"O2": [0, 0], "B": [0.35, 0]}, "mass": 4.0, "inertia": 0.08},
        "rod": {"points": {"B": [0, 0], "C": [0.6, 0]}, "mass": 5.0, "inertia": 0.1},
        "ram": {"points": {"C": [0, 0]}, "mass": 9.0},
    }
    return {
        "ground": {"O1": [0, 0], "O2": [0.45, 0], "G": [0, 0.4], "G2": [1, 0.4]},
        "driver": {"link": "crank"},
        "links": {name: links[name] for name in order},
        "joints": {"guide": {"on": "ram.C", "by": "ground.G", "toward": "G2"}},
        "start": {"phi": 0.3, "points": {"B": [0.5, 0.35], "C": [1.1, 0.4]}},
    }


@pytest.mark.slow
def test_three_links_in_one_pin_are_joined_by_their_order_of_motion():
    """In the file the rod stands before the links that hold its pin: it must not be taken for one of them."""
    outputs = []
    for order in itertools.permutations(("crank", "coupler", "rocker", "rod", "ram")):
        model = machine_of(description_of(four_bar(order), "four_bar"))
        assert [kind for kind, _ in told(model)] == ["RRR", "RRP"], order
        outputs.append(by_the_machine(model, 2.0, 3.0, 4.0)[0])
    for each in outputs[1:]:
        for name in outputs[0].keys() & each.keys():
            # on which link the force of a pin acts depends on the order
            if name.partition(".")[0] in (name, "guide", *model.described_by.structure.links):
                assert each[name] == pytest.approx(outputs[0][name], rel=1e-11, abs=1e-9), name
