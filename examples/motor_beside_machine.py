"""`ChamberForces.fmu` beside a motor of your own, in a plain loop of fmpy; at 6 s all feed moves to the left organ.

Make the FMU first: `chainunit export ChamberForces -o ChamberForces.fmu`.
"""

import shutil
import sys
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave

STEP, STOP, RATIO = 1e-3, 12.0, 50.0
PORT = ("tau_bias", "tau_bias_dphi", "tau_bias_dw", "J", "dJ_dphi", "phi0", "w0")


class Motor:
    """DC motor of 0.37 kW with loops of speed and current, SI units. It takes the load inside its own steps."""

    R, L, k, J = 9.5, 0.11, 1.27, 0.0035  # ohm, H, N m/A, kg m2 of the rotor
    phi = w = a = i = integral = 0.0  # rad, rad/s, rad/s2, A, rad

    def step(self, time, step, load):
        """Go on by `step`. `load` is the load port of the machine: a torque with its slopes, and an inertia."""
        dt = step / 10
        for t in time + dt * np.arange(10):
            error = 150.0 * min(t / 1.5, 1.0) - self.w  # a ramp of 1.5 s to 150 rad/s
            i_ref = min(max(0.25 * error + 0.8 * self.integral, -4.4), 4.4)
            v = self.R * self.i + self.k * self.w + 500.0 * self.L * (i_ref - self.i)
            v = min(max(v, -240.0), 240.0)
            angle, speed = self.phi - load["phi0"], self.w - load["w0"]
            tau = load["tau_bias"] + load["tau_bias_dphi"] * angle + load["tau_bias_dw"] * speed
            self.a = (self.k * self.i - tau) / (self.J + load["J"] + load["dJ_dphi"] * angle)
            self.i += dt * (v - self.R * self.i - self.k * self.w) / self.L
            self.w += dt * self.a
            self.phi += dt * self.w
            self.integral += dt * error * (abs(i_ref) < 4.4)


if not Path("ChamberForces.fmu").exists():
    sys.exit("ChamberForces.fmu is missing: chainunit export ChamberForces -o ChamberForces.fmu")
description, folder = fmpy.read_model_description("ChamberForces.fmu"), fmpy.extract("ChamberForces.fmu")
references = {v.name: v.valueReference for v in description.modelVariables}
identifier = description.coSimulation.modelIdentifier
machine = FMU2Slave(
    guid=description.guid, unzipDirectory=folder, modelIdentifier=identifier, instanceName="machine"
)


def put(**values):
    machine.setReal([references[name.replace("__", ".")] for name in values], list(values.values()))


def read(*names):
    return machine.getReal([references[name] for name in names])


machine.instantiate()
machine.setupExperiment(startTime=0.0)
put(ratio=RATIO, left__processing_force=10.0, right__processing_force=10.0)
machine.enterInitializationMode()
machine.exitInitializationMode()

motor, rows = Motor(), []
for k in range(round(STOP / STEP)):
    time = k * STEP
    if time == 6.0:
        put(left__material_mass=60.0, right__material_mass=0.0, left__processing_force=20.0)
        put(right__processing_force=0.0)
    load = dict(zip(PORT, read(*PORT), strict=True))
    motor.step(time, STEP, load)
    machine.doStep(time, STEP)
    put(phi=motor.phi, w=motor.w, a=motor.a)  # the motion at the end of the step, before the machine is read
    rows.append([time + STEP, motor.i, *read("tau", "rocker.tau", "rocker.tangential_load")])
machine.terminate()
machine.freeInstance()
shutil.rmtree(folder)

time, current, tau, rocker, _ = np.array(rows).T
for name, end in {"both organs": 6.0, "left organ alone": STOP}.items():
    part = (time > end - 4 * np.pi * RATIO / 150.0) & (time <= end)  # two turns of the crank
    peaks = f"crank {RATIO * abs(tau[part]).max():5.1f} N m  rocker {abs(rocker[part]).max():6.1f} N m"
    print(f"{name:16}  {peaks}  current {np.mean(current[part] ** 2) ** 0.5:.3f} A RMS")
