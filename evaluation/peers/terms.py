"""Models that are linear in their terms, dω/dt = Σ c·φ(θ, ω, u): the terms, and their free run with sticking at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from common import Array, Model, Record, as_sensed

#: Kinds of terms by their place; `p` is a term's own constant, `d` is 0 while the bridge is open. A u acts while it is driven.
KINDS = (
    "1", "u", "w", "w d", "sign(w)", "|w|", "w|w|", "clip(u)", "tanh(w)", "sign(u)", "tanh(u)", "|u|", "d",
    "w^2", "w u", "u^2", "w^3", "w^2 u", "w u^2", "u^3", "theta", "sin(theta)", "cos(theta)", "Stribeck",
)  # fmt: skip
SIGN = KINDS.index("sign(w)")
STRIBECK = KINDS.index("Stribeck")
#: Inner steps a time constant, so that the second-order step is exact to some 0.1 %.
FINE = 20.0


@dataclass(frozen=True)
class Term:
    """One candidate: its kind and its constant."""

    name: str
    p: float = 1.0

    def __str__(self) -> str:
        return self.name if self.p == 1.0 else f"{self.name} {self.p:.4g}"

    def column(self, theta: Array, speed: Array, u: Array, driven: Array) -> Array:
        return np.asarray(_column(KINDS.index(self.name), self.p, theta, speed, u, driven))


@njit(cache=True)
def _value(kind, p, th, w, u, d):  # type: ignore[no-untyped-def]
    if kind < 8:
        s = 1.0 if w > 0 else (-1.0 if w < 0 else 0.0)
        return (1.0, u * d, w, w * d, s, abs(w), w * abs(w), min(max(u, -p), p) * d)[kind]
    if kind < 13:
        s = 1.0 if u > 0 else (-1.0 if u < 0 else 0.0)
        return (math.tanh(w / p), s * d, math.tanh(u / p) * d, abs(u) * d, d)[kind - 8]
    v = u * d
    if kind < 20:
        return (w * w, w * v, v * v, w * w * w, w * w * v, w * v * v, v * v * v)[kind - 13]
    s = 1.0 if w > 0 else (-1.0 if w < 0 else 0.0)
    return (th, math.sin(p * th), math.cos(p * th), s * math.exp(-((w / p) ** 2)))[kind - 20]


@njit(cache=True)
def _column(kind, p, theta, speed, u, driven):  # type: ignore[no-untyped-def]
    out = np.empty(len(speed))
    for k in range(len(speed)):
        out[k] = _value(kind, p, theta[k], speed[k], u[k], driven[k])
    return out


@njit(cache=True)
def _rate(kinds, ps, cs, th, w, u, d):  # type: ignore[no-untyped-def]
    rate = 0.0
    for j in range(len(kinds)):
        rate += cs[j] * _value(kinds[j], ps[j], th, w, u, d)
    return rate


@njit(cache=True)
def _run(kinds, ps, cs, level, t, u, driven, th, w, inner, bound, speed, position):  # type: ignore[no-untyped-def]
    speed[0], position[0] = w, th
    for k in range(len(t) - 1):
        n = max(1, int(math.ceil((t[k + 1] - t[k]) / inner)))
        h = (t[k + 1] - t[k]) / n
        for _ in range(n):
            rest = _rate(kinds, ps, cs, th, 0.0, u[k], driven[k])
            if w == 0.0 and abs(rest) <= level:
                continue
            sign = np.sign(w) if w != 0.0 else np.sign(rest)
            start = w if w != 0.0 else sign * 1e-9 * bound
            middle = w + h / 2 * _rate(kinds, ps, cs, th, start, u[k], driven[k])
            if middle * sign < 0.0:
                middle = start
            after = w + h * _rate(kinds, ps, cs, th + h / 2 * w, middle, u[k], driven[k])
            if after * sign < 0.0 and level > 0.0:
                after = 0.0
            th += h * (w + after) / 2
            w = min(max(after, -bound), bound)
        speed[k + 1], position[k + 1] = w, th


def free_run(record: Record, model: Model, terms: list[Term], coefficients: Array) -> Array:
    """The speed as sensed, from the input alone; each run starts from its first measured row."""
    kinds = np.array([KINDS.index(term.name) for term in terms])
    ps = np.array([term.p for term in terms])
    friction = float(sum(coefficients[(kinds == SIGN) | (kinds == STRIBECK)]))
    poles = [abs(c) for term, c in zip(terms, coefficients) if term.name in ("w", "w d")]
    inner = 1 / (FINE * max([*poles, 1e-6]))
    speed, position = np.empty_like(record.y), np.empty_like(record.y)
    place = record.position()
    for run in record.runs():
        start = (float(place[run][0]), float(record.y[run][0]))
        _run(
            kinds, ps, coefficients, max(0.0, -friction), record.t[run], record.u[run], record.driven[run], *start,
            inner, 1e3 * float(np.max(np.abs(record.y)) + 1e-9), speed[run], position[run],
        )  # fmt: skip
    return as_sensed(record, model, speed, position)
