"""The table of motors, their circuits, files of the user's, and the transmission."""

from __future__ import annotations

import csv
import dataclasses
import io
import math
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from command import chainunit
from scipy.optimize import fsolve

from chainunit.core import engines
from chainunit.core.errors import InputError
from chainunit.core.integrators import rk4
from chainunit.core.quantities import Layout
from chainunit.drives.catalogue import (
    KINDS,
    LAYOUT,
    catalogue,
    high_slip_motors,
    motor_of_catalogue,
    offer,
    packaged_motors,
)
from chainunit.drives.catalogue_rows import heading
from chainunit.drives.gearing import KINDS as TRANSMISSIONS
from chainunit.drives.gearing import W_REST, Transmission, geared_acceleration, motor_side
from chainunit.drives.induction_motor import InductionMotor
from chainunit.drives.induction_steady import breakdown, steady
from chainunit.drives.nameplate import LAYOUT as NAMEPLATE
from chainunit.drives.nameplate import TYPICAL, Assumptions, Nameplate, check, identify
from chainunit.study.config import parse
from chainunit.study.study_file import changed_tables

EXAMPLES = Path(__file__).parents[1] / "examples"
MOTORS = catalogue()
FIFTY, SIXTY = ([m for m in MOTORS if m.nameplate.frequency == f] for f in (50.0, 60.0))
STATES = InductionMotor.state_layout
RPM = math.pi / 30.0
PLATE = {
    "power": 2200.0,
    "poles": 4.0,
    "speed": 1455.0 * RPM,
    "efficiency": 0.867,
    "power_factor": 0.80,
    "breakdown_ratio": 3.0,
    "locked_torque_ratio": 2.4,
    "locked_current_ratio": 6.9,
    "J": 0.0086,
    "locked_time": 12.0,
}


def plate(**given) -> Nameplate:
    return NAMEPLATE.from_names(PLATE | given)


# --- the table ---


def test_table_is_whole():
    powers = [
        0.12,
        0.18,
        0.25,
        0.37,
        0.55,
        0.75,
        1.1,
        1.5,
        2.2,
        3,
        4,
        5.5,
        7.5,
        11,
        15,
        18.5,
        22,
        30,
        37,
        45,
        55,
        75,
    ]
    wanted = [(1000.0 * power, poles) for poles in (2.0, 4.0, 6.0) for power in powers]
    assert FIFTY + SIXTY == MOTORS
    for motors in (FIFTY, SIXTY):
        assert [(m.nameplate.power, m.nameplate.poles) for m in motors] == wanted
    assert len({m.designation for m in MOTORS}) == 132
    for m in MOTORS:
        assert f"{m.nameplate.poles:g}-pole {m.nameplate.power / 1000:g} kW, " in m.designation
        assert m.nameplate.voltage == {50.0: 400.0, 60.0: 460.0}[m.nameplate.frequency]
        assert m.designation.endswith(", 60 Hz") == (m in SIXTY)
        assert "typical" in m.source and m.origin.startswith("motors.csv:")


def test_headings_are_the_declarations():
    text = (resources.files("chainunit") / "data" / "motors.csv").read_text("utf-8")
    declarations = {heading(v) for v in LAYOUT.variables}
    assert set(next(csv.reader(io.StringIO(text)))) - {"designation", "source"} <= declarations
    assert heading(LAYOUT.variables[LAYOUT.names.index("speed")]) == "speed [rev/min]"


IE3 = {  # IEC 60034-30-1: coefficients of the limits at 50 Hz from 0.75 kW, by number of poles
    2.0: (0.3569, -3.3076, 11.6108, 82.2503),
    4.0: (0.0773, -1.8951, 9.2984, 83.7025),
    6.0: (0.1252, -2.613, 11.9963, 80.4769),
}


IE4 = {  # the same of class IE4, up to 200 kW
    2.0: (0.34, -3.0479, 10.293, 84.8208),
    4.0: (0.2412, -2.3608, 8.446, 86.8321),
    6.0: (0.3598, -3.2107, 10.7933, 84.107),
}


def test_efficiencies_are_the_standards():
    """IE4 where EU 2019/1781 lets no IE3 motor on the market since July 2023: from 75 to 200 kW."""
    for m in FIFTY:
        name, limits = ("IE4", IE4) if m.nameplate.power >= 75e3 else ("IE3", IE3)
        assert m.designation.startswith(f"{name} ") and name in m.source
        if m.nameplate.power >= 750.0:
            limit = np.polyval(limits[m.nameplate.poles], math.log10(m.nameplate.power / 1000.0))
            assert 100.0 * m.nameplate.efficiency == pytest.approx(limit, abs=0.11), m.designation


LAW_60 = (  # 10 CFR 431.446 and 431.25, which are NEMA Premium and IE3 at 60 Hz: power [kW]; 2, 4, 6 poles [%]
    (0.18, 65.6, 69.5, 67.5), (0.25, 69.5, 73.4, 71.4), (0.37, 73.4, 78.2, 75.3), (0.55, 76.8, 81.1, 81.7),
    (0.75, 77.0, 85.5, 82.5), (1.1, 84.0, 86.5, 87.5), (1.5, 85.5, 86.5, 88.5), (2.2, 86.5, 89.5, 89.5),
    (3.7, 88.5, 89.5, 89.5), (5.5, 89.5, 91.7, 91.0), (7.5, 90.2, 91.7, 91.0), (11.0, 91.0, 92.4, 91.7),
    (15.0, 91.0, 93.0, 91.7), (18.5, 91.7, 93.6, 93.0), (22.0, 91.7, 93.6, 93.0), (30.0, 92.4, 94.1, 94.1),
    (37.0, 93.0, 94.5, 94.1), (45.0, 93.6, 95.0, 94.5), (55.0, 93.6, 95.4, 94.5),
)  # fmt: skip


