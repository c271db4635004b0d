"""Equilibria of linkages at rest: against the potential of an independent solution, the time series of the direct
model, closed forms, the linear model, and on the page; change points."""

from __future__ import annotations

import itertools
import json
import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import chainunit
from multibody import Multibody
from random_linkages import random_linkage
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar
from swinging import with_range
from test_linear_driver import TRAMMEL

from chainunit import linearize
from chainunit.core.engines import MATH
from chainunit.core.errors import InputError
from chainunit.machines.linkages.file import description_of, read_linkage
from chainunit.machines.linkages.model import machine_of
from chainunit.machines.machine import Machine
from chainunit.mechanism.equilibria import PLACES

GALLERY = Path(__file__).parents[1] / "examples" / "linkages"
TEXT = """
title = "Swing"

[ground]
O1 = [0, 0]
O2 = [0.6, 0]

[driver]
link = "crank"

[links.crank]
points = { O1 = [0, 0], A = [0.2, 0] }
mass = 2
inertia = 0.01
centroid = [0.1, 0]

[links.coupler]
points = { A = [0, 0], B = [0.6, 0] }
mass = 5
inertia = 0.1
centroid = [0.3, 0]

[links.rocker]
points = { O2 = [0, 0], B = [0.2, 0] }

[start]
phi = "-60 deg"
points = { B = [0.7, -0.17] }
"""
PARALLELOGRAM = tomllib.loads(TEXT)
HANGS = TEXT.replace('link = "crank"', 'link = "crank"\nrange = ["-150 deg", "-20 deg"]')
BALANCED = """
[ground]
O = [0, 0]

[driver]
link = "arm"

[links.arm]
points = { O = [0, 0], T = [0.5, 0] }
mass = 3
inertia = 0.2
centroid = ["-1/3", 0]
masses = { T = 2 }
"""
"""An arm with a counterweight: both weights are large, and the sum of their efforts is rounding."""


def model(data, name="mine"):
    return machine_of(description_of(data, name))


# random linkages


def springs(data, rng):
    """Two springs without dampers from points of moving links to the ground, at places that are often in tension and
    in pressure over the way."""
    moving = [name for name, link in data["links"].items() if link["points"]]
    loads = {}
    for k in (1, 2):
        link = str(rng.choice(moving))
        data["ground"][f"S{k}"] = [*map(float, rng.uniform(-1.0, 1.0, 2))]
        loads[f"spring{k}"] = {
            "type": "spring", "on": f"{link}.{rng.choice([*data['links'][link]['points']])}", "by": f"ground.S{k}",
            "stiffness": float(rng.uniform(50.0, 1500.0)), "length": float(rng.uniform(0.1, 0.8)),
        }  # fmt: skip
    slides = any("toward" in joint for joint in data["joints"].values())
    return {
        **data,
        "loads": loads,
        "pins": {"friction": 0.0},
        **({"guides": {"friction": 0.0}} if slides else {}),
    }


def tables_of(seed):
    """Tables of a random linkage with springs: of every ten six turn, three swing, and one slides."""
    rng = np.random.default_rng(seed + 5 * 10**5)
    if seed % 10 == 9:
        data = json.loads(json.dumps(TRAMMEL))
        data["links"]["top"]["mass"] = float(rng.uniform(0.5, 5.0))
        return springs(data, rng)
    data, _ = random_linkage(seed)
    data = springs(json.loads(json.dumps({k: v for k, v in data.items() if k != "parameters"})), rng)
    if seed % 10 >= 6:
        phi = math.degrees(data["start"]["phi"])
        low, high = rng.uniform(30.0, 100.0, 2)
        data = with_range(data, [f"{phi - low} deg", f"{phi + high} deg"])
    return data


def closing(count):
    """So many of them that close, with the text of each."""
    found = 0
    for seed in itertools.count():
        try:
            text = description_of(tables_of(seed), f"random_{seed}")
            made = machine_of(text)
        except InputError as error:
            assert (
                "clos" in str(error)
                or "dead" in str(error)
                or "change" in str(error)
                or "triad" in str(error)
            )
            continue
        yield seed, made, text
        found += 1
        if found == count:
            return


