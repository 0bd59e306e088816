"""A motor with effects, for the peer that is told the structure: winding, friction with sticking, input chain, sensor."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from common import Array, Model, Record, as_sensed, delayed

#: Inner steps a time constant.
FINE = 80.0
#: Every parameter with the value at which it does nothing.
NEUTRAL: dict[str, float] = {
    "r": 1.0, "l": 0.0, "kt": 1.0, "ke": 0.0, "j": 1.0, "b": 0.0, "gear": 1.0, "supply": 12.0,
    "gain": 1.0, "offset_v": 0.0, "zone_pos": 0.0, "zone_neg": 0.0, "limit_pos": math.inf, "limit_neg": math.inf,
    "softness": 0.0, "lag_s": 0.0, "drop_v": 0.0, "source_ohm": 0.0, "limit_a": math.inf, "rise_per_w": 0.0,
    "heat_s": 1.0, "knee_a": math.inf, "dry_pos": 0.0, "dry_neg": 0.0, "breakaway": 0.0, "stribeck": 1.0,
    "per_motor": 0.0, "per_load": 0.0, "slope_pos": 0.0, "slope_neg": 0.0, "drag": 0.0, "torque": 0.0, "mgl": 0.0,
    "phase": 0.0, "spring": 0.0, "rest": 0.0, "spring_cubic": 0.0, "cogging": 0.0, "periods": 1.0, "cogging_phase": 0.0,
    "shake": 0.0,
    "shake_hz": 1.0, "shake_phase": 0.0, "load_share": 0.0, "coupling": 0.0, "coupling_damping": 0.0,
    "limit_speed": math.inf, "scale": 1.0, "reading_lag_s": 0.0, "rectified": 0.0, "reading_offset": 0.0, "delay_s": 0.0,
}  # fmt: skip
PLACE = {name: place for place, name in enumerate(NEUTRAL)}
(R, L, KT, KE, J, B, GEAR, SUPPLY, GAIN, OFFSET, ZP, ZN, LP, LN, SOFT, LAG, DROP, SOURCE, AMPS, RISE, HEAT, KNEE, DP, DN,
 BREAK, STRIBECK, PER_MOTOR, PER_LOAD, SP, SN, DRAG, TORQUE, MGL, PHASE, SPRING, REST, CUBIC, COG, PERIODS, COG_PHASE, SHAKE,
 SHAKE_HZ, SHAKE_PHASE, SHARE, COUPLING, C_DAMPING, SPEED_LIMIT, SCALE, READING_LAG, RECTIFIED, READING_OFFSET,
 DELAY) = range(len(NEUTRAL))  # fmt: skip


@njit(cache=True)
def _input(q, u):  # type: ignore[no-untyped-def]
    """The voltage behind gain, offset, dead zone and limit."""
    v = q[GAIN] * u + q[OFFSET]
    v = v - q[ZP] if v > q[ZP] else (v + q[ZN] if v < -q[ZN] else 0.0)
    limit = q[LP] if v > 0 else q[LN]
    if q[SOFT] > 1e-3 and limit < 1e9:
        return v / (1 + (abs(v) / limit) ** (1 / q[SOFT])) ** q[SOFT]
    return min(max(v, -q[LN]), q[LP])


@njit(cache=True)
def _load(q, t, th):  # type: ignore[no-untyped-def]
    """Torque that the place or the time sets."""
    return (
        q[TORQUE]
        - q[MGL] / q[GEAR] * math.sin(th / q[GEAR] + q[PHASE])
        - q[SPRING] * (th - q[REST])
        - q[CUBIC] * (th - q[REST]) ** 3
        - q[COG] * math.sin(q[PERIODS] * th + q[COG_PHASE])
        + q[SHAKE] * math.sin(2 * math.pi * q[SHAKE_HZ] * t + q[SHAKE_PHASE])
    )


@njit(cache=True)
def _current(q, v, w, i, r, h):  # type: ignore[no-untyped-def]
    """The winding's current after a step, exact for a held voltage and speed."""
    settled = (v - q[KE] * w) / r
    if q[DROP] > 0.0:
        drop = q[DROP] / r
        settled = settled - drop if settled > drop else (settled + drop if settled < -drop else 0.0)
    if q[L] > 0.0:
        settled += (i - settled) * math.exp(-h * r / q[L])
    return min(max(settled, -q[AMPS]), q[AMPS])


