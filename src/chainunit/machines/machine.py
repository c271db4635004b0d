"""`Machine`: any linkage machine for Python - arrays in, arrays out."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from typing import Any, Self

import numpy as np

from ..engines import numpy_
from ..errors import InputError
from ..mechanism.machine import MachineState, Mechanism
from ..mechanism.models import InverseMachine
from ..quantities import Variable, complaint

_XP = numpy_()


class Machine:
    """A machine with its parameters checked: `model`, and the parameters `p`.

    Angles and speeds are the motor's, as at the FMU; with ``ratio`` 1 they are the crank's.
    Every argument may be a float or an array; shapes broadcast, and outputs have the common shape. A value that
    is not finite, or a load outside its declared bounds, is an `InputError` that names it, in an array as well as
    alone; a value beyond a bound by rounding only counts as the bound.

    Parameters
    ----------
    model : the inverse model of the machine
    parameters : its `Parameters`, or names of parameters with their values (SI), e.g.
        ``{"r": 0.2, "crank.m": 35.0}``; a value that is not named is the packaged machine's.
    **values : the same for names without a dot.

    Raises
    ------
    KeyError
        for a name that is not declared.
    InputError, GeometryError
        for values out of bounds and lengths that cannot turn, in one line.

    Examples
    --------
    >>> from chainunit.machines.knife_drive import KnifeDrive
    >>> knife = Machine(KnifeDrive, ratio=10.0)
    >>> round(float(knife.outputs(phi=0.5, w=30.0, feed=KnifeDrive.Feed(cut_force=2000.0)).tau), 2)
    3.41
    """

    def __init__(self, model: type[InverseMachine], parameters: Any = None, /, **values: float) -> None:
        base = parameters if isinstance(parameters, model.Parameters) else model.Parameters()
        given = {} if isinstance(parameters, model.Parameters) else dict(parameters or {})
        self.model = model
        self.p: Any = model.check(model.parameter_layout.from_names({**given, **values}, base))

    def replace(self, parameters: Mapping[str, float] | None = None, /, **values: float) -> Self:
        """The same machine with some parameters changed, given as to the constructor."""
        changed = copy.copy(self)
        layout = self.model.parameter_layout
        changed.p = self.model.check(layout.from_names({**(parameters or {}), **values}, self.p))
        return changed

    def __repr__(self) -> str:
        """The call that makes the machine, by the parameters that are not at their start values, to nine digits."""
        start = self.model.parameter_layout.by_name(self.model.Parameters())
        shown = {name: f"{value:.9g}" for name, value in self.by_name.items()}
        changed = [f'"{name}": {x}' for name, x in shown.items() if x != f"{start[name]:.9g}"]
        arguments = [*self._kind, *([f"{{{', '.join(changed)}}}"] if changed else [])]
        return f"{type(self).__name__}({', '.join(arguments)})"

    @property
    def _kind(self) -> list[str]:
        """What tells the machine beside its parameters."""
        return [self.model.name]

    @property
    def ratio(self) -> float:
        """Motor turns per crank turn."""
        return float(self.p.ratio)

    @property
    def by_name(self) -> dict[str, float]:
        """Parameters by name."""
        return self.model.parameter_layout.by_name(self.p)

    def inputs(self, named: Mapping[str, Any]) -> Any:
        """Inputs from values by name, each as its declaration admits it; one that is not named is at its start.

        Raises
        ------
        KeyError
            for a name that is not an input.
        InputError
            see the class.
        """
        layout = self.model.input_layout
        values = layout.values(layout.from_names(dict(named)))
        return layout.instance([admitted(v, x) for v, x in zip(layout.variables, values, strict=True)])

    def state(self, u: Any) -> MachineState:
        """The linkage with the `inputs`.

        Raises
        ------
        TypeError
            for a machine with states of its own.
        """
        if self.model.States is not None:
            raise TypeError(f"{self.model.name}: its outputs follow from its states, too; simulate it")
        return self.model.shared(_XP, self.p, u, None)

    def outputs(self, phi: Any, w: Any = 0.0, a: Any = 0.0, feed: Any = None) -> Any:
        """Torque, load port (without slopes), energies and every reaction at motor angle `phi` [rad], speed `w`
        [rad/s] and acceleration `a` [rad/s2], with the loads `feed`, an instance of `model.Feed`: an instance of
        `model.Outputs`.

        Raises
        ------
        InputError
            see the class.
        """
        return self._outputs(self.inputs({"phi": phi, "w": w, "a": a, **self._named(feed)}))

    def _named(self, feed: Any) -> dict[str, Any]:
        return self.model.feed_layout.by_name(self.model.Feed() if feed is None else feed)

    def _outputs(self, u: Any) -> Any:
        part = self.model.parts[0]
        out = part.equations(_XP, self.p, u, None, self.state(u))
        return part.layout.instance(np.broadcast_arrays(*part.layout.values(out)))

    def evaluate(self, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """All outputs of the FMU by name, from inputs by name; an input not named is 0.

        Raises
        ------
        KeyError
            for a name that is not an input.
        InputError
            see the class.
        """
        u = self.inputs({**dict.fromkeys(self.model.input_layout.names, 0.0), **inputs})
        named: dict[str, Any] = {}
        state = self.state(u)
        for part in self.model.parts:
            named |= part.layout.by_name(part.equations(_XP, self.p, u, None, state))
        return dict(zip(named, np.broadcast_arrays(*named.values()), strict=True))

    def pin_turns(self, run: Mapping[str, Any]) -> dict[str, Any]:
        """Relative angle in each of the model's joints, by output, up to a constant [rad], shape (n,), over a `run`:
        outputs and states of the model by name, each of shape (n,). The sum of all turning to and fro is left to the
        reader."""
        phi = array(run["phi0"])
        turns = self.drive(phi).turns
        step = np.diff(phi / self.p.ratio)
        angles = {}
        for output, joint in self.model.joints.items():
            if joint in turns:
                rate = np.broadcast_to(turns[joint], phi.shape)
                angles[output] = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * step)])
        return angles

    def drive(self, phi: Any) -> Mechanism:
        """The links at motor angles `phi` [rad]; of a machine with chains those of its drive."""
        u = self.inputs({"phi": phi})
        linkage = self.model.linkage(self.p, u)
        return Mechanism(_XP, linkage, u.phi / self.p.ratio, getattr(self.p, "derived", ()))

    @property
    def stored_per_unit(self) -> Mapping[str, Callable[[Mapping[str, Any]], Any]]:
        """By the name of an input, the energy that a unit of it holds on its place [J per unit], a function of
        outputs and states by name: dE/du, with which the input enters an energy balance as it changes."""
        return {}

    def loaded_sides(self, feed: Any) -> tuple[str, ...]:
        """The sides of the machine on which there is any mass or load, where it has sides."""
        return ()


def admitted(variable: Variable, given: Any) -> Any:
    """A float or an array whose every value the declaration admits; a value beyond a bound by rounding is set on
    it.

    Raises
    ------
    InputError
        for any other value.
    """
    q, x = variable.quantity, array(given)
    # NaN is the extreme of any array that holds it
    for extreme in (np.min(x), np.max(x)) if np.size(x) else ():
        if not q.admits(float(extreme)):
            raise InputError(complaint(variable, float(extreme)))
    return q.within_bounds(x) if isinstance(x, float) else np.clip(x, q.low, q.high)


def array(x: Any) -> Any:
    """A float as it is, anything else as an array of floats."""
    return x if isinstance(x, float) else np.asarray(x, float)
