"""Fixtures that the tests share, and their stages. A run without named files is parallel.

A run without named files and without ``-m`` is the first stage. It leaves out the second, which is marked `second`:
FMUs in other clients; processes that are stopped, killed or spread; the structure of the package; the examples, the
papers, the tables of the standard; and studies whose cases the first stage has in parts. ``.ci/run`` runs both.
``.ci/full`` runs what is marked `slow`: importers, other programs, platforms, browsers, sheets, long studies. A named
file runs with all of its tests, except the slow ones.

An FMU costs a test little: what exports compile is kept by its content, whichever worker, test or process asks, and
for later runs of the tests, too (see `chainunit.core.native.cache`). Beyond that,

- a test that needs a C compiler has the mark `compiler`: it is skipped where there is none, as `native_fmus` are;
- `fmus` has the Python FMU of every model, `native_fmus` the native ones: take them where start values do not matter;
- `once` fills a folder once a session, for all workers: take it for a study that tests of several files read, or for
  anything else that costs seconds and is only read;
- a module's own fixtures (`scope="module"`) are made once, as a file is never split between workers;
- `monkeypatch.setenv(VARIABLE, OFF)` compiles anew in a test of the compiler itself.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import shutil
import signal
import subprocess
import tempfile
import threading
from collections import Counter

import fmpy
import hypothesis
import pytest

from chainunit.core.native import cache
from chainunit.core.native.cache import VARIABLE
from chainunit.core.native.compilers import compiler
from chainunit.fmu.export import export
from chainunit.fmu.native.export import export as export_native
from chainunit.models import MODELS

hypothesis.settings.register_profile("same", derandomize=True)
hypothesis.settings.register_profile("random", print_blob=True)
hypothesis.settings.load_profile("same")
# `.ci/full` takes other cases each time, by --hypothesis-profile=random

FIRST = "not slow and not second"
"""What `pytest` runs without ``-m`` and files."""


def pytest_ignore_collect(collection_path, config):
    """The first stage does not import a file that is of another stage as a whole: that alone takes seconds."""
    if config.option.markexpr != FIRST or not collection_path.match("test_*.py"):
        return None
    text = collection_path.read_text("utf-8")
    return (
        True if re.search(r"^pytestmark = \[?\s*pytest[.]mark[.](second|slow)", text, re.MULTILINE) else None
    )


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """`stages(first=2, second=3)`: of the cases of a test, the first stage has two, the second three more, and
    `.ci/full` the others. A number that is left out has no bound."""
    counts = Counter()
    for item in items:
        if not (shares := item.get_closest_marker("stages")):
            continue
        first, second = shares.kwargs.get("first", 0), shares.kwargs.get("second", len(items))
        number = counts[item.parent.nodeid, item.originalname]
        counts[item.parent.nodeid, item.originalname] += 1
        if number >= first:
            item.add_marker(pytest.mark.second if number < first + second else pytest.mark.slow)


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config):
    """Before xdist reads its options: one worker for each processor, for a run of all tests."""
    options = config.option
    whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    worker = hasattr(config, "workerinput")  # a worker comes here, too: it must not start workers of its own
    one = worker or options.usepdb or options.collectonly or not config.pluginmanager.hasplugin("xdist")
    if whole and not worker and options.markexpr == "not slow":
        options.markexpr = FIRST
    if whole and not one and options.numprocesses is None:
        options.numprocesses = config.hook.pytest_xdist_auto_num_workers(config=config)
        options.dist = "loadfile"


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node):
    """A worker reads its options anew: it is told the stage."""
    node.workerinput["marks"] = node.config.option.markexpr


def _store(config):
    """A folder of compiled code that only this user can change, which later runs of the tests use again; one of this
    run alone where there is none. It lies in the user's cache, so that also the tests of a fresh clone use it."""
    os.environ.pop(VARIABLE, None)
    usual = cache.folder()
    store = usual / "tests" if usual else None
    try:
        if store:
            store.mkdir(parents=True, exist_ok=True, mode=0o700)
        if store and not any(cache._trouble(each.stat()) for each in (store, store.parent)):
            return store
    except OSError:  # a home that takes nothing
        pass
    store = tempfile.mkdtemp(prefix="chainunit_tests_")
    config.add_cleanup(lambda: shutil.rmtree(store, ignore_errors=True))
    return store


