"""A report as blocks: every renderer shows the same numbers, a figure is drawn for page and print from one
description, and no renderer knows a study."""

from __future__ import annotations

import ast
import io
import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from records import like
from reports import at, plotly_figure, screen_of
from rich.console import Console

import chainunit.report
from chainunit.reading.text import DEFAULT_UNITS, chosen_units
from chainunit.report import blocks as b
from chainunit.report import figure as fig
from chainunit.report import html, print_figures, runs, terminal
from chainunit.report.lines import Aside, Number, Strong, Words, join, line
from chainunit.report.markdown import markdown
from chainunit.report.motion import Animation, Arrow, Clip, DrawnLink, Reading, pictures
from chainunit.report.reported_result import ResultFigure

RESULT = {
    "speed": {"value": 314.159, "unit": "rad/s", "kind": "speed"},
    "power": {"value": 2200.0, "unit": "W"},
    "torque": {"value": [1461.0, None], "unit": "N.m"},
    "used": {"value": 1.31, "unit": "1", "kind": "used"},
    "band": {"value": 2.0, "unit": "1", "kind": ""},
    "band_from": {"value": 1.0, "unit": "1"},
    "band_to": {"value": 3.0, "unit": "1"},
    "words": "the *motor* <b>",
    "warnings": ["too hot", {"text": "too slow"}],
    "notes": ["assumed"],
    "run": {
        "crank_speed": {"value": 3.0, "unit": "rad/s", "kind": "speed"},
        "turns": {"value": 2.0, "unit": "1"},
    },
}
S = b.Source(RESULT)
VALUES = tuple(
    b.GivenValue(f"run.{name}", name, S.number(f"run.{name}", as_given=True), origin)
    for name, origin in (("crank_speed", "file"), ("turns", "declared"))
)


def curve(name="a line", **more):
    x = np.linspace(0.0, 1.0, 50)
    return fig.Curve(name, x, np.sin(6.0 * x), **more)


def a_figure(*items, **more):
    panel = fig.Panel(fig.Axis("speed", "rad/s", "speed"), fig.Axis("torque", "N.m"), items or (curve(),))
    return fig.Figure("one", "One figure", "A line.", ((panel,),), file="one.png", **more)


def a_report(units=DEFAULT_UNITS):
    share = b.Share(S.number("used", over=True), line(S.number("power"), " of ", S.number("power")))
    blocks = (
        b.Judgement("partly", line("It turns at ", S.number("speed"), ".")),
        b.Judgement("remark", Strong("Was this meant?"), items=(S.words("words"),)),
        b.Cards((b.Card("power", ((S.number("power"), "peak"),), (line("also ", S.number("speed")),)),)),
        b.Table(
            (
                b.TableRow(("first", S.number("torque", 0), share), note="because"),
                b.TableRow(("second", S.number("torque", 1, none="none"), ""), form="long"),
            ),
            (b.Column("row"), b.Column("a long head", "short"), b.Column("used", form="long")),
            title=line("At ", S.number("speed", as_given=True)),
            note_title="why",
        ),
        b.Text(line(S.number("band"), Aside(line(S.number("band_from"), " to ", S.number("band_to"))))),
        *(b.Judgement("warning", S.words(f"warnings.{place}")) for place in ("0", "1.text")),
        b.Text(S.words("notes.0"), "note"),
        b.Text("fine", "fine", "long"),
        b.Given((("Run", VALUES),)),
        a_figure(),
    )
    sections = (b.Section("answer", "The answer", blocks), b.Section("none", "Empty", ()))
    return b.Report("A title", "kind", RESULT, (), sections, units=units)


def told(report, **more):
    out = io.StringIO()
    terminal.show(report, Console(file=out, width=120, markup=False), **more)
    return out.getvalue()