class Potential:
    """The potential of weights and springs of a linkage, by the poses of an independent solution."""

    def __init__(self, made, text, places):
        self.body = Multibody(text)
        self.q = np.linspace(*made.span, places)
        self.poses = [self.body.followed(self.q[0])]
        for q in self.q[1:]:
            self.poses.append(self.body.closed(q, self.poses[-1]))
        self.values = np.array([self.of_pose(pose) for pose in self.poses])

    def of_pose(self, x):
        body, energy = self.body, 0.0
        for link, local, mass, _ in body.bodies:
            energy += mass * body.values["g"] * body.place(x, link, local)[0][1]
        for load in body.data["loads"]:
            on, by = (
                body.place(x, link, body.points[link][name])[0] for link, name in (load["on"], load["by"])
            )
            stretch = np.hypot(*(on - by)) - body.number(load["length"])
            energy += 0.5 * body.number(load["stiffness"]) * stretch**2
        return energy

    def at(self, q):
        k = int(np.argmin(np.abs(self.q - q)))
        return self.of_pose(self.body.closed(q, self.poses[k]))

    def turning_points(self, turns):
        """Places of minima and maxima inside the way, with +1 or -1."""
        values = self.values[:-1] if turns else self.values
        found = []
        for k in range(len(values)):
            if not turns and k in (0, len(values) - 1):
                continue
            before, after = values[k - 1], values[(k + 1) % len(values)]
            for sign in (1.0, -1.0):
                if sign * values[k] < sign * before and sign * values[k] <= sign * after:
                    step = self.q[1] - self.q[0]
                    best = minimize_scalar(
                        lambda q, sign=sign: sign * self.at(q), bounds=(self.q[k] - step, self.q[k] + step),
                        method="bounded", options={"xatol": 1e-9},
                    )  # fmt: skip
                    found.append((float(best.x), sign))
        return found


def check_period(made, each):
    """The period of a small swing about an equilibrium, of the direct model with an inertia on its shaft."""
    direct = made.direct()
    more = 0.02 * each.inertia + 0.01
    p, u = direct.check(replace(direct.Parameters(), J_added=more)), direct.Inputs()
    omega = math.sqrt(each.stiffness / (each.inertia + more))
    assert each.frequency == pytest.approx(
        math.sqrt(each.stiffness / each.inertia) / (2.0 * math.pi), rel=1e-12
    )
    amplitude, layout = 2e-4, direct.state_layout

    def rates(t, x):
        return direct.derivatives(MATH, p, u, layout.instance([float(v) for v in x]))

    def crossing(t, x):
        return x[0] - each.at

    crossing.direction = 1.0
    small = [1e-9 * amplitude, 1e-9 * omega * amplitude]
    run = solve_ivp(
        rates, (0.0, 10.0 / omega), [each.at, omega * amplitude], "DOP853", events=crossing, rtol=1e-9, atol=small
    )  # fmt: skip
    period = next(t for t in run.t_events[0] if t > 3.0 / omega)
    assert 2.0 * math.pi / period == pytest.approx(omega, rel=1e-4)


def check(count, places=145):
    """Places, kinds, energies and natural frequencies of so many linkages. A pair that the samples of the potential
    cannot tell apart is asked for at its own places."""
    kinds = {"stable": 0, "unstable": 0, "on its stop": 0}
    for seed, made, text in closing(count):
        rest = Machine(made).at_rest()
        potential = Potential(made, text, places)
        whole = 2.0 * math.pi
        size = np.ptp(potential.values)
        if size < 1e-9 * np.max(np.abs(potential.values)):  # the crank moves no mass and no spring
            assert not rest.equilibria and rest.balanced == (made.span,), seed
            continue
        inside = [
            (each, kind)
            for each, kind in zip(rest.equilibria, rest.kinds, strict=True)
            if kind != "on its stop"
        ]
        wanted = potential.turning_points(made.turns)
        assert len(wanted) == len(inside), (seed, wanted, inside)
        for place, sign in wanted:
            near = min(
                inside,
                key=lambda pair: abs(
                    math.remainder(pair[0].at - place, whole) if made.turns else pair[0].at - place
                ),
            )
            gap = near[0].at - place
            # near an extreme a value says its place to the root of rounding
            assert abs(math.remainder(gap, whole) if made.turns else gap) < 3e-5 * (
                1.0 if not made.slides else 0.1
            ), seed
            assert near[1] == ("stable" if sign > 0.0 else "unstable"), seed
        if rest.equilibria:
            start = made.span[0]
            at = [start + (e.at - start) % whole if made.turns else e.at for e in rest.equilibria]
            energies = np.array([potential.at(q) for q in at])
            shown = np.array([e.energy for e in rest.equilibria])
            np.testing.assert_allclose(shown, energies - energies.min(), atol=1e-7 * size)
        for each, kind in zip(rest.equilibria, rest.kinds, strict=True):
            kinds[kind] += 1
            if kind == "on its stop":
                assert each.at in made.span and (each.end_stop < 0.0) == (each.at == made.span[0])
                low = each.at == made.span[0]
                slope = np.diff(potential.values)[0 if low else -1]
                assert slope > 0.0 if low else slope < 0.0
            elif kind == "stable":
                check_period(made, each)
    return kinds


