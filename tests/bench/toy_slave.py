"""A stand-in for the estimator: counts turns of the centre gage, no physics. Built into an FMU."""

from pythonfmu import (
    Boolean,
    Fmi2Causality,
    Fmi2Slave,
    Fmi2Variability,
    Integer,
    Real,
)

SAMPLES = 16


class ToyTire(Fmi2Slave):
    description = "toy"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.sample_rate = 1e4
        self.frame_valid = True
        self.register_variable(
            Real(
                "sample_rate", causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed
            )
        )
        names = [f"strain_{i}_{g}" for i in range(1, SAMPLES + 1) for g in range(1, 6)]
        if SAMPLES == 1:
            names = [f"strain_{g}" for g in range(1, 6)]
        self.names = [n for n in names if int(n[-1]) == 3]
        for name in [*names, "speed", "pressure"]:
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        self.register_variable(
            Boolean(
                "frame_valid", causality=Fmi2Causality.input, variability=Fmi2Variability.discrete
            )
        )
        for name in (
            "Fz",
            "alpha",
            "kappa",
            "Fy",
            "Fz_std",
            "alpha_std",
            "kappa_std",
            "Fy_std",
            "age",
            "contact_time",
        ):
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        for name in ("turn", "flags"):
            setattr(self, name, 0)
            self.register_variable(
                Integer(name, causality=Fmi2Causality.output, variability=Fmi2Variability.discrete)
            )
        self.valid = False
        self.register_variable(
            Boolean("valid", causality=Fmi2Causality.output, variability=Fmi2Variability.discrete)
        )
        self.count, self.ready, self.before, self.peak, self.lost = 0, 0, 1.0, 0.0, 0

    def do_step(self, current_time, step_size):
        if self.speed < 0.0:
            raise ValueError("speed is negative; it must be above 0")
        for name in self.names[: round(step_size * self.sample_rate)]:
            x = getattr(self, name)
            self.lost += x != x
            if x == x:
                self.peak = max(self.peak, x)
                if x > 0.006 >= self.before:
                    self.turn += 1
                    self.contact_time = self.count / self.sample_rate
                    self.Fz, self.Fy = 1e5 * self.peak, float(self.lost)
                    self.kappa = self.alpha = self.speed
                    self.Fz_std = self.Fy_std = self.kappa_std = self.alpha_std = 1.0
                    self.flags = 2 if self.lost else 0
                    self.valid = self.turn > 1
                    self.ready, self.peak, self.lost = self.count, 0.0, 0
                self.before = x
            self.count += 1
        self.age = (self.count - self.ready) / self.sample_rate
        return True
