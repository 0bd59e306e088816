"""A fleet on Ray ends with the same bytes whatever is killed on the way."""

import importlib.util
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from truing import InputError, fleet, fleet_check

ROOT = Path(__file__).resolve().parents[3]
FLEET = ROOT / "workbench/python/truing/fleet.py"
SHEET = """schema = "truing-model/1"
[model]
kind = "first_order"
gain_rad_s_per_v = 10.0
time_constant_s = 0.1
[supply]
nominal_v = 12.0
"""
KILLS = 20
# Starts the job; its arguments are the file of the module, manifest, folder and command.
DRIVER = """
import importlib.util, sys
spec = importlib.util.spec_from_file_location("fleet", sys.argv[1])
fleet = importlib.util.module_from_spec(spec)
sys.modules["fleet"] = fleet
spec.loader.exec_module(fleet)
import ray
ray.cloudpickle.register_pickle_by_value(fleet)
assert fleet.run(sys.argv[2], sys.argv[3], workers=2, command=[sys.argv[4]]) == []
"""


def truing():
    built = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "debug/truing"
    found = os.environ.get("TRUING") or (str(built) if built.exists() else shutil.which("truing"))
    return found or pytest.skip("no truing: build it, or name it in TRUING")


def module():
    spec = importlib.util.spec_from_file_location("fleet_alone", FLEET)
    loaded = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = loaded
    spec.loader.exec_module(loaded)
    return loaded


def table(unit, day):
    """Settled speeds of a motor that stands below some volts."""
    rows = ["u_v,omega_rad_s"]
    for tenth in range(-100, 101, 5):
        volts, edge = tenth / 10, 0.8 + 0.1 * unit
        speed = 10 * max(0, abs(volts) - edge) * (1 if volts > 0 else -1)
        rows.append(f"{volts},{speed + 0.02 * ((tenth * 7 + 3 * day + unit) % 11 - 5)}")
    return "\n".join(rows) + "\n"


def drawn(tmp_path, units, days):
    """Logs of a small fleet, and its manifest."""
    (tmp_path / "sheet.toml").write_text(SHEET)
    rows = ["unit,time,model,log"]
    for unit in range(units):
        for day in range(days):
            (tmp_path / f"{unit}-{day}.csv").write_text(table(unit, day))
            rows.append(f"u{unit},2026-03-{day + 1:02},sheet.toml,{unit}-{day}.csv")
    # The rows need not stand in the order of time.
    (tmp_path / "manifest.csv").write_text("\n".join(rows[:1] + rows[:0:-1]) + "\n")
    return tmp_path / "manifest.csv"


def slow(folder):
    """The command line, behind a wait in which it can be killed."""
    script = folder / "slow-truing"
    script.write_text(f'#!/bin/sh\nsleep 0.7\nexec {truing()} "$@"\n')
    script.chmod(0o755)
    return script


def bytes_of(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def undisturbed(manifest, into):
    subprocess.run([truing(), "fleet", "ingest", manifest, "--into", into], check=True, capture_output=True)
    whole = bytes_of(into)
    assert len(whole) == manifest.read_text().count("\n")  # A result a row, and one model file for the head.
    return whole


def descendants(pid):
    """Processes that a process started, and those that they started."""
    children = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True).stdout.split()
    return [int(child) for child in children] + [own for child in children for own in descendants(child)]


def command_of(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""


def kill(pid):
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        pass


def started(manifest, into, command):
    arguments = [sys.executable, "-c", DRIVER, FLEET, manifest, into, command]
    return subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def kill_workers(job, times):
    """Kills workers at work, one after the other; returns how many."""
    killed, until = 0, time.monotonic() + 600
    while killed < times and job.poll() is None and time.monotonic() < until:
        at_work = [pid for pid in descendants(job.pid) if command_of(pid).startswith("ray::judge")]
        if at_work:
            kill(at_work[killed % len(at_work)])
            killed += 1
        time.sleep(1.0)
    return killed


def kill_head(job):
    """Kills the head: what keeps the cluster's state, what starts workers, and the program that asked."""
    pids = descendants(job.pid)
    for pid in [pid for pid in pids if "gcs_server" in command_of(pid)] + [job.pid] + pids:
        kill(pid)
    job.communicate()


def test_without_ray_the_cores_of_this_machine_write_the_same_bytes(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    manifest = drawn(tmp_path, 3, 3)
    failed = module().run(manifest, tmp_path / "alone", workers=2, command=[truing()])
    assert failed == []
    assert bytes_of(tmp_path / "alone") == undisturbed(manifest, tmp_path / "whole")


def test_the_module_writes_the_bytes_of_the_command_line(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    manifest = drawn(tmp_path, 3, 3)
    assert fleet.run(manifest, tmp_path / "inside", workers=2) == []
    ((_, first, *_), *_), *_ = fleet.tasks(manifest)
    one = dict(model=tmp_path / "sheet.toml", log=first, unit="u0", at="2026-03-01", into=tmp_path / "inside")
    assert fleet_check(**one) == "there"
    assert fleet_check(**one | {"into": tmp_path / "one"}) == "searched"
    with pytest.raises(InputError, match="`soon` is no time"):
        fleet_check(**one | {"at": "soon"})
    assert bytes_of(tmp_path / "inside") == undisturbed(manifest, tmp_path / "whole")


def test_a_log_that_cannot_be_judged_is_told_and_keeps_no_other_from_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    manifest = drawn(tmp_path, 2, 2)
    (tmp_path / "1-0.csv").write_text("u_v,omega_rad_s\n1,two\n")
    (told,) = module().run(manifest, tmp_path / "alone", workers=2, command=[truing()])
    assert told.startswith("u1 at 2026-03-01") and "1-0.csv" in told
    assert len(bytes_of(tmp_path / "alone")) == 4


def test_twenty_killed_workers_and_a_killed_head_leave_the_same_bytes(tmp_path):
    pytest.importorskip("ray", reason="Ray is not installed")
    manifest = drawn(tmp_path, 6, 4)
    whole, into, command = undisturbed(manifest, tmp_path / "whole"), tmp_path / "on-ray", slow(tmp_path)
    job = started(manifest, into, command)
    killed = kill_workers(job, KILLS // 2)
    while not list(into.rglob("*.json")) and job.poll() is None:
        time.sleep(0.2)  # Some results are there when the head dies, and some are not.
    kill_head(job)
    before = len(bytes_of(into))
    job = started(manifest, into, command)
    killed += kill_workers(job, KILLS - killed)
    _, complaints = job.communicate(timeout=1200)
    assert job.returncode == 0, complaints
    assert killed == KILLS and 0 < before < len(whole)
    drafts = {name for name in bytes_of(into) if "/.truing-" in name}
    assert {name: text for name, text in bytes_of(into).items() if name not in drafts} == whole