@njit(cache=True)
def _step(q, torque, load, w, h, inertia):  # type: ignore[no-untyped-def]
    """The speed after a step, with dry friction that holds at rest."""
    other = torque + load
    sign = 1.0 if w > 0 else (-1.0 if w < 0 else (1.0 if other > 0 else -1.0))
    more = q[PER_MOTOR] * abs(torque) + q[PER_LOAD] * abs(load)
    level = (q[DP] if sign > 0 else q[DN]) + q[BREAK] * math.exp(-((w / q[STRIBECK]) ** 2)) + more
    if w == 0.0 and abs(other) <= level:
        return 0.0
    viscous = q[B] + (q[SP] if sign > 0 else q[SN]) + q[DRAG] * abs(w)
    decay = h * viscous / inertia
    after = (w * (1 - decay / 2) + h * (other - sign * level) / inertia) / (1 + decay / 2)
    return 0.0 if after * sign < 0.0 and level > 0.0 else after


@njit(cache=True)
def _run(q, t, u, driven, th, w, inner, speed, position, amps):  # type: ignore[no-untyped-def]
    v, i, heat, reading, place = 0.0, 0.0, 0.0, w, th
    wl, thl = w, th
    speed[0], position[0], amps[0] = w, th, 0.0
    motor = q[J] * (1 - q[SHARE])
    for k in range(len(t) - 1):
        n = max(1, int(math.ceil((t[k + 1] - t[k]) / inner)))
        h = (t[k + 1] - t[k]) / n
        target = _input(q, u[k])
        if k == 0 or q[LAG] <= 0.0:
            v = target if q[LAG] <= 0.0 else 0.0
        for m in range(n):
            if q[LAG] > 0.0:
                v += (target - v) * (1 - math.exp(-h / q[LAG]))
            r = q[R] * (1 + q[RISE] * heat)
            sagged = v * (1 - q[SOURCE] * abs(v) / q[SUPPLY] * abs(i) / q[SUPPLY])
            before = i
            i = _current(q, sagged, w, i, r, h) if driven[k] > 0.5 else 0.0
            mean = (before + i) / 2 if q[L] > 0.0 else i
            heat += h / q[HEAT] * (i * i * r - heat)
            torque = q[KT] * mean / (1 + (mean / q[KNEE]) ** 2)
            twist = q[COUPLING] * (th - thl) + q[C_DAMPING] * (w - wl)
            load = _load(q, t[k] + m * h, thl if q[SHARE] > 0.0 else th)
            if q[SHARE] > 0.0:
                after = _step(q, torque, -twist, w, h, motor)
                wl += h * (twist + load) / (q[J] * q[SHARE])
                thl += h * wl
            else:
                after = _step(q, torque, load, w, h, q[J])
            th += h * (w + after) / 2
            w = after
            seen = min(max(q[SCALE] * w, -q[SPEED_LIMIT]), q[SPEED_LIMIT])
            reading = seen if q[READING_LAG] <= 0.0 else reading + (seen - reading) * (1 - math.exp(-h / q[READING_LAG]))
            shown = (abs(reading) if q[RECTIFIED] > 0.5 else reading) + q[READING_OFFSET]
            place += h * shown
        speed[k + 1], position[k + 1], amps[k + 1] = shown, place, i


def parameters(model: Model) -> Array:
    """The plant of a model file."""
    q = np.array(list(NEUTRAL.values()))
    for name, value in (("r", model.r), ("l", model.inductance), ("kt", model.kt), ("ke", model.ke), ("j", model.j)):
        q[PLACE[name]] = value
    q[PLACE["b"]], q[PLACE["gear"]] = model.b, model.gear
    q[PLACE["supply"]] = model.supply if math.isfinite(model.supply) else 1e9
    return q


def simulate(record: Record, model: Model, q: Array) -> tuple[Array, Array]:
    """Speed as sensed, and current, from the input alone; each run starts from its first measured row."""
    late = delayed(record, float(q[DELAY]))
    speed, position, amps = (np.empty_like(record.y) for _ in range(3))
    inner = q[J] / (q[B] + q[KT] * q[KE] / q[R] + 1e-12) / FINE
    if q[SHARE] > 0.0:
        inner = min(inner, 0.1 * math.sqrt(q[J] * q[SHARE] * (1 - q[SHARE]) / q[COUPLING]))
    place = record.position()
    for run in record.runs():
        start = (float(place[run][0]), float(record.y[run][0]))
        _run(q, record.t[run], late.u[run], late.driven[run], *start, inner, speed[run], position[run], amps[run])
    return as_sensed(record, model, speed, position), amps
