"""A notebook goes through every door of the package: tracebacks and `repr` are short, plots have axes with units."""

from __future__ import annotations

import ast
import io
import json
import linecache
import sys
import traceback
import warnings
from contextlib import redirect_stdout
from pathlib import Path
from types import SimpleNamespace

import pytest

import chainunit
from chainunit.core.native.compilers import compiler
from chainunit.reading.result_entries import ResultEntries
from chainunit.work.progress import quiet

EXAMPLES = Path(__file__).parents[1] / "examples"
MILL = (EXAMPLES / "identification" / "mill.toml").read_text("utf-8")
TRUTH = json.loads((EXAMPLES / "identification" / "truth.json").read_text("utf-8"))
MOST_LINES, MOST_LETTERS = 12, 2000
ANGLE = "crank angle from the upward vertical, clockwise [deg]"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("default"),
    pytest.mark.skipif(compiler() is None, reason="no C compiler"),
]


class Publisher:
    """The display of a notebook, which keeps what it shows."""

    is_publishing = False

    def __init__(self):
        self.outputs = []

    def publish(self, data, transient, update):
        self.outputs.append({"data": data, "transient": transient, "update": update})


def ipython():
    """A shell of IPython, where it is installed."""
    try:
        from IPython.core.interactiveshell import InteractiveShell
    except ImportError:
        return None
    InteractiveShell.clear_instance()
    shell = InteractiveShell.instance(colors="nocolor")
    shell.history_manager.enabled = False
    return shell


class OwnShell:
    """Runs cells as IPython does: the value of the last expression, and the tracebacks of errors."""

    def __init__(self):
        self.names = {}
        # matplotlib asks for them
        self.events = SimpleNamespace(register=lambda *_: None, unregister=lambda *_: None)

    def run_cell(self, cell, **_):
        tree = ast.parse(cell)
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        # as of IPython the lines of a cell are known to a traceback
        file = f"<cell {len(linecache.cache)}>"
        linecache.cache[file] = len(cell), None, cell.splitlines(keepends=True), file
        result = SimpleNamespace(success=True, result=None)
        try:
            exec(compile(tree, file, "exec"), self.names)
            if last is not None:
                result.result = eval(compile(ast.Expression(last.value), file, "eval"), self.names)
        except Exception as error:
            result.success = False
            short = getattr(error, "_render_traceback_", None)
            print("\n".join(short() if short else traceback.format_exception(error)))
        return result


def own_shell(patch):
    """A shell of our own that this package takes for IPython's."""
    shell = OwnShell()
    module = SimpleNamespace(get_ipython=lambda: shell, version_info=(9, 0))
    patch.setitem(sys.modules, "IPython", module)
    return shell


def quiet_end():
    """End a shell that has nothing to end."""


class Notebook:
    """Cells of a notebook with a kernel, and what its display has `shown`."""

    def __init__(self, shell):
        self.shell, self.values = shell, []

    @property
    def shown(self):
        return self.shell.display_pub.outputs

    def __call__(self, cell):
        """Run a cell that ends without an error; its last value, whose `repr` is short."""
        text = io.StringIO()
        with redirect_stdout(text):
            result = self.shell.run_cell(cell, store_history=True)
        assert result.success, text.getvalue()
        self.check(result.result)
        return result.result

    def check(self, value):
        """The `repr` of a value of this package, and of its public attributes."""
        if type(value).__module__.startswith("chainunit"):
            self.values.append(value)
            assert len(repr(value)) <= MOST_LETTERS, type(value)
            for name in dir(type(value)):
                if not name.startswith("_") and isinstance(
                    getattr(type(value), name), property | type(_lazy)
                ):
                    part = getattr(value, name)
                    if type(part).__module__.startswith("chainunit"):
                        assert len(repr(part)) <= MOST_LETTERS, (type(value), name)

    def refusal(self, cell):
        """The lines of the traceback of a cell that is refused."""
        text = io.StringIO()
        with redirect_stdout(text):
            result = self.shell.run_cell(cell, store_history=True)
        assert not result.success, "no refusal"
        lines = text.getvalue().rstrip().splitlines()
        assert 0 < len(lines) <= MOST_LINES, text.getvalue()
        return lines


_lazy = next(x for x in vars(chainunit.StudyResult).values() if type(x).__name__ == "cached_property")


