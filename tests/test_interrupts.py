"""A signal at any point ends the program with its status and one line. The signals are raised at fixed points."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
import xarray as xr
from command import chainunit
from records import like

from chainunit.report import series
from chainunit.work import interrupts

PRESS = Path(__file__).parents[1] / "examples" / "linkages" / "slider_crank_press.toml"

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")


class Lost:
    """An interrupt comes in its destructor, where Python drops it."""

    def __init__(self, sent):
        self.sent = sent

    def __del__(self):
        signal.raise_signal(self.sent)


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupt_that_python_drops_comes_again(sent, capsys, request):
    # a parent such as nohup may have this process ignore it
    of_parent = signal.signal(sent, signal.SIG_DFL)
    request.addfinalizer(lambda: signal.signal(sent, of_parent))
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)]
    with interrupts.remembered():
        with pytest.raises(KeyboardInterrupt):
            Lost(sent)
            time.sleep(60.0)
        assert interrupts.received() == sent and interrupts.status() == 128 + sent
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)] == before
    assert capsys.readouterr().err == "", "no traceback of Python"


def test_a_signal_that_the_parent_ignores_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with interrupts.remembered():
            signal.raise_signal(signal.SIGHUP)
            assert interrupts.received() is None
    finally:
        signal.signal(signal.SIGHUP, before)


def test_after_the_end_of_the_work_a_signal_is_remembered_alone():
    with interrupts.remembered():
        interrupts.hold()
        signal.raise_signal(signal.SIGINT)
        assert interrupts.received() == signal.SIGINT


def _swallowed(*_):
    try:
        signal.raise_signal(signal.SIGINT)
    except BaseException:
        return []


def _other_error(*_):
    try:
        signal.raise_signal(signal.SIGINT)
    except BaseException as error:
        raise ValueError("of a library") from error


def _dropped(*_):
    Lost(signal.SIGINT)
    time.sleep(60.0)


def _bare(*_):
    signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize("happens", [_swallowed, _other_error, _dropped, _bare])
@pytest.mark.parametrize("at", ["chainunit.report.reference.overview", "chainunit.report.terminal.show"])
def test_the_status_is_that_of_the_signal_whatever_a_library_makes_of_it(happens, at, tmp_path, monkeypatch):
    monkeypatch.setattr(at, happens)
    done = chainunit("keys", cwd=tmp_path)
    assert done.returncode == 130 and done.stderr == "chainunit: interrupted; nothing was written\n"


def test_a_signal_before_the_command_begins_has_its_line(tmp_path, monkeypatch):
    """typer would end with the bare status."""
    monkeypatch.setattr("typer.core.TyperGroup.make_context", _bare)
    done = chainunit("keys", cwd=tmp_path)
    assert done.returncode == 130 and done.stderr == "chainunit: interrupted; nothing was written\n"


@pytest.mark.second
@pytest.mark.parametrize("happens", [_bare, _swallowed, _other_error])
def test_an_interrupt_while_files_are_written_names_those_that_are_there(happens, tmp_path, monkeypatch):
    from chainunit.report import files

    markdown = files.markdown

    def interrupted(*arguments):
        happens()
        return markdown(*arguments)

    monkeypatch.setattr(files, "markdown", interrupted)
    done = chainunit("linkage", PRESS, "-o", "out", cwd=tmp_path)
    there = ["linkage.json"]
    there += [f"linkage{name}" for name in (".svg", ".png", "_stroke.png", "_reactions.png", "_rest.png")]
    there += (
        ["linkage.md", "report.html", "linkage_copy.toml", "provenance.json"] if happens is _swallowed else []
    )
    assert done.returncode == 130
    assert done.stderr == f"chainunit: interrupted; written: {', '.join(f'out/{name}' for name in there)}\n"
    assert sorted(p.name for p in (tmp_path / "out").iterdir() if p.suffix) == sorted(there)
    json.loads((tmp_path / "out" / "linkage.json").read_text())


def test_the_series_are_whole_where_an_interrupt_comes_while_they_are_written(tmp_path, monkeypatch):
    """Inside its library an interrupt would leave a lock taken, on which the end of the process would wait."""
    written = xr.DataTree.to_netcdf

    def interrupted(*arguments, **options):
        signal.raise_signal(signal.SIGINT)
        written(*arguments, **options)

    monkeypatch.setattr(xr.DataTree, "to_netcdf", interrupted)
    monkeypatch.setattr(series, "title", lambda runs, name: name)
    run = xr.Dataset({"x": ("time", [1.0, 2.0])}, {"time": [0.0, 1.0]})
    study = like(answers={}, series={"start_up": run}, config=SimpleNamespace(title="a study"))
    with pytest.raises(KeyboardInterrupt):
        series.write(study, tmp_path)
    with xr.open_datatree(tmp_path / series.SERIES) as tree:
        assert tree["start_up"]["x"].values.tolist() == [1.0, 2.0]


PROGRAM = """
import atexit, importlib.abc, signal, sys

class Interrupt(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == {module!r}:
            try:
                signal.raise_signal(signal.{sent})
            except BaseException as error:
                raise {error}

sys.meta_path.insert(0, Interrupt())
if {module!r} == "":
    atexit.register(signal.raise_signal, signal.{sent})
sys.argv = ["chainunit", "--version"]
from chainunit.__main__ import main
main()
"""


@pytest.mark.parametrize(
    ("module", "error", "sent"),
    [
        ("chainunit.app.cli", "error", "SIGINT"),
        ("rich.console", "ImportError from error", "SIGINT"),
        ("typer", "error", "SIGTERM"),
        ("", "error", "SIGINT"),
    ],
)
def test_a_signal_while_the_program_begins_or_ends(module, error, sent, tmp_path):
    """In an import, also of a library that makes another error of it; when all is done it changes nothing."""
    script = textwrap.dedent(PROGRAM).format(module=module, error=error, sent=sent)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=tmp_path)
    if module:
        assert done.returncode == 128 + getattr(signal, sent), done.stderr
        assert done.stderr == "chainunit: interrupted; nothing was written\n" and not done.stdout
    else:
        assert done.returncode == 0 and done.stderr == "" and done.stdout.startswith("chainunit ")
