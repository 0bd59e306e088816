"""Fleets on many machines: one task a unit, on Ray where it is installed, else on this machine's cores.

Ray holds nothing that matters: results are files in a folder that all machines see, a task skips those that are there, and a file holds
the same bytes whoever writes it. After any kill, run it again.
"""

from __future__ import annotations

import csv
import os
import secrets
import subprocess
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from datetime import datetime, timezone
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeAlias

#: Model, log, unit, time.
Check: TypeAlias = tuple[str, str, str, str]
# How often Ray starts a task again whose worker dies. A task that was begun again goes on behind its last result.
RETRIES = 100


def tasks(manifest: str | os.PathLike[str]) -> list[list[Check]]:
    """The rows of each unit in the order of time, as arguments of a check: (model, log, unit, time)."""
    folder = Path(manifest).resolve().parent
    units: dict[str, list[tuple[datetime, Check]]] = {}
    with open(manifest, newline="") as file:
        for row in csv.DictReader(file, skipinitialspace=True):
            at = datetime.fromisoformat(row["time"].strip().replace("Z", "+00:00"))
            at = at if at.tzinfo else at.replace(tzinfo=timezone.utc)
            check = (str(folder / row["model"]), str(folder / row["log"]), row["unit"], row["time"].strip())
            units.setdefault(row["unit"], []).append((at, check))
    return [[check for _, check in sorted(rows)] for _, rows in sorted(units.items())]


def judge(rows: Sequence[Check], into: str | os.PathLike[str], command: Sequence[str] | None = None) -> list[str]:
    """Judges the logs of one unit; returns a sentence for each that could not be judged."""
    os.environ["RAYON_NUM_THREADS"] = "1"  # A worker has one core: threads would only wait for each other.
    failed = []
    for model, log, unit, at in rows:
        if command is None:
            try:
                _module()(model=model, log=log, unit=unit, at=at, into=into)
            except ValueError as error:
                failed.append(f"{unit} at {at}: {error}")
            continue
        options = ["--model", model, "--log", log, "--unit", unit, "--at", at, "--into", str(into)]
        ended = subprocess.run([*command, "fleet", "check", *options], capture_output=True, text=True)
        if ended.returncode < 0:
            raise RuntimeError(f"{unit} at {at}: killed by signal {-ended.returncode}")  # Worth another try.
        if ended.returncode > 0:
            failed.append(f"{unit} at {at}: {ended.stderr.strip()}")
    return failed


def _module() -> Callable[..., object]:
    from truing import fleet_check  # Only here: with a command this file needs no package around it.

    return fleet_check


def run(
    manifest: str | os.PathLike[str],
    into: str | os.PathLike[str],
    workers: int | None = None,
    address: str | None = None,
    command: Sequence[str] | None = None,
) -> list[str]:
    """Judges all logs of a manifest and returns what could not be judged, a sentence each.

    `workers`: one-core workers, as many as there are cores unless said otherwise. `address`: a Ray cluster that runs already; its
    machines must see manifest, logs and `into` under the same paths. `command`: how the command line starts, for example
    `["truing"]`; without it `truing.fleet_check` is called in each worker, and a script calls `run` below `if __name__ == "__main__":`.
    """
    workers = workers or os.cpu_count()
    units, into = tasks(manifest), Path(into).resolve()
    try:
        import ray
    except ImportError:
        # The module's own threads do not live on in a forked process.
        with ProcessPoolExecutor(workers, get_context(None if command else "spawn")) as pool:
            told = pool.map(judge, units, [into] * len(units), [command] * len(units))
            return [one for unit in told for one in unit]
    if not ray.is_initialized():
        alone: dict[str, Any] = {}
        if address is None:  # Ray listens on this machine only, and its token does not go into a file of the home folder.
            os.environ.setdefault("RAY_AUTH_TOKEN", secrets.token_hex(32))
            alone = dict(num_cpus=workers, _node_ip_address="127.0.0.1", include_dashboard=False)
        ray.init(address=address, log_to_driver=False, **alone)
    task = ray.remote(num_cpus=1, max_retries=RETRIES, retry_exceptions=[RuntimeError])(judge)
    return [one for unit in ray.get([task.remote(rows, into, command) for rows in units]) for one in unit]
