"""Systems that the tests run."""

from __future__ import annotations

from chainunit.models import MODELS
from chainunit.system import ModelComponent, System, shaft_joints


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
