"""A study on a machine without a C compiler: its runs by wasmtime, against those by native code."""

from __future__ import annotations

import numpy as np
import pytest

from chainunit import InputError
from chainunit.batch import transients
from chainunit.capabilities.sweep.runs import check_drive
from chainunit.core.native.compilers import compiler
from chainunit.fmu import backends
from chainunit.study import run as study_run
from chainunit.study import without_compiler
from chainunit.study.choice import drive_of
from chainunit.study.config import parse
from chainunit.study.rig import Rig
from chainunit.study.run import run_study

pytestmark = pytest.mark.second

STUDY = """
[run]
crank_speed = 3
ramp = 0.3
settle_turns = 1
turns = 1
step = 1e-3

[coupling]
trip_torque = 230

[[event]]
side = "left"
type = "jam"
force = 3000
duration = 0.2

[monte_carlo]
runs = 3
duration = "0.3 s"
event = { type = "jam", force = ["1 kN", "2 kN"], duration = "0.1 s" }
"""


def without(monkeypatch, wasmtime=True):
    """No compiler from here on; and no wasmtime where that is asked for."""
    monkeypatch.setattr(backends.targets, "compiles", lambda fmi: False)
    monkeypatch.setattr(transients, "compiler", lambda: None)
    for module in (transients, without_compiler):
        monkeypatch.setattr(module, "has_wasmtime", lambda: wasmtime)


def numbers(answers):
    """The numbers of the answers of one run, by name."""
    return {k: float(x) for k, x in vars(answers).items() if isinstance(x, (int, float)) and np.isfinite(x)}


def notes(study):
    return [note.text for note in study.notes if note.kind == "no compiler"]


@pytest.mark.skipif(compiler() is None, reason="compares with native code")
def test_a_study_by_wasmtime_has_the_answers_of_native_code(tmp_path, monkeypatch):
    """To the error of the coupling of the FMUs, and nearer to the same system in native code. The coupling opens in
    the lump, and the machine coasts."""
    pytest.importorskip("wasmtime")
    native = run_study(parse(STUDY), tmp_path / "native")
    with monkeypatch.context() as patch:
        patch.setattr(study_run, "Rig", lambda operation, drive, files: Rig(operation, drive, None))
        as_one = run_study(parse(STUDY), tmp_path / "one")
    without(monkeypatch)
    study = run_study(parse(STUDY), tmp_path / "wasm")
    assert study.failure is None and {origin.backend for origin in study.fmus.values()} == {"python"}
    (note,) = notes(study)
    assert "in WebAssembly, by wasmtime" in note and "chainunit[cross]" in note
    assert set(study.answers) == set(native.answers) and {"steady", "jam_left"} <= set(study.answers)
    assert study.answers["jam_left"].coupling_trip_time is not None
    for reference, share in ((native, 1e-3), (as_one, 1e-6)):
        for run, answers in reference.answers.items():
            own = numbers(study.answers[run])
            for name, wanted in numbers(answers).items():
                if name not in ("cycle_gap", "energy_gap", "speed_drift"):  # errors themselves, near to zero
                    assert own[name] == pytest.approx(wanted, rel=share, abs=1e-9), (run, name)
    lumps = [of.findings["monte_carlo"] for of in (study, native)]
    assert {of.method for of in lumps} == {"compiled"}
    peaks, wanted = (of.dataset["crank_torque_peak"].values for of in lumps)
    np.testing.assert_allclose(peaks, wanted, rtol=1e-6)


@pytest.mark.parametrize(
    "text, served", [("", True), ('simulation = "me"\n', False), ("feed_forward = true\n", False)]
)
def test_wasmtime_serves_co_simulations_whose_signals_are_profiles(text, served, monkeypatch):
    """Not Model Exchange, nor a feed-forward, whose reference is no profile: these run their FMUs."""
    pytest.importorskip("wasmtime")
    without(monkeypatch)
    config = parse(text)
    rig = Rig(config.operation, drive_of(config), {})
    own, words = without_compiler.rig_and_note(rig, config.events.values())
    assert (own.files is None, words == without_compiler.BY_WASM) == (served, served)
    assert served or (own is rig and words == without_compiler.BY_PYTHON)


def test_without_wasmtime_it_is_told_how_to_have_it(monkeypatch):
    without(monkeypatch, wasmtime=False)
    config = parse("")
    rig = Rig(config.operation, drive_of(config), {})
    own, words = without_compiler.rig_and_note(rig, config.events.values())
    assert own is rig and words == without_compiler.BY_PYTHON + without_compiler.WITHOUT_WASMTIME
    assert "chainunit[wasm]" in words


def test_measures_of_a_sweep_need_either(monkeypatch):
    text = (
        '[sweep]\nmeasures = ["crank_torque_peak"]\nevent = "jam_left"\n'
        '[[sweep.parameter]]\nname = "machine.crank.m"\nvalues = [40, 60]\n'
    )
    config = parse(text)
    rig = Rig(config.operation, drive_of(config), None)
    plan = config.plans["sweep"]
    without(monkeypatch)
    check_drive(rig, plan, config.events[plan.event])
    without(monkeypatch, wasmtime=False)
    with pytest.raises(
        InputError, match=r"^sweep\.measures: need a C compiler .*, or wasmtime .*leave them out$"
    ):
        check_drive(rig, plan, config.events[plan.event])
