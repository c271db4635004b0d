"""The loads of a linkage file, and the tables that they know."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

from ...core import units
from ...core.errors import InputError, meant, near_name, shown
from ...core.inputs import cells_of, file_text, lines_of_table
from ...mechanism.assur import GROUND, PRISMATIC, REVOLUTE
from ...mechanism.expressions import expression
from .entries import FEWER, MOST_POINTS, NameUnits, is_among, is_given, within
from .joint_kinds import kind_of
from .names import name_fault
from .parameters import ParameterReader

LOADS = {
    "force": ("type", "on", "force"),
    "follower": ("type", "on", "force"),
    "torque": ("type", "on", "torque"),
    "spring": ("type", "on", "by", "stiffness", "length", "damping"),
}
"""Keys of each type of load."""
_OF_LINK: NameUnits = {"phi": "rad", "w": "rad/s", "angle": "rad", "angle_rate": "rad/s"}
_OF_FORCE: NameUnits = {**_OF_LINK, "x": "m", "y": "m", "vx": "m/s", "vy": "m/s"}
_OWN = re.compile(r"\b(min|max|stroke)\(\s*(x|y|angle)\s*\)")
_THOUSANDS = re.compile(r"\s*[+-]?[1-9]\d{0,2},\d{3}\s*")
"""A number whose comma may stand between thousands."""
Column = tuple[list[float], str | None]
"""The values of a column of a table in SI units, and their unit."""
_HEADING = re.compile(r"\s*([^\[(]*?)\s*(?:[\[(]\s*(.*?)\s*[\])])?\s*")


class LoadReader(ParameterReader):
    """The reader of loads and tables."""

    def __init__(self, data: Mapping[str, Any], name: str, folder: Path) -> None:
        super().__init__(data, name)
        self.folder = folder

    def unit_of_place(self) -> str | None:
        """The unit of the place of the first driver: it slides in a guide, or turns; None if its joint is no such
        joint."""
        name, joints = self.table("driver").get("joint"), self.table("joints")
        if name is None:
            return "rad"
        if is_among(name, joints):
            kind = kind_of(joints[name]) if isinstance(joints[name], Mapping) else None
            return {PRISMATIC: "m", REVOLUTE: "rad"}.get(str(kind))
        links = [link.get("points") for link in self.table("links").values() if isinstance(link, Mapping)]
        pins = [pin for points in links if isinstance(points, Mapping) for pin in points]
        # of three links in a pin each further one has a joint that is named by the pin and the link
        return "rad" if any(name == pin or str(name).startswith(f"{pin}_") for pin in pins) else None

    # tables

    def curves(self) -> dict[str, Any]:
        """Tables over the coordinate, and over a quantity that a load gives."""
        curves = {}
        for name, key, table in self.tables("tables", ("phi", "x", "value", "file")):
            self.refused.add(name)
            with self.at(key):
                over = "phi" if "phi" in table else "x"
                (abscissas, of_x), (values, of_value) = self.columns(key, table, over)
                turns = over == "phi" and of_x == "rad" and "range" not in self.table("driver")
                if any(b <= a for a, b in pairwise(abscissas)):
                    raise InputError(f"{over} must rise" + ", within less than one turn" * turns)
                if turns and abscissas[-1] - abscissas[0] >= 2.0 * math.pi:
                    raise InputError("phi must rise, within less than one turn: the table repeats itself")
                self.sizes[name] = len(abscissas)
                curves[name] = {"over": over, "places": abscissas, "values": values}
                if over == "phi":
                    self.table_units[name] = of_value
                self.curve_units[name] = of_x, of_value
                if not name_fault(name):
                    self.refused.discard(name)
        return curves

    def columns(self, key: str, table: Mapping[str, Any], over: str) -> tuple[Column, Column]:
        """The places and the values of a table, each with its unit: from its lists, or from the CSV file that it
        names. `over` is phi or x.

        Raises
        ------
        InputError
            in one line, for lists of different or few numbers.
        """
        if "file" in table:
            if {"phi", "x", "value"} & table.keys():
                raise InputError("has file and lists: the file gives both columns; take one of both out")
            return self.columns_of_file(table["file"])
        least = 3 if over == "phi" else 2
        places, values = table.get(over), table.get("value")
        if (
            not isinstance(places, list)
            or not isinstance(values, list)
            or not least <= len(places) == len(values)
        ):
            raise InputError(
                f"must have {over} and value, two lists of one length, of {least} or more, or file, a CSV file"
            )
        if len(places) > MOST_POINTS:
            raise InputError(f"has {len(places)} points; {FEWER}")
        unit = self.unit_of_place() if over == "phi" else None
        if unit is None:
            return self.like(places), self.like(values)
        return ([self.number(key, x, unit) for x in places], unit), self.like(values)

    def like(self, entries: list[Any]) -> Column:
        """Values of one unit, that of the first one."""
        _, unit = self.with_unit(entries[0], None)
        if unit is None:
            return [self.with_unit(x, None)[0] for x in entries], None
        return [self.number("", x, unit) for x in entries], unit

    def columns_of_file(self, name: Any) -> tuple[Column, Column]:
        """The two columns of a CSV file beside the linkage file, with units in a heading ("way [mm], force [kN]")."""
        if not isinstance(name, str):
            raise InputError(f"file is {shown(name)}; must be the name of a CSV file with two columns")
        file = self.folder / name
        text = lines_of_table(file, file_text(file))
        lines = [line for line in text if line.strip() and not line.lstrip().startswith("#")]
        if len(lines) > MOST_POINTS + 1:
            raise InputError(f"{name}: has {len(lines)} rows; {FEWER}")
        mark = next((mark for mark in ";\t" if any(mark in line for line in lines)), ",")
        rows = cells_of(name, lines, mark)
        if wrong := next((k for k, row in enumerate(rows, 1) if len(row) != 2), None):
            raise InputError(
                f"{name}: row {wrong} has {len(rows[wrong - 1])} columns; each row must have two columns, x "
                "and value"
            )
        column_units: list[str | None] = [None, None]
        scales = [1.0, 1.0]
        if rows and any(_number(cell) is None for cell in rows[0]):
            for k, head in enumerate(rows.pop(0)):
                match = _HEADING.fullmatch(head)
                if match and match[2]:
                    scales[k], column_units[k] = self.with_unit(f"1 {match[2]}", None)
        if len(rows) < 2:
            raise InputError(f"{name}: must have two or more rows of numbers")
        commas = [cell for row in rows for cell in row if "," in cell]
        points = any("." in cell for row in rows for cell in row)
        if commas and (mark == "," or points or all(map(_THOUSANDS.fullmatch, commas))):
            raise InputError(
                f"{name}: {shown(commas[0])} is not clear, as its comma may stand between thousands or before "
                "decimals; write all numbers with a decimal point and without marks between thousands"
            )
        columns: tuple[list[float], list[float]] = ([], [])
        for place, row in enumerate(rows, 1):
            for k, cell in enumerate(row):
                value = _number(cell)
                if value is None or math.isnan(value):
                    # what begins as no number may be of a file that is no table
                    cited = f" {shown(cell)}" if cell.lstrip()[:1] in (*"+-.0123456789",) else ""
                    raise InputError(f"{name}: row {place} of numbers, column {k + 1}:{cited} is no number")
                columns[k].append(within(value * scales[k], cell))
        return (columns[0], column_units[0]), (columns[1], column_units[1])

    # loads

    def load(self, name: str) -> dict[str, Any]:
        """A load by its name: its kind, its point or link, both ends of a spring, and force or torque as numbers or
        expressions; with faults, a part of this."""
        key = f"loads.{name}"
        table = self.table(key, self.table("loads"))
        kind = table.get("type", "force")
        if not is_among(kind, LOADS):
            self.fault(f"{key}.type", f"is {shown(kind)}{meant(str(kind), LOADS)} must be {', '.join(LOADS)}")
            return {}
        self.keys(key, table, LOADS[kind])
        load: dict[str, Any] = {"name": name, "type": kind}
        if kind == "torque":
            on = table.get("on")
            if not is_among(on, self.points) or on == GROUND:
                self.fault(f"{key}.on", f"{is_given(on)}; must be a link{near_name(str(on), self.points)}")
            else:
                load["on"] = [on]
        else:
            for end in ("on", "by") if kind == "spring" else ("on",):
                with self.at(f"{key}.{end}"):
                    load[end] = self.end(table.get(end))
                    if kind != "spring" and load[end][0] == GROUND:
                        raise InputError("acts on the ground; give a point of a link")
        if kind == "spring":
            self.spring(key, table, load)
        elif "on" in load:
            motion = {**(_OF_LINK if kind == "torque" else _OF_FORCE), **self.table_units}
            unit = self.unit_of_place()
            motion |= {"phi": unit, "w": unit and f"{unit}/s"}
            if kind == "torque":
                torque = _placed(table.get("torque"), load["on"])
                load["torque"] = self.entry(f"{key}.torque", torque, "N.m", motion, True)
            else:
                force = _placed(table.get("force"), load["on"])
                load["force"] = self.vector(f"{key}.force", force, "N", motion, True)
            entries = load["force"] if kind != "torque" else [load["torque"]]
            with self.at(key):
                self.count(*(expression(entry) for entry in entries if isinstance(entry, str)))
        return load

    def spring(self, key: str, table: Mapping[str, Any], load: dict[str, Any]) -> None:
        """Add stiffness, length and damping of a spring."""
        if "stiffness" not in table and "damping" not in table:
            self.fault(key, "has neither stiffness nor damping; give one of them, or take the spring out")
        if "stiffness" in table and "length" not in table:
            self.fault(
                f"{key}.length",
                'is missing; must be the length at which the spring has no force, such as "200 mm", or 0 for one '
                "that pulls at every length",
            )
        for quantity, unit in (("stiffness", "N/m"), ("length", "m"), ("damping", "N.s/m")):
            entry = table.get(quantity, 0.0)
            load[quantity] = self.positive(f"{key}.{quantity}", entry, unit, inputs=True)

    def end(self, entry: Any) -> list[str]:
        """A point of a link, as "link.point" or a list of two."""
        if entry is None:
            raise InputError('is missing; must be a link and its point, such as "rod.A"')
        parts = entry.split(".") if isinstance(entry, str) else entry
        if not isinstance(parts, list) or len(parts) != 2 or not all(isinstance(x, str) for x in parts):
            raise InputError(f'is {shown(entry)}; must be a link and its point, such as "rod.A"')
        link, point = parts
        if link not in self.points:
            raise InputError(f"is {shown(entry)}; {link} is no link{near_name(link, self.points)}")
        if point not in self.points[link]:
            points = ", ".join(self.points[link]) or "none"
            raise InputError(
                f"is {shown(entry)}; {point} is no point of {link}{meant(point, self.points[link])} its points: "
                f"{points}"
            )
        return [link, point]


def _placed(entry: Any, place: list[str]) -> Any:
    """An expression, or a list of some, in which extremes of the load's own place have the name of this place."""
    if isinstance(entry, list):
        return [_placed(component, place) for component in entry]
    if not isinstance(entry, str):
        return entry
    return _OWN.sub(lambda m: f"{m[1]}({'.'.join([place[0]] if m[2] == 'angle' else place)}.{m[2]})", entry)


def _number(cell: str) -> float | None:
    try:
        return float(units.with_point(cell.strip()) or cell)
    except ValueError:
        return None
