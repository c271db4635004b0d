# %% [markdown]
# # Synthetic recordings of a hidden machine
#
# The script simulates the packaged DC drive with a machine whose masses, friction and feed are hidden, and writes
# what the sensors of its motor would show: with noise, a converter of 12 bits, jitter, a clock that drifts,
# an offset, and a mark at an angle that is not quite 0. The recordings are no measurements of a real machine.
#
# `python make_recordings.py FOLDER` writes loaded.csv.gz, empty.csv.gz, watch.csv.gz and truth.json; by default into
# the folder of the script. The course is that of the monolithic solution, which has nothing but the equations in
# common with the native loops by which `chainunit` fits a recording.

# %%
import json
import sys
from pathlib import Path

import numpy as np
from synthetic import HiddenRun, Logger, synthetic, write_recording

from chainunit.drives.dc_motor import DcMotor
from chainunit.study.config import parse
from chainunit.study.drive import Drive
from chainunit.system import Profile

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
config = parse("")
drive = Drive(DcMotor, config.motor.parameters, config.machine)
speed = 3.0  # of the crank, rad/s

# %% [markdown]
# What is hidden, by the names of a study file. Masses are up to 40 % beside those of the packaged machine.

# %%
machine = {
    "left.wall_mass": 61.3,
    "left.web_mass": 18.4,
    "right.wall_mass": 47.9,
    "right.web_mass": 25.2,
    "crank.m": 44.6,
    "crank.I": 0.52,
    "coupler.m": 22.1,
    "coupler.I": 5.7,
    "rocker.m": 52.8,
    "rocker.I": 9.3,
    "pin.friction": 0.087,
    "joint_damping": 0.94,
}
feed = {
    "left.material_mass": 33.5,
    "right.material_mass": 27.2,
    "left.processing_force": 64.0,
    "right.processing_force": 41.0,
}
empty = dict.fromkeys(feed, 0.0)

# %% [markdown]
# The recording to watch: both sides are fed alike, and after 70 s a fifth of the feed of the right side moves to the
# left one within half a second.

# %%
share, at, within = 0.2, 70.0, 0.5
watched = {}
for load, value in (("material_mass", 30.0), ("processing_force", 50.0)):
    watched[f"left.{load}"] = Profile(value, ((at, within, (1.0 + share) * value),))
    watched[f"right.{load}"] = Profile(value, ((at, within, (1.0 - share) * value),))

# %% [markdown]
# Each run has its own angle and temperature at the start, and its own drift of the clock and offset of the current.

# %%
runs = {
    "loaded": (feed, 60.0, {"drift": 2.3e-5, "offset": 0.021}, {"angle": 1.1, "temperature": 308.0}),
    "empty": (empty, 60.0, {"drift": -1.7e-5, "offset": -0.034}, {"angle": 4.0, "temperature": 296.0}),
    "watch": (watched, 120.0, {"drift": 0.8e-5, "offset": 0.012}, {"angle": 2.6, "temperature": 312.0}),
}
ranges = {"motor.i": 5.0, "motor.u": 250.0, "motor.w": 200.0}
sensors = {"rate": 200.0, "noise": 0.01, "bits": 12, "full": ranges, "jitter": 2e-5, "mark_angle": -0.13}

folder.mkdir(parents=True, exist_ok=True)
truth = {
    "about": "Hidden values of synthetic recordings, no measurements of a real machine; SI units, radians."
}
truth |= {"crank_speed": speed, "machine": machine, "sensors": sensors, "runs": {}}
for seed, (name, (loads, duration, faults, start)) in enumerate(runs.items()):
    values = {f"machine.{key}": x for key, x in (machine | loads).items()}
    run = HiddenRun(speed, duration, values | {"motor.w_ref": speed * drive.ratio}, **start)
    logger = Logger(**sensors, drift=faults["drift"], offset={"motor.i": faults["offset"]})
    recording = synthetic(drive, list(ranges), run, logger, np.random.default_rng(seed), "monolithic")
    write_recording(recording, folder / f"{name}.csv.gz")
    first = {key: getattr(x, "start", x) for key, x in loads.items()}
    truth["runs"][name] = {"feed": first, **faults, **start}
    print(f"{name}.csv.gz: {len(recording.time)} rows, {', '.join(recording.columns)}")
truth["runs"]["watch"]["event"] = {
    "kind": "shift",
    "side": "left",
    "share": share,
    "time": at,
    "duration": within,
}
(folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