@pytest.mark.stages(first=4, second=12)
@pytest.mark.parametrize("motor", SIXTY, ids=lambda m: m.designation)
def test_a_60_hz_motor_is_the_50_hz_motor_on_other_mains(motor):
    """Its nameplate is the circuit of the 50 Hz motor on 460 V, 60 Hz, and its own circuit meets the nameplate."""
    n, other = motor.nameplate, FIFTY[SIXTY.index(motor)]
    assert motor.designation == f"{other.designation}, 60 Hz"
    fifty = other.identify().parameters
    p = InductionMotor.parameter_layout.from_names({"supply.V": 460.0, "supply.f": 60.0}, fifty)
    warm = p.ambient.T + TYPICAL.rise
    rated = steady(engines.MATH, p, n.speed, T=warm)
    # rev/min are rounded: a torque of a per cent or two in large motors
    assert rated.tau == pytest.approx(n.torque, rel=0.1)
    assert rated.power_factor == pytest.approx(n.power_factor, abs=0.02)
    assert breakdown(p, T=warm).tau == pytest.approx(n.breakdown_ratio * n.torque, rel=0.005)
    locked = steady(engines.MATH, p, 0.0)
    assert locked.tau == pytest.approx(n.locked_torque_ratio * n.torque, rel=0.005)
    assert locked.i == pytest.approx(n.locked_current_ratio * n.rated_current, rel=0.02)
    assert abs(motor.identify().worst[1]) < 0.04
    limits = {power: row for power, *row in LAW_60}
    kW = 3.7 if n.power in (3e3, 4e3) else n.power / 1000.0
    if kW in limits:
        limit = limits[kW][round(n.poles) // 2 - 1] / 100.0
        assert n.efficiency == pytest.approx(max(limit, other.nameplate.efficiency), abs=1e-9)


HIGH_SLIP = high_slip_motors()


def standard_of(motor, step=0):
    """The standard motor of the same power, poles and frequency, or the one so many steps larger."""
    n = motor.nameplate
    row = [m for m in MOTORS if (m.nameplate.poles, m.nameplate.frequency) == (n.poles, n.frequency)]
    return row[[m.nameplate.power for m in row].index(n.power) + step]


def test_high_slip_motors_are_of_design_d():
    """NEMA MG 1, design D: a locked-rotor torque of 2.75 times the rated one; 8 to 13 % slip is a usual class of it.
    Their heat needs the frame of the next larger motor."""
    assert packaged_motors() == [*MOTORS, *HIGH_SLIP] and all(m.is_packaged for m in HIGH_SLIP)
    kinds = {(m.nameplate.power, m.nameplate.poles, m.nameplate.frequency) for m in HIGH_SLIP}
    assert len(kinds) == len(HIGH_SLIP) == 64 and {kind[1:] for kind in kinds} == {
        (poles, f) for poles in (4.0, 6.0) for f in (50.0, 60.0)
    }
    for m in HIGH_SLIP:
        n, standard, larger = m.nameplate, standard_of(m), standard_of(m, 1)
        assert n.slip == pytest.approx(0.1, abs=1e-9) and n.locked_torque_ratio == 2.75
        assert n.locked_current_ratio < standard.nameplate.locked_current_ratio
        assert (n.J, n.mass, n.locked_time) == tuple(
            getattr(larger.nameplate, name) for name in ("J", "mass", "locked_time")
        )
        frame, *rest = larger.designation.split(", ")[1:]
        title = f"High-slip {n.poles:g}-pole {n.power / 1000:g} kW, {frame}"
        assert m.designation == ", ".join([title, *rest])
        assert motor_of_catalogue(m.designation) is m


@pytest.mark.parametrize("motor", HIGH_SLIP[::7], ids=lambda m: m.designation)
def test_a_high_slip_motor_is_the_standard_motor_rewound_with_another_cage(motor):
    """Its nameplate is the circuit of the standard motor with all impedances times one factor and a cage without skin
    effect, which have the rated torque at 10 % slip and the locked-rotor torque of design D; and its own circuit
    meets the nameplate."""
    n, standard = motor.nameplate, standard_of(motor).identify().parameters
    warm = standard.ambient.T + TYPICAL.rise

    def rewound(x):
        factor, resistance = x
        scaled = {"stator.R": standard.stator.R, "main.L": standard.main.L, "cage.L": standard.cage.L}
        values = {name: factor * value for name, value in scaled.items()}
        values |= {"cage.R": resistance * standard.cage.R, "cage.skin_R": 0.0}
        values["rotor.d"] = TYPICAL.friction * n.power / n.speed**2
        return InductionMotor.parameter_layout.from_names(values, standard)

    def missing(x):
        rated = steady(engines.MATH, rewound(x), n.speed, T=warm).tau
        return rated / n.torque - 1.0, steady(engines.MATH, rewound(x), 0.0).tau / (2.75 * n.torque) - 1.0

    solution, _, code, _ = fsolve(missing, (1.15, 5.0), full_output=True)
    assert code == 1 and 0.9 < solution[0] < 1.45 and 1.5 < solution[1] < 12.0
    p = rewound(solution)
    rated, locked = steady(engines.MATH, p, n.speed, T=warm), steady(engines.MATH, p, 0.0)
    assert rated.power_factor == pytest.approx(n.power_factor, abs=0.001)
    assert n.power / rated.supply_power == pytest.approx(n.efficiency, abs=0.001)
    assert locked.i / rated.i == pytest.approx(n.locked_current_ratio, abs=0.006)
    assert breakdown(p, T=warm).tau / n.torque == pytest.approx(n.breakdown_ratio, abs=0.006)
    own = motor.identify()
    assert abs(own.worst[1]) < 0.02
    for share in (0.98, 0.95, 0.9, 0.0):
        torques = [
            steady(engines.MATH, each, share * n.synchronous, T=warm).tau for each in (p, own.parameters)
        ]
        assert torques[1] == pytest.approx(torques[0], abs=0.02 * n.torque), share


def test_values_vary_smoothly_with_size():
    """Each rises or falls along a number of poles, but for rounding."""
    rising = "speed efficiency power_factor breakdown_ratio locked_current_ratio J mass".split()
    for poles in (2.0, 4.0, 6.0):
        rows = [m.nameplate for m in FIFTY if m.nameplate.poles == poles]
        for name in rising:
            values = [getattr(row, name) for row in rows]
            assert values == sorted(values), (poles, name)
        for name in ("locked_torque_ratio", "locked_time"):
            # the smallest, with their large resistances, have less locked torque again
            values = [getattr(row, name) for row in rows if row.power > 500.0]
            assert values == sorted(values, reverse=True), (poles, name)


def test_locked_rotor_currents_are_those_of_efficient_motors():
    """Makers publish 7 to 8.5 for IE3 motors of some kilowatts; IEC 60034-12 permits this in design N: its largest
    apparent power with the rotor locked over the rated power."""
    from_power = {2.0: 1.1e3, 4.0: 1.5e3, 6.0: 7.5e3}
    for m in FIFTY:
        n = m.nameplate
        if n.power >= from_power[n.poles]:
            assert 7.0 <= n.locked_current_ratio <= 8.5, m.designation
        most = 13.0 if n.power <= 6.3e3 else 12.0 if n.power <= 25e3 else 11.0
        assert n.locked_current_ratio * n.apparent_power <= most * n.power, m.designation


def test_a_motor_is_found_by_its_designation():
    wanted = MOTORS[30]
    result = motor_of_catalogue(wanted.designation)
    assert result == wanted
    model, parameters = result.model()
    assert model is InductionMotor
    assert parameters == result.identify().parameters and not model.follows(parameters)
    with pytest.raises(InputError, match=r'"IE3 4-pole 2 kW": not in the catalogue.*"IE3 4-pole 22 kW, '):
        motor_of_catalogue("IE3 4-pole 2 kW")


# --- circuits ---


SMALL = [m for m in FIFTY if m.nameplate.power < 500.0]


@pytest.mark.parametrize("motor", SMALL, ids=lambda m: m.designation)
def test_the_smallest_motors_have_their_circuits_but_for_iron(motor):
    """They lose more in their iron than a circuit without iron losses has, and their resistances are larger."""
    result = motor.identify()
    assert abs(result.worst[1]) < 0.03, result.worst
    p, n = result.parameters, motor.nameplate
    InductionMotor.check(p)
    base = n.voltage**2 / n.apparent_power
    assert 0.05 < p.stator.R / base < 0.2 and 0.04 < p.cage.R / base < 0.2
    assert 0.1 < 100.0 * math.pi * p.cage.L / base < 0.4 and 0.9 < 100.0 * math.pi * p.main.L / base < 2.0


@pytest.mark.parametrize("motor", [m for m in FIFTY if m not in SMALL], ids=lambda m: m.designation)
def test_every_motor_has_its_circuit(motor):
    """Residuals are rounding, below 1e-9; the parameters are those of a motor and no artefact of a bound."""
    result = motor.identify()
    assert abs(result.worst[1]) < 1e-9, result.worst
    p, n = result.parameters, motor.nameplate
    InductionMotor.check(p)
    base = n.voltage**2 / n.apparent_power
    X_l, X_m = (100.0 * math.pi * L / base for L in (p.cage.L, p.main.L))
    assert 0.015 < p.stator.R / base < 0.11 and 0.005 < p.cage.R / base < 0.08
    assert 0.08 < X_l < 0.3 and 1.2 < X_m < 3.5
    assert 0.0 < p.cage.skin_R < 4.0 and 0.0 < p.cage.skin_L < 0.35
    assert 0.05 < result.breakdown.slip < 0.5
    # what was fitted is what the model does, by functions of their own
    warm = p.ambient.T + TYPICAL.rise
    assert breakdown(p, T=warm).tau == pytest.approx(n.breakdown_ratio * n.torque, rel=1e-8)
    locked = steady(engines.MATH, p, 0.0)
    assert locked.i == pytest.approx(n.locked_current_ratio * n.rated_current, rel=1e-8)
    assert locked.tau == pytest.approx(n.locked_torque_ratio * n.torque, rel=1e-8)


@pytest.mark.second
@pytest.mark.parametrize("k", [4, 30, 65], ids=lambda k: MOTORS[k].designation)
def test_rated_running_is_the_dynamic_models(k):
    """A warm motor under rated torque settles at rated speed, current, power factor, and stays as warm."""
    n, p = MOTORS[k].nameplate, MOTORS[k].identify().parameters
    u = InductionMotor.input_layout.from_names({"load.tau_bias": n.torque})
    held = InductionMotor.parameter_layout.from_names({"stator.C": 1e12}, p)  # keeps its temperature
    x = STATES.values(InductionMotor.initial_states(engines.MATH, p))
    T = STATES.names.index("stator.T")
    x[T], x[STATES.names.index("w")] = p.ambient.T + TYPICAL.rise, n.synchronous

    def rates(_, y, p=held):
        return InductionMotor.derivatives(engines.MATH, p, u, STATES.instance(y))

    x = rk4(rates, x, 3.0, InductionMotor.internal_step(engines.MATH, p))
    out = InductionMotor.evaluate(engines.MATH, held, u, STATES.instance(x))[0]
    assert STATES.instance(x).w == pytest.approx(n.speed, rel=1e-6)
    assert (out.i, out.supply_power) == pytest.approx((n.rated_current, n.power / n.efficiency), rel=1e-6)
    assert out.supply_power / (math.sqrt(3.0) * out.v * out.i) == pytest.approx(n.power_factor, rel=1e-6)
    assert abs(rates(0.0, x, p)[T]) < 1e-5 * out.heat / p.stator.C


def test_fit_is_deterministic_and_kept():
    assert identify(plate()) is identify(plate())
    again = identify.__wrapped__(plate())
    assert again.parameters == identify(plate()).parameters
    assert set(identify(plate()).residuals) == {
        *("power", "current", "power_factor", "efficiency"),
        *("breakdown_ratio", "locked_torque_ratio", "locked_current_ratio"),
    }


def test_given_current_is_met():
    derived = plate().rated_current
    assert derived == pytest.approx(2200.0 / (0.867 * 0.80 * math.sqrt(3.0) * 400.0))
    result = identify(plate(current=1.02 * derived))
    assert result.rated.i == pytest.approx(1.02 * derived, rel=1e-9)
    # the supply power follows the current; the efficiency on the nameplate is off by as much
    assert result.worst == ("efficiency", pytest.approx(1.0 / 1.02 - 1.0, rel=1e-6))


def test_other_supply_and_assumptions():
    american = plate(voltage=460.0, frequency=60.0, speed=1755.0 * RPM)
    assumed = Assumptions(friction=0.02, rise=60.0, time_constant=1800.0, growth=0.0)
    result = identify(american, assumed)
    p = result.parameters
    assert abs(result.worst[1]) < 1e-9 and (p.supply.V, p.supply.f) == (460.0, 60.0)
    assert p.rotor.d * american.speed**2 == pytest.approx(0.02 * 2200.0)
    assert p.stator.R_th * p.stator.C == pytest.approx(1800.0)


def test_what_small_motors_lose_in_iron_shows_as_a_residual():
    """Their stator cannot make up for iron losses and still have the pull-out torque: the fit leaves that to the
    efficiency, and says so."""
    small = plate(
        power=750.0,
        poles=2.0,
        speed=2885.0 * RPM,
        efficiency=0.807,
        breakdown_ratio=3.3,
        locked_torque_ratio=2.7,
        locked_current_ratio=6.6,
    )
    result = identify(small)
    assert result.worst[0] == "efficiency" and 0.03 < result.worst[1] < 0.07
    assert abs(result.residuals["power_factor"]) < 0.06
    rest = set(result.residuals) - {"efficiency", "power_factor"}
    assert max(abs(result.residuals[name]) for name in rest) < 0.02


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            {"speed": 1505.0 * RPM},
            r"speed = 157\.\d+ rad/s \(1505 rev/min\).*synchronous speed \(1200 and 1500",
        ),
        ({"speed": 1100.0 * RPM}, r"speed = .*\(1100 rev/min\)"),
        ({"poles": 3.0}, "poles = 3: must be an even number"),
        ({"poles": 50.0}, "poles = 50: must be >= 2 and <= 48"),
        ({"efficiency": 1.1}, "efficiency = 1.1: must be > 0 and <= 1"),
        ({"efficiency": 0.97}, "efficiency = 0.97: a slip of 0.03 and friction of 0.01.*must be < 0.96"),
        ({"power_factor": 0.0}, "power_factor = 0: must be > 0 and <= 1"),
        ({"locked_current_ratio": 0.9}, "locked_current_ratio = 0.9: must be > 1"),
        ({"locked_torque_ratio": 9.9}, r"locked_torque_ratio = 9.9: .*must be < 9\."),
        ({"breakdown_ratio": 1.0}, "breakdown_ratio = 1: must be > 1"),
        ({"current": 6.0}, r"current = 6 A: .*make it 4\.578 A; must be > 4\.12 and < 5\.036 A"),
        ({"J": 0.0}, "J = 0 kg m2: must be > 0 kg m2"),
        ({"power": math.nan}, "power = nan W: must be finite, > 0 W"),
        (
            {"locked_current_ratio": 3.2, "locked_torque_ratio": 1.2},
            r"breakdown_ratio = 3: no circuit meets it.*closest has 2\.\d+; must be within 10% of that",
        ),
    ],
)
def test_contradictory_nameplates_are_refused(given, said):
    with pytest.raises(InputError, match=said) as refusal:
        identify(plate(**given))
    assert "\n" not in str(refusal.value)


