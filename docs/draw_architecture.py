"""Draws docs/architecture.svg from the imports of the package; `imports` serves the test of their direction, too."""

from __future__ import annotations

import ast
from collections import Counter
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "src" / "chainunit"
DRAWING = Path(__file__).with_name("architecture.svg")
LAYERS = (
    ("app",),
    ("capabilities",),
    ("report",),
    ("recordings",),
    ("study",),
    ("system",),
    ("drives", "machines"),
    ("mechanism",),
    ("groups",),
    ("work", "reading"),
    ("core",),
)
"""From above to below; a package imports from its own row and from the rows below. `fmu` stands beside them on
`core`, and serves `system` and all above."""
HOMES = {
    "__main__": "app",
    "models": "system",
    "batch": "core",
}
"""Layer of a module or folder whose name is not that of its layer; any other module beside the folders is `core`."""


def layer(module: str) -> str:
    """The layer of a module, by its path below the package: ``groups.chain`` -> ``groups``."""
    first = module.split(".")[0]
    if first in HOMES:
        return HOMES[first]
    return first if (PACKAGE / first).is_dir() else "core"


def admitted(above: str, below: str) -> bool:
    """Whether a module of the one layer may import from the other."""
    rows = {name: k for k, row in enumerate(LAYERS) for name in row}
    if above == below:
        return True
    if above == "fmu":
        return below == "core"
    if below == "fmu":
        return rows[above] <= rows["system"]
    return rows[above] <= rows[below]


def imports() -> set[tuple[str, str]]:
    """Pairs of modules of the package, importing and imported, wherever in the module the import stands."""
    return _imports(PACKAGE)


@cache
def _imports(package: Path) -> set[tuple[str, str]]:
    pairs = set()
    for file in sorted(package.rglob("*.py")):
        parts = file.relative_to(package).with_suffix("").parts
        if parts == ("__init__",):
            continue  # the names for users, which are loaded when they are needed
        name = ".".join(p for p in parts if p != "__init__")
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            pairs |= {(name, target) for target in _targets(node, parts) if target}
    return pairs


def _targets(node: ast.AST, parts: tuple[str, ...]) -> list[str]:
    """The modules of the package that a statement in the file `parts` imports; empty for the package itself."""
    if isinstance(node, ast.Import):
        paths = [alias.name.split(".") for alias in node.names]
        return [".".join(path[1:]) for path in paths if path[0] == PACKAGE.name]
    if not isinstance(node, ast.ImportFrom):
        return []
    base = node.module.split(".") if node.module else []
    if node.level:
        base = [*parts[: len(parts) - node.level], *base]
    elif base.pop(0) != PACKAGE.name:
        return []
    return [".".join([*base, alias.name] if _is_module(base, alias.name) else base) for alias in node.names]


def _is_module(base: list[str], name: str) -> bool:
    inner = PACKAGE.joinpath(*base, name)
    return inner.is_dir() or inner.with_suffix(".py").exists()


TEXTS = {
    "app": "the commands, and studies from Python",
    "capabilities": "one folder for each question: table, analysis, section, command",
    "report": "tables, page, figures and files of a study",
    "recordings": "recordings of real machines: files, inspection, fit",
    "study": "a file, events, runs, and measures read from the runs",
    "system": "models and FMUs joined by terminals; master, reference, certificate, SSP",
    "machines": "chain unit, knife drive",
    "drives": "motors, gear, shafts, control",
    "mechanism": "any linkage from data: one forward pass, one force pass",
    "groups": "crank, dyad, triad, chain, bodies, friction",
    "work": "jobs, runner, store, progress",
    "reading": "tables, numbers and texts, as people write them",
    "core": "quantities, model, engines, batches, vectors of the plane, load port, integrators, printers, files",
    "fmu": "any model as an FMU",
}
WAYS = {
    "a parameter": ("#0b6fa4", ("machines", "core", "study", "fmu", "system", "report")),
    "a torque": ("#b3400c", ("groups", "mechanism", "machines", "fmu", "system", "drives", "study")),
    "an event": ("#4b7f35", ("study", "system", "fmu", "machines", "study", "report")),
}
"""The stations of each way, as docs/architecture.md tells them."""

_LEFT, _WIDTH, _HEIGHT, _STEP, _TOP = 170, 640, 54, 84, 60
_FMU = (_LEFT + _WIDTH + 60, 240)


