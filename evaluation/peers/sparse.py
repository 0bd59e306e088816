"""PySINDy: sparse regression of the differentiated speed on a library of polynomials, sign, tanh and, with a position, waves."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import numpy as np
import pysindy as ps
from scipy.signal import savgol_filter

from common import Array, Case, Model, NotOffered, Record, aligned, behind_winding, fit_percent, held_out_fit, main
from parameters import shifted
from terms import Term, free_run

#: Windows of PySINDy's smoothed finite difference, rows.
WINDOWS = (5, 11, 25)
#: Thresholds of STLSQ, and weights of SR3, on normalised columns: parts of the norm of the acceleration.
THRESHOLDS = (0.05, 0.1, 0.2, 0.4, 0.8)
#: Of two models the sparser one is taken if its free run over the log is as good to this many per cent of fit.
AS_GOOD = 2.0
#: Polynomials by degree, beside u, ω and 1.
POLYNOMIALS = {1: (), 3: ("w^2", "w u", "u^2", "w^3", "w^2 u", "w u^2", "u^3")}
MEANING = {
    "1": "constant_load|voltage_offset", "sign(w)": "coulomb_friction|voltage_drop", "tanh(w)": "coulomb_friction|voltage_drop",
    "w|w|": "quadratic_drag", "|w|": "viscous_asymmetric", "sign(u)": "dead_zone", "tanh(u)": "dead_zone",
    "u^3": "voltage_saturation", "theta": "torsional_spring", "sin(theta)": "gravity", "cos(theta)": "gravity",
}  # fmt: skip


def library(record: Record, model: Model, degree: int) -> list[Term]:
    u, w = float(np.max(np.abs(record.u))), float(np.max(np.abs(record.y)))
    terms = [Term("u"), Term("w"), Term("1"), *(Term(name) for name in POLYNOMIALS[degree])]
    terms += [Term("sign(w)"), Term("tanh(w)", 0.05 * w), Term("|w|"), Term("w|w|"), Term("sign(u)"), Term("tanh(u)", 0.1 * u)]
    if record.driven.min() == 0.0:
        terms += [Term("w d")]
    if record.theta is not None and model.kind != "inertia":
        terms += [Term("theta"), Term("sin(theta)", 1 / model.gear), Term("cos(theta)", 1 / model.gear)]
    return terms


def features(terms: list[Term]) -> Any:
    """The library as PySINDy takes it: functions of all states and inputs."""

    def function(term: Term) -> Callable[..., Array]:
        def column(theta: Array, speed: Array, u: Array, driven: Array) -> Array:
            flat = [np.ascontiguousarray(np.asarray(values), dtype=float).ravel() for values in (theta, speed, u, driven)]
            return term.column(*flat).reshape(np.shape(speed))

        return column

    names = [lambda th, w, u, d, term=term: str(term) for term in terms]
    return ps.CustomLibrary([function(term) for term in terms], names, interaction_only=True)


class Library:
    """One log and one window of the differentiator, ready for every optimizer."""

    def __init__(self, record: Record, model: Model, window: int, degree: int) -> None:
        self.terms = library(record, model, degree)
        self.degree = degree
        speed, place = aligned(record, model), record.position()
        before = np.concatenate([[record.u[0]], record.u[:-1]])
        held = (record.u + before) / 2  # a centred difference sees the mean of two held inputs
        differ = ps.SmoothedFiniteDifference(smoother_kws={"window_length": window, "polyorder": 3, "axis": 0})
        runs = [run for run in record.runs() if len(record.t[run]) > window]
        if not runs:
            raise NotOffered("its runs are shorter than the differentiator")
        self.x = [np.column_stack([place[run], speed[run]]) for run in runs]
        self.t = [record.t[run] - record.t[run][0] for run in runs]
        # The input passes through the filter that the speed passes through.
        self.u = [np.column_stack([savgol_filter(held[run], window, 3), record.driven[run]]) for run in runs]
        slopes = [differ._differentiate(x[:, 1:], t) for x, t in zip(self.x, self.t)]
        self.scale, self.window, self.differ = float(np.linalg.norm(np.concatenate(slopes))), window, differ

    def fitted(self, optimizer: Any) -> Array:
        """The coefficients of the speed's equation."""
        model = ps.SINDy(
            optimizer=optimizer,
            feature_library=features(self.terms),
            differentiation_method=self.differ,
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model.fit(self.x, t=self.t, u=self.u, feature_names=["theta", "w", "u", "d"])
        return np.asarray(model.coefficients()[1], dtype=float)


def optimizers(scale: float) -> list[tuple[str, Any]]:
    """Both optimizers over all thresholds; `scale` is the norm that a normalised coefficient is compared with."""
    made: list[tuple[str, Any]] = []
    for part in THRESHOLDS:
        threshold = part * scale
        made.append((f"STLSQ {part}", ps.STLSQ(threshold=threshold, alpha=1e-3, normalize_columns=True)))
        weight = threshold**2 / 2  # the L0 prox of SR3 cuts at sqrt(2 weight / nu)
        made.append((f"SR3 {part}", ps.SR3(reg_weight_lam=weight, relax_coeff_nu=1.0, regularizer="L0",
                                           normalize_columns=True, unbias=True)))  # fmt: skip
    return made


def answer(case: Case) -> dict[str, Any]:
    if case.static:
        raise NotOffered("a table of steady states has no derivative")
    model = case.model()
    record = behind_winding(case.log(), model)
    tried: list[tuple[float, int, int, int, str, Any]] = []
    for window in WINDOWS:
        for degree in POLYNOMIALS:
            prepared = Library(record, model, window, degree)
            for name, optimizer in optimizers(prepared.scale):
                found = prepared.fitted(optimizer)
                used = [k for k, c in enumerate(found) if c != 0.0]
                fit = predicted([prepared.terms[k] for k in used], found[used], record, model)
                tried.append((fit, len(used), window, degree, name, optimizer))
    best = max(tried, key=lambda row: row[0])[0]
    sparse = min((row for row in tried if row[0] >= best - AS_GOOD), key=lambda row: (row[1], -row[0]), default=tried[0])
    _, _, window, degree, name, optimizer = sparse
    return told(case, model, Library(record, model, window, degree), name, optimizer)


def predicted(terms: list[Term], found: Array, record: Record, model: Model) -> float:
    return fit_percent([record.y], [free_run(record, model, terms, found)]) if terms else -np.inf


def told(case: Case, model: Model, prepared: Library, name: str, optimizer: Any) -> dict[str, Any]:
    """The model over the whole log with what was chosen."""
    found = prepared.fitted(optimizer)
    terms = [term for term, c in zip(prepared.terms, found) if c != 0.0]
    kept = found[found != 0.0]
    extra = [term.name for term in terms if term.name not in ("u", "w", "w d")]
    names = sorted({MEANING.get(term, term) for term in extra})
    covariance = np.diag((0.01 * kept) ** 2)  # it gives no spread; 1 % stands for it where a parameter may be wrong
    return {
        "names": names or shifted(model, terms, kept, covariance),
        "terms": {str(term): float(c) for term, c in zip(terms, kept)},
        "fit": held_out_fit(case, lambda held_out: free_run(behind_winding(held_out, model), model, terms, kept)),
        "chosen": f"{name}, degree {prepared.degree}, {prepared.window} rows",
    }


if __name__ == "__main__":
    main("PySINDy", f"pysindy {version('pysindy')}", answer, warm_up=False)