def test_assumptions_out_of_bounds_are_refused():
    with pytest.raises(InputError, match=r"friction = 0.5: must be >= 0 and <= 0.1"):
        check(plate(), Assumptions(friction=0.5))


# --- files of the user's ---

ROW = {
    "designation": "pump, old",
    "power [kW]": "2.2",
    "poles": "4",
    "speed [rev/min]": "1455",
    "efficiency": "0.867",
    "power_factor": "0.80",
    "breakdown_ratio": "3",
    "locked_torque_ratio": "2.4",
    "locked_current_ratio": "6.9",
    "J [kg.m2]": "0.0086",
    "locked_time [s]": "12",
}
TOML = "[[motor]]\n" + "\n".join(
    f'{name} = "{value} rad/s"' if name == "speed" else f"{name} = {value!r}"
    for name, value in ({"designation": "pump, old"} | PLATE).items()
)


def csv_file(folder: Path, *rows: dict[str, str]) -> Path:
    file = folder / "own.csv"
    with file.open("w", newline="", encoding="utf-8-sig") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return file


def test_own_motors_stand_behind_the_packaged(tmp_path):
    toml = tmp_path / "own.toml"
    toml.write_text(TOML)
    csv_ = csv_file(tmp_path, ROW, ROW | {"designation": "fan", "power [kW]": "2200 W"})
    for file, where in ((csv_, 2), (toml, 1)):
        own = catalogue(file)[132:]
        assert (own[0].designation, own[0].origin) == ("pump, old", f"{file}:{where}")
        assert own[0].source == own[0].origin
        for name, value in PLATE.items():
            assert getattr(own[0].nameplate, name) == pytest.approx(value, rel=1e-12)
        assert own[0].nameplate.mass == 0.0
        assert abs(own[0].identify().worst[1]) < 1e-9
    assert [m.designation for m in catalogue(csv_)[132:]] == ["pump, old", "fan"]
    assert len(catalogue()) == 132