def test_every_renderer_shows_the_same_numbers():
    text, page, document = told(a_report()), html.render(a_report()), markdown(a_report(), ["one.png"])
    plain = re.sub(r"<[^>]*>", "", page[: page.index("<script")]).replace("\u00a0", " ").replace("\u202f", "")
    # cards and the shares of a limit are of the long form
    for each, short in (
        ("314 rad/s", True),
        ("3000 rev/min", True),
        ("1461 N m", True),
        ("2.20 kW", False),
        ("131 %", False),
    ):
        assert each in plain and each in document and (each in text) == short, each
    for messages in (text, plain, document.replace("\\", "")):
        assert (
            "too hot" in messages
            and "too slow" in messages
            and "assumed" in messages
            and "because" in messages
        )
        assert (
            "2.00" in messages
            and "1.00 to 3.00" in messages
            and "the *motor* <b>" in messages.replace("&lt;b&gt;", "<b>")
        )
    assert "second" in plain and "second" not in text and "a long head" in plain and "short" in text
    assert "![One figure](one.png)" in document and "](one.png)" not in markdown(a_report(), [])
    assert "\\<b\\>" in document and "the *motor* &lt;b&gt;" in page
    # what is wrong stands last, next to the prompt; an empty section has no heading
    assert text.rstrip().splitlines()[-3:] == ["Warning: too hot", "Warning: too slow", "Note: assumed"]
    assert "Empty" not in page.partition("<script")[0] and "Empty" not in document


def test_each_number_of_a_page_names_its_place():
    page = html.render(a_report())
    places = re.findall(r'data-path="([^"]*)" value="([^"]*)"', page)
    assert {path for path, _ in places} >= {"speed", "power", "torque.value.0", "torque.value.1", "band_from"}
    for path, value in places:
        node = at(RESULT, path)
        assert json.loads(value) == (node["value"] if isinstance(node, dict) else node)


def test_what_the_file_does_not_give_is_marked():
    page, document = html.render(a_report()), markdown(a_report(), [])
    assert page.count('<abbr class="from" title="the program&#x27;s default">d</abbr>') == 1
    assert "Not in the study file: d: the program's default." in page and "t: tuned" not in page
    rows = [line for line in document.splitlines() if line.startswith("| run.")]
    assert rows[0].endswith("| file |") and rows[1].endswith("| declared |")


def test_a_remark_that_was_printed_before_is_not_repeated():
    remark = "Remark: the *motor* <b>"
    assert told(a_report()).count(remark) == 1 and remark not in told(a_report(), remarks=False)


@pytest.mark.parametrize("count", [3, 200, 5000])
def test_one_screen_counts_the_rows_that_it_leaves_out(count):
    """Rows of the long form alone are none of it; a long table is printed a few times, not once for each row."""
    rows = [b.TableRow((f"row {k}", S.number("power"))) for k in range(count)]
    hidden = [b.TableRow(("of the page", ""), form="long")] * 7
    table = b.Table((*rows, *hidden), (b.Column("row"), b.Column("power")))
    lines = screen_of(b.Report("A title", "kind", RESULT, (), (b.Section("answer", "", (table,)),)))
    shown = sum("row " in line for line in lines if line.startswith("│"))
    left = sum(int(number) for line in lines for number in re.findall(r"^[.]{3} and (\d+) more rows$", line))
    assert shown + left == count and len(lines) <= 45 and "of the page" not in "".join(lines)


@pytest.mark.second
@pytest.mark.parametrize("text_of", [screen_of, lambda report: terminal.brief(report, 0).splitlines()])
def test_a_long_table_is_printed_a_few_times_to_find_its_room(text_of, monkeypatch):
    """On one screen and in a notebook alike, and not once for each row that is left out."""
    printed, show = [], terminal._show_table
    monkeypatch.setattr(terminal, "_show_table", lambda *args: printed.append(args) or show(*args))
    rows = tuple(b.TableRow((f"row {k}", S.number("power"))) for k in range(1000))
    table = b.Table(rows, (b.Column("row"), b.Column("power")))
    lines = text_of(b.Report("A title", "kind", RESULT, (), (b.Section("answer", "", (table,)),)))
    (left,) = (int(line.split()[2]) for line in lines if re.fullmatch(r"[.]{3} and \d+ more rows", line))
    assert sum("row " in line for line in lines if line.startswith("│")) + left == 1000 and left < 990
    assert len(printed) <= 12


def test_a_notebook_draws_a_figure_once(monkeypatch):
    figure, drawn, draw = ResultFigure(a_figure(), DEFAULT_UNITS), [], ResultFigure.to_matplotlib
    monkeypatch.setattr(ResultFigure, "to_matplotlib", lambda self: drawn.append(self) or draw(self))
    ways = (
        getattr(figure, f"_repr_{kind}_", None)
        for kind in ("html", "png", "svg", "jpeg", "pdf", "mimebundle")
    )
    shown = [way() for way in ways if way is not None]
    assert len(shown) == len(drawn) == 1 and shown[0].startswith(b"\x89PNG")