def _box(name: str) -> tuple[float, float, float, float]:
    """Left, top, width and height of the box of a layer."""
    if name == "fmu":
        top = _box("machines")[1]
        return _FMU[0], top, _FMU[1], _box("groups")[1] + _HEIGHT - top
    (row,) = (k for k, names in enumerate(LAYERS) if name in names)
    names = LAYERS[row]
    wide = _FMU[0] + _FMU[1] - _LEFT if name == "core" else _WIDTH
    width = (wide - 20 * (len(names) - 1)) / len(names)
    return _LEFT + names.index(name) * (width + 20), _TOP + row * _STEP, width, _HEIGHT


def _layer_box(name: str) -> list[str]:
    x, y, width, height = _box(name)
    middle = y + (height / 2 if name == "fmu" else 0)
    return [
        f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="5" fill="#f4f4f2" stroke="#555"/>',
        f'<text x="{x + 12:g}" y="{middle + 22:g}" font-weight="bold">{name}</text>',
        f'<text x="{x + 12:g}" y="{middle + 42:g}" font-size="12">{TEXTS[name]}</text>',
    ]


def _arrow(above: str, below: str, count: int) -> str:
    """An arc for the imports of one layer from another; red where they run upward."""
    colour = "#999" if admitted(above, below) else "#d00000"
    width = min(0.8 + 0.08 * count, 3.0)
    (x1, y1, _, h1), (x2, y2, w2, h2) = _box(above), _box(below)
    if "fmu" in (above, below):
        end = (x2 + w2 / 2, y2) if below == "fmu" else (x1 + 30, y2)
        start = (_LEFT + _WIDTH, y1 + h1 / 2) if below == "fmu" else (x1 + 30, y1 + h1)
        path = f"M {start[0]:g} {start[1]:g} Q {end[0]:g} {start[1]:g} {end[0]:g} {end[1]:g}"
    else:
        a, b = y1 + 0.65 * h1, y2 + 0.35 * h2
        out = _LEFT - 0.24 * abs(b - a) - 10
        path = f"M {_LEFT} {a:g} C {out:g} {a:g} {out:g} {b:g} {_LEFT} {b:g}"
    return f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width:g}" marker-end="url(#tip)"/>'


def _way(k: int, name: str) -> list[str]:
    """The numbered stations of a way and the line through them."""
    colour, stations = WAYS[name]
    places: dict[str, list[str]] = {}
    for number, station in enumerate(stations, 1):
        places.setdefault(station, []).append(str(number))

    def centre(station: str) -> tuple[float, float]:
        x, y, width, height = _box(station)
        right = _LEFT + _WIDTH if station == "core" else x + width
        return right - 36 * (len(WAYS) - k) + 12, y + (28 if station == "fmu" else height / 2 - 10)

    points = " ".join("{:g},{:g}".format(*centre(station)) for station in stations)
    marks = [f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.6" opacity="0.55"/>']
    for station, numbers in places.items():
        x, y = centre(station)
        marks += [
            f'<rect x="{x - 15:g}" y="{y - 9:g}" width="30" height="18" rx="9" fill="{colour}"/>',
            f'<text x="{x:g}" y="{y + 4:g}" text-anchor="middle" font-size="11" fill="white">'
            f"{','.join(numbers)}</text>",
        ]
    return marks


def drawing() -> str:
    """The house as SVG: a box for each layer, an arc for the imports between two, a line for each way."""
    links = Counter((layer(a), layer(b)) for a, b in imports() if layer(a) != layer(b))
    width, height = _FMU[0] + _FMU[1] + 30, _TOP + len(LAYERS) * _STEP
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" font-family="sans-serif" '
        'font-size="15">',
        '<defs><marker id="tip" markerWidth="7" markerHeight="7" refX="6" refY="3" orient="auto" '
        'markerUnits="userSpaceOnUse"><path d="M0,0 L6,3 L0,6 z" fill="#777"/></marker></defs>',
        f'<rect width="{width:g}" height="{height:g}" fill="white"/>',
        f'<text x="{_LEFT}" y="34" font-size="13">Grey arcs: imports, thicker for more of them. Numbered: '
        "the way of</text>",
    ]
    for k, (name, (colour, _)) in enumerate(WAYS.items()):
        lines.append(
            f'<text x="{_LEFT + 420 + 110 * k}" y="34" font-size="13" font-weight="bold" '
            f'fill="{colour}">{name}</text>'
        )
    lines += [_arrow(above, below, n) for (above, below), n in sorted(links.items())]
    for name in TEXTS:
        lines += _layer_box(name)
    for k, name in enumerate(WAYS):
        lines += _way(k, name)
    return "\n".join([*lines, "</svg>"]) + "\n"


if __name__ == "__main__":
    DRAWING.write_text(drawing(), "utf-8")
