"""A DC motor of somebody else, as an FMU by pythonfmu: with the terminals' variables alone, and nothing of chainunit.

Its equations are those of `chainunit.drives.dc_motor` with the start values there, written anew.
"""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

NAMES = {}  # what it calls otherwise
LEFT_OUT = ()  # outputs that it does not have
R, L, K, ALPHA, HEAT, COOLING, AMBIENT = 9.5, 0.11, 1.27, 0.00393, 2000.0, 0.9, 293.15
INERTIA, DRAG = 0.0035, 0.001
MOST_CURRENT, MOST_VOLTAGE = 4.4, 240.0
SPEED_P, SPEED_I, CURRENT_P, CURRENT_I = 0.1017, 0.6102, 33.0, 2850.0
LONGEST = 2.5e-4  # s
INPUTS = ("tau_bias", "J", "dJ_dphi", "phi0", "w0", "tau_bias_dphi", "tau_bias_dw")


class ForeignMotor(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u = dict.fromkeys([*(f"load.{name}" for name in INPUTS), "w_ref"], 0.0)
        # angle, speed, current, temperature, integrals of the control
        self.x = [0.0, 0.0, 0.0, AMBIENT, 0.0, 0.0]
        for name in self.u:
            self.declare(name, Fmi2Causality.input, lambda name=name: self.u[name])
            self.vars[len(self.vars) - 1].setter = lambda value, name=name: self.u.update({name: value})
        self.declare("phi", Fmi2Causality.output, lambda: self.x[0])
        self.declare("w", Fmi2Causality.output, lambda: self.x[1])
        for name, getter in {"a": lambda: self.rates(self.x)[1], "tau": self.torque}.items():
            if name not in LEFT_OUT:
                self.declare(name, Fmi2Causality.output, getter)
        self.drag = DRAG
        drag = Real(
            "drag",
            causality=Fmi2Causality.parameter,
            variability=Fmi2Variability.tunable,
            start=DRAG,
            getter=lambda: self.drag,
        )
        self.register_variable(drag, nested=False)
        drag.setter = lambda value: setattr(self, "drag", value)

    def declare(self, name, causality, getter):
        start = {"start": 0.0} if causality == Fmi2Causality.input else {}
        self.register_variable(
            Real(
                NAMES.get(name, name),
                causality=causality,
                variability=Fmi2Variability.continuous,
                getter=getter,
                **start,
            ),
            nested=False,
        )

    def load(self, x):
        """Torque at constant speed and inertia, linearised about the point of the load."""
        u = {name: self.u[f"load.{name}"] for name in INPUTS}
        turned, faster = x[0] - u["phi0"], x[1] - u["w0"]
        torque = u["tau_bias"] + u["tau_bias_dphi"] * turned + u["tau_bias_dw"] * faster
        return torque, u["J"] + u["dJ_dphi"] * turned

    def rates(self, x):
        _, w, i, T, integral_i, integral_v = x
        behind = self.u["w_ref"] - w
        wanted_i = SPEED_P * behind + integral_i
        i_ref = max(min(wanted_i, MOST_CURRENT), -MOST_CURRENT)
        wanted_v = CURRENT_P * (i_ref - i) + integral_v + K * w
        v = max(min(wanted_v, MOST_VOLTAGE), -MOST_VOLTAGE)
        hot = R * (1.0 + ALPHA * (T - 293.15))
        torque, inertia = self.load(x)
        return [
            w,
            (K * i - self.drag * w - torque) / (INERTIA + inertia),
            (v - hot * i - K * w) / L,
            (hot * i * i - (T - AMBIENT) / COOLING) / HEAT,
            SPEED_I * (behind + (i_ref - wanted_i) / SPEED_P),
            CURRENT_I * (i_ref - i + (v - wanted_v) / CURRENT_P),
        ]

    def torque(self):
        torque, inertia = self.load(self.x)
        return inertia * self.rates(self.x)[1] + torque

    def do_step(self, current_time, step_size):
        n = max(1, round(step_size / LONGEST + 0.499))
        h = step_size / n
        for _ in range(n):
            k = [self.rates(self.x)]
            for share in (0.5, 0.5, 1.0):
                k.append(self.rates([x + share * h * dx for x, dx in zip(self.x, k[-1], strict=True)]))
            self.x = [
                x + h / 6.0 * (a + 2.0 * b + 2.0 * c + d) for x, a, b, c, d in zip(self.x, *k, strict=True)
            ]
        return True

    def _get_fmu_state(self):
        return {"x": list(self.x), "u": dict(self.u)}

    def _set_fmu_state(self, state):
        self.x, self.u = list(state["x"]), dict(state["u"])
