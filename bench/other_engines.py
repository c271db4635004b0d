"""The packaged machine in other engines: exudyn, MuJoCo and its jax version MJX, and pylinkage.

The machine is the same: no friction, no processing force, 30 kg of material a side; the states are those of one turn
at constant speed. Each function returns rows: the rate; what one evaluation is; the largest distance of two points
that a joint should hold together (`loop`, m); and the largest deviation of the torque from ours in parts of its peak
(`torque`), which is the residual of the power balance in parts of the peak power. An engine that moves by itself has
`energy`, too: what it loses or wins over a turn, in parts of the largest kinetic energy.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from figures import least, parser, save

from chainunit import ChainUnitMachine
from chainunit.core.engines import MATH
from chainunit.machines.chain_unit import ChamberForces

W = 3.0  # rad/s of the crank
TURN = 2.0 * math.pi / W
LOADS = {
    f"{side}.{name}": x
    for side in ("left", "right")
    for name, x in (("material_mass", 30.0), ("processing_force", 0.0))
}
MACHINE = ChainUnitMachine({"pin.friction": 0.0})
CORES = os.cpu_count() or 1
ABSENT = 3


@dataclass(frozen=True)
class Rod:
    """A rod: where its first pin sits (on a rod at a distance, or at a point of the ground), length and body."""

    name: str
    carrier: str | None
    at: tuple[float, float]
    length: float
    m: float
    s: float
    I: float


class Rods:
    """The machine as rods, each on its carrier, and the pairs of rods whose ends are one joint."""

    def __init__(self) -> None:
        linkage = ChamberForces.linkage(MATH, MACHINE.p, ChamberForces.input_layout.from_names(LOADS))
        places: dict[str, tuple[str | None, tuple[float, float]]] = {
            name: (None, (at.x, at.y)) for name, at in linkage.ground.items()
        }
        self.rods: list[Rod] = []
        self.loops: list[tuple[str, str, str]] = []
        for group in (linkage.driver, *linkage.groups):
            (inner,), bars = group.pins, group.bars
            for bar in bars:
                carrier, at = places[bar.pin]
                self.rods.append(Rod(bar.name, carrier, at, bar.length, bar.mass.m, bar.mass.s, bar.mass.I))
                places |= {name: (bar.name, (s, t)) for name, (s, t) in bar.points.items()}
            places[inner] = bars[-1].name, (bars[-1].length, 0.0)
            if len(bars) > 1:
                self.loops.append((inner, bars[0].name, bars[1].name))
        self.by_name = {rod.name: rod for rod in self.rods}

    def motion(self, phi: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """The angle of each rod [rad] and its rate [rad/s] at crank angles `phi`."""
        links = MACHINE.drive(phi).links
        angles = {
            rod.name: np.unwrap(np.arctan2(links[rod.name].u.y, links[rod.name].u.x)) for rod in self.rods
        }
        return angles, {rod.name: np.broadcast_to(links[rod.name].t1 * W, phi.shape) for rod in self.rods}

    def gap(self, angles: Any) -> float:
        """The largest distance of the two ends of a joint [m], from the angles by rod."""

        def place(name: str, s: float, t: float = 0.0) -> Any:
            rod, (c, d) = self.by_name[name], (np.cos(angles[name]), np.sin(angles[name]))
            start = place(rod.carrier, *rod.at) if rod.carrier else np.array(rod.at)[:, None]
            return start + np.array([s * c - t * d, s * d + t * c])

        ends = ([place(name, self.by_name[name].length) for name in pair] for _, *pair in self.loops)
        return max(float(np.max(np.hypot(*(a - b)))) for a, b in ends)


def torque(phi: Any) -> Any:
    """Our torque at these crank angles."""
    return MACHINE.evaluate(LOADS | {"phi": phi, "w": W})["tau"]


def inertia(phi: Any) -> Any:
    """Our reflected inertia at these crank angles."""
    return MACHINE.evaluate(LOADS | {"phi": phi, "w": W})["J"]


# %% MuJoCo


class InMujoco:
    """The rods in MuJoCo: hinges along the tree, and `connect` constraints that close the loops, as stiff as they
    may be."""

    STEP = 1e-3

    def __init__(self, rods: Rods) -> None:
        import mujoco

        self.rods = rods
        self.model = mujoco.MjModel.from_xml_string(self._text())
        m = self.model
        for k, (_, first, second) in enumerate(rods.loops):
            # the anchors are the ends of both rods; the compiler would take them from a pose in which they differ
            m.eq_data[k, :6] = [rods.by_name[first].length, 0.0, 0.0, rods.by_name[second].length, 0.0, 0.0]
        self.places = [m.joint(rod.name).qposadr[0] for rod in rods.rods]
        self.crank = m.joint("crank").dofadr[0]

    def _text(self) -> str:
        def body(rod: Rod) -> str:
            inner = "".join(body(each) for each in self.rods.rods if each.carrier == rod.name)
            return (
                f'<body name="{rod.name}" pos="{rod.at[0]!r} {rod.at[1]!r} 0"><joint name="{rod.name}" axis="0 0 1"/>'
                f'<inertial pos="{rod.s!r} 0 0" mass="{rod.m!r}" diaginertia="{rod.I!r} {rod.I!r} {rod.I!r}"/>'
                f"{inner}</body>"
            )

        loops = "".join(
            f'<connect body1="{a}" body2="{b}" anchor="0 0 0" solref="{2.0 * self.STEP} 1" '
            'solimp=".9999 .9999 .001"/>'
            for _, a, b in self.rods.loops
        )
        return (
            f'<mujoco><option timestep="{self.STEP}" gravity="0 {-MACHINE.p.g!r} 0" iterations="50" '
            'tolerance="1e-14"><flag contact="disable"/></option><worldbody>'
            + "".join(body(rod) for rod in self.rods.rods if rod.carrier is None)
            + f"</worldbody><equality>{loops}</equality>"
            '<actuator><motor joint="crank" gear="-1"/></actuator></mujoco>'
        )

    def states(self, phi: Any) -> tuple[Any, Any]:
        """Joint angles and rates at crank angles, shape (n, joints)."""
        angles, rates = self.rods.motion(phi)
        own = []
        for values in (angles, rates):
            relative = np.empty((len(phi), len(self.rods.rods)))
            for place, rod in zip(self.places, self.rods.rods, strict=True):
                relative[:, place] = values[rod.name] - (values[rod.carrier] if rod.carrier else 0.0)
            own.append(relative)
        return own[0], own[1]

    def deviation(self, phi: Any, acceleration: Any) -> float:
        """Of the torque: the crank's acceleration with our torque would be zero."""
        return float(np.max(np.abs(inertia(phi) * acceleration)) / np.max(np.abs(torque(phi))))

    def turn(self) -> tuple[Any, Any, Any]:
        """A turn of MuJoCo's own with our torque, by the method of Runge and Kutta: joint angles, rates and torques
        at each step."""
        import mujoco

        m, data = self.model, mujoco.MjData(self.model)
        (data.qpos[:],), (data.qvel[:],) = self.states(np.array([0.0]))
        m.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        rows = []
        for _ in range(self.steps):
            data.ctrl[0] = np.interp((0.5 * math.pi - data.qpos[self.crank]) % (2.0 * math.pi), *self.course)
            rows.append((data.qpos.copy(), data.qvel.copy(), data.ctrl[0]))
            mujoco.mj_step(m, data)
        m.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
        q, v, tau = zip(*rows, strict=True)
        return np.array(q), np.array(v), np.array(tau)

    @property
    def steps(self) -> int:
        """Number of steps of a turn."""
        return round(TURN / self.STEP)

    @cached_property
    def course(self) -> tuple[Any, Any]:
        """Crank angles of a turn, and our torque there."""
        phi = np.linspace(0.0, 2.0 * math.pi, 7201)
        return phi, torque(phi)

    def judged(self, q: Any, v: Any, tau: Any) -> dict[str, float]:
        """Of a turn: the loop error, and the energy that is lost or won, in parts of the largest kinetic energy."""
        import mujoco

        data, energies, kinetic = mujoco.MjData(self.model), [], []
        for data.qpos[:], data.qvel[:] in zip(q, v, strict=True):
            mujoco.mj_fwdPosition(self.model, data)
            mujoco.mj_energyPos(self.model, data)
            mujoco.mj_energyVel(self.model, data)
            energies.append(sum(data.energy))
            kinetic.append(data.energy[1])
        w = -v[:, self.crank]
        # the torque is held over a step
        work = np.concatenate([[0.0], np.cumsum(0.5 * self.STEP * tau[:-1] * (w[:-1] + w[1:]))])
        gained = np.array(energies) - energies[0] - work
        by_rod: dict[str | None, Any] = {None: 0.0}
        for place, rod in zip(self.places, self.rods.rods, strict=True):
            by_rod[rod.name] = q[:, place] + by_rod[rod.carrier]
        return {
            "loop": self.rods.gap(by_rod),
            "energy": float(np.max(np.abs(gained)) / max(kinetic)),
        }


