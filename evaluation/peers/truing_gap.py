"""Truing: `truing gap` names what is missing and extends the model, `truing simulate` runs the extended model."""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from common import Array, Case, Model, Record, as_sensed, held_out_fit, main

TRUING = os.environ.get("TRUING", "truing")


def truing(*arguments: str) -> None:
    subprocess.run([TRUING, *arguments], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def simulated(extended: Path, record: Record, model: Model, folder: Path, column: str) -> Array:
    """The record through `truing simulate`."""
    number = np.zeros(len(record.t))
    number[record.starts[1:]] = 1
    rows = np.column_stack([np.cumsum(number), record.t, record.u, record.driven])
    head = f"run,t_s,{column},bridge"
    np.savetxt(folder / "input.csv", rows, "%.12g", ",", header=head, comments="")
    truing("simulate", "--model", str(extended), "--input", str(folder / "input.csv"), "--out", str(folder / "out.csv"))
    names = (folder / "out.csv").open().readline().strip().split(",")
    columns = dict(zip(names, np.loadtxt(folder / "out.csv", delimiter=",", skiprows=1).T))
    speed, position = (columns.get(a, columns.get(b)) for a, b in (("omega_rad_s", "v_m_s"), ("theta_rad", "q_m")))
    assert speed is not None and position is not None
    # Rows that stand twice in the input are simulated once.
    shown = [np.empty_like(record.y) for _ in range(2)]
    for place, run in enumerate(record.runs()):
        ours = columns["run"] == place
        for out, values in zip(shown, (speed, position)):
            out[run] = np.interp(record.t[run], columns["t_s"][ours], values[ours])
    return as_sensed(record, model, shown[0], shown[1])


def from_rest(case: Case) -> bool:
    """`truing simulate` starts every run at rest."""
    moving = [abs(record.y[start]) / np.max(np.abs(record.y)) for record in case.holdouts() for start in record.starts]
    return max(moving) < 0.05


def answer(case: Case) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as name:
        folder, begin = Path(name), children()
        arguments = ["--model", case.model_file, "--log", case.log_file, "--out", name, "--json", f"{name}/gap.json"]
        truing("gap", *arguments, "--holdout", *case.holdout_files)
        spent = children() - begin
        found = json.loads((folder / "gap.json").read_text())
        reported = found["holdout"]["fit_percent_after"]
        extended = folder / "model.extended.toml"
        if not extended.is_file():
            extended = Path(case.model_file)
        column = "current_a" if "current_a" in Path(case.log_file).open().readline() else "u_v"
        fit = reported
        if from_rest(case) and not case.static:
            fit = held_out_fit(case, lambda record: simulated(extended, record, case.model(), folder, column))
    return {
        "names": [effect["name"] for effect in found["effects"]],
        "verdict": found["verdict"],
        "fit": fit,
        "reported": reported,
        "intervals": {
            key: [value["value"] - 1.96 * value["std"], value["value"] + 1.96 * value["std"]]
            for effect in found["effects"]
            for key, value in effect["parameters"].items()
            if value.get("std") is not None
        },
        "cpu_s": spent,
    }


def version() -> str:
    return subprocess.run([TRUING, "--version"], check=True, capture_output=True, text=True).stdout.strip()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--truing", default=TRUING)
    own, rest = parser.parse_known_args()
    TRUING = own.truing
    sys.argv[1:] = rest
    main("Truing", version(), answer, warm_up=False)