def test_columns_may_have_any_unit_of_their_kind(tmp_path):
    values = {name: value for name, value in ROW.items() if "[" not in name}
    values |= {
        "power [W]": "2200",
        "speed [rad/s]": str(PLATE["speed"]),
        "J [g.m2]": "8.6",
        "locked_time [min]": "0.2",
    }
    (own,) = catalogue(csv_file(tmp_path, values))[132:]
    for name, value in PLATE.items():
        assert getattr(own.nameplate, name) == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize(
    ("column", "cell", "said"),
    [
        ("power [kW]", "-1", r":3: column power = -1000 W: must be > 0 W and <= 1e\+10 W \(rated power"),
        ("power [kW]", "much", ':3: column power = "much": must be a number in W'),
        ("power [kW]", "nan", ':3: column power = "nan": must be a number in W'),
        ("power [kW]", "", ":3: column power: is missing; must be > 0 W"),
        ("poles", "5", ":3: column poles = 5: must be an even number"),
        ("speed [rev/min]", "1555", r":3: column speed = .* \(1555 rev/min\)"),
        ("efficiency", "86.7", ":3: column efficiency = 86.7: must be > 0 and <= 1"),
        ("designation", "", ':3: column designation = "": must be a text of one line'),
        ("designation", "a\nb", r":3: column designation = \"a\\nb\": must be a text of one line"),
        ("designation", "pump, old", ':3: column designation = "pump, old": stands in the catalogue already'),
        ("designation", MOTORS[0].designation, ":3: column designation = .* stands in the catalogue already"),
    ],
)
def test_bad_rows_are_refused(tmp_path, column, cell, said):
    file = csv_file(tmp_path, ROW, ROW | {"designation": "fan"} | {column: cell})
    with pytest.raises(InputError, match=said) as refusal:
        catalogue(file)
    assert str(refusal.value).startswith(f"{file}:") and "\n" not in str(refusal.value)