def mujoco(rods: Rods, count: int = 8192) -> list[dict[str, Any]]:
    """Rows of MuJoCo."""
    import mujoco
    from mujoco import rollout

    own, phi = InMujoco(rods), np.linspace(0.0, 2.0 * math.pi, count, endpoint=False)
    (q, v), tau, judged = own.states(phi), torque(phi), own.judged(*own.turn())
    begin = np.column_stack([np.zeros(count), q, v])
    rows = []
    for threads in sorted({1, CORES}):
        data = [mujoco.MjData(own.model) for _ in range(threads)]
        with rollout.Rollout(nthread=threads if threads > 1 else 0) as pool:
            call = partial(pool.rollout, own.model, data, begin, tau[:, None, None], chunk_size=64)
            spent, (after, _) = least(call), call()
        gained = after[:, 0, 1 + own.model.nq + own.crank] - v[:, own.crank]
        rows.append({
            "engine": "mujoco", "threads": threads, "rate": count / spent.wall,
            "cpu": threads * count / spent.processor,
            "work": "mj_step from a given state: bodies, accelerations, forces of the joints",
            "torque": own.deviation(phi, gained / own.STEP), **judged,
        })  # fmt: skip
    return rows


def mjx(rods: Rods, count: int = 2048) -> list[dict[str, Any]]:
    """Rows of MJX, in double precision on the device that jax takes."""
    import jax
    import jax.numpy as jnp
    from mujoco import mjtIntegrator, mjx

    jax.config.update("jax_enable_x64", True)
    # with two processors a call in the background may wait for a thread that waits for it
    jax.config.update("jax_cpu_enable_async_dispatch", False)
    own, phi = InMujoco(rods), np.linspace(0.0, 2.0 * math.pi, count, endpoint=False)
    (q, v), tau = own.states(phi), torque(phi)
    model = mjx.put_model(own.model)
    data = mjx.make_data(own.model)

    def accelerations(q: Any, v: Any, tau: Any) -> Any:
        return mjx.forward(model, data.replace(qpos=q, qvel=v, ctrl=tau[None])).qacc

    call = jax.jit(jax.vmap(accelerations))
    spent = least(lambda: jax.block_until_ready(call(q, v, tau)), rounds=3)
    deviation = own.deviation(phi, np.asarray(call(q, v, tau))[:, own.crank])
    own.model.opt.integrator = mjtIntegrator.mjINT_RK4
    stepped = mjx.put_model(own.model)

    def step(now: Any, _: Any) -> Any:
        tau = jnp.interp((0.5 * math.pi - now.qpos[own.crank]) % (2.0 * math.pi), *own.course)
        return mjx.step(stepped, now.replace(ctrl=tau[None])), (now.qpos, now.qvel, tau)

    turn = jax.jit(lambda begin: jax.lax.scan(step, begin, length=own.steps)[1])
    judged = own.judged(*map(np.asarray, turn(data.replace(qpos=q[0], qvel=v[0]))))
    device = jax.devices()[0].platform
    return [{
        "engine": "mjx", "threads": CORES if device == "cpu" else device, "rate": count / spent.wall,
        "cpu": count * (CORES if device == "cpu" else 1) / spent.processor,
        "work": "mjx.forward at given states, all in one call", "torque": deviation,
        **judged,
    }]  # fmt: skip