@pytest.fixture(scope="module")
def notebook(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "displayhook", sys.displayhook)
        patch.chdir(tmp_path_factory.mktemp("notebook"))
        shell = ipython() or own_shell(patch)
        shell.display_pub, shell.kernel = Publisher(), "a notebook"
        own = Notebook(shell)
        own("import matplotlib\nmatplotlib.use('Agg')")
        own(
            "import warnings\nwarnings.simplefilter('ignore')\n"
            "import numpy as np, xarray, pint\nimport chainunit\nfrom chainunit import *\nu = pint.UnitRegistry()"
        )
        yield own
        getattr(shell, "clear_instance", quiet_end)()


@pytest.fixture(scope="module")
def study(notebook):
    """The notebook with a study and its result."""
    notebook(
        "study = Study(title='Mill', machine={'r': 150 * u.mm}, event=[{'type': 'jam', 'side': 'left'}],\n"
        "    run={'crank_speed': 20 * u.rpm, 'turns': 1, 'settle_turns': 1, 'step': '4 ms'})\nstudy"
    )
    notebook("result = study.run()\nresult")
    return notebook


def check_words(result):
    """The words that all results share."""
    assert result.answers.columns[0] == "unit" and len(result.answers) >= 1
    assert result.answers.drop(columns="unit").notna().any(axis=None)
    assert isinstance(result.verdict, str) and result.verdict
    assert isinstance(result.warnings, list) and all(isinstance(words, str) for words in result.warnings)
    assert ResultEntries(json.loads(result.to_json()))


def check_figure(figure, *labels):
    """A figure is a picture for the page, and its axes have these labels."""
    assert figure._repr_png_().startswith(b"\x89PNG")
    axes = figure.to_matplotlib().axes
    found = {label for axis in axes for label in (axis.get_xlabel(), axis.get_ylabel())}
    assert set(labels) <= found, found


def test_the_progress_is_a_bar_that_goes(study):
    bars = [each["data"] for each in study.shown if "progress" in each["data"].get("text/html", "")]
    assert any("start-up and steady running" in bar["text/html"] for bar in bars)
    assert all("%" in bar["text/plain"] for bar in bars)
    identities = {each["transient"]["display_id"] for each in study.shown}
    assert len(identities) == 1 and [each["update"] for each in study.shown[:2]] == [False, True]
    assert study.shown[-1]["data"]["text/html"] == ""
    before = len(study.shown)
    study("study.run(progress=lambda *said: None)")
    assert len(study.shown) == before


def test_without_a_notebook_there_is_no_bar(monkeypatch):
    from chainunit.report.notebook import shown_progress

    monkeypatch.delitem(sys.modules, "IPython", raising=False)
    with shown_progress(None) as progress:
        assert progress is quiet


def test_a_study_and_its_result(study):
    result = study("result")
    check_words(result)
    assert list(study("result.runs")) == ["start_up", "jam_left", "steady"] and study("len(result.runs)") == 3
    for name in ("start_up", "jam_left", "steady"):
        axes = study(f"result.runs['{name}']['motor.w'].plot()[0].axes")
        assert axes.get_xlabel() == "time [s]" and "[rad/s]" in axes.get_ylabel()
    steady = study("result.runs['steady']")
    assert steady.time.values[0] > 0.0 and steady.time.units == "s"
    check_figure(study("result.figures['turn']"), ANGLE, "crank torque [N m]")
    check_figure(study("result.figures['time-jam-left']"), "time after the event [s]")
    for kind, begin in (("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")):
        file = study(f"result.figures['turn'].save('turn.{kind}')")
        assert file.read_bytes().startswith(begin)
    assert "must end in .png, .svg, .pdf" in study.refusal("result.figures['turn'].save('turn.gif')")[-1]
    assert 'was "turn" meant?' in study.refusal("result.figures['turm']")[-1]
    assert 'was "jam_left" meant?' in study.refusal("result.runs['jam_lef']")[-1]
    assert study("result.save('saved')")
    assert "<svg" in study("study._repr_html_()") and "<table" in study("result._repr_html_()")


def test_a_plot_of_the_user_keeps_its_backend(study):
    study(
        "import matplotlib.pyplot as plt\nplt.close('all')\nmatplotlib.use('svg')\nopen_figure = plt.figure()"
    )
    study("result.figures['turn']._repr_png_()\nresult.save('saved', png=True)")
    assert study("matplotlib.get_backend()") == "svg" and study("plt.get_fignums()") == [1]
    study("matplotlib.use('Agg')")