def test_all_wrong_cells_are_told_at_once(tmp_path):
    rows = [
        ROW | {"power [kW]": "-1", "poles": "four", "current [A]": "4,9"},
        ROW | {"designation": "fan", "poles": "5", "current [A]": "9"},
        ROW | {"designation": "fan"},
    ]
    file = csv_file(tmp_path, *rows)
    with file.open("a", encoding="utf-8") as stream:
        stream.write("a,b\n")
    with pytest.raises(InputError) as refusal:
        catalogue(file)
    messages = [line.removeprefix(f"{file}:") for line in str(refusal.value).splitlines()]
    begins = [
        "2: column power = -1000 W: must be > 0 W",
        '2: column poles = "four": must be a pure number',
        '2: column current = "4,9": must be a number in A, or a text such as "2 A" (rated current',
        "3: column current = 9 A: power, voltage, efficiency and power factor make it",
        "3: column poles = 5: must be an even number",
        '4: column designation = "fan": stands in the catalogue already',
        "5: has 2 cells; must have",
    ]
    assert len(messages) == len(begins)
    for line, begin in zip(messages, begins, strict=True):
        assert line.startswith(begin), line
    assert 'was "4.9" meant?' in messages[2]


def test_all_wrong_headings_are_told_at_once(tmp_path):
    file = tmp_path / "own.csv"
    file.write_text("designation,pwer [kW],speed [kg],source [m],poles,poles\n")
    with pytest.raises(InputError) as refusal:
        catalogue(file)
    messages = [line.removeprefix(f"{file}:1: ") for line in str(refusal.value).splitlines()]
    assert messages[0].startswith('heading "pwer [kW]": unknown; was "power" meant?')
    assert messages[1:4] == [
        'heading "speed [kg]": must have a unit such as speed [rev/min]',
        'heading "source [m]": has no unit',
        "column poles: stands twice; take one of both out",
    ]
    # a column whose heading is wrong is there, and is not missing, too
    missing = "efficiency power_factor breakdown_ratio locked_torque_ratio locked_current_ratio J locked_time"
    assert [line.split(":")[0] for line in messages[4:]] == [f"column {name}" for name in missing.split()]


