"""Linkages whose driver swings, as tables of a file: a double rocker, and six-bars of Watt and Stephenson."""

from __future__ import annotations

import copy


def body(points, mass, inertia, centroid):
    return {"points": points, "mass": mass, "inertia": inertia, "centroid": centroid}


DOUBLE_ROCKER = {
    "ground": {"O1": [0.0, 0.0], "O2": [1.0, 0.1]},
    "driver": {"link": "crank", "range": ["20 deg", "75 deg"]},
    "links": {
        "crank": body({"O1": [0, 0], "A": [0.6, 0]}, 5.0, 0.2, [0.3, 0.02]),
        "coupler": body({"A": [0, 0], "B": [0.5, 0], "P": [0.2, 0.15]}, 4.0, 0.1, [0.2, 0.04]),
        "rocker": body({"O2": [0, 0], "B": [0.6, 0]}, 6.0, 0.3, [0.3, -0.05]),
    },
    "loads": {"pull": {"on": "coupler.P", "force": [120.0, -400.0]}},
    "start": {"phi": "60 deg", "points": {"B": [0.8, 0.65]}},
}
"""No link turns round: the longest and the shortest are together longer than both others."""

_WATT_LINKS = {
    **{name: copy.deepcopy(link) for name, link in DOUBLE_ROCKER["links"].items()},
    "arm": body({"P": [0, 0], "F": [0.7, 0]}, 3.0, 0.12, [0.35, 0.0]),
    "leg": body({"R": [0, 0], "F": [0.6, 0], "T": [0.8, 0.1]}, 2.5, 0.09, [0.4, 0.03]),
}
_WATT_LINKS["rocker"]["points"]["R"] = [0.75, 0.1]
WATT = {
    **DOUBLE_ROCKER,
    "links": _WATT_LINKS,
    "loads": {"pull": {"on": "leg.T", "force": [150.0, -300.0]}},
    "start": {"phi": "60 deg", "points": {"B": [0.8, 0.65], "F": [0.7, 1.4]}},
}
"""A second dyad hangs on coupler and rocker (Watt I)."""

_STEPHENSON_LINKS = {
    **{name: copy.deepcopy(link) for name, link in DOUBLE_ROCKER["links"].items()},
    "arm": body({"P": [0, 0], "F": [0.9, 0]}, 3.0, 0.12, [0.35, 0.0]),
    "leg": body({"O3": [0, 0], "F": [0.7, 0], "T": [0.8, 0.1]}, 2.5, 0.09, [0.4, 0.03]),
}
STEPHENSON = {
    **DOUBLE_ROCKER,
    "ground": {**DOUBLE_ROCKER["ground"], "O3": [-0.2, 1.2]},
    "links": _STEPHENSON_LINKS,
    "loads": {"pull": {"on": "leg.T", "force": [150.0, -300.0]}},
    "start": {"phi": "60 deg", "points": {"B": [0.8, 0.65], "F": [0.1, 1.5]}},
}
"""A second dyad hangs on coupler and ground (Stephenson III)."""

CLOCKWISE = {
    **WATT,
    "driver": {**WATT["driver"], "zero": "95 deg", "positive": "clockwise"},
    "start": {**WATT["start"], "phi": "35 deg"},
}
"""The same six-bar with an angle that counts the other way."""

ALL = {"double_rocker": DOUBLE_ROCKER, "watt": WATT, "stephenson": STEPHENSON, "clockwise": CLOCKWISE}


def with_range(data, span):
    """The same with another range of the driver; None for one that turns all the way round."""
    driver = {key: value for key, value in data["driver"].items() if key != "range"}
    return {**data, "driver": driver if span is None else {**driver, "range": span}}