def test_the_chosen_units_are_everywhere():
    units = chosen_units({"speed": "rev/min", "power": "W", "torque": "kN.m"})
    report = a_report(units)
    text, page, document = told(report), html.render(report), markdown(report, [])
    for messages in (text, page.replace("\u00a0", " ").replace("</span>", ""), document):
        assert "rad/s" not in re.sub(r'title="[^"]*"', "", messages.partition("<script")[0])
    assert "3000 rev/min" in text and "1.46 kN m" in text and "2200 W" in document
    axes = plotly_figure(a_figure(), units).layout
    assert axes.xaxis.title.text == "speed [rev/min]" and axes.yaxis.title.text == "torque [kN m]"
    drawn = plotly_figure(a_figure(), units).data[0]
    assert drawn.x[-1] == pytest.approx(30.0 / np.pi) and np.max(drawn.y) == pytest.approx(1e-3, rel=1e-2)


ITEMS = (
    curve("a line", look=2),
    curve("points", marker="o", has_line=False),
    fig.Between("between", [0.0, 1.0], [0.0, 0.0], [0.5, 1.0]),
    fig.Shade(0.2, 0.4, "shade"),
    fig.Shade(0.2, 0.4, "lying shade", "y"),
    fig.Mark(0.5, "mark", "here"),
    fig.Mark(0.5, "lying mark", axis="y"),
    fig.Label(0.5, 0.5, "a label"),
)


def test_a_figure_is_drawn_for_page_and_print_from_one_description(tmp_path, monkeypatch):
    field = fig.Field(
        [0.0, 1.0], [0.0, 1.0], np.array([[0.0, 2.0], [1.0, np.nan]]), (-1.0, 0.5, 3.0), ("low", "high"), 0.5
    )
    axis = fig.Axis("x")
    bars = fig.Bars("bars", [0, 1], [3.0, 4.0], 0.4, 3, words=("three", "four"))
    panels = (
        (fig.Panel(axis, fig.Axis("y"), ITEMS, "all"), fig.Panel(axis, fig.Axis("map"), (field,))),
        (fig.Panel(axis, fig.Axis("y", log=True, low=1e-3, high=1.0), (curve(),)), None),
        (fig.Panel(fig.Axis("size", "N", low=0.0), fig.Axis("pin", names=("A", "B")), (bars,)), None),
    )
    figure = fig.Figure("many", "Many", "Everything.", panels, file="many.png")
    drawn = plotly_figure(figure, DEFAULT_UNITS)
    names = [trace.name for trace in drawn.data if trace.showlegend]
    reference = {
        "a line",
        "points",
        "between",
        "shade",
        "lying shade",
        "mark",
        "lying mark",
        "low",
        "high",
        "bars",
    }
    # each name once, though two panels have the line
    assert sorted(names) == sorted(reference)
    assert {"here", "a label", "<b>all</b>"} <= {each.text for each in drawn.layout.annotations}
    # the panels of a column that share an axis have one cursor
    assert {trace.xaxis for trace in drawn.data if trace.name == "a line"} == {"x"}
    assert (
        drawn.layout.hoversubplots == "axis"
        and figure.sharing(0, 0) == [0, 1]
        and figure.sharing(2, 0) == [2]
    )
    legends = []
    legend = print_figures._legend

    def keep(drawing, *rest):
        legend(drawing, *rest)
        legends.append({text.get_text() for text in drawing.legends[0].get_texts()})

    monkeypatch.setattr(print_figures, "_legend", keep)
    (file,) = print_figures.write([figure, fig.Figure("page", "", "", panels)], tmp_path, DEFAULT_UNITS)
    assert file.name == "many.png" and file.read_bytes().startswith(b"\x89PNG")
    assert legends == [reference]