def test_missing_columns_are_told_once_beside_wrong_cells(tmp_path):
    file = tmp_path / "own.csv"
    columns = {name: cell for name, cell in ROW.items() if name not in ("poles", "J [kg.m2]")}
    rows = [columns | {"power [kW]": "-1"}, columns | {"designation": "fan", "efficiency": "x"}]
    file = csv_file(tmp_path, *rows)
    with pytest.raises(InputError) as refusal:
        catalogue(file)
    messages = [line.removeprefix(f"{file}:") for line in str(refusal.value).splitlines()]
    assert messages[:2] == [
        '1: column poles: is missing; add the heading "poles"',
        '1: column J: is missing; add the heading "J [kg.m2]"',
    ]
    assert [line.partition(" = ")[0] for line in messages[2:]] == ["2: column power", "3: column efficiency"]


def test_thousands_with_blanks_have_the_unit_of_their_column(tmp_path):
    rows = ROW | {"speed [rev/min]": "1\u202f455"}, ROW | {"designation": "2", "speed [rev/min]": "1.455e3"}
    for motor in catalogue(csv_file(tmp_path, *rows))[132:]:
        assert motor.nameplate.speed == pytest.approx(PLATE["speed"], rel=1e-12)


def test_wrong_values_of_a_toml_catalogue_have_their_own_lines(tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(
        f"# own\n\n{TOML}\n{TOML}".replace("2200.0", '"2 m"', 1).replace("poles = 4.0", "poles = []", 1)
    )
    with pytest.raises(InputError) as refusal:
        catalogue(file)
    messages = [line.removeprefix(f"{file}:") for line in str(refusal.value).splitlines()]
    assert [line.partition(" = ")[0] for line in messages] == [
        "5: motor 1: power", "6: motor 1: poles", "16: motor 2: designation",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.csv", "", "is empty; must begin with a row of headings"),
        (
            "a.csv",
            "designation;power\n",
            'heading "designation;power": unknown; known here: designation, order_number, source, pow',
        ),
        ("a.csv", "designation,colour\n", 'heading "colour": unknown'),
        ("a.csv", "power [W],power [kW]\n", "a.csv:1: column power: stands twice"),
        (
            "a.csv",
            "designation,power [V]\nx,1\n",
            'a.csv:1: heading "power [V]": must have a unit such as power [W]',
        ),
        ("a.csv", f"{','.join(ROW)}\nx\n", f"a.csv:2: has 1 cells; must have {len(ROW)}"),
        ("a.csv", 'designation\n"x\n', "a.csv:2: no valid CSV"),
        ("a.toml", "x = ", "a.toml:1: no valid TOML"),
        ("a.toml", '[[motor]]\nsource = "a\\u0007"', 'a.toml:2: motor.1.source: "a\\u0007" has U+0007'),
        ("a.toml", "x = 1", '"x": unknown; each thing is a table [[motor]] or [[gear]] or [[coupling]]'),
        ("a.toml", "", "is empty; each thing is a table [[motor]]"),
        ("a.toml", "motor = 1", "motor = 1: each motor must be a table"),
        ("a.toml", f"{TOML}\ncolour = 1", 'a.toml:13: motor 1: "colour": unknown; known here: designation'),
        ("a.toml", TOML.replace("'pump, old'", "1"), "motor 1: designation = 1: must be a text of one line"),
        ("a.toml", TOML.replace("2200.0", "true"), "motor 1: power = true: must be a number in W"),
        ("a.toml", f"{TOML}\nmass = -1", "motor 1: mass = -1 kg: must be >= 0 kg"),
    ],
)
def test_bad_files_are_refused(tmp_path, name, text, said):
    file = tmp_path / name
    file.write_text(text)
    with pytest.raises(InputError) as refusal:
        catalogue(file)
    lines = str(refusal.value).splitlines()
    assert said in lines[0] and all(line.startswith(f"{file}:") for line in lines)
    # beside a wrong heading, columns may be missing
    assert all("is missing; add the heading" in line for line in lines[1:])


