# %% [markdown]
# What the tests notice
#
# Changes one operator, number or result at a time in a copy of the tree and runs the tests on it: first those close
# to the changed module by their imports. The mutants that these do not notice then meet the other tests of the fast
# stage (what `pytest` runs), and those left over the second stage (what `.ci/run` adds), all in one tree: a test that
# fails there is run on each of them alone. A mutant that no test notices is a gap in the tests; one that the second
# stage alone notices is what the fast stage leaves to `.ci/run`.
#
# The mutants are drawn by a seed, as many of each module; the results are lines of a file, so that a run that was
# stopped goes on where it ended, and a greater `--count` adds to what is there.
#
#     python bench/mutation.py --count 200 --results mutants.jsonl
#     python bench/mutation.py --results mutants.jsonl --show

# %%
from __future__ import annotations

import argparse
import ast
import contextlib
import copy
import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = Path("src/chainunit")
MODULES = (
    "core/quantities.py",
    "core/integrators.py",
    "core/units.py",
    "batch/evaluate.py",
    "groups/chain.py",
    "groups/triad.py",
    "groups/followed.py",
    "groups/tetrad.py",
    "groups/block.py",
    "groups/joints.py",
    "groups/dyad.py",
    "groups/loads.py",
    "mechanism/assur.py",
    "mechanism/machine.py",
    "machines/chain_unit.py",
    "drives/dc_motor.py",
    "drives/contactor.py",
    "drives/induction_motor.py",
    "drives/induction_steady.py",
    "drives/cardan.py",
    "system/simulation.py",
    "system/graph.py",
    "study/cycle_quantities.py",
    "study/events.py",
    "capabilities/sizing/preference.py",
    "capabilities/sizing/protection.py",
)
"""The modules that most of the others rest on, and those that decide what a study recommends."""
FAST, SECOND = "not slow and not second", "second and not slow"
NEAR = 1
"""Steps of imports from a test file to a module that it is close to; more where no file has so few."""

# %% [markdown]
# ## Mutants

# %%
COMPARED = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
REVERSED = {ast.Lt: ast.Gt, ast.LtE: ast.GtE, ast.Gt: ast.Lt, ast.GtE: ast.LtE}
COMPUTED = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """One change: the bytes `begin` to `end` of a module become `after`."""

    module: str
    line: int
    kind: str
    begin: int
    end: int
    before: str
    after: str

    @property
    def key(self) -> str:
        """The same change of the same place has the same key, as long as the module stays as it is before it."""
        text = "\0".join((self.module, str(self.begin), self.before, self.after))
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def changes(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """Every change of a node, by its kind."""

    def changed(kind: str, **fields: object) -> tuple[str, ast.AST]:
        other = copy.copy(node)
        for name, value in fields.items():
            setattr(other, name, value)
        return kind, other

    match node:
        case ast.Compare(ops=[op]):
            yield changed("bound", ops=[COMPARED[type(op)]()])
            if type(op) in REVERSED:
                yield changed("comparison", ops=[REVERSED[type(op)]()])
        case ast.BinOp(op=op) | ast.AugAssign(op=op) if type(op) in COMPUTED:
            yield changed("arithmetic", op=COMPUTED[type(op)]())
        case ast.BoolOp(op=op):
            yield changed("logic", op=ast.Or() if isinstance(op, ast.And) else ast.And())
        case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand) if not isinstance(operand, ast.Constant):
            yield "sign", operand
        case ast.Constant(value=bool(value)):
            yield changed("constant", value=not value)
        case ast.Constant(value=int(value)):
            yield changed("constant", value=value + 1)
        case ast.Constant(value=float(value)):
            yield changed("constant", value=1.5 * value if value else 1.0)
        case ast.Return(value=ast.expr() as value) if not (
            isinstance(value, ast.Constant) and value.value is None
        ):
            yield changed("result", value=ast.Constant(None))
        case ast.IfExp(test=test):
            yield changed("condition", test=ast.UnaryOp(ast.Not(), test))
        case _:
            pass


