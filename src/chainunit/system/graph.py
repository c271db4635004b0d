"""A system: FMUs by name, and connections between their variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..ports import LoadPort, PortValues
from ..quantities import Layout


@dataclass(frozen=True)
class System:
    """What is simulated.

    `fmus` maps instance names to files, `connections` are pairs (source, target) of full names such as
    ``("motor.phi", "machine.phi")``, `start` holds start values of parameters and inputs by full name.
    """

    fmus: Mapping[str, Path]
    connections: Sequence[tuple[str, str]]
    start: Mapping[str, float] = field(default_factory=dict)


def port_connections(
    machine: str, driver: str, *, slopes: bool = True, shaft: str = ""
) -> list[tuple[str, str]]:
    """The connections of a load port and of the shaft behind it: the machine's seven signals to the driver,
    the driver's angle, speed and acceleration to the machine. Without `slopes` the load is held constant
    over the step, and the coupling is of first order only. `shaft` goes before the names of a driver's shaft that is
    not its only one ("driven." of a driveline)."""
    port = Layout(LoadPort if slopes else PortValues).names
    return [
        *((f"{driver}.{shaft}{x}", f"{machine}.{x}") for x in ("phi", "w", "a")),
        *((f"{machine}.{name}", f"{driver}.load.{name}") for name in port),
    ]