def test_other_doors_of_a_study(study):
    check_words(study("other = study.compare(study.with_values({'machine.r': '170 mm'}))\nother"))
    assert "steady.crank_torque_peak" in other_answers(study)
    check_words(study("study.compare('saved')"))
    study(
        "swept = Study(sweep={'points': 8, 'parameter': [{'name': 'machine.r', 'from': 0.14, 'to': 0.15}]}).sweep()"
    )
    assert "is no result of a study" in study.refusal("study.compare(swept)")[-1]
    assert "has no result" in study.refusal("study.compare('nowhere')")[-1]
    linear = study("study.linearize()")
    assert linear.A.shape[0] == len(linear.states) and "steady running" in linear.at
    study("linearize('DcMotor', {'w': 600 * u.rpm})")
    for cell in ("study.export('mill.fmu')", "study.export_ssp('mill.ssp')", "study.live('mill.html')"):
        assert study(cell).stat().st_size > 1000
    bare = study("Study.from_text('event = []')")
    assert "Study.from_text" not in repr(bare) and study("Study.from_file()")


def other_answers(study):
    table = study("other.answers")
    assert list(table.columns) == ["unit", "a", "b", "difference", "relative"]
    return table.index


@pytest.mark.parametrize(
    "cell",
    [
        "Study(machin={}, run={'crank_speed': '30 kg', 'turns': 'x', 'step': []}, feed=3, motor=4, event=[3])",
        "Study.from_text('x = ')",
        "Study.from_file('nowhere.toml')",
        "study.with_values({'event.jam.force': 3})",
        "study.run(backend='natve')",
        "study.sweep()",
        "study.optimize()",
        "study.identify()",
        "study.watch()",
        "study.linearize('jam_left')",
        "study.export('mill.fmu', fmi=4)",
        "linkage('nowhere.toml')",
        "ChainUnitMachine(r=0.9)",
        "ChainUnitMachine(rr=0.9)",
        "ChainUnitMachine().forces('12 kg')",
        "def sized(r):\n    return ChainUnitMachine(r=r)\n\nsized('9 kg')",
        "ChainUnitMachine().batch({'phi': [0.0], 'q': 1.0})",
        "linearize('DcMotor', 'w=3 kg')",
        "linearize('DcMoter')",
    ],
)
def test_a_refusal_is_short(study, cell):
    lines = study.refusal(cell)
    # no frame of the package, and the line of the user
    assert not [line for line in lines if "src/chainunit" in line or "Traceback" in line]
    inside = [k for k, line in enumerate(cell.splitlines(), 1) if line.startswith("    ")] or [1]
    assert lines[0] == f"line {inside[0]}: {cell.splitlines()[inside[0] - 1].strip()}"
    assert "Error: " in lines[1]


def test_a_machine_alone(notebook):
    notebook("machine = ChainUnitMachine(r='160 mm')\nmachine")
    notebook("out = machine.forces(np.linspace(0.0, 6.28, 3600), '30 rpm')\nout")
    notebook("machine.p")
    notebook("machine.equilibria()")
    notebook("machine.slopes(0.5, 3.0)")
    states = notebook(
        "turn = xarray.DataArray(np.linspace(0.0, 360.0, 90), dims='place', attrs={'units': 'deg'})\n"
        "states = machine.batch({'phi': turn, 'w': 30 * u.rpm}, ['tau'])\nstates"
    )
    assert states.tau.dims == ("place",)
    axes = notebook("states.tau.plot()[0].axes")
    assert "[rad]" in axes.get_xlabel() and "[N.m]" in axes.get_ylabel()
    assert axes.get_xlim()[1] == pytest.approx(6.6, abs=0.1)


def test_a_linkage(notebook):
    press = EXAMPLES / "linkages" / "slider_crank_press.toml"
    result = notebook(f"press = linkage({str(press)!r}, 60 * u.rpm)\npress")
    check_words(result)
    assert result.answers.loc["turn.torque_peak", "unit"] == "N.m"
    check_figure(notebook("press.figures['linkage-turn']"), "angle of the driver [deg]")
    assert notebook("press.machine").model.noun and notebook("press.save('press')")