def test_random_linkages_rest_where_their_potential_says():
    kinds = check(10)
    assert all(kinds.values()), kinds


@pytest.mark.second
def test_a_hundred_random_linkages():
    kinds = check(100)
    assert min(kinds["stable"], kinds["unstable"]) > 60 and kinds["on its stop"] > 40, kinds


# closed forms and words


def test_a_pendulum():
    """A crank alone: it hangs below its bearing with sqrt(m g s / J), and stands above it."""
    data = {
        "ground": {"O": [0, 0]},
        "driver": {"link": "arm"},
        "links": {"arm": {"points": {"O": [0, 0], "T": [0.5, 0]}, "mass": 3.0, "inertia": 0.2, "centroid": [0.4, 0]}},
    }  # fmt: skip
    rest = Machine(model(data)).at_rest()
    (top, low), inertia = rest.equilibria, 0.2 + 3.0 * 0.4**2
    assert rest.kinds == ("unstable", "stable") and rest.stable is low
    assert (top.at, low.at) == pytest.approx((0.5 * math.pi, 1.5 * math.pi), abs=1e-12)
    assert low.stiffness == pytest.approx(3.0 * 9.81 * 0.4, rel=1e-12) and low.inertia == pytest.approx(
        inertia
    )
    assert low.frequency == pytest.approx(math.sqrt(3.0 * 9.81 * 0.4 / inertia) / (2.0 * math.pi), rel=1e-12)
    assert (low.energy, top.energy) == pytest.approx((0.0, 2.0 * 3.0 * 9.81 * 0.4), rel=1e-12)
    assert top.frequency is None and rest.holding.work == 0.0
    assert rest.holding.torque_peak == pytest.approx(3.0 * 9.81 * 0.4, rel=1e-12)
    assert rest.holding.torque_peak_at % math.pi == pytest.approx(0.0, abs=1e-6)


def test_two_equilibria_between_two_places():
    """A weight and a torque that is nearly the largest of its holding torques: both equilibria lie within a hundredth
    of a degree, at the angles of the closed form."""
    delta = math.radians(0.02)
    arm = {"points": {"O": [0, 0], "T": [0.5, 0]}, "mass": 3.0, "inertia": 0.2, "centroid": [0.4, 0]}
    phi = math.radians(0.3)
    data = {
        "ground": {"O": [0, 0]},
        "driver": {"link": "arm", "zero": phi},
        "links": {"arm": arm},
        "loads": {"push": {"type": "torque", "on": "arm", "torque": 3.0 * 9.81 * 0.4 * math.cos(delta)}},
    }
    rest = Machine(model(data)).at_rest()
    step = 2.0 * math.pi / (PLACES - 1)
    assert 2.0 * delta < 0.1 * step
    places = sorted(math.remainder(each.at + phi, 2.0 * math.pi) for each in rest.equilibria)
    assert places == pytest.approx([-delta, delta], abs=1e-9)
    assert sorted(rest.kinds) == ["stable", "unstable"]
    # the torque takes energy all the way round, so that a place has none
    assert rest.holding.work == pytest.approx(-2.0 * math.pi * 3.0 * 9.81 * 0.4 * math.cos(delta), rel=1e-9)
    assert all(each.energy is None for each in rest.equilibria)


