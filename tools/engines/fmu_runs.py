"""Runs exported FMUs in FMPy beside `truing simulate`: `cargo xtask engines` calls it.

One line a case. An error is the largest difference over the largest value, of speed, angle and current; `steps`: the same between
communication steps of 1 ms and 0.4 ms under a constant voltage.
"""
import argparse, csv, math, pathlib, subprocess, sys
import fmpy
import numpy as np
from fmpy.validation import validate_fmu

ROW_S = 1e-3
LIMIT = 1e-9
COLUMNS = {"speed": "omega_rad_s", "angle": "theta_rad", "current": "i_a"}


def free_run(seconds):
    """Chirp, then square reversals at three levels: everything is met within five seconds."""
    t = np.arange(round(seconds / ROW_S) + 1) * ROW_S
    sine = 9 * np.sin(2 * math.pi * (0.3 * t + 0.25 * t**2))
    square = np.select([t % 1 < 0.3, t % 1 < 0.6], [9.0, -7.0], 2.5)
    return t, np.where(t % 5 < 3, sine, square)


def simulated(truing, model, t, u):
    """What `truing simulate` says, column by column."""
    rows = model.with_name("fmu_input.csv")
    with open(rows, "w", newline="") as file:
        csv.writer(file).writerows([("t_s", "u_v"), *zip(t.tolist(), u.tolist())])
    out = model.with_name("fmu_truth.csv")
    subprocess.run([truing, "simulate", "--model", model, "--input", rows, "--out", out], check=True)
    with open(out) as file:
        table = list(csv.DictReader(file))
    return {name: np.array([float(row[column]) for row in table]) for name, column in COLUMNS.items()}


def driven(fmu, step, t, u):
    """The FMU under the voltages of `t`, in steps of `step`; its other inputs stay as they are."""
    inputs = [it for it in fmpy.read_model_description(str(fmu)).modelVariables if it.causality == "input"]
    signals = np.zeros(len(t), dtype=[("time", float), *((it.name, float) for it in inputs)])
    for it in inputs:
        signals[it.name] = u if it.name == "voltage" else float(it.start)
    signals["time"] = t
    return fmpy.simulate_fmu(str(fmu), start_time=0.0, stop_time=t[-1], output_interval=step, input=signals, output=list(COLUMNS))


def apart(one, other):
    """The largest difference over the largest value."""
    def of(name):
        most = np.max(np.abs(other[name]))
        return np.max(np.abs(one[name] - other[name])) / most if most > 0 else np.max(np.abs(one[name]))

    return max(of(name) for name in COLUMNS)


def one(chosen, name, version):
    model = chosen.folder / f"{name}.toml"
    fmu = chosen.folder / f"{name}_{version}.fmu"
    library = ["--fmu-library", chosen.built] if chosen.built else []
    subprocess.run([chosen.truing, "export", "--to", version, model, "--out", fmu, *library], check=True)
    for problem in (problems := validate_fmu(str(fmu))):
        print(f"{name} {version}: {problem}")
    t, u = free_run(5)
    error = apart(driven(fmu, ROW_S, t, u), simulated(chosen.truing, model, t, u))
    still = np.array([0.0, 0.5]), np.array([9.0, 9.0])
    every_ms, finer = (driven(fmu, step, *still) for step in (ROW_S, 0.4 * ROW_S))
    steps = apart(finer[::5], every_ms[::2])
    fmu.unlink()
    print(f"{name:34} {version} {error:9.1e} steps {steps:9.1e}", flush=True)
    return {"case": name, "error": error, "steps": steps, "valid": not problems}


def main():
    ask = argparse.ArgumentParser()
    ask.add_argument("--truing", required=True)
    ask.add_argument("--library", dest="built", help="libtruing_fmu.so, if it is not beside the program")
    ask.add_argument("--folder", type=pathlib.Path, required=True)
    ask.add_argument("--only", default="", help="cases whose name begins so")
    chosen = ask.parse_args()
    names = sorted(path.stem for path in chosen.folder.glob("*.toml") if path.stem.startswith(chosen.only or ("one_", "three_")))
    print(f"FMPy {fmpy.__version__}")
    missed = not names
    for version in ("fmu2", "fmu3"):
        cases = [one(chosen, name, version) for name in names]
        within = sum(max(case["error"], case["steps"]) <= LIMIT for case in cases)
        valid = sum(case["valid"] for case in cases)
        worst = max(cases, key=lambda case: case["error"], default={"error": 0, "case": "-"})
        steps = max((case["steps"] for case in cases), default=0)
        print(f"{version}: {within} of {len(cases)} within {LIMIT}, {valid} valid, worst {worst['error']:.1e} ({worst['case']}), other steps {steps:.1e}")
        missed |= within < len(cases) or valid < len(cases)
    sys.exit(missed)


main()