def test_a_scale_that_panels_share_holds_all_of_them(tmp_path, monkeypatch):
    """One end of it given: the other is that of the largest panel, not of the first."""
    axes = fig.Axis("x"), fig.Axis("y", low=0.0)
    small, large = (fig.Panel(*axes, (fig.Curve("c", [0.0, 1.0], [0.0, top]),)) for top in (1.0, 10.0))
    seen = []
    monkeypatch.setattr(print_figures, "_legend", lambda drawing, axes, columns: seen.extend(axes.flat))
    figure = fig.Figure("two", "", "", ((small, large),), file="two.png", level=True)
    print_figures.write([figure], tmp_path, DEFAULT_UNITS)
    assert [axis.get_ylim() for axis in seen] == [(0.0, pytest.approx(10.5))] * 2
    assert plotly_figure(figure, DEFAULT_UNITS).layout.yaxis2.matches == "y"


def test_a_curve_that_hardly_changes_is_not_on_the_edge(tmp_path, monkeypatch):
    curve = fig.Curve("c", [0.0, 1.0], [899.0, 900.0])
    panel, seen = fig.Panel(fig.Axis("x"), fig.Axis("y", low=0.0), (curve,)), []
    monkeypatch.setattr(print_figures, "_legend", lambda drawing, axes, columns: seen.extend(axes.flat))
    figure = fig.Figure("one", "", "", ((panel,),), file="one.png")
    print_figures.write([figure], tmp_path, DEFAULT_UNITS)
    assert seen[0].get_ylim()[1] > 1.02 * 900.0


def test_curves_over_the_same_points_are_thinned_together():
    x = np.linspace(0.0, 1.0, 5001)
    straight, bent = fig.Curve("straight", x, x), fig.Curve("bent", x, np.abs(x - 0.3))
    other = fig.Curve("other", x.copy(), x)
    drawn = plotly_figure(a_figure(straight, bent, other), DEFAULT_UNITS).data
    assert [len(trace.x) for trace in drawn] == [3, 3, 2]
    assert drawn[0].x[1] == pytest.approx(0.3, abs=1e-6)


def test_what_moves_is_played_as_it_is():
    turn = np.linspace(0.0, 2.0 * np.pi, 50)
    crank = {"O": (0.0, 0.0), "A": (np.sin(turn), np.cos(turn))}
    clip = Clip(
        "turn",
        "a turn",
        0.1 * turn,
        crank,
        (Reading("Speed", np.full(50, 10.0), "rad/s", "speed"),),
        (Arrow("bearing", "O", 0.0 * turn, 10.0 + turn),),
        still=0.3,
    )
    moving = Animation((DrawnLink("crank", ("O", "A"), "crank"),), ("O",), (clip,), 0.6)
    played = json.loads(json.dumps(pictures(moving, chosen_units({"speed": "rev/min"}))))
    (run,) = played["runs"]
    assert run["joints"]["O"] == {"x": [0], "y": [0]} and len(run["joints"]["A"]["x"]) == 50
    assert np.hypot(run["joints"]["A"]["x"], run["joints"]["A"]["y"]) == pytest.approx(1.0, abs=1e-4)
    assert run["readings"] == [{"title": "Speed", "unit": "rev/min", "values": [pytest.approx(95.49)]}]
    assert run["forces"][0]["y"][-1] == pytest.approx(10.0 + 2.0 * np.pi, rel=1e-3)
    assert run["time"][run["still"] - 1] < 0.3 <= run["time"][run["still"]]


def test_lines():
    assert line("a", ("b", "c"), Aside("d")) == ("a", "b", "c", Aside("d"))
    assert join(["a", ("b", "c")], "; ") == ("a", "; ", "b", "c") and join([]) == ()
    speed = S.number("speed", as_given=True)
    assert speed == Number(314.159, "rad/s", "speed", "speed", as_given=True)
    assert S.number("power", digits=5).digits == 5
    words = S.words("words")
    assert words == "the *motor* <b>" and isinstance(words, Words) and words.path == "words"


RENDERERS = (
    "blocks figure files html lines linkage markdown motion".split()
    + "page_figures print_figures style terminal".split()
)


