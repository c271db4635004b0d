"""The DC motor: energy, limits, limit cases."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import control
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chainunit.core import engines
from chainunit.core.errors import InputError
from chainunit.core.integrators import controlled, rk4
from chainunit.drives.dc_motor import DcMotor
from chainunit.drives.speed_control import loop, tune
from chainunit.study.choice import choose
from chainunit.study.config import load

LAYOUT = DcMotor.state_layout


def outputs(p, u, x):
    return DcMotor.evaluate(engines.MATH, p, u, x)[0]


def run(p, u, stop, longest=2.5e-4):
    x = LAYOUT.values(DcMotor.initial_states(engines.MATH, p))
    return LAYOUT.instance(
        rk4(lambda _, y: DcMotor.derivatives(engines.MATH, p, u, LAYOUT.instance(y)), x, stop, longest)
    )


def parameters(**values):
    return DcMotor.parameter_layout.from_names({k.replace("__", "."): v for k, v in values.items()})


def inputs(**values):
    return DcMotor.input_layout.from_names({k.replace("__", "."): v for k, v in values.items()})


def test_electric_power_is_accounted_for():
    """v i = heat + magnetic energy + air-gap power, and that is kinetic energy, losses and load."""
    p, u = parameters(), inputs(w_ref=100.0, load__tau_bias=0.5, load__J=0.002)
    x = LAYOUT.instance([0.3, 40.0, 2.0, 320.0, 0.4, 1.0, 0.0])
    out = outputs(p, u, x)
    d = dict(zip(LAYOUT.names, DcMotor.derivatives(engines.MATH, p, u, x), strict=True))
    magnetic = p.armature.L * x.armature.i * d["armature.i"]
    assert out.supply_power == pytest.approx(out.heat + magnetic + out.air_gap_tau * x.w, rel=1e-12)
    rotor = p.rotor.J * out.a * x.w + p.rotor.d * x.w**2
    assert out.air_gap_tau * x.w == pytest.approx(rotor + d["load_energy"], rel=1e-12)
    assert d["load_energy"] == pytest.approx((0.5 + 0.002 * out.a) * x.w, rel=1e-12)


def test_steady_state_is_the_hand_calculation():
    p = parameters(armature__alpha=0.0)
    x = run(p, inputs(w_ref=100.0, load__tau_bias=1.0), 8.0)
    i = (1.0 + p.rotor.d * 100.0) / p.armature.k
    assert x.w == pytest.approx(100.0, rel=1e-6)
    assert x.armature.i == pytest.approx(i, rel=1e-6)
    out = outputs(p, inputs(w_ref=100.0, load__tau_bias=1.0), x)
    assert out.v == pytest.approx(p.armature.k * 100.0 + p.armature.R * i, rel=1e-6)


def test_current_and_voltage_limits_hold_and_do_not_wind_up():
    gains = tune(DcMotor.Parameters().armature, 0.05 + DcMotor.Parameters().rotor.J).parameters
    p, u = DcMotor.parameter_layout.from_names(gains), inputs(w_ref=100.0, load__tau_bias=1.0, load__J=0.05)
    x, currents, voltages, speeds = LAYOUT.values(DcMotor.initial_states(engines.MATH, p)), [], [], []
    for _ in range(3000):
        x = rk4(lambda _, y: DcMotor.derivatives(engines.MATH, p, u, LAYOUT.instance(y)), x, 1e-3, 2.5e-4)
        s = LAYOUT.instance(x)
        currents.append(s.armature.i)
        speeds.append(s.w)
        voltages.append(outputs(p, u, s).v)
    assert max(currents) < p.limit.i * 1.02 and max(currents) > p.limit.i * 0.95
    assert max(np.abs(voltages)) <= p.limit.v
    assert max(speeds) < 110.0
    assert speeds[-1] == pytest.approx(100.0, rel=1e-2)


def test_blocked_motor_heats_as_the_closed_form():
    p = parameters(armature__alpha=0.0, armature__C=50.0)
    u = inputs(w_ref=100.0, load__tau_bias=0.0, load__J=1e9)
    x = run(p, u, 20.0, 1e-3)
    heat = p.armature.R * p.limit.i**2
    tau = p.armature.R_th * p.armature.C
    rise = heat * p.armature.R_th * (1.0 - math.exp(-20.0 / tau))
    assert pytest.approx(rise, rel=5e-3) == x.armature.T - p.ambient.T


def test_internal_integrator_against_an_error_controlled_solver():
    p, u = parameters(), inputs(w_ref=100.0, load__tau_bias=0.5, load__J=0.002)
    x0 = LAYOUT.values(DcMotor.initial_states(engines.MATH, p))
    exact = solve_ivp(
        lambda t, y: DcMotor.derivatives(engines.MATH, p, u, LAYOUT.instance(y)),
        (0.0, 0.3), x0, method="Radau", rtol=1e-11, atol=1e-12,
    ).y[:, -1]  # fmt: skip
    got = LAYOUT.values(run(p, u, 0.3))
    np.testing.assert_allclose(got, exact, rtol=1e-5, atol=1e-6)


def test_declared_gains_are_the_tuned_ones_of_the_packaged_drive():
    config = load()
    drive = choose(config, Path(), lambda *said: None).drive
    tuned = drive.parameters
    declarations = DcMotor.Parameters()
    for name in ("kp", "ki"):
        assert getattr(declarations.speed_control, name) == pytest.approx(
            getattr(tuned.speed_control, name), rel=1e-3
        )
        assert getattr(declarations.current_control, name) == pytest.approx(
            getattr(tuned.current_control, name), rel=1e-3
        )
    assert drive.tuning.phase_margin > 60.0


def test_tuning_scales_with_inertia_and_refuses_a_loop_without_margin():
    arm = DcMotor.Parameters().armature
    one, two = tune(arm, 0.004), tune(arm, 0.008)
    assert two.parameters["speed_control.kp"] == pytest.approx(2.0 * one.parameters["speed_control.kp"])
    assert one.crossover == pytest.approx(30.0, rel=0.05)
    with pytest.raises(InputError, match="phase margin"):
        tune(arm, 0.004, crossover_share=1.0)


@pytest.mark.parametrize("share", [0.02, 0.1, 0.3])
def test_the_margin_of_the_tuning_is_that_of_python_control(share):
    arm, inertia = DcMotor.Parameters().armature, 0.4
    tuned = tune(arm, inertia, 250.0, share)
    kp, ki, inner_kp, inner_ki = tuned.parameters.values()
    s = control.tf("s")
    inner = control.feedback((inner_kp + inner_ki / s) / (arm.L * s + arm.R), 1)
    _, phase, _, at = control.margin(
        control.minreal((kp + ki / s) * inner * arm.k / (inertia * s), verbose=False)
    )
    assert tuned.phase_margin == pytest.approx(phase, rel=1e-6) and tuned.crossover == pytest.approx(
        at, rel=1e-6
    )


def test_the_loop_is_that_of_the_tuning_and_of_the_motor():
    """Margins as tuned; the disturbance step against the motor's own equations, limits not met."""
    p = parameters()
    inertia = 0.006
    tuned = tune(p.armature, inertia)
    p = DcMotor.parameter_layout.from_names({**tuned.parameters, "rotor.d": 0.0, "armature.alpha": 0.0}, p)
    result = loop(p, inertia)
    assert result.phase_margin == pytest.approx(tuned.phase_margin, rel=1e-6)
    assert result.crossover == pytest.approx(tuned.crossover, rel=1e-6)
    # gain 1 at the crossover, phase there is the margin above -180 deg
    assert np.interp(result.crossover, result.frequency, result.gain) == pytest.approx(1.0, rel=1e-3)
    phase = np.interp(result.crossover, result.frequency, result.phase)
    assert phase + 180.0 == pytest.approx(result.phase_margin, abs=0.1)
    u = inputs(load__tau_bias=0.5, load__J=inertia - p.rotor.J)
    solution = solve_ivp(
        lambda t, x: DcMotor.derivatives(engines.MATH, p, u, LAYOUT.instance(x)),
        (0.0, result.time[-1]),
        LAYOUT.values(DcMotor.initial_states(engines.MATH, p)),
        t_eval=result.time,
        rtol=1e-9,
        atol=1e-12,
    )
    speed = solution.y[LAYOUT.names.index("w")]
    np.testing.assert_allclose(speed, 0.5 * result.deviation, atol=1e-6 * np.max(np.abs(speed)))
    assert result.largest_deviation == pytest.approx(np.max(np.abs(speed)) / 0.5, rel=1e-4)


