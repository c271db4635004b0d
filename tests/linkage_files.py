"""The public reference machines as tables of a linkage file."""

from __future__ import annotations

import json
import re
from pathlib import Path

from chainunit.machines.linkages.file import description_of
from chainunit.machines.linkages.model import machine_of

MACHINES = {
    each["description"]["name"]: each
    for each in json.loads((Path(__file__).parent / "data" / "linkages.json").read_text())["machines"]
}
"""Made by an independent constrained-multibody solution in 50-digit arithmetic."""


def tables(d):
    """The file of a described machine, joints by name, all masses as numbers."""
    links = {
        b["name"]: {
            "points": {**b["points"]},
            "mass": b["mass"],
            "inertia": b["inertia"],
            "centroid": b["centroid"],
            "masses": {m["point"]: m["mass"] for m in d["masses"] if m["body"] == b["name"]},
        }
        for b in d["bodies"]
    }
    joints = {}
    for j in d["joints"]:
        more = {key: j[key] for key in ("toward", "angle") if key in j}
        joints[j["name"]] = {"type": j["type"], "on": ".".join(j["on"]), "by": ".".join(j["by"]), **more}
    loads = {
        each["name"]: {"type": each["type"], "on": ".".join(each["on"]), "force": each["force"]}
        for each in d["loads"]
    }
    start = {"phi": d["start"]["value"], "poses": d["start"]["poses"]}
    return {
        "title": d["title"], "ground": d["ground"], "driver": {"link": d["driver"]["body"]}, "links": links,
        "joints": joints, "loads": loads, "start": start,
    }  # fmt: skip


def pressed_both_ways(folder: Path) -> Path:
    """The press of the gallery with the loads of its reference machine, forces that never change: a file in a
    folder."""
    text = (Path(__file__).parents[1] / "examples" / "linkages" / "slider_crank_press.toml").read_text(
        "utf-8"
    )
    before, _, behind = text.partition("[loads.pressing]")
    text = before + '[loads.pressing]\non = "ram.T"\nforce = ["150 N", "press_force"]\n\n[start]'
    text = re.sub("pressing_way = .*\n", "", text).replace('"20 kN"', '"2.5 kN"')
    file = folder / "slider_crank_press.toml"
    file.write_text(text + behind.partition("[start]")[2], "utf-8")
    return file


def model(name):
    return machine_of(description_of(tables(MACHINES[name]["description"]), name))


def expected(state):
    """The outputs at a reference state, by the names of the machine's outputs."""
    for ours, theirs in (
        ("tau_bias_dphi", "dtau_bias_dphi"), ("tau_bias_dw", "dtau_bias_dw"),
        *((same, same) for same in "tau J tau_bias dJ_dphi kinetic_energy potential_energy load_power".split()),
    ):  # fmt: skip
        yield ours, state[theirs]
    yield "dissipated_power", state["dissipated_power"] - state["load_power"]
    for group in ("reactions", "guides", "bodies"):
        for name, values in state.get(group, {}).items():
            for key, value in values.items():
                yield f"{name}.{key}", value
    for name, values in state["points"].items():
        link, point = name.split(".")
        for key, value in zip("x y vx vy ax ay".split(), values, strict=True):
            yield f"{link}.{'centroid' if point == 'cg' else point}.{key}", value
