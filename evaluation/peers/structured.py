"""scipy's least squares on a simulation whose structure is given: what an engineer gets who knows what is there."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from scipy.optimize import least_squares

from common import Array, Case, Model, NotOffered, Record, held_out_fit, main
from plant import PLACE, parameters, simulate

#: Evaluations for each start, and for the best of them.
SHORT, LONG = 20, 60
#: Starts of a coupling's stiffness, and of a spring's, which has three of its rest for each.
COUPLINGS = (0.5, 5.0, 50.0, 500.0, 5e3)
SPRINGS = (0.05, 0.05, 0.05, 0.5, 0.5, 0.5, 2.0, 2.0, 2.0)


@dataclass(frozen=True)
class Number:
    """A number that is fitted: its places in the plant, its name in the library, starts and bounds in `unit`."""

    places: tuple[str, ...]
    name: str
    unit: float
    starts: tuple[float, ...]
    low: float = -math.inf
    high: float = math.inf


def numbers(effect: str, record: Record, model: Model) -> list[Number]:
    """The numbers of an effect. Units come from the log and the model file: the largest input, its torque, the speed."""
    volts = float(np.max(np.abs(record.u)))
    speed = float(np.max(np.abs(record.y)))
    torque, tau = model.kt / model.r * volts, model.time_constant()
    small, ratio, phase = (0.03, 0.2), (1.0,), (0.0, 1.6, 3.1, -1.6)

    def level(places: str, name: str, unit: float) -> Number:
        return Number(tuple(places.split()), name, unit, small, 0.0, 2.0)

    def either(places: str, name: str, unit: float) -> Number:
        return Number(tuple(places.split()), name, unit, (0.05, -0.05), -2.0, 2.0)

    def times(places: str) -> Number:
        return Number(tuple(places.split()), "ratio", 1.0, ratio, 0.1, 10.0)

    limit = (0.5, 0.8)
    table: dict[str, list[Number]] = {
        "dead_zone": [level("zone_pos zone_neg", "half_width_v", volts)],
        "dead_zone_asymmetric": [level("zone_pos", "pos_v", volts), level("zone_neg", "neg_v", volts)],
        "voltage_saturation": [Number(("limit_pos", "limit_neg"), "limit_v", volts, limit, 0.02, 3.0),
                               Number(("softness",), "softness", 1.0, (0.01, 0.5), 0.002, 3.0)],
        "voltage_saturation_asymmetric": [Number(("limit_pos",), "pos_v", volts, limit, 0.02, 3.0),
                                          Number(("limit_neg",), "neg_v", volts, limit, 0.02, 3.0),
                                          Number(("softness",), "softness", 1.0, (0.01, 0.5), 0.002, 3.0)],
        "drive_gain": [times("gain")], "encoder_scale": [times("scale")], "resistance": [times("r")],
        "motor_gain": [times("kt ke")], "inertia": [times("j")], "viscous_friction": [times("b")],
        "voltage_offset": [either("offset_v", "offset_v", volts)],
        "transport_delay": [Number(("delay_s",), "seconds", tau, (0.03, 0.2, 0.6), 0.0, 2.0)],
        "actuator_lag": [level("lag_s", "time_constant_s", tau)],
        "sensor_lag": [level("reading_lag_s", "time_constant_s", tau)],
        "voltage_drop": [level("drop_v", "drop_v", volts)],
        "supply_sag": [level("source_ohm", "source_ohm", model.r)],
        "current_limit": [Number(("limit_a",), "limit_a", volts / model.r, limit, 0.02, 3.0)],
        "thermal_resistance": [level("rise_per_w", "rise_per_w", model.r / volts**2),
                               Number(("heat_s",), "time_constant_s", tau, (30.0, 300.0), 1.0, 1e4)],
        "kt_saturation": [Number(("knee_a",), "knee_a", volts / model.r, (0.7, 2.0), 0.05, 20.0)],
        "coulomb_friction": [level("dry_pos dry_neg", "level_nm", torque)],
        "coulomb_asymmetric": [level("dry_pos", "pos_nm", torque), level("dry_neg", "neg_nm", torque)],
        "stribeck_friction": [level("dry_pos dry_neg", "level_nm", torque), level("breakaway", "more_nm", torque),
                              Number(("stribeck",), "stribeck_rad_s", speed, (0.02, 0.05, 0.1, 0.2), 1e-3, 1.0)],
        "load_dependent_friction": [level("dry_pos dry_neg", "level_nm", torque),
                                    level("per_motor", "per_motor_torque", 1.0), level("per_load", "per_load_torque", 1.0)],
        "viscous_asymmetric": [either("slope_pos", "pos_nms", torque / speed), either("slope_neg", "neg_nms", torque / speed)],
        "quadratic_drag": [level("drag", "drag_nms2", torque / speed**2)],
        "constant_load": [either("torque", "torque_nm", torque)],
        "gravity": [level("mgl", "mgl_nm", torque * model.gear),
                    Number(("phase",), "phase_rad", 1.0, phase, -7.0, 7.0)],
        "torsional_spring": [Number(("spring",), "stiffness_nm_per_rad", torque / turn(record), SPRINGS, -1.0, 10.0),
                             Number(("rest",), "rest_rad", turn(record), (-0.5, 0.0, 0.5), -5.0, 5.0),
            Number(("spring_cubic",), "cubic_nm_per_rad3", torque / turn(record) ** 3, (0.05,), -1.0, 10.0)],
        "cogging": [level("cogging", "amplitude_nm", torque), Number(("periods",), "periods_per_rev", 1.0, (), 0.5, 100.0),
                    Number(("cogging_phase",), "phase_rad", 1.0, phase, -7.0, 7.0)],
        "periodic_load": [level("shake", "amplitude_nm", torque), Number(("shake_hz",), "frequency_hz", 1.0, (), 0.01, 200.0),
                          Number(("shake_phase",), "phase_rad", 1.0, phase, -7.0, 7.0)],
        "flexible_coupling": [Number(("coupling",), "stiffness_nm_per_rad", model.j / tau**2, COUPLINGS, 0.01, 1e6),
                              Number(("coupling_damping",), "damping", model.j / tau, (0.3,), 0.0, 100.0),
                              Number(("load_share",), "load_share", 1.0, (0.5,), 0.05, 0.95)],
        "speed_saturation": [Number(("limit_speed",), "limit_rad_s", speed, (0.9, 1.0), 0.1, 2.0)],
        "sensor_rectified": [], "sensor_offset": [either("reading_offset", "offset", speed)],
    }  # fmt: skip
    if effect not in table:
        raise NotOffered(f"{effect} is not in this simulation")
    return table[effect]


def turn(record: Record) -> float:
    return float(np.max(np.abs(record.position()))) + 1e-9


def base(model: Model) -> list[tuple[Number, float]]:
    """The numbers of the model file with the spread, as a logarithm, that the file gives them."""
    spread = 3.0 if model.fitted else model.tolerance
    names = ("r", "l", "j", "b") if model.ke > 0.0 else ("kt", "b")
    ratios = [(Number((name,), name, 1.0, (1.0,), 0.02, 50.0), spread) for name in names]
    if model.ke > 0.0:
        ratios.append((Number(("kt", "ke"), "k", 1.0, (1.0,), 0.02, 50.0), spread))
    return ratios


#: Numbers that multiply what the model file says.
RATIOS = {"r", "l", "kt", "ke", "j", "b", "gain", "scale"}


class Problem:
    """The simulation of one case as a function of its numbers."""

    def __init__(self, case: Case) -> None:
        self.model, self.record = case.model(), case.log()
        self.effects = case.structure
        self.base = base(self.model)
        self.own = [number for effect in self.effects for number in numbers(effect, self.record, self.model)]
        self.all = [number for number, _ in self.base] + self.own
        self.noise = max(noise(self.record.y), 1e-4 * float(np.max(np.abs(self.record.y))))
        self.stiff_in_current = self.record.current is not None and self.model.ke > 0.0

    def plant(self, x: Array) -> Array:
        q = parameters(self.model)
        if "sensor_rectified" in self.effects:
            q[PLACE["rectified"]] = 1.0
        for number, value in zip(self.all, x):
            for place in number.places:
                q[PLACE[place]] = value * (q[PLACE[place]] if place in RATIOS else number.unit)
        return q

    def residuals(self, x: Array) -> Array:
        speed, amps = simulate(self.record, self.model, self.plant(x))
        parts = [(speed - self.record.y) / self.noise]
        if self.stiff_in_current and self.record.current is not None:
            parts.append((amps - self.record.current)[1:] / noise(self.record.current))
        prior = [math.log(value) / spread for (_, spread), value in zip(self.base, x)]
        return np.nan_to_num(np.concatenate([*parts, prior]), nan=1e6, posinf=1e6, neginf=-1e6)

    def starts(self) -> list[Array]:
        """Small and large starts; a number of periods is looked for over a grid."""
        most = max((len(number.starts) for number in self.own), default=1)
        starts = []
        for k in range(max(most, 1)):
            own = [number.starts[k % len(number.starts)] if number.starts else 0.0 for number in self.own]
            starts.append(np.array([1.0] * len(self.base) + own))
        for place, number in enumerate(self.all):
            if not number.starts:
                starts = [self.scanned(starts[0], place, grid(number, self.record))]
        return starts

    def scanned(self, start: Array, place: int, values: Array) -> Array:
        """The value at which a small wave, in two phases, explains most of what is left."""

        def left(value: float) -> tuple[float, Array]:
            x = start.copy()
            x[place], x[place - 1], x[place + 1] = value, 0.0, 0.0
            rest = self.residuals(x)
            x[place - 1] = 0.02
            waves = []
            for phase in (0.0, math.pi / 2):
                x[place + 1] = phase
                waves.append(self.residuals(x) - rest)
            (a, b), *_ = np.linalg.lstsq(np.column_stack(waves), -rest, rcond=None)
            x[place - 1], x[place + 1] = 0.02 * math.hypot(a, b), math.atan2(b, a)
            return float(np.linalg.norm(rest + a * waves[0] + b * waves[1])), x

        return min((left(value) for value in values), key=lambda found: found[0])[1]

    def solve(self, x: Array, evaluations: int) -> Any:
        low, high = (np.array([getattr(number, side) for number in self.all]) for side in ("low", "high"))
        inside = np.clip(x, low + 1e-9, high - 1e-9)
        return least_squares(self.residuals, inside, bounds=(low, high), x_scale="jac", max_nfev=evaluations, diff_step=1e-4)


def grid(number: Number, record: Record) -> Array:
    if number.name == "periods_per_rev":
        return np.arange(1.0, 49.0)
    return np.geomspace(0.1, 40.0, 120)


def noise(values: Array) -> float:
    """Standard deviation of white noise, from second differences."""
    return float(np.median(np.abs(np.diff(values, 2)))) / 0.6745 / math.sqrt(6.0) + 1e-12


def intervals(problem: Problem, result: Any) -> dict[str, list[float]]:
    """95 % intervals from the Jacobian; residuals that follow each other count for as many as are independent."""
    rest = result.fun[: len(problem.record.y)]
    spectrum = np.abs(np.fft.rfft(rest - rest.mean(), 2 * len(rest))) ** 2
    lags = np.fft.irfft(spectrum)[: len(rest) // 4]
    lags = lags / lags[0]
    first = int(np.argmax(lags < 0.05)) or len(lags)
    inflation = max(1.0, 1 + 2 * float(lags[1:first].sum())) * max(1.0, float(rest @ rest) / len(rest))
    data = result.jac[: len(result.fun) - len(problem.base)]
    prior = result.jac[len(result.fun) - len(problem.base) :]
    covariance = np.linalg.pinv(data.T @ data / inflation + prior.T @ prior)
    half = 1.96 * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    bounds = zip(problem.all[len(problem.base) :], result.x[len(problem.base) :], half[len(problem.base) :])
    return {number.name: [float(number.unit * (x - h)), float(number.unit * (x + h))] for number, x, h in bounds}


def answer(case: Case) -> dict[str, Any]:
    problem = Problem(case)
    short: Callable[[Array], Any] = lambda start: problem.solve(start, SHORT)  # noqa: E731
    starts = problem.starts()
    best = min((short(start) for start in starts), key=lambda result: result.cost) if len(starts) > 1 else None
    result = problem.solve(starts[0] if best is None else best.x, LONG)
    q = problem.plant(result.x)
    return {
        "fit": held_out_fit(case, lambda held_out: simulate(held_out, problem.model, q)[0]),
        "intervals": intervals(problem, result),
        "base": {number.name: float(x) for (number, _), x in zip(problem.base, result.x)},
    }


if __name__ == "__main__":
    main("scipy, structure given", f"scipy {scipy.__version__}", answer)
