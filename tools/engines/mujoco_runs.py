"""Runs exported models in MuJoCo beside `truing simulate`, and back: `cargo xtask engines` calls it.

One line a case; the last lines are the table. Errors are rms of the difference of speeds over the rms of the speed.
"""
import argparse, csv, importlib.util, json, math, pathlib, re, subprocess
import mujoco
import numpy as np

ROW_S = 1e-3
LIMITS = {"native": 0.3, "helper": 0.5, "half": 0.1}


def free_run(seconds):
    """Chirp, then square reversals at three levels: everything is met within five seconds."""
    t = np.arange(round(seconds / ROW_S) + 1) * ROW_S
    sine = 9 * np.sin(2 * math.pi * (0.3 * t + 0.25 * t**2))
    square = np.select([t % 1 < 0.3, t % 1 < 0.6], [9.0, -7.0], 2.5)
    return t, np.where(t % 5 < 3, sine, square)


def rich(seconds):
    """What tells names apart without an open bridge: reversals, sines, slow triangles and stairs at several levels."""
    t = np.arange(round(seconds / ROW_S) + 1) * ROW_S
    # The log keeps every fourth row: the input is constant in between.
    t = np.floor(t / (4 * ROW_S) + 1e-9) * 4 * ROW_S
    level = np.select([t < 6, t < 12], [3.0, 6.0], 10.0)
    part, local = (t % 6) // 2, t % 2
    square = np.where(local % 1 < 0.5, 1.0, -0.7)
    sine = np.sin(2 * math.pi * (0.5 * local + local**2))
    triangle = 2 * np.abs(2 * ((local / 2 + 0.25) % 1) - 1) - 1
    return np.arange(len(t)) * ROW_S, level * np.select([part == 0, part == 1], [square, sine], triangle)


def write(path, columns, rows):
    with open(path, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(columns)
        out.writerows(rows)


def run(xml, t, u, parts=1):
    """Speed as the sensor shows it at each row. parts: into how many the advised step is divided."""
    mujoco.set_mjcb_control(None)
    mujoco.set_mjcb_act_bias(None)
    model = mujoco.MjModel.from_xml_path(str(xml))
    model.opt.timestep /= parts
    data = mujoco.MjData(model)
    path = xml.with_name(xml.stem + "_helper.py")
    servo = None
    if path.exists():
        spec = importlib.util.spec_from_file_location("helper", path)
        helper = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(helper)
        servo = helper.install(model)
    adr = model.sensor("speed").adr[0]
    read = getattr(servo, "read", None)
    steps = round(ROW_S / model.opt.timestep)
    speed = np.zeros(len(t))
    for k in range(len(t)):
        if k:
            data.ctrl[0] = u[k - 1]
            for _ in range(steps):
                mujoco.mj_step(model, data)
            if not read:
                # Sensors are those of the start of the step; this brings them up to its end.
                mujoco.mj_fwdPosition(model, data)
                mujoco.mj_fwdVelocity(model, data)
                mujoco.mj_sensorVel(model, data)
        speed[k] = read(data) if read else data.sensordata[adr]
    return speed, servo is not None


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def one(truing, folder, name, t, u):
    model, xml = folder / f"{name}.toml", folder / f"{name}.xml"
    xml.with_name(name + "_helper.py").unlink(missing_ok=True)
    subprocess.run([truing, "export", "--to", "mjcf", model, "--out", xml], check=True, stderr=subprocess.DEVNULL)
    truth = folder / f"{name}.csv"
    subprocess.run([truing, "simulate", "--model", model, "--input", folder / "input.csv", "--out", truth], check=True)
    wanted = np.genfromtxt(truth, delimiter=",", names=True)["omega_rad_s"]
    speed, helped = run(xml, t, u)
    finer, _ = run(xml, t, u, 2)
    scale = 100 / max(rms(wanted), 1e-9)
    # What a resistance of 0.05 % more does to the truth: beyond a limit the case tells nothing of the engine.
    near = folder / "near.toml"
    near.write_text(re.sub(r"R_ohm = (\S+)", lambda it: f"R_ohm = {float(it[1]) * 1.0005!r}", model.read_text()))
    subprocess.run([truing, "simulate", "--model", near, "--input", folder / "input.csv", "--out", folder / "near.csv"], check=True)
    near.unlink()
    moved = np.genfromtxt(folder / "near.csv", delimiter=",", names=True)["omega_rad_s"]
    return {"case": name, "kind": "helper" if helped else "native", "error": scale * rms(speed - wanted), "half": scale * rms(finer - speed), "moved": scale * rms(moved - wanted)}


def back(truing, folder, effect, seed):
    """A log made by the engine: nothing is missing with the extended model, the same name with the nominal one."""
    t, u = rich(18)
    speed, _ = run(folder / f"one_{effect}.xml", t, u)
    noise = np.random.default_rng(seed).normal(0, 0.003 * max(abs(speed)), len(t))
    log = folder / f"log_{effect}.csv"
    write(log, ["t_s", "u_v", "omega_rad_s"], [(f"{a:.4f}", f"{b:.6f}", f"{c:.6f}") for a, b, c in zip(t[::4], u[::4], (speed + noise)[::4])])
    found = []
    for model in (f"one_{effect}", "nominal"):
        out = folder / f"{effect}_{model}.json"
        subprocess.run([truing, "gap", "--model", folder / f"{model}.toml", "--log", log, "--json", out], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        result = json.loads(out.read_text()) if out.exists() else {"verdict": "failed", "effects": []}
        found.append((result["verdict"], [it["name"] for it in result["effects"]], json.dumps(result.get("ties", ""))))
    extended, nominal = found
    return {"case": effect, "nothing_missing": extended[0] == "nothing_missing", "named": nominal[1] == [effect], "verdict": nominal[0], "names": nominal[1], "tied": effect in nominal[2]}


def main():
    ask = argparse.ArgumentParser()
    ask.add_argument("--truing", required=True)
    ask.add_argument("--folder", type=pathlib.Path, required=True)
    ask.add_argument("--back", action="store_true", help="the round trip as well: minutes")
    ask.add_argument("--only", default="", help="cases whose name begins so")
    chosen = ask.parse_args()
    folder = chosen.folder
    t, u = free_run(5)
    write(folder / "input.csv", ["t_s", "u_v"], zip(t, u))
    names = sorted(path.stem for path in folder.glob("*.toml") if path.stem.startswith(chosen.only or ("one_", "three_")))
    cases = []
    for name in names:
        cases.append(one(chosen.truing, folder, name, t, u))
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
    if chosen.back:
        trips = []
        for seed, name in enumerate(name for name in names if name.startswith("one_")):
            trips.append(back(chosen.truing, folder, name.removeprefix("one_"), seed))
            print(trips[-1], flush=True)
        extended, named = (sum(trip[key] for trip in trips) for key in ("nothing_missing", "named"))
        print(f"round trip: nothing missing {extended} of {len(trips)}, the same name {named} of {len(trips)}")


main()
