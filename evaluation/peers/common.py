"""What every peer shares: cases, records, the free run of a term model, the fit, and the file of results."""

from __future__ import annotations

import argparse
import json
import math
import time
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]

#: Window over which a speed is differenced where a log has a position alone, s: the window that Truing takes on EMPS.
POSITION_WINDOW_S = 0.008
#: A level of a table of steady states is held this many time constants, so that 0.005 % of a step is left.
SETTLED = 10.0


@dataclass
class Record:
    """One log. `driven` is 0 while the bridge is open; `starts` are the rows at which separate runs begin."""

    t: Array
    u: Array
    y: Array
    theta: Array | None
    current: Array | None
    driven: Array
    starts: list[int]

    def runs(self) -> list[slice]:
        return [slice(a, b) for a, b in zip(self.starts, self.starts[1:] + [len(self.t)])]

    def position(self) -> Array:
        """The logged position, or the integral of the speed of each run."""
        if self.theta is not None:
            return self.theta
        sums = np.zeros_like(self.y)
        for run in self.runs():
            steps = np.diff(self.t[run]) * (self.y[run][1:] + self.y[run][:-1]) / 2
            sums[run] = np.concatenate([[0.0], np.cumsum(steps)])
        return sums


@dataclass
class Model:
    """The model file, as J dω/dt = kt·i − b·ω with i = (u − ke·ω)/r: `ke` is zero where the kind has no winding."""

    kind: str
    r: float
    inductance: float
    kt: float
    ke: float
    j: float
    b: float
    gear: float
    supply: float
    tolerance: float
    window: float
    causal: bool
    fitted: bool

    def time_constant(self) -> float:
        return self.j / (self.b + self.kt * self.ke / self.r)


@dataclass
class Case:
    """A data set: files, and what is known of it."""

    name: str
    group: str
    model_file: str
    log_file: str
    holdout_files: list[str]
    structure: list[str]
    truth: dict[str, Any] | None = None
    accepted: list[list[str]] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)
    static: bool = False

    def model(self) -> Model:
        return read_model(Path(self.model_file))

    def log(self) -> Record:
        return read_record(Path(self.log_file), self.static and self.model())

    def holdouts(self) -> list[Record]:
        return [read_record(Path(file), self.static and self.model()) for file in self.holdout_files]


def read_model(path: Path) -> Model:
    text = tomllib.loads(path.read_text())
    values = {**text["model"], **text.get("motor", {})}
    kind = text["model"]["kind"]
    inertia = values.get("inertia_kgm2", values.get("mass_kg", 1.0))
    r, inductance, ke = 1.0, 0.0, 0.0
    if kind == "first_order":
        b = 1 / values["time_constant_s"]
        kt = values["gain_rad_s_per_v"] * b
    elif kind == "inertia":
        kt, b = values.get("drive_gain", 1.0), values["viscous"]
    else:
        r, inductance, inertia = values["R_ohm"], values.get("L_h", 0.0), values["J_kgm2"]
        kt, b = values["Kt_nm_per_a"], values["b_nms_per_rad"]
        ke = values.get("Ke_vs_per_rad", kt)
    sensors = text.get("sensors", {})
    return Model(
        kind, r, inductance, kt, ke, inertia, b,
        gear=values.get("gear_ratio", 1.0),
        supply=text.get("supply", {}).get("nominal_v", math.inf),
        tolerance=text.get("tolerance", {}).get("default", 0.05),
        window=sensors.get("speed_window_s", 0.0),
        causal=sensors.get("speed") == "encoder_difference_causal",
        fitted=values.get("fitted_to_log", False),
    )  # fmt: skip


def read_record(path: Path, table_of: Model | bool = False) -> Record:
    """Reads a log. A table of steady states becomes a staircase: each level is held until it is settled and read at its end."""
    names = path.open().readline().strip().split(",")
    rows = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    columns = dict(zip(names, rows.T))
    first = next(columns[name] for name in ("u_v", "current_a", "torque_nm", "tau_Nm") if name in columns)
    theta = next((columns[name] for name in ("theta_rad", "q_m", "q_rad") if name in columns), None)
    if isinstance(table_of, Model):
        t = np.arange(len(first)) * SETTLED * table_of.time_constant()
    else:
        t = columns["t_s"]
    run = columns.get("run", np.zeros_like(t))
    starts = [0, *(np.flatnonzero(np.diff(run)) + 1).tolist()]
    y = next((columns[name] for name in ("omega_rad_s", "v_m_s", "w_rad_s") if name in columns), None)
    if y is None:
        assert theta is not None, f"{path}: neither speed nor position"
        y = windowed(t, theta, POSITION_WINDOW_S, causal=False)
    driven = (columns.get("bridge", np.ones_like(t)) == 1).astype(float)
    return Record(t, first, y, theta, columns.get("i_a"), driven, starts)


