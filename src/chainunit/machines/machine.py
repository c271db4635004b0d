"""`Machine`: any linkage machine in Python, with arrays as arguments and results."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from ..core.declared_numbers import in_declared_unit, one_number
from ..core.engines import numpy_
from ..core.errors import InputError, check_kind, shown
from ..core.quantities import Variable, complaint
from ..mechanism.machine import MachineState, Mechanism
from ..mechanism.models import InverseMachine, MachineModel
from .differing import shared_by_law

if TYPE_CHECKING:
    import xarray as xr

    from .equilibria import Equilibria

_XP = numpy_()


class Machine:
    """A machine with checked parameters: its `model`, and its parameters `p`.

    Angles and speeds count at the motor, as in the FMU; with ``ratio`` 1 at the crank. Every argument may be a number
    or an array in SI units, a text such as "160 mm", or a quantity of pint; shapes broadcast, and outputs have the
    common shape. A value that is not
    finite, or a load outside its declared bounds, raises an `InputError` that names it; in an array this holds for
    each value. A value that exceeds a bound only by rounding counts as the bound.

    Parameters
    ----------
    model : the inverse model of the machine
    parameters : its `Parameters`, or values by the names of parameters, e.g. ``{"r": 0.2, "crank.m": 35.0}``;
        all other parameters have the values of the packaged machine.
    **values : values by names without a dot.

    Raises
    ------
    InputError, GeometryError
        for a name that is not declared, values of another type or out of bounds, and lengths that cannot turn, in
        one line.

    Examples
    --------
    >>> from chainunit.machines.knife_drive import KnifeDrive
    >>> knife = Machine(KnifeDrive, ratio=10.0)
    >>> round(float(knife.outputs(phi=0.5, w=30.0, feed=KnifeDrive.Feed(cut_force=2000.0)).tau), 2)
    3.41
    """

    in_place: ClassVar[str] = ""
    """Words on what the results without a run are of, if the runs have another model; else empty."""

    def __init__(self, model: InverseMachine, parameters: Any = None, /, **values: Any) -> None:
        check_kind("model", model, MachineModel, "a machine, such as KnifeDrive")
        if isinstance(parameters, model.Parameters):
            parameters = model.parameter_layout.by_name(parameters)
        check_kind("parameters", parameters, Mapping | None, _NAMED)
        values = {**(parameters or {}), **values}
        self.model = model.having(values)
        self.p: Any = self._checked(self._completed(values), self.model.Parameters())

    def _completed(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """The `values` by name, with the values of all pins for what they leave out of the law of one."""
        start = self.model.parameter_layout.by_name(self.model.Parameters())
        shared = shared_by_law(self.model).items()
        return {name: values.get(source, start[source]) for name, source in shared} | dict(values)

    def _checked(self, values: Mapping[str, Any], base: Any) -> Any:
        """The checked parameters `base` with other values by name."""
        layout = self.model.parameter_layout
        declared = {v.name: v for v in layout.variables}
        numbers = {
            name: one_number(declared[name], value) if name in declared else value
            for name, value in values.items()
        }
        return self.model.check(layout.from_names(numbers, base))

    def replace(self, parameters: Mapping[str, Any] | None = None, /, **values: Any) -> Self:
        """The same machine with new values of some parameters; the arguments are as of the constructor."""
        machine, values = copy.copy(self), {**(parameters or {}), **values}
        machine.model, base = self.model.having([*values]), self.p
        if machine.model is not self.model:
            values, base = machine._completed(self.by_name | values), machine.model.Parameters()
        machine.p = machine._checked(values, base)
        return machine

    def __repr__(self) -> str:
        """The call that makes the machine, with the parameters that differ from their start values, to nine
        digits, and with the further parameters, see `MachineModel.having`."""
        model = self.model.root or self.model
        start = dict.fromkeys(self.by_name, math.nan) | model.parameter_layout.by_name(model.Parameters())
        texts = {name: f"{value:.9g}" for name, value in self.by_name.items()}
        changes = [f'"{name}": {x}' for name, x in texts.items() if x != f"{start[name]:.9g}"]
        arguments = [*self._kind, *([f"{{{', '.join(changes)}}}"] if changes else [])]
        return f"{type(self).__name__}({', '.join(arguments)})"

    @property
    def _kind(self) -> list[str]:
        """The arguments of the constructor besides the parameters, as texts."""
        return [self.model.name]

    @property
    def ratio(self) -> float:
        """Motor turns per crank turn."""
        return float(self.p.ratio)

    @property
    def simulated(self) -> Machine:
        """The machine as its runs have it: this one, or one with another model."""
        return self

    @property
    def by_name(self) -> dict[str, float]:
        """Values of the parameters by name."""
        return self.model.parameter_layout.by_name(self.p)

    @property
    def in_plane(self) -> dict[str, float]:
        """Values by name of the parameters that every machine of its kind has, see `MachineModel.having`."""
        return (self.model.root or self.model).parameter_layout.by_name(self.p)

    def inputs(self, values: Mapping[str, Any]) -> Any:
        """Inputs from values by name, each within the bounds of its declaration; all others have their start values.

        Raises
        ------
        InputError
            for a name that is not an input; see also the class.
        """
        check_kind("inputs", values, Mapping, _NAMED)
        layout = self.model.input_layout
        numbers = layout.values(layout.from_names(dict(values)))
        admitted = [admit(v, x) for v, x in zip(layout.variables, numbers, strict=True)]
        check_shapes(dict(zip(layout.names, admitted, strict=True)))
        return layout.instance(admitted)

    def state(self, u: Any) -> MachineState:
        """The linkage with the `inputs`.

        Raises
        ------
        TypeError
            for a machine whose outputs depend on states.
        """
        if self.model.States is not None:
            raise TypeError(f"{self.model.name}: its outputs depend on its states, too; simulate it")
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
        return self._outputs(self.inputs({"phi": phi, "w": w, "a": a, **self._feed(feed)}))

    def _feed(self, feed: Any) -> dict[str, Any]:
        try:
            return self.model.feed_layout.by_name(self.model.Feed() if feed is None else feed)
        except AttributeError:
            raise InputError(f"feed = {shown(feed)}: must be the Feed of {self.model.name}") from None

    def _outputs(self, u: Any) -> Any:
        part = self.model.parts[0]
        out = part.equations(_XP, self.p, u, None, self.state(u))
        return part.layout.instance(np.broadcast_arrays(*part.layout.values(out)))

    def evaluate(self, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """All outputs of the FMU by name, from inputs by name; all other inputs are 0.

        Raises
        ------
        InputError
            for a name that is not an input; see also the class.
        """
        check_kind("inputs", inputs, Mapping, _NAMED)
        u = self.inputs({**dict.fromkeys(self.model.input_layout.names, 0.0), **inputs})
        outputs: dict[str, Any] = {}
        state = self.state(u)
        for part in self.model.parts:
            outputs |= part.layout.by_name(part.equations(_XP, self.p, u, None, state))
        return dict(zip(outputs, np.broadcast_arrays(*outputs.values()), strict=True))

    def batch(
        self, values: Mapping[str, Any], outputs: Sequence[str] | None = None, **options: Any
    ) -> xr.Dataset:
        """Outputs, derivatives and cycle quantities over arrays of inputs and parameters, in compiled code; this
        machine gives all other parameters, and all other inputs have their start values, as in the FMU (`evaluate`
        takes 0). Arguments and result are those of `chainunit.batch.evaluate`.

        Examples
        --------
        >>> from chainunit import ChainUnitMachine
        >>> turn = ChainUnitMachine().batch({"phi": [0.0, 0.5], "r": [0.14, 0.15], "w": 3.0}, ["tau"])
        >>> turn.tau.dims, turn.tau.units
        (('phi', 'r'), 'N.m')
        """
        from ..batch import evaluate

        return evaluate(self.model, values, outputs, parameters=self.p, **options)

    def equilibria(self, feed: Any = None) -> Equilibria:
        """All equilibria under its weight, its springs and the loads `feed` over the way of the driver, with
        stiffness and natural frequency, and the holding torque elsewhere; see
        `chainunit.machines.equilibria.equilibria`.

        Examples
        --------
        >>> from chainunit.machines.knife_drive import KnifeDrive
        >>> [each.kind for each in Machine(KnifeDrive).equilibria().places]
        ['unstable', 'stable']
        """
        from .equilibria import equilibria

        self._feed(feed)
        return equilibria(self, feed)

    def pin_turns(self, run: Mapping[str, Any]) -> dict[str, Any]:
        """Relative angle in each of the model's joints over a `run`, by output, up to a constant [rad], shape (n,).
        The `run` has outputs and states of the model by name, each of shape (n,). The caller sums the turning to and
        fro."""
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
        """The linkage at motor angles `phi` [rad]; for a machine with chains, its drive only."""
        u = self.inputs({"phi": phi})
        linkage = self.model.linkage(_XP, self.p, u)
        return Mechanism(_XP, linkage, u.phi / self.p.ratio, getattr(self.p, "derived", ()))

    @property
    def stored_per_unit(self) -> Mapping[str, Callable[[Mapping[str, Any]], Any]]:
        """By the name of an input, a function of outputs and states by name: the energy that one unit of the input
        holds at its place [J per unit]. This is dE/du, with which a change of the input enters an energy balance."""
        return {}

    def loaded_sides(self, feed: Any) -> tuple[str, ...]:
        """The sides of the machine with any mass or load; none for a machine without sides."""
        return ()


_NAMED = "a mapping of names to values"


def check_shapes(values: Mapping[str, Any]) -> None:
    """Refuse arrays whose shapes do not broadcast, in one line with the name and the shape of each."""
    try:
        np.broadcast_shapes(*map(np.shape, values.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {np.shape(x)}" for name, x in values.items() if np.ndim(x))
        raise InputError(f"shapes do not fit: {shapes}; give arrays of one shape, or numbers") from None


def admit(variable: Variable, value: Any) -> Any:
    """A float or an array of values that the declaration admits; a value that exceeds a bound by rounding is set to
    the bound.

    Raises
    ------
    InputError
        for a value that the declaration does not admit, of another type, and of a unit of another kind.
    """
    q, x = variable.quantity, in_declared_unit(variable, value)
    # the extremes of an array with a NaN are NaN
    for extreme in (np.min(x), np.max(x)) if np.size(x) else ():
        if not q.admits(float(extreme)):
            raise InputError(complaint(variable, float(extreme)))
    return q.within_bounds(x) if isinstance(x, float) else np.clip(x, q.low, q.high)


def array(x: Any) -> Any:
    """A float unchanged, anything else as an array of floats."""
    return x if isinstance(x, float) else np.asarray(x, float)