@pytest.mark.parametrize("name", RENDERERS)
def test_nothing_that_renders_knows_a_study(name):
    folder = Path(chainunit.report.__file__).parent
    tree = ast.parse((folder / f"{name}.py").read_text("utf-8"))
    imported = {
        (node.level, node.module or alias.name)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    own = {module for level, module in imported if level == 1}
    beyond = {module.split(".")[0] for level, module in imported if level == 2}
    assert own <= set(RENDERERS)
    assert beyond <= {"core", "reading", "__version__", "mechanism"}
    assert ("mechanism" in beyond) == (name == "linkage")


@pytest.mark.parametrize("grouped", [False, True])
@pytest.mark.parametrize("width", [66, 80, 100, 120])
def test_a_table_on_a_narrow_terminal_keeps_its_right_edge_and_its_numbers_whole(grouped, width):
    source = b.Source({name: {"value": 0.00431, "unit": "kg.m2"} for name in "abc"})
    rows = (
        b.TableRow((f"inertia {n} of the machine", *[source.number(n)] * 3), note="in the start-up")
        for n in "abc"
    )
    table = b.Table(
        tuple(rows),
        b.heads("inertia", *["a head of many words"] * 3),
        "Inertias",
        note_title="because of it",
        groups=((1, 2), (3,)) if grouped else (),
    )
    report = b.Report("A title", "kind", {}, (), (b.Section("answer", "The answer", (table,)),))
    out = io.StringIO()
    terminal.show(report, Console(file=out, width=width, markup=False))
    drawn = [line for line in out.getvalue().splitlines() if line[0] in "┏┃┡│└"]
    assert drawn and all(line[-1] in "┓┃┩│┘" and len(line) <= width for line in drawn), out.getvalue()
    # at 66 letters three numbers with their units do not stand beside each other: a unit goes to the next line
    text = out.getvalue()
    assert (width == 66 and not grouped) or text.count("0.00431 kg m²") == 9, text
    assert text.count("0.00431") == 9 and text.count("machine") == (3 if text.count("Inertias") == 1 else 6)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("Warning: short (in brackets).", "Warning: short (in brackets)."),
        (
            "Warning: Bars in compression, where a chain goes slack: start-up (web mean pull -325 N, wall -12 N).",
            "Warning: Bars in compression, where a chain goes slack: start-up.",
        ),
        (
            "Warning: No motor of the catalogue fits (2 of 2 were tried; see below): the motor of 1.1 kW is near.",
            "Warning: No motor of the catalogue fits: the motor of 1.1 kW is near.",
        ),
        (
            "Warning: No motor of the catalogue fits (2 of 2 were tried; see below): the nearest is one of 1.1 kW.",
            "Warning: No motor of the catalogue fits: the nearest is one of 1.1 kW.",
        ),
        (
            "Warning: The speed does not return to its steady band within the time followed: the rocker is blocked.",
            "Warning: The speed does not return to its steady band within the time followed.",
        ),
        (
            "Warning: Crank speed too high for the rocker torque of two bars, which may be off by more than 10 %.",
            "Warning: Crank speed too high for the rocker torque of two bars.",
        ),
        (
            "Warning: Steady running: the crank makes 0.283 of a turn in the 9.69 s that are evaluated; so.",
            "Warning: Steady running: the crank makes 0.283 of a turn in the 9.69 s that ...",
        ),
        ("Warning: " + "word " * 20, "Warning: " + "word " * 13 + "..."),
    ],
)
def test_a_warning_is_cut_at_the_end_of_a_clause(text, line):
    assert terminal.cut(text, 79) == line


def test_markdown_has_the_lines_below_the_numbers_of_a_card():
    card = b.Card(
        "crank torque",
        ((Number(40.0, "N.m"), "peak"),),
        (line("overload: peak ", Number(194.0, "N.m"), ", a lump"),),
    )
    cards = (card, b.Card("motor", (("IE3", "chosen"),)))
    document = markdown(b.Report("T", "k", {}, (b.Cards(cards),), ()), [])
    assert "| Crank torque | 40.0 N m | peak |" in document
    assert document.count("\n- ") == 1 and "\n- Crank torque: overload: peak 194 N m, a lump\n" in document