def test_unreadable_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        catalogue(tmp_path / "none.csv")
    file = tmp_path / "a.csv"
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="is not UTF-8 text"):
        catalogue(file)


# --- gears and couplings, templates, and the command ---

GEAR = {
    "designation": "G 99",
    "order_number": "4711",
    "ratio": "99.7",
    "rated_torque [kN.m]": "1.6",
    "efficiency": "94 %",
    "largest_speed [rev/min]": "3000",
    "backlash [arcmin]": "6",
    "price": "1180",
}
COUPLING = {"designation": "S", "setting_least [N.m]": "5", "setting_most [N.m]": "20"}


def test_gears_and_couplings_stand_in_files_of_their_own_or_in_one(tmp_path):
    (tmp_path / "g").mkdir()
    gears, couplings = csv_file(tmp_path / "g", GEAR), csv_file(tmp_path, COUPLING)
    both = tmp_path / "both.toml"
    both.write_text(
        "[[gear]]\ndesignation = 'G 99'\norder_number = '4711'\nratio = 99.7\nrated_torque = '1.6 kNm'\n"
        "efficiency = '94 %'\nlargest_speed = '3000 rev/min'\nbacklash = '6 arcmin'\nprice = 1180\n"
        f"[[coupling]]\ndesignation = 'S'\nsetting_least = 5\nsetting_most = 20\n{TOML}\n"
    )
    for found, motors in ((offer(gears, couplings), 0), (offer(both), 1)):
        (gear,), (coupling,) = found.gears, found.couplings
        assert (gear.designation, gear.order_number, gear.price) == ("G 99", "4711", 1180.0)
        transmission = Transmission(ratio=99.7, efficiency=0.94, torque_limit=1600.0, start_factor=2.0)
        assert vars(gear.transmission) == pytest.approx(vars(transmission))
        assert gear.data.largest_speed == pytest.approx(3000.0 * RPM)
        assert gear.data.backlash == pytest.approx(math.radians(0.1))
        assert (coupling.price, coupling.data.release_time) == (None, 0.005)
        assert [coupling.can_be_set(torque, 100.0) for torque in (4.9, 5.0, 20.0, 20.1)] == [0, 1, 1, 0]
        assert len(found.motors) == motors
    # each kind has names of its own, over all files
    with pytest.raises(InputError, match=r'own\.csv:2: column designation = "G 99": stands in the catalogue'):
        offer(both, gears)


def test_the_application_factor_widens_the_rating_of_a_gear(tmp_path):
    """Running may put rated_torque x application_factor on the output, a start start_factor times that."""
    row = GEAR | {"application_factor": "1.5", "start_factor": "1.8"}
    (gear,) = offer(csv_file(tmp_path, row)).gears
    assert gear.transmission.torque_limit == pytest.approx(2400.0)
    assert gear.transmission.start_limit == pytest.approx(1.8 * 2400.0)