def test_feed_forward_of_the_whole_torque_leaves_no_dip():
    p = parameters(armature__alpha=0.0, rotor__d=0.0)
    dips = []
    for tau_ff in (0.0, 1.0):
        x = LAYOUT.values(DcMotor.initial_states(engines.MATH, p))
        u = inputs(load__tau_bias=1.0, tau_ff=tau_ff)
        least = 0.0
        for _ in range(400):
            x = rk4(lambda _, y: DcMotor.derivatives(engines.MATH, p, u, LAYOUT.instance(y)), x, 1e-3, 2.5e-4)  # noqa: B023
            least = min(least, x[LAYOUT.names.index("w")])
        dips.append(least)
    assert dips[1] > 0.25 * dips[0] and dips[0] < -0.5


def test_the_internal_step_resolves_the_current_loop_and_the_rotor():
    """A quarter of the time constant of the closed current loop, where that is the fastest part."""
    p = DcMotor.Parameters()
    slow = engines.MATH
    armature = dataclasses.replace(p.armature, L=0.01)
    quick = dataclasses.replace(
        p, armature=armature, current_control=dataclasses.replace(p.current_control, kp=90.0)
    )
    loop_time = 0.01 / (armature.R + 90.0)
    assert DcMotor.internal_step(slow, quick) == pytest.approx(0.25 * loop_time)
    long = dataclasses.replace(p, armature=dataclasses.replace(p.armature, L=10.0))
    assert DcMotor.internal_step(slow, long) == 2.5e-4


def test_states_that_leave_all_bounds_end_a_controlled_step():
    def broken(t, x):
        raise ValueError("no number")

    def keep(t, x):
        return x

    with pytest.raises(ArithmeticError, match="left all bounds"):
        controlled(broken, keep, [1.0], 0.1, 0.0, 0.05, 1e-6, [1.0])

    def late(t, x):
        return [1.0 / (0.05 - t) if t < 0.05 else math.nan]

    # up to there the step goes on with shorter substeps
    x, _ = controlled(late, keep, [0.0], 0.04, 0.0, 0.05, 1e-8, [1.0])
    assert x[0] == pytest.approx(math.log(5.0), rel=1e-6)