@pytest.mark.parametrize(
    ("largest", "label", "shown"), [(2.1e6, "force [kN]", 2100.0), (900.0, "force [N]", 900.0)]
)
def test_an_axis_has_the_unit_of_its_largest_value(largest, label, shown):
    """All curves of one axis have one unit, and so have equal axes and the level panels of a row; a unit that the
    reader chose stays."""

    def panel(size, name="force"):
        return fig.Panel(
            fig.Axis("time", "s"), fig.Axis(name, "N"), (fig.Curve("", [0.0, 1.0], [0.0, size]),)
        )

    figure = fig.Figure("f", "f", "f", ((panel(largest), panel(5.0)), (panel(5.0, "pull"), None)))
    (first, second), (third, _) = fig.in_units(figure, DEFAULT_UNITS).panels
    assert [each.y.label for each in (first, second, third)] == [label, label, "pull [N]"]
    for each, size in ((first, shown), (second, 5.0 * shown / largest), (third, 5.0)):
        np.testing.assert_allclose(each.items[0].y, [0.0, size])
    row = replace(figure, panels=((panel(largest), panel(5.0, "pull")),), level=True)
    assert fig.in_units(row, DEFAULT_UNITS).panels[0][1].y.label == label.replace("force", "pull")
    chosen = fig.in_units(figure, chosen_units({"force": "N"})).panels[0]
    assert [each.y.label for each in chosen] == ["force [N]", "force [N]"]


@pytest.mark.parametrize("width", range(24, 60))
def test_no_line_of_a_screen_ends_between_a_number_and_its_unit(width):
    """The line after "heat 82.3" held "%." alone."""
    words = "Chosen: heat 82.3 %, 4.28 kg m² and 1.25 kN m at 5 A; 29.3 rad/s (280 rev/min)."
    out = io.StringIO()
    console = Console(file=out, markup=False, highlight=False, width=width)
    report = b.Report("", "kind", RESULT, (), (b.Section("answer", "", (b.Text(words, central=True),)),))
    terminal.screen(report, console, "")
    printed = out.getvalue()
    assert printed.split() == words.split()
    for whole in ("82.3 %", "4.28 kg m²", "1.25 kN m", "5 A", "29.3 rad/s", "280 rev/min"):
        assert whole in printed


@pytest.mark.parametrize("coupling", [None, 1304.0])
def test_the_worst_overload_is_without_a_limiter_only_if_there_is_none(monkeypatch, coupling):
    """The column of 1891 N m, with a limiter that trips, stood below "without torque limiter"."""
    monkeypatch.setattr(runs, "by_side", lambda runs, answers: ["steady", "surge"])
    study = like(
        overloads=["surge"],
        proposal=object(),
        insufficient="",
        config=SimpleNamespace(coupling=coupling),
        title_of=lambda run: run,
        titles={"surge": "rock rises"},
        answers={"surge": SimpleNamespace(crank_torque_peak=1891.0)},
    )
    monkeypatch.setattr(runs.run_names, "title", lambda runs, run: runs.titles[run])
    table = b.Table((b.TableRow(("peak", "1", "2")),), b.heads("", "steady", "surge"))
    title = runs._beside_the_worst(study, table).title
    bare = " (without torque limiter)" if coupling is None else ""
    assert title == f"Steady running beside the worst overload{bare}: rock rises"


def test_a_table_is_cut_to_a_form_and_to_columns():
    """Rows and columns of other forms go, and the places of groups follow the columns that stay."""
    columns = (
        b.Column("pin"),
        b.Column("peak"),
        b.Column("in", form="short"),
        b.Column("in the run", form="long"),
    )
    rows = (
        b.TableRow(("A", "1 N", "jam", "a jam on the left")),
        b.TableRow(("B", "2 N", "stop", "a stop"), form="long"),
    )
    table = b.Table(rows, columns, groups=((1, 2), (3,)))
    short, long = (table.of_form(form) for form in ("short", "long"))
    assert [row.cells for row in short.rows] == [("A", "1 N", "jam")] and short.groups == ((1, 2), ())
    assert [row.cells[0] for row in long.rows] == ["A", "B"] and long.groups == ((1,), (2,))
    assert [column.title for column in long.columns] == ["pin", "peak", "in the run"]
    assert table.of_columns([0, 3]).rows[1].cells == ("B", "a stop") and table.width == 4
    report = b.Report("", "report", {}, (table,), (b.Section("pins", "Pins", (b.Tables((table,)),)),))
    assert report.blocks("short") == [short]
    assert report.blocks("long") == [long, b.Tables((long,))]
    text = markdown(report, [])
    assert "jam |" not in text and text.count("a stop") == 2
