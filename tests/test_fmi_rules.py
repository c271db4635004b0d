"""Rules of FMI that a native FMU keeps, by FMI 2.0 and 3.0 alike."""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import struct
import subprocess
import sys
import textwrap
import zlib
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave
from lxml import etree

from chainunit.core.native.compilers import compiler
from chainunit.models import MODELS

HERE = Path(__file__).parent
pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")
both = pytest.mark.parametrize("fmi", [2, 3])


def allowed(model, name):
    """The end of a line that refuses a value."""
    declarations = (*MODELS[model].parameter_layout.variables, *MODELS[model].input_layout.variables)
    return next("must be " + v.quantity.allowed_range for v in declarations if v.name == name)


class Unit:
    """An instance by either version of FMI; `refused` cites what it logged."""

    def __init__(self, native, name, fmi, capsys, exchange=False):
        folder = native[name, fmi][1]
        description = fmpy.read_model_description(folder)
        self.fmi, self.capsys = fmi, capsys
        self.reference = {v.name: v.valueReference for v in description.modelVariables}
        self.type = {v.name: v.type for v in description.modelVariables}
        made = {2: (FMU2Slave, FMU2Model), 3: (FMU3Slave, FMU3Model)}[fmi][exchange]
        self.api = made(
            guid=description.guid or description.instantiationToken,
            unzipDirectory=folder, modelIdentifier=name, instanceName="unit",
        )  # fmt: skip
        self.api.instantiate()
        self.status = None

    def start(self, time=0.0, stop=None, **given):
        self.set(given)
        if self.fmi == 2:
            self.api.setupExperiment(startTime=time, stopTime=stop)
            self.api.enterInitializationMode()
        else:
            self.api.enterInitializationMode(startTime=time, stopTime=stop)
        self.api.exitInitializationMode()
        return self

    def set(self, given):
        """Set values by the functions of their types."""
        by_type = {}
        for name, value in given.items():
            name = name.replace("__", ".")
            by_type.setdefault(self.type[name], {})[self.reference[name]] = value
        for kind, values in by_type.items():
            getattr(self.api, f"set{kind}")(list(values), list(values.values()))

    def get(self, *names):
        (kind,) = {self.type[n] for n in names}
        return getattr(self.api, f"get{kind}")([self.reference[n] for n in names])

    def step(self, time, size):
        self.api.doStep(time, size)

    def serialized(self):
        if self.fmi == 2:
            return self.api.serializeFMUstate(self.api.getFMUState())
        return self.api.serializeFMUState(self.api.getFMUState())

    def restore(self, raw):
        call = self.api.deSerializeFMUstate if self.fmi == 2 else self.api.deserializeFMUState
        self.api.setFMUState(call(raw))

    def refused(self, call, *args, **given):
        """The line that an error or a discarded step is logged with; its status is kept."""
        self.capsys.readouterr()
        with pytest.raises(FMICallException) as caught:
            call(*args, **given)
        self.status = caught.value.status
        return self.capsys.readouterr().out.strip().partition("] ")[2]


@pytest.fixture
def unit(native_fmus, capsys):
    made = []

    def one(name, fmi, **more):
        made.append(Unit(native_fmus, name, fmi, capsys, **more))
        return made[-1]

    yield one
    for each in made:
        each.api.freeInstance()


@both
def test_an_input_out_of_its_bounds_is_an_error_of_the_call_that_computes_with_it(unit, fmi):
    one = unit("ChamberForces", fmi)
    line = "left.material_mass = -50 kg: " + allowed("ChamberForces", "left.material_mass")
    assert one.refused(one.start, left__material_mass=-50.0) == line  # before the initialization
    one.set({"left.material_mass": 30.0})
    one.api.enterInitializationMode() if fmi == 2 else one.api.enterInitializationMode(startTime=0.0)
    one.api.exitInitializationMode()
    good = one.get("tau")
    one.set({"left.material_mass": -50.0})
    assert one.get("left.material_mass") == [-50.0]
    assert one.refused(one.get, "tau") == line and one.refused(one.step, 0.0, 0.1) == line
    one.set({"left.material_mass": 30.0})
    assert one.get("tau") == good
    one.step(0.0, 0.1)
    # zero but for rounding
    one.set({"left.material_mass": -1e-12})
    assert one.get("left.material_mass") == [0.0]
    one.step(0.1, 0.1)


@both
def test_an_input_out_of_its_bounds_stops_model_exchange_too(unit, fmi):
    one = unit("ChainUnit", fmi, exchange=True).start()
    one.set({"right.processing_force": -1.0})
    rates = (ctypes.c_double * 2)()
    call = one.api.getDerivatives if fmi == 2 else one.api.getContinuousStateDerivatives
    line = "right.processing_force = -1 N: " + allowed("ChainUnit", "right.processing_force")
    assert one.refused(call, rates, 2) == line
    known, unknown = one.reference["tau"], one.reference["a"]
    assert one.refused(one.api.getDirectionalDerivative, [unknown], [known], [1.0]) == line
    one.set({"right.processing_force": 0.0})
    call(rates, 2)
    one.api.getDirectionalDerivative([unknown], [known], [1.0])


