"""The gallery of linkage files as FMUs in other importers."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from systems import initialized
from test_clients import test_ecos as test_ecos
from test_clients import test_libcosim as test_libcosim
from test_native import random_calls

from chainunit.core.native.compilers import compiler
from chainunit.fmu.native.export import export
from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine

pytestmark = [pytest.mark.slow, pytest.mark.skipif(compiler() is None, reason="no C compiler")]
GALLERY = sorted((Path(__file__).parents[1] / "examples" / "linkages").glob("*.toml"))


@pytest.fixture(scope="module", params=GALLERY, ids=lambda file: file.stem)
def machine(request):
    return Machine(read_linkage(request.param))


@pytest.fixture(scope="module")
def alone(machine, tmp_path_factory):
    """Its FMUs by version of FMI, off a place where everything is 0, and the variables that are read."""
    folder, model = tmp_path_factory.mktemp("gallery"), machine.model
    low, high = model.span
    start = {"phi": low + 0.3 * (high - low), "w": 0.0 if not model.turns else 2.0, "a": 0.7}
    names = [
        "tau",
        "J",
        "dJ_dphi",
        "margin",
        "kinetic_energy",
        *[f"{name}.fx" for name in [*model.joints][:3]],
    ]
    return {fmi: export(model, folder / f"{model.name}{fmi}.fmu", start, fmi=fmi) for fmi in (2, 3)}, names


def test_valid(machine, alone):
    """fmpy expects further names of outputs among the initial unknowns of FMI 3.0, where a value stands once."""
    for fmi, file in alone[0].items():
        problems = validate_fmu(str(file))
        if fmi == 3 and machine.model.repeated:
            (problem,) = problems
            expected, present = (set(names.split(", ")) for names in re.findall(r"{(.*?)}", problem))
            assert problem.startswith("ModelStructure/InitialUnknowns") and present < expected
            assert expected - present == {*machine.model.repeated}
        else:
            assert not problems


def test_directional_derivatives(machine, alone):
    """Of all outputs by angle, speed and acceleration, against differences of the Python model."""
    model = machine.model
    low, high = model.span
    at = {"phi": low + 0.3 * (high - low), "w": 2.0 if model.turns else 0.1, "a": 0.7}
    at |= model.feed_layout.by_name(model.Feed())
    with initialized(alone[0][2]) as (unit, description):
        references = {v.name: v.valueReference for v in description.modelVariables}
        outputs = [v.name for v in description.modelVariables if v.causality == "output"]
        unit.setReal([references[name] for name in at], list(at.values()))
        for name, h in (("phi", 1e-5), ("w", 1e-5), ("a", 1e-3)):
            got = np.array(
                unit.getDirectionalDerivative([references[n] for n in outputs], [references[name]], [1.0])
            )
            near = [machine.evaluate({**at, name: at[name] + k * h}) for k in (-2, -1, 1, 2)]
            a, b, c, d = (np.array([float(each[n]) for n in outputs]) for each in near)
            wanted = (a - 8.0 * b + 8.0 * c - d) / (12.0 * h)
            # what a difference of rounded values leaves; a small force is the difference of large ones
            size = np.abs(a) + np.abs(d)
            forces = [name.endswith((".fx", ".fy")) for name in outputs]
            size[forces] = np.max(size[forces])
            rounding = 1e-15 * size / h
            worst = np.abs(got - wanted) / (1e-6 * np.abs(wanted) + 1e-9 + 10.0 * rounding)
            assert np.max(worst) < 1.0, (name, outputs[int(np.argmax(worst))])


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("name", ["blake_jaw_crusher", "edge_trimmer", "scotch_yoke_pump"])
def test_random_calls_under_sanitizers(name, fmi, tmp_path):
    file = next(file for file in GALLERY if file.stem == name)
    fmu = export(read_linkage(file), tmp_path / "unit.fmu", fmi=fmi)
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(tmp_path / "unpacked")
    random_calls(tmp_path / "unpacked", fmi, 300_000, tmp_path)
