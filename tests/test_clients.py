"""Native FMUs in other importers. They are in the extra `dev`; without them these tests are skipped."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
import textwrap

import fmpy
import pytest

from chainunit.fmu.native.export import export
from chainunit.fmu.native.platforms import compiler
from chainunit.models import MODELS

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")

START = {"phi_start": 0.4}  # from rest at 0.4 rad the machine falls and swings


@pytest.fixture(scope="module")
def falling(tmp_path_factory):
    return export(MODELS["ChainUnit"], tmp_path_factory.mktemp("clients") / "ChainUnit.fmu", START)


def here(package):
    return pytest.mark.skipif(importlib.util.find_spec(package) is None, reason=f"{package} is not installed")


@here("libcosimpy")
def test_libcosim(falling):
    script = """
        import json, sys
        from libcosimpy.CosimExecution import CosimExecution
        from libcosimpy.CosimObserver import CosimObserver
        from libcosimpy.CosimSlave import CosimLocalSlave

        execution = CosimExecution.from_step_size(step_size=1_000_000)
        index = execution.add_local_slave(CosimLocalSlave(fmu_path=sys.argv[1], instance_name="unit"))
        observer = CosimObserver.create_last_value()
        execution.add_observer(observer=observer)
        assert execution.step(step_count=500)
        variables = {v.name.decode(): v.reference for v in execution.slave_variables(slave_index=index)}
        wanted = [variables[n] for n in ("phi", "w", "a", "left.support.fy", "margin")]
        print("values", json.dumps(list(observer.last_real_values(slave_index=index, variable_references=wanted))))
    """
    command = [sys.executable, "-c", textwrap.dedent(script), str(falling)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    names = ["phi", "w", "a", "left.support.fy", "margin"]
    end = fmpy.simulate_fmu(
        str(falling), fmi_type="CoSimulation", stop_time=0.5, output_interval=1e-3, output=names
    )[-1]
    assert abs(end["w"]) > 0.01
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("values ")]
    assert json.loads(line.removeprefix("values ")) == pytest.approx([end[n] for n in names], rel=1e-12)


@here("fmu_manipulation_toolbox")
def test_fmu_manipulation_toolbox(falling, tmp_path):
    command = [sys.executable, "-m", "fmu_manipulation_toolbox.cli.fmutool", "-input", str(falling), "-check"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    said = done.stdout + done.stderr
    assert done.returncode == 0 and "No semantic error" in said and "compliant with FMI-2.0" in said, said