def computed(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a tree that compute something: no annotation, no type, nothing for type checkers alone, and no
    text, whose inner places Python 3.11 does not tell."""
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "type_comment"):
            continue
        for child in value if isinstance(value, list) else [value]:
            told = isinstance(child, ast.AST) and not isinstance(
                child, ast.JoinedStr | ast.Raise | ast.Assert
            )
            typing = isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test)
            alias = isinstance(child, ast.Assign) and isinstance(child.value, ast.Subscript | ast.BinOp) and any(
                isinstance(target, ast.Name) and target.id[:1].isupper() and not target.id.isupper()
                for target in child.targets
            )  # fmt: skip
            if told and not typing and not (alias and isinstance(node, ast.Module)):
                yield from computed(child)


def mutants(module: str) -> list[Mutant]:
    """Every change of a module, by its place."""
    source = (ROOT / PACKAGE / module).read_bytes()
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found = []
    for node in computed(ast.parse(source)):
        for kind, other in changes(node):
            begin = starts[node.lineno - 1] + node.col_offset  # type: ignore[attr-defined]
            end = starts[node.end_lineno - 1] + node.end_col_offset  # type: ignore[attr-defined]
            # as one line, in brackets: the places of all that is before and behind it stay
            text = ast.unparse(other)
            after = f"({text})" if isinstance(node, ast.expr) else text
            found.append(Mutant(module, node.lineno, kind, begin, end, source[begin:end].decode(), after))  # type: ignore[attr-defined]
    return sorted(found, key=lambda each: (each.begin, each.end, each.after))


def sampled(modules: tuple[str, ...], count: int, seed: int) -> list[Mutant]:
    """As many of each module, in turn; the first of a greater `count` are those of a smaller one."""
    each = {}
    for module in modules:
        each[module] = mutants(module)
        random.Random(f"{seed} {module}").shuffle(each[module])
    turns = [each[m][n] for n in range(max(map(len, each.values()))) for m in modules if n < len(each[m])]
    return turns[:count]


# %% [markdown]
# ## The tests of a module


# %%
def imported(file: Path, name: str) -> set[str]:
    """Modules of the package that a file imports anywhere, by their dotted names behind ``chainunit``; other files of
    the tests by their own names."""
    found = set()
    package = name.split(".")[:-1]
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*base, *([node.module] if node.module else [])])
            found |= {source} | {f"{source}.{alias.name}" for alias in node.names}
    return found


@cache
def graph() -> dict[str, set[str]]:
    """Which module or test file imports which; a package stands for its ``__init__``."""
    files = {}
    for file in (ROOT / PACKAGE).rglob("*.py"):
        parts = ("chainunit", *file.relative_to(ROOT / PACKAGE).with_suffix("").parts)
        files[".".join(parts)] = file
    files |= {file.stem: file for file in (ROOT / "tests").rglob("*.py")}
    names = {name.removesuffix(".__init__"): name for name in files}
    return {
        name: {names[other] for other in imported(file, name) if other in names}
        for name, file in files.items()
    }


def distances(module: str) -> dict[str, int]:
    """Test files by their steps of imports to a module; one with its name is at 0. The conftest counts for none."""
    edges = graph()
    backwards: dict[str, set[str]] = {}
    for name, others in edges.items():
        for other in others:
            backwards.setdefault(other, set()).add(name)
    target = ".".join(("chainunit", *Path(module).with_suffix("").parts))
    steps, waiting = {target: 0}, deque([target])
    while waiting:
        name = waiting.popleft()
        for other in backwards.get(name, ()):
            if other not in steps and other != "conftest":
                steps[other] = steps[name] + 1
                waiting.append(other)
    places = {file.stem: file.relative_to(ROOT).as_posix() for file in (ROOT / "tests").rglob("test_*.py")}
    found = {places[name]: n for name, n in steps.items() if name in places}
    named = f"test_{Path(module).stem}"
    return found | ({places[named]: 0} if named in places else {})


# %% [markdown]
# ## Runs


# %%
@dataclass(frozen=True)
class Outcome:
    """What pytest said of a run: the first test that failed, or none, and all that did; a run without end counts as
    noticed."""

    failed: str
    seconds: float
    tests: tuple[str, ...] = ()


class Bench:
    """A copy of the tree, and the runs of its tests."""

    def __init__(self, folder: Path, workers: int, allowed: float) -> None:
        self.tree, self.workers, self.allowed = folder / "tree", workers, allowed
        self.is_sound = False
        """whether the tests ran without a mutant; one may break the import of the package"""
        skipped = shutil.ignore_patterns(
            ".git", ".venv", "__pycache__", ".*_cache", ".hypothesis", "results", "build", "dist"
        )
        shutil.copytree(ROOT, self.tree, ignore=skipped)
        # a mutant's code is no code of the user's cache, nor does it displace what is there
        self.environment = os.environ | {
            "PYTHONPATH": str(self.tree / "src"), "XDG_CACHE_HOME": str(folder / "cache"), "PYTHONHASHSEED": "0",
        }  # fmt: skip
        (folder / "cache").mkdir(mode=0o700)
        place = subprocess.run(
            [sys.executable, "-c", "import chainunit; print(chainunit.__file__)"],
            env=self.environment, cwd=self.tree, capture_output=True, text=True, check=True,
        )  # fmt: skip
        assert Path(place.stdout.strip()).is_relative_to(self.tree), "the tests would not see a mutant"

    def write(self, module: str, content: bytes) -> None:
        """Change a module. Its compiled form goes, as it may have the same size and second."""
        file = self.tree / PACKAGE / module
        file.write_bytes(content)
        for compiled in (file.parent / "__pycache__").glob(f"{file.stem}.*.pyc"):
            compiled.unlink()

    def run(self, marks: str, files: Sequence[str], workers: int, *, to_the_end: bool = False) -> Outcome:
        """The tests of `files`, or all without any, that have these `marks`, up to the first that fails or to the
        end."""
        options = f"-m pytest -q -p no:cacheprovider --tb=no -rfE -n {workers} --dist loadfile".split()
        report = self.tree.parent / "report.xml"
        report.unlink(missing_ok=True)
        options += ["--junitxml", str(report), "-o", "junit_family=xunit1"]
        command = [sys.executable, *options, *([] if to_the_end else ["-x"]), "-m", marks]
        began = time.perf_counter()
        process = subprocess.Popen(
            [*command, *files], env=self.environment, cwd=self.tree, text=True, start_new_session=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        try:
            # a mutant may run for ever: it shall not take the time of a whole stage
            said, _ = process.communicate(timeout=self.allowed / 12.0 if files else self.allowed)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            return Outcome("no end", time.perf_counter() - began)
        seconds = time.perf_counter() - began
        if process.returncode == pytest.ExitCode.USAGE_ERROR and not self.is_sound:
            sys.exit(said)
        if process.returncode in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
            return Outcome("", seconds)
        tests = tuple(_failed(report)) if report.exists() else ()
        return Outcome(tests[0] if tests else said.strip().splitlines()[-1][:200], seconds, tests)


def _failed(report: Path) -> Iterator[str]:
    """The tests of a report that failed, by the names that pytest takes; a file that cannot be read by its own."""
    for case in ElementTree.parse(report).iter("testcase"):
        if case.find("failure") is not None or case.find("error") is not None:
            file = case.get("file")
            yield (
                f"{file}::{case.get('name')}" if file else f"{(case.get('name') or '').replace('.', '/')}.py"
            )


def without_overlap(chosen: list[Mutant]) -> list[Mutant]:
    """Mutants that can stand in one tree: none lies within another."""
    found: list[Mutant] = []
    for mutant in sorted(chosen, key=lambda each: (each.module, each.begin, each.end)):
        if not found or found[-1].module != mutant.module or found[-1].end <= mutant.begin:
            found.append(mutant)
    return found


@contextlib.contextmanager
def changed(bench: Bench, chosen: list[Mutant]) -> Iterator[None]:
    """These mutants in the tree, none of which lies within another."""
    # the files of the copy: the tree itself may change in the hours that this takes
    sources = {module: (bench.tree / PACKAGE / module).read_bytes() for module in {m.module for m in chosen}}
    try:
        for module, source in sources.items():
            for mutant in sorted(
                (m for m in chosen if m.module == module), key=lambda m: m.begin, reverse=True
            ):
                source = source[: mutant.begin] + mutant.after.encode() + source[mutant.end :]
            bench.write(module, source)
        yield
    finally:
        for module, source in sources.items():
            bench.write(module, source)


def judged(bench: Bench, mutant: Mutant, near: list[str]) -> dict[str, object]:
    """Which stage notices a mutant by the tests near it, and by which test."""
    runs = [("fast", FAST, near)] if near else []
    if some := [name for name in near if "mark.second" in (ROOT / name).read_text("utf-8")]:
        runs += [("second", SECOND, some)]
    seconds = 0.0
    with changed(bench, [mutant]):
        for stage, marks, files in runs:
            outcome = bench.run(marks, files, bench.workers if len(files) != 1 else 0)
            seconds += outcome.seconds
            if outcome.failed:
                return {"stage": stage, "by": outcome.failed, "seconds": round(seconds, 1)}
    return {"stage": "none", "by": "", "seconds": round(seconds, 1)}


def noticed(bench: Bench, marks: str, left: list[Mutant]) -> Iterator[tuple[Mutant, str]]:
    """The mutants that a whole stage notices, each with the test that fails. They stand in one tree until no test
    fails; the tests that fail are run on each alone, which tells whom they notice."""
    while left:
        together = without_overlap(left)
        with changed(bench, together):
            outcome = bench.run(marks, [], bench.workers, to_the_end=True)
        if not outcome.failed:
            left = [mutant for mutant in left if mutant not in together]
            continue
        by_it = {}
        for mutant in together:
            with changed(bench, [mutant]):
                by_it[mutant] = bench.run(marks, outcome.tests, 0).failed if outcome.tests else ""
        found = {mutant: test for mutant, test in by_it.items() if test}
        if not found:
            # only several of them make it fail
            found = {mutant: test for mutant in together if (test := _alone(bench, marks, mutant))}
            left = [mutant for mutant in left if mutant not in together]
        yield from found.items()
        left = [mutant for mutant in left if mutant not in found]


def _alone(bench: Bench, marks: str, mutant: Mutant) -> str:
    with changed(bench, [mutant]):
        return bench.run(marks, [], bench.workers).failed


# %% [markdown]
# ## Results


# %%
def read(file: Path) -> dict[str, dict]:
    """What is known, by the keys of the mutants; a line that a stopped run cut off is none."""
    found = {}
    for line in file.read_text("utf-8").splitlines() if file.exists() else []:
        try:
            row = json.loads(line)
        except ValueError:
            continue
        found[row["key"]] = row
    return found


def show(rows: list[dict]) -> None:
    """A table of the modules, and the mutants that the fast stage does not notice."""
    counts = Counter((row["module"], row["stage"]) for row in rows)
    print(f"{'module':32}{'fast':>6}{'second':>8}{'none':>6}")
    for module in [*sorted({row["module"] for row in rows}), None]:
        cells = [sum(n for (m, s), n in counts.items() if s == stage and module in (m, None)) for stage in
                 ("fast", "second", "none")]  # fmt: skip
        print(f"{module or 'all':32}{cells[0]:6}{cells[1]:8}{cells[2]:6}")
    for stage, words in (
        ("second", "the full run notices, the fast stage does not"),
        ("none", "no test notices"),
    ):
        chosen = [row for row in rows if row["stage"] == stage]
        print(f"\n{len(chosen)} mutants that {words}:")
        for row in sorted(chosen, key=lambda row: (row["module"], row["line"])):
            known = "" if row["whole"] or stage == "second" else " (of the tests near it)"
            before, after = (" ".join(row[name].split())[:70] for name in ("before", "after"))
            by = f" [{row['by']}]" if row["by"] else ""
            print(f"  {row['module']}:{row['line']} {row['kind']}: {before} -> {after}{by}{known}")


def main() -> None:
    options = argparse.ArgumentParser(description="Changes the package and sees which tests notice.")
    options.add_argument("--count", type=int, default=200, help="mutants in all")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--modules", nargs="*", default=MODULES, help="files below src/chainunit")
    options.add_argument(
        "--results", type=Path, required=True, help="JSON lines; what is in it is not run again"
    )
    options.add_argument("--workers", type=int, default=2, help="processes of a run of the tests")
    options.add_argument(
        "--allowed",
        type=float,
        default=1800.0,
        help="seconds of a run of a whole stage; twelve runs of files take as long",
    )
    options.add_argument(
        "--near",
        action="store_true",
        help="only the tests close to a module: quick, but a survivor tells little",
    )
    options.add_argument("--show", action="store_true", help="only show the results that are there")
    given = options.parse_args()
    known = read(given.results)
    chosen = sampled(tuple(given.modules), given.count, given.seed)
    if not given.show:
        with tempfile.TemporaryDirectory(prefix="mutation_") as folder:
            bench = Bench(Path(folder), given.workers, given.allowed)
            closest: dict[str, list[str]] = {}
            for module in dict.fromkeys(m.module for m in chosen if m.key not in known):
                steps = distances(module)
                least = max(NEAR, min(steps.values(), default=NEAR))
                closest[module] = [t for t in sorted(steps, key=lambda t: (steps[t], t)) if steps[t] <= least]
            # a test that fails without a mutant would notice every one
            files = sorted({file for near in closest.values() for file in near})
            marks = FAST if not given.near else "not slow"
            sound = (
                bench.run(marks, files if given.near else [], given.workers) if closest else Outcome("", 0.0)
            )
            if sound.failed:
                sys.exit(f"without a mutant {sound.failed} fails")
            bench.is_sound = True
            print(f"without a mutant all tests pass, in {sound.seconds:.0f} s", flush=True)

            def keep(mutant: Mutant, found: dict[str, object], place: str) -> None:
                row = {"key": mutant.key, **asdict(mutant), **found}
                known[mutant.key] = row
                with given.results.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
                print(
                    f"{place}: {mutant.module}:{mutant.line} {mutant.kind}: {row['stage']} {row['by']} "
                    f"{row['seconds']} s", flush=True,
                )  # fmt: skip

            for n, mutant in enumerate(chosen, 1):
                if mutant.key not in known:
                    found = judged(bench, mutant, closest[mutant.module])
                    keep(mutant, found | {"whole": found["stage"] == "fast"}, f"{n} of {len(chosen)}")
            # what the fast stage notices is settled; the others meet all tests of both stages
            for stage, marks in () if given.near else (("fast", FAST), ("second", SECOND)):
                open_ = [m for m in chosen if not (row := known[m.key])["whole"] and (
                    stage == "fast" or row["stage"] == "none")]  # fmt: skip
                print(f"{len(open_)} mutants meet the whole {stage} stage", flush=True)
                for mutant, failed in noticed(bench, marks, open_):
                    keep(mutant, {"stage": stage, "by": failed, "seconds": 0.0, "whole": True}, stage)
            for mutant in chosen if not given.near else ():
                if not (row := known[mutant.key])["whole"]:
                    keep(mutant, {k: row[k] for k in ("stage", "by", "seconds")} | {"whole": True}, "settled")
    show([known[mutant.key] for mutant in chosen if mutant.key in known])


if __name__ == "__main__":
    main()
