"""A machine of somebody else, as an FMU by pythonfmu: a pump whose piston sits on an eccentric, with the terminals'
variables alone, and nothing of chainunit.

Its shaft is the crank: x = throw cos(phi) is the place of the piston, which the back pressure resists both ways.
"""

import math

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real

NAMES = {}  # what it calls otherwise
LEFT_OUT = ()  # outputs that it does not have
AREA, SMOOTH, WHEEL, DRAG = 0.01, 0.02, 2.0, 0.5


class ForeignMachine(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.description = "An eccentric pump: one piston"
        self.u = {"phi": 0.0, "w": 0.0, "a": 0.0, "back_pressure": 0.0, "valves": 1}
        self.p = {"piston.mass": 40.0, "throw": 0.15, "cylinders": 1, "vented": False}
        for table, causality in ((self.u, Fmi2Causality.input), (self.p, Fmi2Causality.parameter)):
            for name in table:
                self.declare(name, causality, table)
        outputs = ("tau_bias", "J", "dJ_dphi", "phi0", "w0", "tau_bias_dphi", "tau_bias_dw", "tau")
        for name in outputs:
            if name not in LEFT_OUT:
                self.declare(name, Fmi2Causality.output)

    def declare(self, name, causality, table=None):
        getter = (lambda: self.load()[name]) if table is None else (lambda: table[name])
        setter = None if table is None else (lambda value: table.update({name: value}))
        start = {} if table is None else {"start": table[name]}
        kind = Fmi2Variability.tunable if causality == Fmi2Causality.parameter else Fmi2Variability.continuous
        of = Real if table is None else {int: Integer, bool: Boolean}.get(type(table[name]), Real)
        variable = of(
            NAMES.get(name, name),
            causality=causality,
            variability=kind,
            getter=getter,
            setter=setter,
            **start,
        )
        self.register_variable(variable, nested=False)

    def load(self):
        phi, w, a, pressure = (self.u[name] for name in ("phi", "w", "a", "back_pressure"))
        mass, throw, cylinders = self.p["piston.mass"], self.p["throw"], self.p["cylinders"]
        s, c, force = math.sin(phi), math.cos(phi), 0.0 if self.p["vented"] else pressure * AREA * cylinders
        moving = mass * cylinders * throw * throw
        v = throw * w * s
        root = math.sqrt(v * v + SMOOTH * SMOOTH)
        share, slope = v / root, SMOOTH * SMOOTH / root**3
        J, dJ, ddJ = WHEEL + moving * s * s, 2.0 * moving * s * c, 2.0 * moving * (c * c - s * s)
        tau_bias = 0.5 * dJ * w * w + force * throw * s * share + DRAG * w
        return {
            "tau_bias": tau_bias,
            "J": J,
            "dJ_dphi": dJ,
            "phi0": phi,
            "w0": w,
            "tau_bias_dphi": 0.5 * ddJ * w * w + force * throw * (c * share + s * slope * throw * w * c),
            "tau_bias_dw": dJ * w + force * throw * s * slope * throw * s + DRAG,
            "tau": J * a + tau_bias,
        }

    def do_step(self, current_time, step_size):
        return True

    def _get_fmu_state(self):
        return {"u": dict(self.u), "p": dict(self.p)}

    def _set_fmu_state(self, state):
        self.u.update(state["u"])
        self.p.update(state["p"])