def windowed(t: Array, position: Array, window: float, causal: bool) -> Array:
    """What a sensor shows that takes the difference of a position over a window, s."""
    late = t if causal else t + window / 2
    early = late - window
    back, ahead = np.maximum(early, t[0]), np.minimum(late, t[-1])
    return (np.interp(ahead, t, position) - np.interp(back, t, position)) / np.maximum(ahead - back, 1e-12)


def as_sensed(record: Record, model: Model, speed: Array, position: Array) -> Array:
    """The simulated speed as the sensor shows it that the model file describes."""
    if model.window == 0.0:
        return speed
    shown = np.empty_like(speed)
    for run in record.runs():
        shown[run] = windowed(record.t[run], position[run], model.window, model.causal)
    return shown


def aligned(record: Record, model: Model) -> Array:
    """The measured speed at the time at which it was true: the difference over a past window is late by half of it."""
    if not model.causal or model.window == 0.0:
        return record.y
    out = np.empty_like(record.y)
    for run in record.runs():
        out[run] = np.interp(record.t[run] + model.window / 2, record.t[run], record.y[run])
    return out


def delayed(record: Record, seconds: float) -> Record:
    """The same record with an input that acts later: of each row the mean of the held input, moved."""
    if seconds <= 0.0:
        return record
    u, driven = record.u.copy(), record.driven.copy()
    for run in record.runs():
        t = record.t[run]
        last = 2 * t[-1] - t[-2]
        edges = np.append(t, last)
        for whole, moved in ((record.u[run], u[run]), (record.driven[run], driven[run])):
            area = np.concatenate([[0.0], np.cumsum(whole * np.diff(edges))])
            at = edges - seconds
            moved_area = np.interp(at, edges, area) + np.minimum(at - t[0], 0.0) * whole[0]
            moved[:] = np.diff(moved_area) / np.diff(edges)
        driven[run] = np.round(driven[run])
    return replace(record, u=u, driven=driven)


def behind_winding(record: Record, model: Model) -> Record:
    """The input as it acts behind the winding of the model file, whose lag L/R counts as a delay."""
    return delayed(record, model.inductance / model.r)


def fit_percent(measured: list[Array], predicted: list[Array]) -> float:
    """100 (1 − ‖y − ŷ‖ / ‖y − ȳ‖) over all held-out records together; NRMSE is 1 − fit/100."""
    y, prediction = np.concatenate(measured), np.concatenate(predicted)
    if not np.all(np.isfinite(prediction)):
        return -math.inf
    return float(100 * (1 - np.linalg.norm(y - prediction) / np.linalg.norm(y - y.mean())))


def held_out_fit(case: Case, predict: Callable[[Record], Array]) -> float:
    """The free run over the held-out records: every run starts from its first measured row and sees the input alone."""
    records = case.holdouts()
    return fit_percent([record.y for record in records], [predict(record) for record in records])


def judged(case: Case, names: list[str]) -> bool | None:
    """Is this the right name? `names` holds the names given; `a|b` stands for both where the data cannot tell them apart."""
    given = [set(name.split("|")) for name in names]
    if case.truth is not None:
        hidden = [FAMILY.get(name, name) for name in case.truth["hidden"]]
        named = [{FAMILY.get(name, name) for name in group} for group in given]
        return len(named) == len(hidden) and all(any(name in group for group in named) for name in hidden)
    if not case.accepted:
        return None
    every = set().union(*given)
    return all(every & set(group) for group in case.accepted) and not any(group <= set(case.wrong) for group in given)


#: Names that count as one, as docs/naming.md says.
FAMILY = {"encoder_scale": "drive_gain", "stribeck_friction": "coulomb_friction"}


def main(peer: str, version: str, answer: Callable[[Case], dict[str, Any]], warm_up: bool = True) -> None:
    """Runs one peer over the list of cases and writes its results. Cases that stand there are not run again; one that a
    peer cannot do is written with its reason."""
    parser = argparse.ArgumentParser(description=f"{peer} over the cases")
    parser.add_argument("--cases", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", default="", help="part of a case's name")
    arguments = parser.parse_args()
    results: dict[str, Any] = json.loads(arguments.out.read_text())["results"] if arguments.out.is_file() else {}
    cases = [Case(**entry) for entry in json.loads(arguments.cases.read_text())]
    if warm_up:  # what is compiled at the first call is no work on a case
        answer(cases[0])
    for case in cases:
        if arguments.only in case.name and case.name not in results:
            begin = time.process_time()
            try:
                result = answer(case)
            except NotOffered as reason:
                result = {"skipped": str(reason)}
            result.setdefault("cpu_s", time.process_time() - begin)
            if "names" in result:
                result["right"] = judged(case, result["names"])
            results[case.name] = result
            print(f"{peer}: {case.name}: {json.dumps(result)}", flush=True)
            arguments.out.write_text(json.dumps({"peer": peer, "version": version, "results": results}, indent=1) + "\n")


class NotOffered(Exception):
    """The peer has no way to do this case; the text says why."""