def test_an_input_that_runs_out_of_its_bounds_in_a_step_discards_it(unit):
    one = unit("ChamberForces", 2).start(left__material_mass=1.0)
    one.api.setRealInputDerivatives([one.reference["left.material_mass"]], [1], [-20.0])
    line = one.refused(one.step, 0.0, 0.1)
    refusal = "left.material_mass = -1 kg: " + allowed("ChamberForces", "left.material_mass")
    assert line == f"at the end of the step from t = 0 s, {refusal}"
    assert one.status == 2
    one.step(0.0, 0.05)  # to zero exactly


@both
def test_a_shaft_turns_on_inside_a_step(unit, fmi):
    """Angle and speed follow speed and acceleration. A saved state, a refused step and a reset know where they
    are."""
    names = ("phi", "w", "phi0", "w0", "tau", "rocker.psi")
    one = unit("ChamberForces", fmi).start(phi=1.0, w=4.0, a=-3.0)
    begin = one.get(*names)
    one.step(0.0, 0.1)
    assert one.get("phi", "w") == one.get("phi0", "w0") == pytest.approx([1.385, 3.7], rel=1e-15)
    saved, here = one.serialized(), one.get(*names)
    assert here[4:] != begin[4:]
    for size in (-0.1, float("nan"), float("inf")):
        one.refused(one.step, 0.1, size)
    if fmi == 2:
        one.step(0.1, 0.0)
    assert one.get(*names) == here
    one.step(0.1, 0.2)
    there = one.get(*names)
    assert there[:2] == pytest.approx([1.0 + 1.2 - 0.135, 3.1], rel=1e-15)
    one.restore(saved)
    assert one.get(*names) == here
    one.step(0.1, 0.2)
    assert one.get(*names) == there
    one.set({"phi": 1.0, "w": 4.0})
    assert one.get(*names) == begin
    one.api.reset()
    one.start(phi=1.0).step(0.0, 0.1)
    assert one.get("phi", "w", "phi0", "w0") == [1.0, 0.0, 1.0, 0.0]


@both
def test_a_shaft_stands_where_it_is_set_in_model_exchange(unit, fmi):
    one = unit("ChamberForces", fmi, exchange=True).start(phi=1.0, w=4.0, a=-3.0)
    (one.api.newDiscreteStates if fmi == 2 else one.api.updateDiscreteStates)()
    one.api.enterContinuousTimeMode()
    before = one.get("phi0", "tau", "rocker.psi")
    one.api.setTime(0.1)
    one.api.completedIntegratorStep()
    assert one.get("phi0", "tau", "rocker.psi") == before and before[0] == 1.0


def test_derivatives_of_the_importer_hold_in_place_of_the_own(unit):
    """Those of the value 0, too, by which a master sets inputs that are of the end of the step. They are of one step,
    and a saved state has them."""
    one = unit("ChamberForces", 2).start(phi=1.0, w=4.0, a=-3.0)
    shaft = [one.reference["phi"], one.reference["w"]]
    one.api.setRealInputDerivatives(shaft, [1, 1], [10.0, 0.0])
    one.step(0.0, 0.1)
    assert one.get("phi", "w") == [2.0, 4.0]
    one.step(0.1, 0.1)
    assert one.get("phi", "w") == pytest.approx([2.385, 3.7])
    at = one.get("phi", "w")
    one.api.setRealInputDerivatives(shaft, [1, 1], [0.0, 0.0])
    saved, outputs = one.serialized(), one.get("tau", "rocker.psi")
    for _ in range(2):
        one.step(0.2, 0.1)
        assert one.get("phi", "w") == at and one.get("tau", "rocker.psi") == outputs
        one.restore(saved)


@both
@pytest.mark.parametrize("name", ["ChamberForces", "DcMotor"])
def test_the_communication_point_and_the_stop_time_are_honoured(unit, name, fmi):
    one = unit(name, fmi).start(2.0, 3.0)
    assert one.refused(one.step, 999.0, 0.1) == "step from t = 999 s: the FMU is at t = 2 s"
    assert one.status == 3
    t = 2.0
    for _ in range(10):
        one.step(t, 0.1)
        t += 0.1
    assert t != 3.0, "the sum is off by rounding"
    line = "step of 0.1 s from t = 3 s: must end at 3 s, the stop time, or before"
    assert one.refused(one.step, t, 0.1) == line and one.status == 3
    late = unit(name, fmi)
    assert late.refused(late.start, 2.0, 1.0) == "stop time = 1 s: must be >= 2 s, the start time"


