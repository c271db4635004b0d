"""The contactor of an induction motor, and its connection in star or delta.

*Opening.* The arcs between the contacts bring the stator currents to zero with the time constant t_d:

    d i_s/dt = -i_s/t_d        in the frame of the supply

The winding then is open: psi_r goes on without a jump and decays with the time constant of the rotor, and the stator
has the flux that it induces, i_s(psi_s, psi_r) = 0. As i_s depends on the fluxes, its derivative gives that of psi_s:

    A d psi_s/dt = (1/L_l) d psi_r/dt - i_r (d L_l/dt)/L_l - i_s/t_d        A = d i_s/d psi_s

A is positive definite, so that there is neither a loop nor a part that is stiffer than t_d. With u_o, the voltage at
the winding in this motion, the contactor carries the voltage u - u_o and takes the power 3/2 Re((u - u_o) conj(i_s)),
the loss of its arcs. While the contactor is open psi_r turns against the supply with the slip, as in the model, so
that it has its phase when the contactor closes.

*A share* c of the contactor between 0 and 1 stands for contacts that are closed for this share of the time: the
winding has the voltage c u + (1 - c) u_o.

*Star.* Parameters and states are those of delta. In star a winding has 1/sqrt(3) of the line's voltage, and the line
1/sqrt(3) of the current: to the states the line is behind a transformer of the complex ratio

    k = 1 - s + s exp(+-30 deg j)/sqrt(3)

for the share s of star, i.e. u = k u_line and i_line = conj(k) i_s, which loses no power at any s. The voltage of a
winding in star leads that in delta by 30 deg in the preferred connection of the delta (U1-V2, V1-W2, W1-U2, for a
field that turns as L1, L2, L3), so that the field, which falls behind the line while the contactor is open, is nearer
to the voltage when delta is closed; in the other connection (U1-W2, V1-U2, W1-V2) it lags by 30 deg.
"""

from __future__ import annotations

import math
from typing import Any

from ..core.quantities import Value, declaration, quantity

CONTACTOR_EDGE = 2e-3
"""Time in which a contactor goes from closed to open, or back, in the signals of a study [s]."""
_QUADRATURE = 0.5 / math.sqrt(3.0)


@declaration
class DeltaConnection:
    """The connection of the winding in delta."""

    preferred: Value = quantity(
        "1",
        "true: in delta the voltage of a winding lags that in star by 30 deg (U1-V2), preferred as the current of a "
        "change from star to delta is small; false: it leads (U1-W2)",
        default=True,
        type="Boolean",
    )


@declaration
class Switching(DeltaConnection):
    """The contactor, and the connection of the winding."""

    decay: Value = quantity(
        "s", "time constant in which the currents vanish after the contactor opens",
        default=1e-3, min=1e-4, max=0.1,
    )  # fmt: skip


@declaration
class StarDelta(DeltaConnection):
    """A start in star, then in delta."""

    time: Value = quantity(
        "s", "time in star, from switching on", default=3.0, min=0.01, max=1e3, usual=(0.1, 60.0)
    )
    pause: Value = quantity(
        "s", "time for which the motor is cut off between star and delta",
        default=0.05, min=0.02, max=10.0, usual=(0.02, 1.0),
    )  # fmt: skip


def connection(star: Any, preferred: Any) -> tuple[Any, Any]:
    """Real and imaginary part of the ratio k of the voltage at the states to that of the line.

    Parameters
    ----------
    star : share of star, 0 to 1
    preferred : 1 where the delta is the preferred one, else 0
    """
    return 1.0 - 0.5 * star, (2.0 * preferred - 1.0) * _QUADRATURE * star


def opening(
    psi: tuple[Any, Any],
    admittance: Any,
    bend: Any,
    pull: tuple[Any, Any],
    current: tuple[Any, Any],
    decay: Any,
) -> tuple[Any, Any]:
    """The derivative [V] of the stator's flux `psi` [Wb] while the contactor is open, in the frame of the supply.

    Parameters
    ----------
    admittance, bend : A = `admittance` 1 + `bend` psi psi^T, of the stator's current by its flux [1/H], [1/(H Wb2)]
    pull : the part of the derivative of the current that follows from the rotor, with the opposite sign [A/s]
    current : of the stator [A]
    decay : time constant of the current [s]
    """
    (d, q), (pull_d, pull_q), (i_d, i_q) = psi, pull, current
    g_d, g_q = pull_d - i_d / decay, pull_q - i_q / decay
    # the inverse of a multiple of 1 and a dyad
    along = bend * (d * g_d + q * g_q) / (admittance + bend * (d * d + q * q))
    return (g_d - d * along) / admittance, (g_q - q * along) / admittance