# %% exudyn


class InExudyn:
    """The rods in exudyn: bodies in absolute coordinates and revolute joints, the crank at constant speed."""

    def __init__(self, rods: Rods, steps: int, sensors: bool) -> None:
        import exudyn
        from exudyn import itemInterface as item  # noqa: N813

        self.exudyn, self.rods = exudyn, rods
        mbs = self.mbs = exudyn.SystemContainer().AddSystem()
        bodies: dict[str | None, int] = {None: mbs.AddObject(item.ObjectGround())}
        links = MACHINE.drive(0.0).links
        for rod in rods.rods:
            link = links[rod.name]
            c = link.at(rod.s)
            node = mbs.AddNode(
                item.NodeRigidBody2D(
                    initialCoordinates=[c.p.x, c.p.y, math.atan2(link.u.y, link.u.x)],
                    initialVelocities=[c.p1.x * W, c.p1.y * W, link.t1 * W],
                )
            )
            bodies[rod.name] = mbs.AddObject(
                item.ObjectRigidBody2D(mass=rod.m, inertia=rod.I, nodeNumber=node)
            )
            weighed = mbs.AddMarker(item.MarkerBodyMass(bodyNumber=bodies[rod.name]))
            mbs.AddLoad(item.LoadMassProportional(markerNumber=weighed, loadVector=[0.0, -MACHINE.p.g, 0.0]))
            if rod.name == "crank":
                turned = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=2))

        def marker(name: str | None, s: float, t: float) -> int:
            s = s - rods.by_name[name].s if name else s
            return mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=bodies[name], localPosition=[s, t, 0.0]))

        pairs = [((rod.name, 0.0, 0.0), (rod.carrier, *rod.at)) for rod in rods.rods]
        pairs += [tuple((name, rods.by_name[name].length, 0.0) for name in pair) for _, *pair in rods.loops]
        joints = [
            mbs.AddObject(item.ObjectJointRevolute2D(markerNumbers=[marker(*a), marker(*b)]))
            for a, b in pairs
        ]
        zero = mbs.AddMarker(
            item.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(item.NodePointGround()), coordinate=0)
        )
        drive = mbs.AddObject(
            item.ObjectConnectorCoordinate(markerNumbers=[zero, turned], velocityLevel=True, offset=-W)
        )
        self.sensors = []
        for number, what in (
            [(drive, "Force"), *((joint, "Displacement") for joint in joints)] if sensors else ()
        ):
            kind = getattr(exudyn.OutputVariableType, what)
            self.sensors.append(
                mbs.AddSensor(
                    item.SensorObject(
                        objectNumber=number, outputVariableType=kind, storeInternal=True, writeToFile=False
                    )
                )
            )
        mbs.Assemble()
        self.settings = exudyn.SimulationSettings()
        self.settings.solution.file.write = False
        self.settings.solution.sensors.writePeriod = 0.0
        time = self.settings.timeIntegration
        time.numberOfSteps, time.endTime, time.adaptiveStep = steps, TURN, False
        time.newton.relativeTolerance, time.newton.absoluteTolerance = 1e-10, 1e-12
        time.newton.numericalDifferentiation.relativeEpsilon = 1e-8

    def run(self) -> list[Any]:
        """The rows of all sensors over a turn."""
        self.mbs.SolveDynamic(self.settings, solverType=self.exudyn.DynamicSolverType.TrapezoidalIndex2)
        return [self.mbs.GetSensorStoredData(number) for number in self.sensors]


