"""The textbook: stepwise regression of the acceleration on known terms; BIC decides what enters and when to stop."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

from common import Array, Case, Model, Record, aligned, behind_winding, delayed, held_out_fit, main
from parameters import shifted
from terms import Term, free_run

#: Windows of the smoothing differentiator that are tried, rows; the free run over the log decides.
WINDOWS = (5, 9, 15, 25, 41)
#: Grids of constants that a linear regression cannot find: parts of the largest input or speed.
ZONES = (0.02, 0.03, 0.05, 0.07, 0.1, 0.14, 0.2, 0.3)
LIMITS = (0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
STRIBECK = (0.01, 0.03, 0.1)
#: Delays that are tried, time constants.
DELAYS = (0.0, 0.03, 0.1, 0.2, 0.35, 0.5, 0.7)
#: More rows than this are thinned after the filter.
ROWS = 6000
CANDIDATES_OF_A_TURN = (1, 2, 3, 4, 6, 8, 10, 12, 14, 20, 24, 28, 36, 42)
#: Signs that terms have for physical reasons: friction brakes, a spring pulls back, a dead zone takes input away.
SIGNS = {
    "coulomb_friction": {"sign(w)": -1},
    "coulomb_asymmetric": {"sign(w)": -1},
    "quadratic_drag": {"w|w|": -1},
    "stribeck_friction": {"sign(w)": -1, "Stribeck": -1},
    "torsional_spring": {"theta": -1},
    "dead_zone": {"clip(u)": -1},
    "dead_zone_asymmetric": {"sign(u)": -1},
    "voltage_saturation": {"clip(u)": 1},
}

Group = tuple[str, list[Term]]


def candidates(record: Record, model: Model, settled: bool) -> Iterator[Group]:
    """What may enter, each with the names of what it stands for."""
    u, w = float(np.max(np.abs(record.u))), float(np.max(np.abs(record.y)))
    yield "constant_load|voltage_offset", [Term("1")]
    if settled:  # in a table friction is a dead zone, and whatever bends over u is a limit
        yield "dead_zone_asymmetric|coulomb_asymmetric", [Term("sign(u)"), Term("1")]
        for part in ZONES:
            yield "dead_zone|coulomb_friction", [Term("clip(u)", part * u)]
        for part in LIMITS:
            yield "voltage_saturation", [Term("clip(u)", part * u)]
        return
    yield "coulomb_friction|voltage_drop", [Term("sign(w)")]
    yield "coulomb_asymmetric", [Term("sign(w)"), Term("1")]
    yield "viscous_asymmetric", [Term("|w|")]
    yield "quadratic_drag", [Term("w|w|")]
    for part in STRIBECK:
        yield "stribeck_friction", [Term("sign(w)"), Term("Stribeck", part * w)]
    for part in ZONES:
        yield "dead_zone", [Term("clip(u)", part * u)]
    for part in LIMITS:
        yield "voltage_saturation", [Term("clip(u)", part * u)]
    yield "dead_zone_asymmetric", [Term("sign(u)"), Term("d")]
    if record.theta is not None and model.kind != "inertia":
        yield "torsional_spring", [Term("theta"), Term("1")]
        yield "gravity", [Term(f"{wave}(theta)", 1 / model.gear) for wave in ("sin", "cos")]
        for n in CANDIDATES_OF_A_TURN:
            yield "cogging", [Term(f"{wave}(theta)", float(n)) for wave in ("sin", "cos")]


def smoothed(record: Record, values: Array, window: int) -> Array:
    """Savitzky and Golay's filter over every run."""
    out = np.empty_like(values)
    for run in record.runs():
        length = min(window, (len(values[run]) - 1) // 2 * 2 + 1)
        out[run] = savgol_filter(values[run], length, min(3, length - 1))
    return out


class Regression:
    """The acceleration equation of one log, differentiated over one window."""

    def __init__(self, case: Case, record: Record, model: Model, window: int) -> None:
        self.case, self.record, self.model, self.window = case, record, model, window
        self.stride = 1 + len(record.t) // ROWS
        self.raw = aligned(record, model)
        self.columns: dict[Term, Array] = {}
        if case.static:  # settled: nothing accelerates, and the speed itself is explained
            self.speed, self.slope = self.raw, self.raw / model.time_constant()
        else:
            self.speed = smoothed(record, self.raw, window)
            self.slope = np.concatenate([np.gradient(self.speed[run], record.t[run]) for run in record.runs()])
        u_acts_late = np.concatenate([[record.u[0]], record.u[:-1]])
        self.u = record.u if case.static else (record.u + u_acts_late) / 2
        self.base = [Term("u")] if case.static else [Term("u"), Term("w")]
        if record.driven.min() == 0.0:
            self.base.append(Term("w d"))

    def column(self, term: Term, place: Array) -> Array:
        """A term of every row, filtered as the speed is: both sides of the equation see the same filter."""
        if term not in self.columns:
            speed = self.raw if term.name in ("w", "w d") else self.speed
            column = term.column(place, speed, self.u, self.record.driven)
            self.columns[term] = column if self.case.static else smoothed(self.record, column, self.window)
        return self.columns[term]

    def solved(self, terms: list[Term]) -> tuple[Array, Array, float]:
        """Coefficients, their covariance, and BIC over rows that are independent."""
        place = self.record.position()
        matrix = np.column_stack([self.column(term, place)[:: self.stride] for term in terms])
        scale = np.linalg.norm(matrix, axis=0) + 1e-300
        slope = self.slope[:: self.stride]
        found, *_ = np.linalg.lstsq(matrix / scale, slope, rcond=1e-10)
        rest = slope - matrix @ (found / scale)
        independent = len(self.slope) / (1 if self.case.static else self.window)
        variance = float(rest @ rest) / max(independent - len(terms), 1) * (independent / len(rest))
        covariance = np.linalg.pinv((matrix / scale).T @ (matrix / scale)) * variance * len(rest) / independent
        bic = independent * np.log(float(rest @ rest) / len(rest)) + len(terms) * np.log(independent)
        return found / scale, covariance / np.outer(scale, scale), float(bic)

    def bic(self, name: str, terms: list[Term], group: list[Term]) -> float:
        """BIC; what has a sign that its physics forbids does not enter."""
        found, _, bic = self.solved(terms)
        signs = SIGNS.get(name.split("|")[0], {})
        allowed = all(found[terms.index(term)] * signs.get(term.name, 0) >= 0 for term in group)
        return bic if allowed else np.inf

    def stepwise(self) -> tuple[list[str], list[Term]]:
        """Adds the group that lowers BIC most, until none does."""
        names: list[str] = []
        terms = list(self.base)
        best = self.solved(terms)[2]
        while True:
            offers = [
                (self.bic(name, terms + [term for term in group if term not in terms], group), name, group)
                for name, group in candidates(self.record, self.model, self.case.static)
                if name not in names and any(term not in terms for term in group)
            ]
            bic, name, group = min(offers, key=lambda offer: offer[0], default=(np.inf, "", []))
            if bic >= best:
                return names, terms
            best, names = bic, [*names, name]
            terms = terms + [term for term in group if term not in terms]

    def predict(self, terms: list[Term], found: Array, record: Record) -> Array:
        if not self.case.static:
            return free_run(record, self.model, terms, found)
        columns = [term.column(record.position(), record.y, record.u, record.driven) for term in terms]
        return np.column_stack(columns) @ found * self.model.time_constant()


def best_delay(case: Case, record: Record, model: Model) -> float:
    """The delay of the input, s, with which the equation is explained best; none unless BIC asks for it plainly."""
    tried = []
    for part in (0.0,) if case.static else DELAYS:
        seconds = part * model.time_constant()
        regression = Regression(case, delayed(record, seconds), model, WINDOWS[1])
        tried.append((regression.solved(regression.stepwise()[1])[2], seconds))
    best = min(tried)
    return best[1] if best[0] < tried[0][0] - np.log(len(record.t)) else 0.0


def answer(case: Case) -> dict[str, Any]:
    model = case.model()
    record = behind_winding(case.log(), model)
    delay = best_delay(case, record, model)
    late = delayed(record, delay)
    best: tuple[float, Any] = (np.inf, None)
    for window in (1,) if case.static else WINDOWS:
        regression = Regression(case, late, model, window)
        names, terms = regression.stepwise()
        found, covariance, _ = regression.solved(terms)
        error = float(np.linalg.norm(record.y - regression.predict(terms, found, late)))
        if best[1] is None or error < best[0]:
            best = (error, (regression, names, terms, found, covariance))
    regression, names, terms, found, covariance = best[1]

    def predict(held_out: Record) -> Array:
        return regression.predict(terms, found, delayed(behind_winding(held_out, model), delay))

    late_name = ["transport_delay|sensor_lag|actuator_lag"] if delay > 0.0 else []
    return {
        "names": names + late_name or shifted(model, terms, found, covariance),
        "terms": {str(term): float(c) for term, c in zip(terms, found)} | {"delay_s": delay},
        "fit": held_out_fit(
            case, lambda held_out: regression.predict(terms, found, delayed(behind_winding(held_out, model), delay))
        ),
        "window": regression.window,
        "intervals": sizes(model, terms, found, covariance, names),
    }


def sizes(model: Model, terms: list[Term], found: Array, covariance: Array, names: list[str]) -> dict[str, list[float]]:
    """95 % intervals of what a single name says, in its unit: a coefficient over that of u, by the delta method."""
    parameter = {"sign(w)": ("level_nm", -1.0), "1": ("torque_nm", 1.0), "w|w|": ("drag_nms2", -1.0)}
    intervals: dict[str, list[float]] = {}
    for place, term in enumerate(terms):
        if term.name in parameter and len(names) == 1:
            name, sign = parameter[term.name]
            unit = sign * model.kt / model.r
            ratio = found[place] / found[0]
            slope = np.zeros(len(terms))
            slope[place], slope[0] = 1 / found[0], -ratio / found[0]
            half = 1.96 * float(np.sqrt(slope @ covariance @ slope))
            intervals[name] = sorted(float(unit * (ratio + side * half)) for side in (-1, 1))
    return intervals


if __name__ == "__main__":
    main("Stepwise regression", f"numpy {np.__version__}", answer)
