"""Systems that the tests run."""

from __future__ import annotations

import contextlib

from fmpy.fmi2 import FMU2Model

from chainunit.drives.dc_motor import DcMotor
from chainunit.machines.flexible import flexible
from chainunit.models import MODELS
from chainunit.study import config
from chainunit.study.drive import Drive
from chainunit.system import ModelComponent, System, shaft_joints
from chainunit.system.instance import Fmu


def component(model, file=None, values=None):
    """The component of a model (a class or a name) with start values, except the given ones, and its FMU if
    there is one."""
    model = MODELS.get(model, model)
    return ModelComponent(model, model.parameter_layout.from_names(values or {}), file)


def pair(machine, motor, files=None, values=None):
    """A motor that drives a machine; `files` are their FMUs by component, `values` by full name."""
    files = files or {}
    components = {
        "machine": component(machine, files.get("machine")),
        "motor": component(motor, files.get("motor")),
    }
    return System(components, shaft_joints("motor", "machine")).with_values(values or {})


def whole_systems():
    """A machine with chains, whose start is an iteration; and by name systems of models: a motor on its machine, with
    a shaft line between, with a model of the machine in the control, and with chains."""
    chains = flexible(2, 1)
    parts = {
        "machine": component("ChamberForces", values={"ratio": 2.0}),
        "line": component("CardanDriveline", values={"ratio": 10.0, "d2": 20.0, "d3": 20.0}),
        "motor": component("InductionMotor"),
    }
    joints = [
        *shaft_joints("line", "machine", flange="driven", load="machine"),
        *shaft_joints("motor", "line"),
    ]
    study = config.load()
    turning = {"machine.ratio": 20.0, "motor.phi_start": 5.0, "motor.w_start": 10.0}
    return chains, {
        "motor": pair("ChamberForces", "DcMotor", values={"machine.ratio": 20.0}),
        "line": System(parts, joints),
        "feed-forward": Drive(DcMotor, study.motor.parameters, study.machine, feed_forward=True).graph,
        "chains": pair(chains, "DcMotor", values=turning),
    }


@contextlib.contextmanager
def initialized(file):
    """A Model Exchange instance of a native FMU (FMI 2.0) after its initialization, and the FMU's description."""
    with contextlib.closing(Fmu(file)) as fmu:
        told = fmu.description
        unit = FMU2Model(
            guid=told.guid, unzipDirectory=fmu.folder, instanceName="unit",
            modelIdentifier=told.modelExchange.modelIdentifier,
        )  # fmt: skip
        unit.instantiate()
        try:
            unit.setupExperiment()
            unit.enterInitializationMode()
            unit.exitInitializationMode()
            yield unit, told
        finally:
            unit.freeInstance()