def exudyn(rods: Rods, steps: int = 4000) -> list[dict[str, Any]]:
    """Rows of exudyn."""
    import exudyn

    exudyn.config.printToConsole = False
    drive, *gaps = InExudyn(rods, steps, True).run()
    wanted = torque(W * drive[:, 0])
    # the multipliers alternate about their course: every second one
    deviation = np.max(np.abs(drive[:, 1] - wanted)[::2]) / np.max(np.abs(wanted))
    models = iter([InExudyn(rods, steps, False) for _ in range(6)])
    spent = least(lambda: next(models).run(), rounds=5)
    return [{
        "engine": "exudyn", "threads": 1, "rate": steps / spent.wall, "cpu": steps / spent.processor,
        "work": f"a step of its time integration, the trapezoidal rule with {steps} steps a turn",
        "loop": max(float(np.max(np.hypot(*gap[:, 1:3].T))) for gap in gaps), "torque": float(deviation),
    }]  # fmt: skip


# %% pylinkage


def pylinkage(rods: Rods, count: int = 100_000) -> list[dict[str, Any]]:
    """Rows of pylinkage: places of the pins only, compiled by numba where that is installed."""
    import pylinkage as pl
    from pylinkage._numba_compat import HAS_NUMBA

    course = 2.0 * math.pi / count * np.arange(1, count + 1)
    wanted = {name: at.p for name, at in MACHINE.drive(course).pins.items()}
    start = {name: at.p for name, at in MACHINE.drive(np.zeros(1)).pins.items()}
    p = MACHINE.p
    o1, c, left, right = (
        pl.Ground(float(at.x), float(at.y), name=name)
        for name in ("O1", "C", "A1 left", "A1 right")
        for at in (MACHINE.drive(0.0).pins[name].p,)
    )
    crank = pl.Crank(
        anchor=o1, radius=p.r, angular_velocity=-2.0 * math.pi / count, initial_angle=0.5 * math.pi
    )

    def dyad(name: str, one: Any, other: Any, *lengths: float) -> Any:
        at = start[name]
        return pl.RRRDyad(one, other, *lengths, x=float(at.x[0]), y=float(at.y[0]), name=name)

    bd = dyad("Bd", crank.output, c, p.l, p.h)
    a2 = pl.FixedDyad(c, bd, distance=p.e, angle=0.0, name="A2")
    b_left, b_right = dyad("B left", left, a2, p.l1, p.l2), dyad("B right", right, a2, p.l1, p.l2)
    parts = {"Bd": bd, "A2": a2, "B left": b_left, "B right": b_right}
    linkage = pl.simulation.Linkage([o1, c, left, right, crank, bd, a2, b_left, b_right])
    places = linkage.step_fast(count)
    order = list(linkage.components)
    found = {name: places[:, order.index(part)] for name, part in parts.items()}
    found |= {"A": places[:, order.index(crank)]}
    ends = {"A1 left": (left.x, left.y), "A1 right": (right.x, right.y), "C": (0.0, 0.0)}

    def misfit(one: str, other: str, length: float) -> float:
        a, b = (found.get(name, np.array(ends.get(name, (0.0, 0.0)))) for name in (one, other))
        return float(np.max(np.abs(np.hypot(*(a - b).T) - length)))

    loop = max(
        misfit("A", "Bd", p.l),
        misfit("C", "Bd", p.h),
        *(misfit(f"A1 {side}", f"B {side}", p.l1) for side in ("left", "right")),
        *(misfit("A2", f"B {side}", p.l2) for side in ("left", "right")),
    )
    place = max(
        float(np.max(np.hypot(at[:, 0] - wanted[n].x, at[:, 1] - wanted[n].y))) for n, at in found.items()
    )
    spent = least(lambda: linkage.step_fast(count))
    return [{
        "engine": "pylinkage", "threads": 1, "rate": count / spent.wall, "cpu": count / spent.processor,
        "work": "places of the pins along a turn, no forces" + ("" if HAS_NUMBA else "; without numba"),
        "loop": loop, "place": place,
    }]  # fmt: skip


