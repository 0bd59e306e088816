"""The way back: MuJoCo makes a log from an export, and `truing gap` searches it; `cargo xtask engines --back` calls it.

With the extended model nothing must be missing, with the nominal one the effect. Cases come from the example `engine_trips`; a name counts as in
docs/naming.md. One line a case, the last ones are the count.
"""
import argparse, csv, json, pathlib, subprocess, tomllib
import numpy as np
from mujoco_servo import Servo
from truth import moved, simulated

QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
# Levels of a table, a way; each is met on the way up and on the way down, so that its noise is seen.
LEVELS = 41


def write(path, columns):
    with open(path, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(columns)
        out.writerows(zip(*([f"{value:.9g}" for value in values] for values in columns.values())))


def record(xml, trip, given, noise):
    """Time, input, angle of the encoder, speed of the tacho and current: that of the helper's winding, else torque over the torque constant."""
    speed, angle, torque, current = Servo(xml, trip["interval_s"]).driven(given["u_v"])
    count = 2 * np.pi / trip["counts_per_rev"]
    current = np.where(np.isnan(current), torque / trip["constant_nm_per_a"], current)
    return {
        "t_s": given["t_s"],
        "u_v": given["u_v"],
        "theta_rad": np.floor(angle / count + noise.uniform()) * count,
        "omega_rad_s": speed + noise.normal(0, trip["sigma_rad_s"], len(speed)),
        "i_a": current + noise.normal(0, trip["current_sigma_a"], len(current)),
    }


def table(xml, trip, noise):
    """Settled speeds at levels of the input, up and down."""
    up = np.linspace(-1, 1, LEVELS) * trip["volts"]
    volts = np.concatenate([up, up[::-1]])
    # The first is the start at rest: each level is shown at its end.
    speed = Servo(xml, trip["settled_s"]).driven([*volts, 0.0])[0][1:]
    return {"u_v": volts, "omega_rad_s": speed + noise.normal(0, trip["sigma_rad_s"], len(speed))}


def answer(truing, folder, model):
    """Verdict and names of the search."""
    out = folder / f"{model}.json"
    out.unlink(missing_ok=True)
    run = [truing, "gap", "--model", folder / f"{model}.toml", "--log", folder / "log.csv", "--json", out]
    if (folder / "holdout.csv").exists():
        run += ["--holdout", folder / "holdout.csv"]
    subprocess.run(run, **QUIET)
    if not out.exists():
        return "failed", []
    result = json.loads(out.read_text())
    return result["verdict"], [effect["name"] for effect in result["effects"]]


def back(truing, folder):
    trip = tomllib.loads((folder / "trip.toml").read_text())
    xml = folder / "servo.xml"
    xml.with_name("servo_helper.py").unlink(missing_ok=True)
    subprocess.run([truing, "export", "--to", "mjcf", folder / "extended.toml", "--out", xml], check=True, **QUIET)
    noise = np.random.default_rng(trip["seed"])
    if trip["table"]:
        write(folder / "log.csv", table(xml, trip, noise))
    else:
        for name in ("log", "holdout"):
            given = np.genfromtxt(folder / f"{name}_input.csv", delimiter=",", names=True)
            write(folder / f"{name}.csv", record(xml, trip, given, noise))
    extended, nominal = (answer(truing, folder, model) for model in ("extended", "nominal"))
    result = {
        "case": folder.name,
        "nothing_missing": extended[0] == "nothing_missing",
        "named": len(nominal[1]) == 1 and nominal[1][0] in trip["right"],
        "extended": extended,
        "nominal": nominal,
        "visibility": round(trip["visibility"], 2),
        "tolerance": trip["tolerance"],
    }
    if not (trip["table"] or result["nothing_missing"] and result["named"]):
        # In deviations of the noise. Beyond one, the case asks more of an engine than its search could see.
        model, given = folder / "extended.toml", folder / "log_input.csv"
        result["truth_moves"] = round(moved(truing, model, given, simulated(truing, model, given)) / trip["sigma_rad_s"], 2)
    return result


def main():
    ask = argparse.ArgumentParser()
    ask.add_argument("--truing", required=True)
    ask.add_argument("--folder", type=pathlib.Path, required=True)
    ask.add_argument("--only", default="", help="cases whose name begins so")
    chosen = ask.parse_args()
    trips = []
    for folder in sorted(path.parent for path in chosen.folder.glob("*/trip.toml")):
        if folder.name.startswith(chosen.only):
            trips.append(back(chosen.truing, folder))
            print(trips[-1], flush=True)
    for key in ("nothing_missing", "named"):
        missed = [trip["case"] for trip in trips if not trip[key]]
        print(f"round trip, {key}: {len(trips) - len(missed)} of {len(trips)}; not: {missed}")


main()
