"""Runs exported models in MuJoCo beside `truing simulate`: `cargo xtask engines` calls it.

One line a case; the last lines are the table. Errors are rms of the difference of speeds over the rms of the speed.
"""
import argparse, csv, math, pathlib, subprocess
import mujoco
import numpy as np
from mujoco_servo import Servo
from truth import moved, rms, simulated

ROW_S = 1e-3
LIMITS = {"native": 0.3, "helper": 0.5, "half": 0.1}


def free_run(seconds):
    """Chirp, then square reversals at three levels: everything is met within five seconds."""
    t = np.arange(round(seconds / ROW_S) + 1) * ROW_S
    sine = 9 * np.sin(2 * math.pi * (0.3 * t + 0.25 * t**2))
    square = np.select([t % 1 < 0.3, t % 1 < 0.6], [9.0, -7.0], 2.5)
    return t, np.where(t % 5 < 3, sine, square)


def write(path, columns, rows):
    with open(path, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(columns)
        out.writerows(rows)


def run(xml, u, parts=1):
    """Speed as the sensor shows it at each row, and whether a helper stands beside the file."""
    servo = Servo(xml, ROW_S, parts)
    return servo.driven(u)[0], servo.helper is not None


def one(truing, folder, name, u):
    model, xml = folder / f"{name}.toml", folder / f"{name}.xml"
    xml.with_name(name + "_helper.py").unlink(missing_ok=True)
    subprocess.run([truing, "export", "--to", "mjcf", model, "--out", xml], check=True, stderr=subprocess.DEVNULL)
    wanted = simulated(truing, model, folder / "input.csv")
    speed, helped = run(xml, u)
    finer, _ = run(xml, u, 2)
    scale = 100 / max(rms(wanted), 1e-9)
    near = moved(truing, model, folder / "input.csv", wanted)
    return {"case": name, "kind": "helper" if helped else "native", "error": scale * rms(speed - wanted), "half": scale * rms(finer - speed), "moved": scale * near}


def main():
    ask = argparse.ArgumentParser()
    ask.add_argument("--truing", required=True)
    ask.add_argument("--folder", type=pathlib.Path, required=True)
    ask.add_argument("--only", default="", help="cases whose name begins so")
    chosen = ask.parse_args()
    folder = chosen.folder
    t, u = free_run(5)
    write(folder / "input.csv", ["t_s", "u_v"], zip(t, u))
    names = sorted(path.stem for path in folder.glob("*.toml") if path.stem.startswith(chosen.only or ("one_", "three_")))
    cases = []
    for name in names:
        cases.append(one(chosen.truing, folder, name, u))
        print("{case:34} {kind:6} {error:8.3f} % half {half:7.3f} % truth moves {moved:7.3f} %".format(**cases[-1]), flush=True)
    print(f"MuJoCo {mujoco.__version__}")
    for kind in ("native", "helper"):
        all_of = [case for case in cases if case["kind"] == kind]
        those = [case for case in all_of if case["moved"] <= LIMITS[kind]]
        within = sum(case["error"] <= LIMITS[kind] for case in those)
        half = sum(case["half"] <= LIMITS["half"] for case in those)
        worst = max(those, key=lambda case: case["error"], default={"error": 0, "case": "-"})
        middle = np.median([case["error"] for case in those]) if those else 0
        print(f"{kind}: {within} of {len(those)} within {LIMITS[kind]} %, median {middle:.3f} %, worst {worst['error']:.3f} % ({worst['case']}); halved step within 0.1 %: {half}; left out, because 0.05 % of R moves the truth more: {[case['case'] for case in all_of if case not in those]}")


main()