ENGINES = {"exudyn": exudyn, "mujoco": mujoco, "mjx": mjx, "pylinkage": pylinkage}
"""By the name under which people install them."""


LONGEST = 150
"""Time that one engine may take [s]."""


def measure() -> tuple[list[dict[str, Any]], dict[str, str]]:
    """The rows of all engines, each in a process of its own, and by the name of an engine why it has none."""
    rows, missing = [], {}
    for name in ENGINES:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "rows.json"
            command = [sys.executable, __file__, name, "--json", str(file)]
            try:
                process = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST)
            except subprocess.TimeoutExpired:
                missing[name] = f"did not end in {LONGEST} s"
                continue
            if process.returncode == ABSENT:
                missing[name] = "is not installed"
            elif process.returncode:
                raise SystemExit(f"{name}: {process.stderr}")
            else:
                rows += json.loads(file.read_text("utf-8"))
    return rows, missing


def main() -> None:
    options = parser()
    options.add_argument("engine", choices=list(ENGINES), nargs="*")
    given = options.parse_args()
    try:
        rows = [row for name in given.engine or ENGINES for row in ENGINES[name](Rods())]
    except ImportError as error:
        print(error)
        raise SystemExit(ABSENT) from None
    for row in rows:
        print({name: x for name, x in row.items() if x is not None})
    save(given.json, rows)


if __name__ == "__main__":
    main()