def test_a_sweep(notebook):
    result = notebook(
        "swept = Study(sweep={'points': 32, 'angles': 90, 'quantities': ['peak(crank_torque)'], 'parameter': [\n"
        "    {'name': 'machine.r', 'from': 130 * u.mm, 'to': '170 mm'}]}).sweep(workers=1)\nswept"
    )
    check_words(result)
    row = result.answers.loc["peak(crank_torque)"]
    assert row["unit"] == "N.m" and row["least"] < row["study"] < row["largest"]
    assert row["largest"] == result.dataset["peak(crank_torque)"].max()
    check_figure(notebook("swept.figures['curves']"), "machine.r [m]")


def test_a_search(notebook):
    result = notebook(
        "best = Study(optimize={'objectives': ['peak(crank_torque)'], 'starts': 1,\n"
        "    'free': {'r': {'min': 0.12, 'max': 0.2}, 'crank.m': {'min': '10 kg', 'max': '200 kg'}},\n"
        "    'limits': {'range(rocker.psi)': {'min': '16 deg'}}}).optimize()\nbest"
    )
    check_words(result)
    assert (
        result.met
        and result.answers.loc["peak(crank_torque)", "best"]
        < result.answers.loc["peak(crank_torque)", "today"]
    )
    assert result.answers.loc["r", "unit"] == "m" and notebook("best.study")
    check_figure(notebook("best.figures['best-torque']"), "crank angle [deg]", "torque at the crank [N m]")


def test_a_watched_recording(notebook):
    machine = "\n".join(f"{name} = {value}" for name, value in TRUTH["machine"].items())
    head, _, rest = MILL.partition("[machine]")
    text = f"{head}[machine]\n{machine}\n[motor]{rest.partition('[motor]')[2].partition('[identify]')[0]}"
    watch = EXAMPLES / "identification" / "watch.csv.gz"
    text = text.replace("processing_force = 50", "processing_force = 40")
    Path("watch.toml").write_text(f"{text}\n[watch]\nfile = {json.dumps(str(watch))}\n", "utf-8")
    result = notebook("seen = Study.from_file('watch.toml').watch()\nseen")
    check_words(result)
    assert result.answers.loc["left.material_mass", "value"] == pytest.approx(30.0, abs=1.0)
    watched = notebook("seen.watched")
    assert watched["imbalance.feed"].dims == ("time",) and watched["imbalance.feed"].units == "kg"
    assert watched.time.units == "s" and watched.time.values[-1] - watched.time.values[0] > 100.0
    axes = notebook("seen.watched['imbalance.feed'].plot()[0].axes")
    assert "[s]" in axes.get_xlabel() and "[kg]" in axes.get_ylabel()
    check_figure(notebook("seen.figures['imbalance']"), "time [s]")
    assert len(notebook("seen.alarms")) == 1


def test_an_identified_machine(notebook):
    first, _, rest = MILL.partition("[[identify.run]]")
    sensors = (
        "[[identify.sensor]]"
        + rest.partition("[[identify.sensor]]")[2].partition("[[identify.parameter]]")[0]
    )
    loaded = EXAMPLES / "identification" / "loaded.csv.gz"
    run = f"[[identify.run]]\nname = 'loaded'\nfile = {json.dumps(str(loaded))}\n"
    sought = ("feed.left.material_mass", "feed.right.material_mass")
    parameters = "".join(f"[[identify.parameter]]\nname = '{name}'\nfrom = 5\nto = 70\n" for name in sought)
    Path("mill.toml").write_text(f"{first}{run}{sensors}{parameters}", "utf-8")
    result = notebook("mill = Study.from_file('mill.toml').identify()\nmill")
    check_words(result)
    assert list(result.answers.index) == list(sought) and set(result.answers["unit"]) == {"kg"}
    check_figure(notebook("mill.figures['course-loaded']"), "crank angle [deg]", "current [A]")


def test_every_public_name_was_used(study):
    """A new name of the package needs a cell here."""
    cells = Path(__file__).read_text("utf-8")
    beside = {"EMPTY", "ChamberForces", "__version__", "SideLoads"}
    kinds = {type(value).__name__ for value in study.values}
    for name in set(chainunit.__all__) - beside:
        value = getattr(chainunit, name)
        is_error = isinstance(value, type) and issubclass(value, Exception)
        assert is_error or name in kinds or f"{name}(" in cells, name


def test_warnings_are_texts(study):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        study(
            "with warnings.catch_warnings():\n    warnings.simplefilter('always')\n    study.export('mill.fmu')"
        )
    assert any("Not in it: the events jam_left" in str(each.message) for each in caught)
