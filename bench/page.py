"""Writes docs/evidence.md from bench/figures.json, the figures that the benches print.

`python bench/page.py` writes the page. `python bench/page.py --measure` runs all benches before that but for the
identification, which takes an hour and a half, and `--measure states accuracy` those that are named; the figures of
the others stay.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import identification
import observer
from figures import table

HERE = Path(__file__).parent
FIGURES = HERE / "figures.json"
DOCS = HERE.parent / "docs"
BENCHES = (
    "states",
    "step_cost",
    "study_time",
    "accuracy",
    "chain_speed",
    "monte_carlo",
    "sweep_time",
    "cosim_memory",
    "observer",
)
LONG = ("identification",)
"""Benches that run only where they are named."""


def millions(x: float) -> str:
    return f"{1e-6 * x:.2f}" if x < 1e7 else f"{1e-6 * x:.1f}"


def large(x: float) -> str:
    """A rate in full, to three digits."""
    digits = len(str(int(x)))
    return f"{round(x, 3 - digits):,.0f}"


def small(x: float | None) -> str:
    return "" if x is None else f"{x:.1e}"


def threads_of(row: dict[str, Any]) -> str:
    return str(row["threads"])


def limit_of(row: dict[str, Any]) -> tuple[float, str]:
    """The lower limit of a row, and its kind."""
    limits = {"arithmetic": row["arithmetic"]}
    if "memory" in row:
        limits["memory"] = row["memory"]
    kind = min(limits, key=limits.__getitem__)
    return limits[kind], kind


def goals(f: Any) -> str:
    rows = []
    for each in f["states"]["goals"]:
        big = each["demanded"] > 1e3
        number = (
            (lambda x: f"{millions(x)} million")
            if big
            else (lambda x: f"{x:.2g}" if x < 1e-3 else f"{x:.0f}")
        )
        met = "yes" if each["met"] else "**no**"
        sign = "at most" if each["demanded"] < 1e-3 else "at least"
        rows.append([each["goal"], f"{sign} {number(each['demanded'])}", number(each["measured"]), met])
    return table(["goal", "demanded", "measured", "met"], rows)


def own_rates(f: Any) -> str:
    s, rows = f["states"], []
    by_key = {row["key"]: row for row in s["rows"]}
    for row in s["rows"]:
        if "arithmetic" in row and (row["threads"] < s["cores"] or row["states"] < 1e6):
            continue
        line = [row["work"], f"{row['states']:,}", threads_of(row), millions(row["rate"])]
        if "arithmetic" in row:
            limit, kind = limit_of(row)
            line += [f"{millions(limit)} ({kind})", f"{row['rate'] / limit:.2f}"]
        else:
            limit = by_key["all" if row["work"].startswith("Machine") or "all" in row["key"] else "chosen"][
                "arithmetic"
            ]
            line += [f"{millions(limit)} (arithmetic)", f"{row['rate'] / limit:.3f}"]
        rows.append(line)
    head = ["work", "states of a call", "threads", "million states/s", "limit", "share"]
    return table(head, rows)


def engines(f: Any) -> str:
    s, rows = f["states"], []
    fastest = {}
    for row in s["rows"]:
        name = row["key"].split()[0]
        engine = {"chosen": "native", "numpy": "numpy"}.get(name)
        if engine and (name != "numpy" or "chosen" in row["key"]):
            fastest[engine] = max(fastest.get(engine, row), row, key=lambda each: each["rate"])
    best = fastest["native"]["rate"]
    limit = max(row["arithmetic"] for row in s["rows"] if row["key"] == "chosen")

    def line(name: str, row: Any, errors: Any) -> list[str]:
        share, faster = row["rate"] / limit, best / row["rate"]
        return [
            name, threads_of(row), large(row["rate"]), f"{share:.1e}" if share < 0.01 else f"{share:.2f}",
            large(faster) if faster > 10.0 else f"{faster:.1f}",
            *(small(errors.get(key)) for key in ("loop", "torque", "energy")),
        ]  # fmt: skip

    for engine, row in fastest.items():
        rows.append(line(engine, row, s["errors"][engine.split()[0]]))
    rows += [line(row["engine"], row, row) for row in s["others"]]
    head = [
        "engine",
        "threads",
        "evaluations/s",
        "of the limit",
        "native is faster",
        "joints, m",
        "torque",
        "energy",
    ]
    works = dict.fromkeys(f"- {row['engine']}: {row['work']}" for row in s["others"])
    return table(head, rows) + "\nAn evaluation is\n\n" + "\n".join([WORK.format(**s), *works]) + "\n"


WORK = "- native, numpy: {chosen} outputs, the torques and all reactions, stored"


def missing(f: Any) -> str:
    absent = f["states"]["missing"]
    return " ".join(f"{name} {why}." for name, why in absent.items()) + ("\n" if absent else "")


def notes(f: Any) -> str:
    """What the numbers of other engines need to be understood."""
    rows = {row["engine"]: row for row in f["states"]["others"]}
    lines = []
    if {"mjx", "mujoco"} <= rows.keys() and rows["mjx"]["torque"] > 100.0 * rows["mujoco"]["torque"]:
        lines.append(
            "MJX leaves the rate of the constraints' Jacobian out of the accelerations, which MuJoCo has: hence its "
            "deviation of the torque. Along a turn the constraints correct themselves."
        )
    if "pylinkage" in rows:
        lines.append(
            f"The places of pylinkage deviate from ours by at most {small(rows['pylinkage']['place'])} m."
        )
    return "\n".join(lines)


def step_rows(f: Any) -> str:
    us = f["step_cost"]["us"]
    whole = "set + step + get all outputs"
    rows = [
        ("native `ChamberForces` from C (limit: 1.5 times the next row)", f"native FMU from C, {whole}"),
        ("the generated equations alone, from C", "bare generated kernel, all outputs, from C"),
        ("the same FMU through fmpy (limit: the next row)", f"native FMU through fmpy, {whole}"),
        ("an empty native FMU through fmpy", "an empty native FMU through fmpy, set + step + get"),
        ("the Python FMU through fmpy (limit: the next row)", f"python FMU through fmpy, {whole}"),
        ("its printed equations alone, one point", "kernel, all outputs, printed Python, one point"),
        ("the equations as they are written, in Python, one point", "kernel, all outputs, math, one point"),
        ("the equations with numpy, per point of 10,000", "kernel, all outputs, numpy, per point of 10,000"),
    ]
    return table(["call", "us"], ([text, f"{us[key]:.3g}"] for text, key in rows))


def accuracy_rows(f: Any) -> str:
    rows, before = [], None
    for each in f["accuracy"]:
        if each["force"] or (
            not each["slopes"] and (each["step"] != 0.001 or not each["title"].startswith("direct"))
        ):
            continue
        title = each["title"] if each["slopes"] else "the same with the slopes of the load port set to zero"
        orders = [order or "" for order in each["orders"]]
        rows.append([
            "" if title == before else title, f"{1e3 * each['step']:g} ms", small(each["torque"]), orders[0],
            small(each["speed"]), orders[1], small(each["energy"]),
        ])  # fmt: skip
        before = title
    return table(["", "step", "crank torque", "order", "speed", "order", "energy residual"], rows)


def reached(c: Any) -> str:
    """The communication steps that reach the rate that is demanded."""
    steps = [f"{1e3 * r['step']:g} ms" for r in c["rows"] if r["rate"] >= c["demanded"]]
    return " and ".join(steps) or "no length"


def sweep(f: Any) -> str:
    w = f["sweep_time"]
    row = [
        f"{w['points']:,}", f"{w['points'] * w['angles']:.1e}", f"{w['whole']:.1f}", f"{w['loop']:.1f}",
        f"{w['loop'] / w['whole']:.2f}", f"{w['memory']:.0f}",
    ]  # fmt: skip
    return table(
        ["points", "states", "s", "limit: the native loop alone, s", "share", "largest memory, MB"], [row]
    )


def evidence(f: Any) -> str:
    """What was checked against what, with the speed, the accuracy and the trials that the benches measured."""
    s, us = f["states"], f["step_cost"]["us"]
    faster = (
        us["python FMU through fmpy, set + step + get all outputs"]
        / us["native FMU through fmpy, set + step + get all outputs"]
    )
    m, c, t = f["monte_carlo"], f["chain_speed"], f["study_time"]
    memory = {w["way"]: f"{w['memory']:.0f}" for w in f["cosim_memory"]["ways"]}
    return (HERE / "evidence.md").read_text("utf-8").format(
        cores=s["cores"], processor=s["processor"], chosen=s["chosen"], all=s["all"], goals=goals(f),
        rates=own_rates(f), engines=engines(f), missing=missing(f), notes=notes(f),
        outputs=small(max(each["outputs"] for each in s["errors"].values())),
        points=s["points"]["points"], values=s["points"]["values"], worst=small(s["points"]["worst"]),
        steps=step_rows(f), faster=large(faster), size=f"{f['step_cost']['size']['native'] / 1000:.0f}",
        study=f"{t['study']:.0f}", again=f"{t['again']:.0f}",
        importing=f"{t['importing']:.1f}", allowed=f"{t['allowed']:.0f}", accuracy=accuracy_rows(f),
        rods=c["rods"], speed=f"{c['speed']:g}", error=f"{c['error']:g}", demanded=f"{c['demanded']:g}",
        reached=reached(c),
        exudyn="exudyn was not installed." if c["exudyn"] is None else
        f"the FMU is {c['exudyn']:.0f} times as fast as exudyn; {c['demanded_exudyn']:g} times are demanded.",
        ratio=large(m["compiled"] / m["cosimulation"]),
        thousand=f"{1e3 / m['compiled']:.1f}", difference=small(max(m["differences"].values())),
        seconds=f"{f['cosim_memory']['seconds']:.0f}", whole=memory["all rows, in memory"],
        file=memory["all rows, to a file"], libraries=memory["a second"],
        sweep=sweep(f), sweep_angles=f["sweep_time"]["angles"],
        sweep_parameters=f["sweep_time"]["parameters"], sweep_quantities=f["sweep_time"]["quantities"],
        **identification.tables(f["identification"]), **observer.tables(f["observer"]),
    )  # fmt: skip


PAGES = {"evidence.md": evidence}


def measure(names: Sequence[str], file: Path) -> None:
    """Run these benches, and put their figures into the file."""
    own = json.loads(file.read_text("utf-8")) if file.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            print(f"-- {name}", flush=True)
            made = Path(folder) / f"{name}.json"
            subprocess.run([sys.executable, HERE / f"{name}.py", "--json", made], check=True)
            own[name] = json.loads(made.read_text("utf-8"))
    ordered = {name: own[name] for name in (*BENCHES, *LONG) if name in own}
    file.write_text(json.dumps(ordered, indent=1) + "\n", "utf-8")


def main() -> None:
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument(
        "--measure", nargs="*", choices=(*BENCHES, *LONG), metavar="BENCH", help="run benches before"
    )
    options.add_argument("--figures", type=Path, default=FIGURES, help="file of the figures")
    options.add_argument("--docs", type=Path, default=DOCS, help="folder of the page")
    given = options.parse_args()
    if given.measure is not None:
        measure(given.measure or BENCHES, given.figures)
    figures = json.loads(given.figures.read_text("utf-8"))
    for name, page in PAGES.items():
        (given.docs / name).write_text(page(figures), "utf-8")


if __name__ == "__main__":
    main()
