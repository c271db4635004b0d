"""A measured stroke of a beam pump beside its linkage: `python measured_pump.py stroke.csv --step 0.0524`."""

import argparse
import csv
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import least_squares

from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine

INCH, LBF, HEADS = 0.0254, 4.4482216152605, ("position [in]", "load [lbf]")
LINKAGE = Path(__file__).with_name("linkages") / "beam_pump_api.toml"
USAGE = f"""%(prog)s FILE [--step SECONDS]
FILE is a CSV file of one stroke of the polished rod, sampled evenly, its first sample not repeated, with the
columns "{HEADS[0]}" and "{HEADS[1]}". It comes from a dynamometer survey: any well analyser exports both. The
dimensions A, C, I, K, P and R of API 11E, from the data sheet of the pumping unit, go into {LINKAGE.name}."""
parser = argparse.ArgumentParser(usage=USAGE)
parser.add_argument("file", type=Path)
parser.add_argument("--step", type=float, default=0.0524, help="time from sample to sample [s]")
args = parser.parse_args()
try:
    pump = Machine(read_linkage(LINKAGE), g=0.0)
    rows = list(csv.DictReader(args.file.read_text("utf-8-sig").splitlines())) or [{}]
    if not set(HEADS) <= set(rows[0]):
        raise ValueError(f"the columns are {list(rows[0])}")
    position, load = np.array([[float(row[head] or "nan") for row in rows] for head in HEADS])
    if len(rows) < 40 or not np.all(np.isfinite([position, load])) or not args.step > 0.0:
        raise ValueError("must have 40 samples or more, all of them numbers; --step must be above 0")
except (OSError, ValueError) as error:
    parser.error(f"{args.file}: {error}")
if np.sum((load + np.roll(load, -1)) * (np.roll(position, -1) - position)) < 0.0:
    print("The samples run backwards in time: the rod would drive the unit. They are taken in reverse.")
    position, load = position[::-1], load[::-1]
A, C, I, K, P, R = (pump.by_name[name] / INCH for name in "ACIKPR")
turn = 2.0 * np.pi * np.arange(len(rows)) / len(rows)


def rod(x, sense):  # x: phase of the crank, zero of the sensor, two terms of each harmonic of the crank angle
    waves = (a * np.sin(k * turn) + b * np.cos(k * turn) for k, (a, b) in enumerate(x[2:].reshape(-1, 2), 1))
    phi = x[0] + sense * turn + sum(waves)
    return phi, x[1] + A * pump.outputs(phi).beam.angle


def fit(sense, starts):
    fits = (least_squares(lambda x: position - rod(x, sense)[1], start) for start in starts)
    return min(fits, key=lambda one: one.cost)


senses = {s: fit(s, [np.array([phase, 0.0]) for phase in (0.0, 1.5, 3.0, 4.5)]) for s in (1, -1)}
sense = min(senses, key=lambda s: senses[s].cost)
way = "clockwise" if sense > 0 else "counter-clockwise"
print(f"crank {way}, with the well on the right; the other sense: {np.std(senses[-sense].fun):.2f} in RMS")
stroke = A * np.ptp(pump.outputs(np.linspace(0.0, 2.0 * np.pi, 7201)).beam.angle)
print(f"stroke {np.ptp(position):.2f} in measured, {stroke:.2f} in computed")
figure, (upper, lower) = plt.subplots(2, sharex=True, figsize=(9, 6), layout="constrained")
time = args.step * np.arange(len(rows))
upper.plot(time, position, "k.", label="measured")
finer = fit(sense, [np.append(senses[sense].x, np.zeros(8))])
for name, solution in {"steady crank": senses[sense], "four harmonics": finer}.items():
    rms = np.std(solution.fun)  # their mean is 0
    print(f"{name}: {rms:.3f} in RMS, {100.0 * rms / np.ptp(position):.2f} % of the stroke")
    upper.plot(time, position - solution.fun, label=name)
    lower.plot(time, solution.fun, label=name)
print("harmonics of the crank angle:", np.degrees(np.hypot(finer.x[2::2], finer.x[3::2])).round(2), "deg")
upper.set(ylabel="polished rod [in]")
lower.set(ylabel="measured less computed [in]", xlabel="time [s]")
upper.legend()
figure.savefig("measured_pump.png")
phi, _ = rod(finer.x, sense)
torque = pump.evaluate({"phi": phi, "rod_load": LBF * load})["tau"] / (INCH * LBF)
theta = phi - np.arcsin(I / K)
J = np.sqrt(K**2 + R**2 - 2.0 * K * R * np.cos(theta))
beta = np.arccos((C**2 + P**2 - J**2) / (2.0 * C * P))
psi = np.arccos((C**2 + J**2 - P**2) / (2.0 * C * J)) - np.arcsin(R * np.sin(theta) / J)
factor = A * R / C * np.sin(beta + psi - theta) / np.sin(beta)  # torque factor of API 11E
gap = np.max(np.abs(torque - factor * load)) / np.max(np.abs(torque))
print(f"gear torque {torque.min():.0f} to {torque.max():.0f} lbf in; by torque factors: {gap:.0e} off")