@both
def test_a_million_steps_added_up_are_no_other_time(unit, fmi):
    """A master that adds up its steps, and an FMU that is told the sum: no drift that is refused."""
    one = unit("ChamberForces", fmi).start(0.0, 100.0)
    h, n = 1e-4, 1_000_000
    added = np.cumsum(np.full(n, h))
    assert abs(added[-1] - 100.0) > 1e-9, "more than a rounding of the time itself"
    for t in (*added[:3], *added[-1000:-1]):
        one.restore(moved_to(one, t))
        one.step(t + 2e-16 * t, h)
    one.restore(moved_to(one, added[-2]))
    one.step(added[-2], h)
    assert "the stop time" in one.refused(one.step, added[-1], h)


@both
def test_a_late_clock_allows_no_other_times(unit, fmi):
    """Seconds since 1970: rounding is 2.4e-7 s there, and no step begins or ends seconds off."""
    begin = 1.7e9
    one = unit("ChamberForces", fmi).start(begin, begin + 100.0)
    assert "the FMU is at t = 1.7e+09 s" in one.refused(one.step, begin + 1.5, 0.1)
    assert "the FMU is at t = 1.7e+09 s" in one.refused(one.step, begin + 1e-3, 0.1)
    assert "the stop time" in one.refused(one.step, begin, 100.5)
    for k in range(10):
        one.step(begin + 10.0 * k, 10.0)
    # the worst that a million additions err by, half a unit of the last place each
    fresh = unit("ChamberForces", fmi).start(begin, begin + 100.0)
    fresh.step(begin, 100.0 + 1e6 * np.spacing(begin) / 4)
    # a small step is no step from anywhere within 1e-9 of a large time
    small = unit("ChamberForces", fmi).start(100.0, 101.0)
    assert "the FMU is at t = 100 s" in small.refused(small.step, 100.0 + 1e-8, 1e-4)


@both
def test_a_step_of_no_length(unit, fmi):
    """FMI 3.0 forbids it; hosts of FMI 2.0 take it to evaluate outputs anew."""
    one = unit("DcMotor", fmi).start(w_ref=50.0)
    if fmi == 3:
        assert (
            one.refused(one.step, 0.0, 0.0) == "fmi3DoStep: a step must be longer than 0 s"
            and one.status == 3
        )
    else:
        one.step(0.0, 0.0)
    one.step(0.0, 0.01)


def test_the_order_of_an_input_and_its_derivative_does_not_matter(unit):
    """They are of one step: before the next they are set anew, or the input stays."""
    ends = []
    for derivative_first in (True, False):
        one = unit("DcMotor", 2).start()
        w_ref = one.reference["w_ref"]
        if derivative_first:
            one.api.setRealInputDerivatives([w_ref], [1], [500.0])
        one.set({"w_ref": 2.0})
        if not derivative_first:
            one.api.setRealInputDerivatives([w_ref], [1], [500.0])
        one.step(0.0, 0.05)
        assert one.get("w_ref") == [27.0]
        one.step(0.05, 0.05)
        assert one.get("w_ref") == [27.0]
        ends.append(one.get("w", "armature.i"))
    assert ends[0] == ends[1]
    # a saved state knows which step they are of
    one.api.setRealInputDerivatives([w_ref], [1], [500.0])
    raw = one.serialized()
    one.step(0.1, 0.01)
    duration = one.serialized()
    one.restore(raw)
    one.step(0.1, 0.01)
    assert one.get("w_ref") == [32.0]
    one.restore(duration)
    one.step(0.11, 0.01)
    assert one.get("w_ref") == [32.0]


def sealed(body):
    """A serialized state with the checksum that belongs to it."""
    return struct.pack("<Q", zlib.crc32(body)) + body


def moved_to(one, time):
    """The instance's state at another time."""
    raw = bytearray(one.serialized())
    raw[32:40] = struct.pack("<d", time)
    return sealed(bytes(raw[8:]))


@both
def test_a_step_that_model_exchange_takes_past_the_stop_time_is_an_error(unit, fmi):
    one = unit("DcMotor", fmi, exchange=True).start(0.0, 1.0)
    one.api.enterContinuousTimeMode()
    one.api.setTime(1.01)  # to look ahead is an integrator's right
    n_x = len(MODELS["DcMotor"].state_layout.names)
    rates = (ctypes.c_double * n_x)()
    (one.api.getDerivatives if fmi == 2 else one.api.getContinuousStateDerivatives)(rates, n_x)
    line = "time = 1.01 s: must be <= 1 s, the stop time"
    assert one.refused(one.api.completedIntegratorStep) == line
    assert one.refused(one.api.enterEventMode) == line
    one.api.setTime(1.0)
    one.api.completedIntegratorStep()
    one.api.enterEventMode()
    one.api.setTime(1.01)
    assert one.refused(one.api.newDiscreteStates if fmi == 2 else one.api.updateDiscreteStates) == line
    one.api.setTime(1.0)
    (one.api.newDiscreteStates if fmi == 2 else one.api.updateDiscreteStates)()