def test_all_faults_of_all_files_are_told_at_once(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    gears = csv_file(
        tmp_path / "a",
        GEAR | {"ratio": "0", "colour": "blue"},
        GEAR | {"designation": "", "efficiency": "94", "colour": ""},
    )
    couplings = csv_file(tmp_path / "b", COUPLING | {"setting_most [N.m]": "4"})
    with pytest.raises(InputError) as refusal:
        offer(gears, couplings)
    messages = str(refusal.value).splitlines()
    begins = [
        f'{gears}:1: heading "colour": unknown; known here: designation, order_number, source, ratio, rated_torque',
        f"{gears}:2: column ratio = 0: must be > 0 and <= 10000 (real ratio",
        f'{gears}:3: column designation = "": must be a text of one line',
        f"{gears}:3: column efficiency = 94: must be >= 0.05 and <= 1 (efficiency while the motor",
        f"{couplings}:2: column setting_most = 4 N m: must be >= setting_least = 5 N m",
    ]
    assert len(messages) == len(begins)
    for line, begin in zip(messages, begins, strict=True):
        assert line.startswith(begin), line
    assert 'was "94 %" meant?' in messages[3]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_templates_follow_from_the_declarations(tmp_path, kind):
    """A template has every column, its rows are right, and the reader tells its kind by its headings."""
    file = tmp_path / "template.csv"
    file.write_text(kind.template(), encoding="utf-8")
    first = next(csv.reader(io.StringIO(kind.template())))
    assert [each.partition(" ")[0] for each in first] == [*kind.columns]
    found = offer(file)
    items = zip(KINDS, (found.motors, found.gears, found.couplings, found.flexible), strict=True)
    (item,) = {each.name: own for each, own in items}[kind.name]
    assert "made up" in item.source and item.order_number and item.price


def test_the_command_writes_templates_and_checks_files(tmp_path):
    written = chainunit("catalogue", "--template", cwd=tmp_path)
    assert written.returncode == 0 and "each row needs designation, ratio, rated_torque" in written.stdout
    files = sorted((tmp_path / "catalogue").iterdir())
    assert [file.name for file in files] == [
        "flexible_couplings.csv",
        "gears.csv",
        "motors.csv",
        "torque_limiters.csv",
    ]
    names = [str(file) for file in files]
    right = chainunit("catalogue", *names, cwd=tmp_path)
    assert right.returncode == 0 and "every row is right" in right.stdout and "1 gear" in right.stdout
    gears = files[1]
    gears.write_text(gears.read_text().replace(",0.94,", ",94,").replace("99.7,1600", "99.7,-1"))
    wrong = chainunit("catalogue", *names, cwd=tmp_path)
    lines = wrong.stderr.splitlines()
    assert wrong.returncode == 2 and len(lines) == 2
    assert f"{gears}:2: column rated_torque = -1 N m: must be > 0 N m" in lines[0]
    assert f"{gears}:2: column efficiency = 94: must be >= 0.05 and <= 1" in lines[1]
    again = chainunit("catalogue", "--template", cwd=tmp_path)
    assert again.returncode == 2 and "is there already; name another folder by -o" in again.stderr
    both = chainunit("catalogue", "--template", names[0], cwd=tmp_path)
    assert both.returncode == 2 and "checks none" in both.stderr
    assert "real ratio" in chainunit("catalogue", cwd=tmp_path).stdout


def test_a_study_file_names_several_catalogues(tmp_path):
    csv_file(tmp_path, GEAR).rename(tmp_path / "gears.csv")
    csv_file(tmp_path, ROW)
    source = str(tmp_path / "study.toml")
    config = parse("catalogue = ['own.csv', 'gears.csv']\n[system]\nmotor = 'pump, old'", source)
    assert config.file.catalogues == (tmp_path / "own.csv", tmp_path / "gears.csv")
    assert config.plate.designation == "pump, old"
    tables = changed_tables(config, {}, "moved", tmp_path / "below")
    assert tables["catalogue"] == ["../own.csv", "../gears.csv"]
    for wrong in ("[]", "['a.csv', 1]", "1", "['']"):
        with pytest.raises(InputError, match=r"catalogue = .*must be the name of a file, or a list of"):
            parse(f"catalogue = {wrong}\n[sizing]", source)


# --- transmission ---


def test_transmission_loses_power_whichever_way_it_flows():
    xp = engines.MATH
    t = Transmission(ratio=12.0, efficiency=0.9, d=0.002)
    for torque in (-50.0, 0.0, 80.0):
        for w in (-100.0, -1.0, 1.0, 100.0):
            losses = motor_side(xp, t, torque, w) * w - torque * w / t.ratio
            by_torque = (1.0 / 0.9 - 1.0) * abs(torque * w) / t.ratio
            assert losses == pytest.approx(by_torque + 0.002 * w * w, rel=1e-9)
    forward = motor_side(xp, t, 80.0, 100.0) - t.d * 100.0
    assert forward == pytest.approx(80.0 / (12.0 * 0.9))
    assert motor_side(xp, t, -80.0, 100.0) - t.d * 100.0 == pytest.approx(-80.0 * (2.0 - 1.0 / 0.9) / 12.0)
    # a worm gear locks itself: the motor must help even where the load would drive
    assert motor_side(xp, Transmission(ratio=50.0, efficiency=0.4), -80.0, 100.0) > 0.0


@pytest.mark.parametrize("loss", [0.0, 0.04, 0.43, 0.9])
def test_a_rotor_turns_its_load_by_the_equation_of_motion_with_the_loss(loss):
    """For motors and loads of any sign, forward, backward and near rest; without a loss as if no gear were there."""
    rng = np.random.default_rng(7)
    J, inertia = 10.0 ** rng.uniform(-3.0, 0.0, 2000), 10.0 ** rng.uniform(-4.0, 1.0, 2000)
    tau, load = 50.0 * rng.normal(size=(2, 2000))
    w = rng.choice([-100.0, -0.3, 0.0, 0.5, 150.0], 2000)
    a = geared_acceleration(engines.numpy_(), load, inertia, w, J, tau, loss)
    passed = load + inertia * a
    lost = loss * np.abs(passed) * np.clip(w, -1.0, 1.0)
    np.testing.assert_allclose(J * a, tau - passed - lost, atol=1e-12 * np.max(np.abs(tau) + np.abs(load)))
    assert np.all(lost * w >= 0.0)
    if loss == 0.0:
        np.testing.assert_array_equal(a, (tau - load) / (J + inertia))


def test_a_self_locking_gear_stands_where_the_load_drives():
    """With a loss above 1 the load cannot drive the rotor: what the rotor feels stays above a part of its own
    inertia, so that the acceleration is finite."""
    a = geared_acceleration(engines.MATH, -80.0, 5.0, 100.0, 0.01, 0.0, 1.5)
    assert math.isfinite(a) and a < 0.0


def test_transmission_at_rest_and_in_arrays():
    t = TRANSMISSIONS["gear"]
    assert motor_side(engines.MATH, t, 60.0, 0.0) == 60.0 / t.ratio
    w = np.array([-W_REST, 0.0, W_REST, 10.0])
    every = motor_side(engines.numpy_(), t, np.array([60.0]), w)
    np.testing.assert_array_equal(every, [motor_side(engines.MATH, t, 60.0, float(x)) for x in w])
    assert np.all(np.diff(every[:3]) > 0.0)
    direct = TRANSMISSIONS["direct"]
    assert motor_side(engines.MATH, direct, 60.0, 10.0) == 60.0
    for kind in TRANSMISSIONS.values():
        for v, x in zip(Layout(Transmission).variables, dataclasses.astuple(kind), strict=True):
            assert v.quantity.admits(x)
