"""A motor and the machine that it drives, as they are co-simulated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..cosim import Profile, System, port_connections
from ..drives.motor import Motor
from ..fmu.backends import Backend, export
from ..machines.api import ChainUnit
from ..machines.chain_unit import ChamberForces, DirectChainUnit
from ..model import Model
from ..quantities import Layout


@dataclass(frozen=True)
class Drive:
    """`motor` with its `parameters` turns `machine`; `follows` says whether it follows the reference `w_ref`."""

    motor: type[Motor]
    parameters: Any
    machine: ChainUnit
    follows: bool = True
    rated_current: float | None = None
    """[A], where a nameplate tells it"""
    feed_forward: bool = False
    """whether the speed control is told the torque of the machine with its normal feed, from a second machine FMU at
    the motor's angle and speed and the acceleration that is asked for"""

    @property
    def ratio(self) -> float:
        """Motor turns per crank turn."""
        return float(self.machine.p.ratio)

    def models(self) -> dict[str, tuple[type[Model], Any]]:
        """Models and parameters by instance name, the machine first."""
        return {"machine": (ChamberForces, self.machine.p), "motor": (self.motor, self.parameters)}

    def start(self) -> dict[str, float]:
        """Parameters of the whole system by full name."""
        return {
            f"{name}.{parameter}": value
            for name, (model, p) in self.models().items()
            for parameter, value in model.parameter_layout.named(p).items()
        }

    def export(self, folder: Path, backend: Backend | None = None) -> tuple[dict[str, Path], dict[str, str]]:
        """Write the FMUs, with these start values; returns files by instance name, and how they were made."""
        files, made = {}, {}
        for name, (model, p) in self.models().items():
            files[name] = folder / f"{model.name}.fmu"
            made[name] = export(model, files[name], model.parameter_layout.named(p), backend=backend)
        return files, made

    def system(self, files: Mapping[str, Path]) -> System:
        """The system of FMUs that were made of these models, whatever start values they carry."""
        if not self.feed_forward:
            return System(files, self.connections(), self.start())
        told = {f"model.{name}": value for name, value in self.machine_parameters().items()}
        return System({**files, "model": files["machine"]}, self.connections(), self.start() | told)

    def connections(self, *, slopes: bool = True) -> list[tuple[str, str]]:
        """The load port and the shaft, see `port_connections`; and what the control is told."""
        told = [("motor.phi", "model.phi"), ("motor.w", "model.w"), ("model.tau", "motor.tau_ff")]
        return port_connections("machine", "motor", slopes=slopes) + (told if self.feed_forward else [])

    def reference(self, crank_speed: float, ramp: float | None = None) -> dict[str, Any]:
        """The signal of the speed reference for this crank speed [rad/s], after a ramp from rest where given [s]."""
        if not self.follows:
            return {}
        w = crank_speed * self.ratio
        if ramp is None:
            return {"motor.w_ref": w} | ({"model.a": 0.0} if self.feed_forward else {})
        rise = Profile(0.0, ((0.0, ramp, w),))
        return {"motor.w_ref": rise} | ({"model.a": rise.rate} if self.feed_forward else {})

    def loads(self, feed: Any) -> dict[str, Any]:
        """Signals of the loads in normal running: of the machine, and of the one that the control asks."""
        named = Layout(type(feed)).named(feed)
        told = {f"model.{name}": value for name, value in named.items()} if self.feed_forward else {}
        return {f"machine.{name}": value for name, value in named.items()} | told

    def machine_parameters(self) -> dict[str, float]:
        """Parameters of the machine by name."""
        return ChamberForces.parameter_layout.named(self.machine.p)

    def largest_torque(self) -> float:
        """Largest steady air-gap torque of the motor at any speed [N m]."""
        return self.motor.largest_torque(self.parameters)

    def coasting(self, folder: Path, backend: Backend | None = None) -> Path:
        """Write the FMU of the machine that turns by itself."""
        file = folder / f"{DirectChainUnit.name}.fmu"
        export(DirectChainUnit, file, self.machine_parameters(), backend=backend)
        return file