@pytest.mark.parametrize("name", [name for name, model in MODELS.items() if model.state_layout])
def test_importers_are_asked_to_tell_each_step(native_fmus, name):
    """Else FMI 3.0 lets them leave the call out that finds a step past the stop time."""
    assert fmpy.read_model_description(native_fmus[name, 3][1]).modelExchange.needsCompletedIntegratorStep


def reinitialized(description):
    """Names of the variables with reinit="true" in a modelDescription.xml, which fmpy does not read."""
    return {
        node.get("name") or node.getparent().get("name")
        for node in etree.fromstring(description).iter("Real", "Float64")
        if node.get("reinit") == "true"
    }


@both
@pytest.mark.parametrize("name", [name for name, model in MODELS.items() if model.state_layout])
def test_states_that_an_event_changes_are_declared_with_reinit(unit, native_fmus, name, fmi):
    """Those of a chain, whose end may not follow the rocker after a jump; no others."""
    description = fmpy.read_model_description(native_fmus[name, fmi][1])
    derivatives = [v.derivative for v in description.modelVariables if v.derivative]
    one = unit(name, fmi, exchange=True).start()
    n = len(derivatives)
    before, after, nominal = ((ctypes.c_double * n)() for _ in range(3))
    one.api.getContinuousStates(before, n)
    one.api.getNominalsOfContinuousStates(nominal, n)
    before[:] = [x + 1e-3 * size for x, size in zip(before, nominal, strict=True)]
    one.api.enterContinuousTimeMode()
    one.api.setContinuousStates(before, n)
    one.api.enterEventMode()
    values_changed = (one.api.newDiscreteStates if fmi == 2 else one.api.updateDiscreteStates)()[3]
    one.api.getContinuousStates(after, n)
    moved = {v.name for v, x, y in zip(derivatives, before, after, strict=True) if x != y}
    text = Path(native_fmus[name, fmi][1], "modelDescription.xml").read_bytes()
    assert reinitialized(text) == {v.name for v in derivatives if name == "ChainUnitFlexible"} >= moved
    assert bool(moved) == bool(values_changed) == (name == "ChainUnitFlexible")


@both
def test_a_completed_step_does_not_compute_with_a_refused_input(unit, fmi):
    one = unit("ChamberForces", fmi, exchange=True).start()
    one.api.enterContinuousTimeMode()
    one.set({"left.material_mass": -50.0})
    line = "left.material_mass = -50 kg: " + allowed("ChamberForces", "left.material_mass")
    assert one.refused(one.api.completedIntegratorStep) == line and one.status == 3
    one.set({"left.material_mass": 0.0})
    one.api.completedIntegratorStep()


@both
@pytest.mark.parametrize("name", [name for name, model in MODELS.items() if model.state_layout])
def test_a_step_beyond_the_budget_is_discarded_and_leaves_all_as_it_was(unit, name, fmi):
    one = unit(name, fmi).start(solver__max_steps=20)
    states = MODELS[name].state_layout.names
    one.step(0.0, 1e-3)
    before = one.get(*states)
    line = one.refused(one.step, 1e-3, 10.0)
    reference = (
        "takes more than solver.max_steps = 20 steps of its own; shorten the step, or raise solver.max_steps"
    )
    assert line == f"step of 10 s from t = 0.001 s: {reference}" and one.status == 2
    assert one.get(*states) == before
    if fmi == 2:
        time = ctypes.c_double()
        one.api.fmi2GetRealStatus(one.api.component, 2, ctypes.byref(time))
        assert time.value == 1e-3
    else:
        assert one.get("time") == [1e-3]
    one.step(1e-3, 1e-3)
    fresh = unit(name, fmi)
    assert "solver.max_steps = 0: must be a whole number >= 1" in fresh.refused(
        fresh.start, solver__max_steps=0
    )