def pytest_configure(config):
    """Ctrl-C for this process and all that it starts, also where the parent ignores it, as ``nohup`` and CI runners
    do; and the folder of compiled code for all of them, workers included."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if compiler() is None:  # a remark, which is expected then
        config.addinivalue_line("filterwarnings", "ignore:no C compiler")
    if hasattr(config, "workerinput"):
        config.option.markexpr = config.workerinput["marks"]
    else:
        os.environ[VARIABLE] = str(_store(config))
        # the matrices are small: beside the workers, threads of a BLAS only wait for each other
        for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
            os.environ.setdefault(threads, "1")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """A test that needs a C compiler is skipped where there is none, before its fixtures are made."""
    if item.get_closest_marker("compiler") and compiler() is None:
        pytest.skip("no C compiler")


@pytest.fixture(autouse=True)
def _no_process_outlives_its_test(monkeypatch):
    """A test that fails before it ends its processes leaves none that would disturb the next. A process that was
    started in a session of its own is ended with all that it started."""
    started = []

    class Noted(subprocess.Popen):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            started.append((self, options.get("start_new_session", False)))

    monkeypatch.setattr(subprocess, "Popen", Noted)
    yield
    for process, leads_session in started:
        if leads_session:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
        if process.poll() is None:
            process.kill()
            process.communicate()


@pytest.fixture(scope="session")
def once(tmp_path_factory):
    """``once(name, fill)``: the folder `name`, which ``fill(folder)`` has filled, once a session for all workers.

    What is in it must only be read. A `fill` that fails is tried again by the next that asks, in an empty folder.
    """
    base = tmp_path_factory.getbasetemp()
    shared = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "once"
    shared.mkdir(exist_ok=True)

    def filled(name, fill):
        folder, done = shared / name, shared / f"{name}.done"
        with (shared / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not done.exists():
                shutil.rmtree(folder, ignore_errors=True)
                folder.mkdir()
                fill(folder)
                done.touch()
        return folder

    return filled


@pytest.fixture(scope="session")
def fmus(once):
    """The Python FMU of every model, by its name, in a folder whose name has spaces."""

    def fill(folder):
        for name, model in MODELS.items():
            export(model, folder / f"{name}.fmu")

    folder = once("path with spaces", fill)
    return {name: folder / f"{name}.fmu" for name in MODELS}


@pytest.fixture(scope="session")
def c_compiler():
    """The C compiler of this machine, for fixtures that need one: where there is none, their tests are skipped."""
    return compiler() or pytest.skip("no C compiler")


@pytest.fixture(scope="session")
def native_fmus(c_compiler, once):
    """Native FMUs by FMI 2 and 3 of every model, unpacked: {(name, fmi): (file, folder)}."""

    def fill(folder):
        name, fmi = folder.name[:-1], int(folder.name[-1])
        export_native(MODELS[name], folder.with_suffix(".fmu"), fmi=fmi)
        fmpy.extract(str(folder.with_suffix(".fmu")), unzipdir=str(folder))

    wanted = [(name, fmi) for name in MODELS for fmi in (2, 3)]
    # half of the workers begin at the end: two that come here together share the work
    odd = os.environ.get("PYTEST_XDIST_WORKER", "gw0")[-1] in "13579"
    folders = {(name, fmi): once(f"{name}{fmi}", fill) for name, fmi in (wanted[::-1] if odd else wanted)}
    return {key: (folders[key].with_suffix(".fmu"), str(folders[key])) for key in wanted}