def test_a_balanced_linkage_rests_anywhere(tmp_path):
    light = tomllib.loads(BALANCED)
    light["links"]["arm"] = {"points": {"O": [0, 0], "T": [0.5, 0]}, "mass": 3.0, "inertia": 0.2}
    for data in (light, tomllib.loads(BALANCED)):
        rest = Machine(model(data)).at_rest()
        assert not rest.equilibria and rest.balanced == ((0.0, 2.0 * math.pi),) and rest.stable is None
    (tmp_path / "arm.toml").write_text(BALANCED, "utf-8")
    done = chainunit("linkage", "arm.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 0 and "the linkage rests anywhere" in " ".join(done.stdout.split())
    assert "Equilibria of the driver" not in done.stdout


def test_loads_that_depend_on_the_speed_are_named():
    rest = Machine(read_linkage(GALLERY / "slider_crank_press.toml")).at_rest()
    assert rest.by_speed == ("loads.pressing",)
    assert not Machine(read_linkage(GALLERY / "knife_drive.toml")).at_rest().by_speed


def test_a_driver_counts_its_places_whatever_the_ratio():
    one = Machine(read_linkage(GALLERY / "watt_six_bar.toml")).at_rest()
    geared = Machine(read_linkage(GALLERY / "watt_six_bar.toml"), ratio=20.0).at_rest()
    for a, b in zip(one.equilibria, geared.equilibria, strict=True):
        assert (b.at, b.stiffness, b.inertia) == pytest.approx((a.at, a.stiffness, a.inertia), rel=1e-9)


# change points


def refusal(data):
    with pytest.raises(InputError) as caught:
        model(data)
    return str(caught.value)


def test_a_parallelogram_is_told_as_a_change_point():
    words = refusal(PARALLELOGRAM)
    assert "the group of coupler, rocker comes to a change point at 0 deg of crank, a dead position" in words
    assert "a parallelogram may turn into a crossed one" in words and "cannot close" not in words
    found = re.search(r'write range = \["(\S+) deg", "(\S+) deg"\]', words)
    clear = with_range(PARALLELOGRAM, [f"{x} deg" for x in found.groups()])
    assert model(clear).turns is False
    # in a range, too; a length that is 1 mm too long does not close at all
    assert "change point at" in refusal(with_range(PARALLELOGRAM, ["-160 deg", "30 deg"]))
    long = {**PARALLELOGRAM, "ground": {"O1": [0, 0], "O2": [0.601, 0]}}
    assert "1 mm more than both are long" in refusal(long) and "change point" not in refusal(long)


# the command, its page, and the linear model


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rest")
    (folder / "swing.toml").write_text(HANGS, "utf-8")
    done = chainunit("linkage", "swing.toml", "-o", "out", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder, done, json.loads((folder / "out" / "linkage.json").read_text("utf-8"))


def test_the_command_shows_them(shown):
    """A parallelogram hangs with J = I + m r^2/4 of the crank and m r^2 of the coupler, which does not turn."""
    folder, done, result = shown
    inertia, weight = 0.01 + 2.0 * 0.1**2 + 5.0 * 0.2**2, 9.81 * (2.0 * 0.1 + 5.0 * 0.2)
    (only,) = result["equilibria"].values()
    assert only["kind"] == "stable" and only["at"]["value"] == pytest.approx(-0.5 * math.pi)
    assert only["frequency"] == {
        "value": pytest.approx(math.sqrt(weight / inertia) / (2.0 * math.pi)), "unit": "Hz"
    }  # fmt: skip
    assert "stable" in done.stdout and "1.14 Hz" in done.stdout
    q, torque = (np.array(result["holding_over_the_way"][name]["value"]) for name in ("driver", "torque"))
    np.testing.assert_allclose(torque, weight * np.cos(q), rtol=1e-9, atol=1e-12)
    page = (folder / "out" / "report.html").read_text("utf-8")
    assert "Equilibria of the driver without effort" in page and 'id="plot-linkage-rest"' in page
    assert (folder / "out" / "linkage_rest.png").stat().st_size > 5000


def test_the_linear_model_at_an_equilibrium(shown):
    folder, _, result = shown
    found = linearize(folder / "swing.toml", "equilibrium")
    (pole,) = found.poles
    frequency = result["equilibria"]["1"]["frequency"]["value"]
    assert pole.imaginary / (2.0 * math.pi) == pytest.approx(frequency, rel=1e-9) and abs(pole.real) < 1e-9
    with pytest.raises(
        InputError, match=r'"equilibrium:4": the number of an equilibrium must be 1, the only one'
    ):
        linearize(folder / "swing.toml", "equilibrium:4")
    with pytest.raises(
        InputError, match=r"no stable equilibrium clear of its end stops; it has 1 on its stop: name a place"
    ):
        linearize(GALLERY / "cylinder_lift.toml", "equilibrium")
    with pytest.raises(InputError, match=r"there the driver rests on its end stop"):
        linearize(GALLERY / "cylinder_lift.toml", "equilibrium:1")
    unstable = linearize(GALLERY / "watt_six_bar.toml", "equilibrium:2", inverse=False)
    assert max(pole.real for pole in unstable.poles) > 1.0
    assert found.at == "equilibrium, phi = -1.5708 rad"
    assert found.title == "Swing" and unstable.title == linearize(GALLERY / "watt_six_bar.toml").title


def test_a_point_beyond_the_range_is_told():
    beyond = linearize(GALLERY / "toggle_clamp.toml", "phi=95 deg, w=0").at
    assert beyond == "phi = 1.65806 rad, w = 0 rad/s, beyond the range of the driver, on its upper end stop"
    assert linearize(GALLERY / "toggle_clamp.toml", "phi=-0.01").at.endswith("on its lower end stop")
    assert linearize(GALLERY / "toggle_clamp.toml", "phi=10 deg").at == "phi = 0.174533 rad"
    assert linearize(GALLERY / "watt_six_bar.toml", "phi=-10 deg").at == "phi = -0.174533 rad"