@both
def test_a_serialized_state_with_any_flipped_bit_is_refused(unit, fmi):
    one = unit("DcMotor", fmi).start(w_ref=50.0)
    one.step(0.0, 0.01)
    raw, kept = one.serialized(), one.get("w", "armature.i")
    one.step(0.01, 0.01)
    after = one.get("w", "armature.i")
    lines = set()
    for bit in range(8 * len(raw)):
        flipped = bytearray(raw)
        flipped[bit // 8] ^= 1 << bit % 8
        lines.add(one.refused(one.restore, bytes(flipped)))
        assert one.status == 3
    another = "saved state: it belongs to another model, another version or kind of simulation"
    assert lines == {"saved state: it is damaged", another}
    assert one.get("w", "armature.i") == after
    one.restore(raw)
    assert one.get("w", "armature.i") == kept
    assert one.refused(one.restore, raw[:-8]) == "saved state: its size is not this model's"


@both
def test_a_serialized_state_with_any_two_flipped_signs_is_refused(unit, fmi):
    """And with any other two flipped bits: a CRC is linear, so that two bits pass together only if each alone
    changes it alike."""
    one = unit("DcMotor", fmi).start(w_ref=50.0)
    one.step(0.0, 0.01)
    raw = one.serialized()
    words = np.frombuffer(raw, np.uint64)
    tops = np.uint64(1) << np.uint64(63)
    for i in range(len(words)):
        for k in range(i):
            both_signs = words.copy()
            both_signs[[i, k]] ^= tops
            assert one.refused(one.restore, both_signs.tobytes())
    assert sealed(raw[8:]) == raw, "the FMU's checksum is the CRC-32 of zlib"
    body, changes = bytearray(raw[8:]), [1 << bit for bit in range(32)]  # those of the checksum itself
    for bit in range(8 * len(body)):
        body[bit // 8] ^= 1 << bit % 8
        changes.append(zlib.crc32(body) ^ zlib.crc32(raw[8:]))
        body[bit // 8] ^= 1 << bit % 8
    assert 0 not in changes and len(set(changes)) == len(changes)


@both
def test_a_step_without_end_is_refused(unit, fmi):
    """Its end is no number, although its beginning and its length are."""
    for name in ("ChamberForces", "DcMotor"):
        one = unit(name, fmi).start(1.7e308)
        assert "must be finite" in one.refused(one.step, 1.7e308, 1e308) and one.status == 3
        one.restore(one.serialized())


@both
def test_a_serialized_state_out_of_bounds_is_refused(unit, fmi):
    one = unit("DcMotor", fmi).start(w_ref=50.0)
    raw = one.serialized()
    assert sealed(raw[8:]) == raw
    first = len(raw) - 8 * (
        len(MODELS["DcMotor"].parameter_layout.names) + 3 * len(MODELS["DcMotor"].input_layout.names)
    )
    first -= 8 * (
        len(MODELS["DcMotor"].state_layout.names)
        - MODELS["DcMotor"].parameter_layout.names.index("armature.R")
    )
    assert struct.unpack_from("<d", raw, first)[0] == one.get("armature.R")[0]
    negative = bytearray(raw)
    struct.pack_into("<d", negative, first, -1.0)
    line = one.refused(one.restore, sealed(bytes(negative[8:])))
    assert line == "saved state: armature.R = -1 Ohm: " + allowed("DcMotor", "armature.R")
    struct.pack_into("<d", negative, first, float("nan"))
    line = one.refused(one.restore, sealed(bytes(negative[8:])))
    assert line == "saved state: a number in it is not finite, or its internal step is negative"
    mode = bytearray(raw)
    struct.pack_into("<i", mode, 16, 5)
    line = one.refused(one.restore, sealed(bytes(mode[8:])))
    assert line == "saved state: the mode in it, 5, does not exist"


@both
def test_a_number_that_is_none_is_refused_in_plain_words(unit, fmi):
    one = unit("ChamberForces", fmi)
    assert one.refused(one.set, {"phi": float("nan")}) == "phi = nan rad: must be a finite number"
    bounded = "left.material_mass = inf kg: must be finite, "
    bounded += allowed("ChamberForces", "left.material_mass").removeprefix("must be ")
    assert one.refused(one.set, {"left.material_mass": float("inf")}) == bounded


@both
@pytest.mark.parametrize("name", [name for name, model in MODELS.items() if model.state_layout])
def test_every_declared_initial_dependency_has_a_derivative(unit, native_fmus, name, fmi):
    """Parameters, too, as the start follows from them: as setting them and asking again gives it."""
    description = fmpy.read_model_description(native_fmus[name, fmi][1])
    one = unit(name, fmi)
    if fmi == 2:
        one.api.setupExperiment(startTime=0.0)
        one.api.enterInitializationMode()
    else:
        one.api.enterInitializationMode(startTime=0.0)
    by, number = {}, {2: "Real", 3: "Float64"}[fmi]
    for declarations in description.initialUnknowns:
        for known in declarations.dependencies:
            if known.type == number == declarations.variable.type:
                by.setdefault(known.valueReference, []).append(declarations.variable.valueReference)
    parameters = {v.valueReference for v in description.modelVariables if v.causality == "parameter"}
    assert parameters & by.keys()
    set_values, read = (
        (one.api.setReal, one.api.getReal) if fmi == 2 else (one.api.setFloat64, one.api.getFloat64)
    )
    slopes = one.api.getDirectionalDerivative
    moved = 0
    for known, unknown in by.items():
        result = np.array(slopes(unknown, [known], [1.0]))
        assert np.isfinite(result).all()
        (at,) = read([known])
        # another step than the FMU's own
        h = 1e-4 * (abs(at) if at and known in parameters else max(1.0, abs(at)))
        sides = []
        try:
            for x in (at + h, at - h):
                set_values([known], [x])
                sides.append(np.array(read(unknown)))
        except FMICallException:
            continue  # on a bound, or a length that the machine needs: no difference of both sides
        finally:
            set_values([known], [at])
        # what a kink, or the rounding of the states at the start, gives both
        size = np.maximum(np.abs(result), np.abs(sides[0]) / max(1.0, abs(at))) + 1.0
        np.testing.assert_allclose(result / size, (sides[0] - sides[1]) / (2.0 * h) / size, atol=1e-3)
        moved += known in parameters and bool(result.any())
    assert moved >= 3
    # two at once, and none in a run
    first, second = [k for k in by if k in parameters][:2]
    every = [*{u for unknown in by.values() for u in unknown}]
    alone = [np.array(slopes(every, [k], [1.0])) for k in (first, second)]
    np.testing.assert_allclose(
        slopes(every, [first, second], [2.0, 3.0]), 2 * alone[0] + 3 * alone[1], rtol=1e-4, atol=1e-4
    )
    one.api.exitInitializationMode()
    line = one.refused(slopes, every, [first], [1.0])
    assert line.endswith("is neither input nor state, and parameters are known in initialization only")


@both
def test_a_number_out_of_reach_is_discarded(unit, fmi):
    """The host may try a smaller step or another input: by the standard the state is that before the step."""
    one = unit("ChamberForces", fmi).start()
    one.set({"w": 1e200})
    assert "is not a finite number" in one.refused(one.get, "tau") and one.status == 2
    one = unit("DcMotor", fmi, exchange=True).start()
    one.api.enterContinuousTimeMode()
    n_x = len(MODELS["DcMotor"].state_layout.names)
    far, rates = (ctypes.c_double * n_x)(*[1e308] * n_x), (ctypes.c_double * n_x)()
    one.api.setContinuousStates(far, n_x)
    call = one.api.getDerivatives if fmi == 2 else one.api.getContinuousStateDerivatives
    assert "a derivative is not a finite number" in one.refused(call, rates, n_x) and one.status == 2


@both
@pytest.mark.parametrize("reference", [2**31, 2**31 + 5, 2**32 - 1])
def test_references_beyond_all_are_refused(unit, fmi, reference):
    one = unit("DcMotor", fmi).start()
    known = one.reference["w_ref"]
    for unknown, by in ((reference, known), (one.reference["a"], reference)):
        assert f"value reference {reference} is n" in one.refused(
            one.api.getDirectionalDerivative, [unknown], [by], [1.0]
        )
    set_values = one.api.setReal if fmi == 2 else one.api.setFloat64
    assert one.refused(set_values, [reference], [1.0]) == f"value reference {reference} does not exist"


@pytest.fixture(scope="module")
def german(tmp_path_factory):
    """A folder with a locale that writes 1,5."""
    folder = tmp_path_factory.mktemp("locale")
    if shutil.which("localedef") is None or not Path("/usr/share/i18n/locales/de_DE").exists():
        pytest.skip("no localedef, or nothing that it makes locales of")
    subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", folder / "de_DE.UTF-8"], check=True)
    return folder


@pytest.mark.second
@both
def test_messages_do_not_follow_the_hosts_locale(native_fmus, german, fmi):
    script = textwrap.dedent(
        """
        import ctypes, locale, sys
        sys.path.insert(0, sys.argv[1])
        from test_fmi_rules import Unit
        unit = Unit({("DcMotor", int(sys.argv[3])): (None, sys.argv[2])}, "DcMotor", int(sys.argv[3]), None)
        locale.setlocale(locale.LC_NUMERIC, "de_DE.UTF-8")
        text = ctypes.create_string_buffer(30)
        ctypes.CDLL(None).snprintf(text, 30, b"%g", ctypes.c_double(1.5))
        assert text.value == b"1,5"
        try:
            unit.start(rotor__J=-1.5)
        except Exception:
            pass
        """
    )
    folder = native_fmus["DcMotor", fmi][1]
    process = subprocess.run(
        [sys.executable, "-c", script, str(HERE), folder, str(fmi)],
        capture_output=True, text=True, env=os.environ | {"LOCPATH": str(german)},
    )  # fmt: skip
    assert process.returncode == 0, process.stderr
    assert process.stdout.strip() == "[ERROR] rotor.J = -1.5 kg m2: " + allowed("DcMotor", "rotor.J")


@pytest.mark.skipif(sys.platform != "linux" or shutil.which("objdump") is None, reason="no objdump")
def test_libraries_run_with_an_old_glibc(native_fmus):
    for (name, _), (_, folder) in native_fmus.items():
        (library,) = Path(folder, "binaries").glob("*/*.so")
        table = subprocess.run(["objdump", "-T", library], capture_output=True, text=True, check=True).stdout
        versions = {tuple(map(int, v.split("."))) for v in re.findall(r"GLIBC_([\d.]+)", table)}
        assert versions and max(versions) <= (2, 17), name


@pytest.mark.second
@pytest.mark.skipif(sys.platform != "linux" or shutil.which("nm") is None, reason="no nm")
def test_several_fmus_are_linked_into_one_program(native_fmus, tmp_path):
    """Two models, each by both versions of FMI, with the prefixes of the standard's headers."""
    cc, ends = (
        shutil.which("cc"),
        {"ChamberForces": ("phi", "w", "tau"), "DcMotor": ("w_ref", "load.tau_bias", "w")},
    )
    objects, defined, calls = [], [], []
    for name in ends:
        for fmi in (2, 3):
            folder = native_fmus[name, fmi][1]
            sources = Path(folder, "sources")
            prefix = f"-DFMI{fmi}_FUNCTION_PREFIX={name}_"
            files = [sources / f for f in ("kernels.c", "model.c", f"fmi{fmi}.c")]
            for file in (*files, HERE / "host.c"):
                made = tmp_path / f"{name}{fmi}{file.stem}.o"
                more = (f"-DFMI={fmi}", f"-DLINKED={name}_") if file.stem == "host" else (prefix,)
                flags = ("-std=c99", "-O0", "-fPIC", "-ffp-contract=off", *more, "-I", str(sources))
                subprocess.run([cc, *flags, "-c", file, "-o", made], check=True)
                objects.append(made)
                if file.stem != "host":
                    output = subprocess.run(
                        ["nm", "-g", "--defined-only", made], capture_output=True, text=True
                    ).stdout
                    defined += [line.split()[-1] for line in output.splitlines()]
            description = fmpy.read_model_description(folder)
            reference = {v.name: str(v.valueReference) for v in description.modelVariables}
            token = description.guid or description.instantiationToken
            arguments = ", ".join(f'"{x}"' for x in ("", "", token, *(reference[n] for n in ends[name])))
            calls.append(
                (
                    f"{name}_host{fmi}",
                    f"{{{arguments}}}",
                    folder,
                    [token, *(reference[n] for n in ends[name])],
                )
            )
    assert len(defined) == len(set(defined)), "a name that two of them have"
    assert all(name.startswith(tuple(f"{model}_" for model in ends)) for name in defined)
    lines = [f"int {call}(int, char **);" for call, *_ in calls]
    lines += ["int main(void) {"]
    lines += [f"    {{ char *a[] = {values}; if ({call}(6, a)) return 1; }}" for call, values, *_ in calls]
    (tmp_path / "main.c").write_text("\n".join([*lines, "    return 0;", "}", ""]))
    program = tmp_path / "program"
    subprocess.run([cc, "-o", program, tmp_path / "main.c", *objects, "-lm"], check=True)
    together = subprocess.run([program], capture_output=True, text=True, check=True).stdout.split()
    # each FMU's own library, loaded by itself
    alone = []
    for call, _, folder, arguments in calls:
        host = tmp_path / call
        flags = [f"-DFMI={call[-1]}", "-I", f"{folder}/sources"]
        subprocess.run([cc, *flags, "-o", host, HERE / "host.c", "-ldl"], check=True)
        (library,) = Path(folder, "binaries").glob("*/*.so")
        alone += subprocess.run(
            [host, library, *arguments], capture_output=True, text=True, check=True
        ).stdout.split()
    assert len(alone) == 40
    np.testing.assert_allclose([float(x) for x in together], [float(x) for x in alone], rtol=1e-12)


def test_sources_are_of_one_version(native_fmus, tmp_path):
    """With the prefixes of both, two FMUs would share a name."""
    sources = Path(native_fmus["ChamberForces", 2][1], "sources")
    flags = [
        "-DFMI2_FUNCTION_PREFIX=A_",
        "-DFMI3_FUNCTION_PREFIX=A_",
        "-fsyntax-only",
        str(sources / "model.c"),
    ]
    process = subprocess.run([shutil.which("cc"), *flags], capture_output=True, text=True)
    assert process.returncode and "define the one of this FMU's version of FMI" in process.stderr
    assert not subprocess.run([shutil.which("cc"), flags[0], *flags[2:]]).returncode


@both
def test_a_variable_is_read_and_set_by_the_functions_of_its_type_alone(unit, fmi):
    """A count, a switch and a number of the motor; no variable is a text."""
    one = unit("InductionMotor", fmi)
    names = {2: ("Real", "Integer", "Boolean", "String"), 3: ("Float64", "Int32", "Boolean", "String")}[fmi]
    own = dict(zip(("cage.R", "pole_pairs", "inverter.on"), names, strict=False))
    good = {"cage.R": 2.5, "pole_pairs": 3, "inverter.on": True}
    for name, value in good.items():
        vr = one.reference[name]
        assert one.type[name] == own[name]
        for kind in names:
            get, put = (getattr(one.api, f"{verb}{kind}") for verb in ("get", "set"))
            if kind == own[name]:
                put([vr], [value])
                assert get([vr]) == [value]
                continue
            line = f"value reference {vr} is no variable of the type {kind}"
            assert one.refused(get, [vr]) == line and one.status == 3
            assert one.refused(put, [vr], ["" if kind == "String" else 1]) == line and one.status == 3
    line = "value reference 9999 does not exist"
    assert one.refused(getattr(one.api, f"get{names[1]}"), [9999]) == line
    one.start()
    assert {name: one.get(name)[0] for name in good} == good
    fixed = "pole_pairs is fixed: set it before initialization or after reset"
    assert one.refused(one.set, {"pole_pairs": 2}) == fixed
    # no derivative by a whole number
    again = unit("InductionMotor", fmi)
    if fmi == 2:
        again.api.setupExperiment()
    again.api.enterInitializationMode()
    slopes, w, vr = again.api.getDirectionalDerivative, again.reference["w"], again.reference["pole_pairs"]
    assert f"value reference {vr} is no variable" in again.refused(slopes, [w], [vr], [1.0])


@both
def test_a_count_out_of_its_bounds_is_refused_at_the_initialization(unit, fmi):
    limits = allowed("InductionMotor", "pole_pairs")
    assert limits == "must be a whole number >= 1 and <= 24"
    for pairs in (0, 25, -(2**31), 2**31 - 1):
        one = unit("InductionMotor", fmi)
        line = one.refused(one.start, pole_pairs=pairs)
        assert line.startswith("pole_pairs = ") and line.endswith(limits)
        one.set({"pole_pairs": 4})
        one.start()


@both
def test_a_saved_state_has_counts_and_switches(unit, fmi):
    one = unit("InductionMotor", fmi).start(pole_pairs=3, inverter__on=True, w_ref=100.0)
    raw = one.serialized()
    other = unit("InductionMotor", fmi).start()
    other.restore(raw)
    assert other.get("pole_pairs") == [3] and other.get("inverter.on") == [True]
    for each in (one, other):
        each.step(0.0, 0.01)
    assert other.get("w", "slip") == one.get("w", "slip")


@both
def test_the_alarm_of_model_exchange_changes_in_event_mode_only(unit, native_fmus, fmi):
    """A discrete output: the FMU asks for the event, and holds the value until then."""
    description = fmpy.read_model_description(native_fmus["LoadObserver", fmi][1])
    order = [v.derivative.name for v in description.modelVariables if v.derivative]
    (alarm,) = (v for v in description.modelVariables if v.name == "alarm")
    assert (alarm.variability, alarm.causality) == ("discrete", "output")
    one = unit("LoadObserver", fmi, exchange=True).start(phi=1.0, w=150.0)
    n, update = len(order), one.api.newDiscreteStates if fmi == 2 else one.api.updateDiscreteStates
    update()
    one.api.enterContinuousTimeMode()
    x = (ctypes.c_double * n)()
    one.api.getContinuousStates(x, n)
    equal, loaded = list(x), list(x)
    # as after a long time: sure of the loads, and one side has too much
    loaded[order.index("left.material_mass")] = 300.0

    def seen(states):
        """The alarm, and whether the FMU asks for an event, at these states."""
        x[:] = states
        one.api.setContinuousStates(x, n)
        return one.get("alarm")[0], one.api.completedIntegratorStep()[0]

    assert seen(equal) == (0, False)
    assert seen(loaded) == (0, True)
    raw = one.serialized()
    for _ in range(2):
        assert one.get("alarm") == [0]  # still, though the states are beyond the threshold
        one.api.enterEventMode()
        assert one.get("alarm") == [1]
        update()
        one.api.enterContinuousTimeMode()
        assert seen(loaded) == (1, False)
        assert seen(equal) == (1, True)
        one.restore(raw)  # which holds the alarm, too
    one.api.enterEventMode()
    x[:] = loaded
    one.api.setContinuousStates(x, n)
    one.api.enterContinuousTimeMode()
    assert seen(equal) == (1, True)
    one.api.terminate()
    assert one.get("alarm") == [1]


@both
def test_a_refused_experiment_leaves_nothing_behind(unit, fmi):
    """From an endless time to an endless time: the FMU takes its own saved state, and starts."""
    one = unit("InductionMotor", fmi)
    assert one.refused(one.start, float("inf"), float("inf")) == "start time = inf s: must be a finite number"
    one.restore(one.serialized())
    one.start(0.0, float("inf")).step(0.0, 0.01)
    one.restore(one.serialized())
