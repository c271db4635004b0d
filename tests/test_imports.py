"""Libraries that take long to import are imported only where they are needed."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

import chainunit
from chainunit.models import MODELS

pytestmark = pytest.mark.second

DEPENDENCIES = {
    re.match(r"[\w-]+", line)[0].lower()
    for line in metadata.requires("chainunit")
    if "extra ==" not in line.replace("'", "").replace('"', "")
}


TIPPER = str(Path(__file__).parents[1] / "examples" / "linkages" / "tipper.toml")
OF_FILES = {"typer", "rich", "numpy", "pydantic"}
"""What a command needs that reads a study file or a linkage file."""


def _command(*words):
    return f"from chainunit.app.cli import app; app({list(words)!r}, standalone_mode=False)"


@pytest.mark.parametrize(
    ("code", "needed"),
    [
        ("import chainunit", set()),
        (_command("--help"), {"typer", "rich"}),
        ("import chainunit; chainunit.ChainUnitMachine", {"numpy"}),
        (_command("keys"), OF_FILES),
        (_command("live"), OF_FILES | {"casadi"}),
        (_command("live", TIPPER), OF_FILES | {"casadi"}),
    ],
)
def test_imports_no_more_than_is_needed(code, needed, tmp_path, monkeypatch):
    assert {"numpy", "scipy", "xarray", "casadi", "fmpy", "matplotlib", "typer", "rich"} <= DEPENDENCIES
    monkeypatch.chdir(tmp_path)
    after = f"import sys\n{code}\nprint('loaded', *{{m.split('.')[0].lower() for m in sys.modules}})"
    process = subprocess.run([sys.executable, "-c", after], capture_output=True, text=True, check=True)
    loaded = set(process.stdout.splitlines()[-1].split())
    assert loaded & DEPENDENCIES == needed


@pytest.mark.parametrize(
    ("module", "package"), [("casadi.tools", "casadi"), ("netCDF4", "netcdf4"), ("PIL.Image", "pillow")]
)
def test_a_package_that_is_not_installed_has_a_sentence(module, package):
    """Some are not to be had for every machine, and a check of a certified file needs few. A module that is missing
    by a fault of ours is no bad input."""

    def run(missing):
        fails = f"def fail(*given, **options): raise ModuleNotFoundError('no', name={missing!r})"
        code = f"from chainunit.app import cli\n{fails}\ncli.app = fail\ncli.main()"
        return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)

    words = f"this needs the package {package}, which is not installed: pip install {package}"
    assert (run(module).returncode, run(module).stderr) == (2, f"chainunit: {words}\n")
    assert "Traceback" in run("chainunit.nothing").stderr


@pytest.mark.parametrize(("name", "most"), [("ChamberForces", 90), (TIPPER, 122)])
def test_an_export_imports_the_machine_and_nothing_of_studies(name, most, tmp_path):
    code = f"import sys; {_command('export', name, '-o', str(tmp_path / 'it.fmu'), '--backend', 'python')}"
    after = "print('loaded', *(m for m in sys.modules if m.split('.')[0] == 'chainunit'))"
    run = subprocess.run(
        [sys.executable, "-c", f"{code}; {after}"], capture_output=True, text=True, check=True
    )
    loaded = run.stdout.splitlines()[-1].split()[1:]
    assert "chainunit.fmu.native.export" in loaded and len(loaded) <= most, len(loaded)
    assert not {m for m in loaded if m.startswith(("chainunit.study", "chainunit.capabilities"))}
    others = {"accelerator", "knife_drive", "flexible"}
    assert not others & {m.rpartition(".")[2] for m in loaded}


RESULTS = ("BestResult", "IdentificationResult", "SweepResult", "WatchResult")


def test_public_names():
    assert {"Study", "ChainUnitMachine", "ChamberForces", "SideLoads", "InputError"} <= set(chainunit.__all__)
    assert set(RESULTS) <= set(chainunit.__all__)
    for name in chainunit.__all__:
        assert getattr(chainunit, name) is getattr(chainunit, name) and name in dir(chainunit)
    assert chainunit.__version__ == metadata.version("chainunit")
    with pytest.raises(AttributeError, match="module 'chainunit' has no attribute 'Chainunit'"):
        chainunit.Chainunit  # noqa: B018
    with pytest.raises(ImportError):
        from chainunit import nothing  # noqa: F401


def test_completion_shows_the_public_names_alone_before_they_are_used():
    code = "import chainunit; print([name for name in dir(chainunit) if name[0] != '_'])"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == str([name for name in chainunit.__all__ if name != "__version__"])


def test_a_linkage_is_shown_without_the_capabilities_of_a_study(tmp_path):
    """A folder is claimed by the kinds of results of all commands, which need no more than the commands."""
    code = f"import sys; {_command('linkage', TIPPER, '-o', str(tmp_path / 'out'))}"
    after = "print('loaded', *(m for m in sys.modules if m.startswith('chainunit.capabilities.')))"
    run = subprocess.run(
        [sys.executable, "-c", f"{code}; {after}"], capture_output=True, text=True, check=True
    )
    loaded = [name.split(".")[2:] for name in run.stdout.splitlines()[-1].split()[1:]]
    assert ["sweep", "command"] in loaded
    assert {tuple(name[1:]) for name in loaded} <= {(), ("command",)}


def test_the_package_runs_as_a_module_and_names_all_models():
    def printed(*words):
        command = [sys.executable, "-m", "chainunit", *words]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    assert printed("--version").startswith("chainunit ")
    message = " ".join(printed("export", "--help").split())
    assert ", ".join(MODELS) in message and "Accelerator" in message
