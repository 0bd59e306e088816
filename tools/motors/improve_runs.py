"""`truing improve` on the motors beside this file, through the image in QEMU: `cargo xtask motors` calls it.

A line a run, errors in degrees rms with the numbers of before and of after. It fails where a motor follows a motion worse afterwards.
"""
import argparse, importlib.util, json, math, os, pathlib, shlex, statistics, subprocess, sys

# Program beside this file, and what it needs.
MOTORS = {"mujoco_arm": "mujoco", "scipy_lugre": "scipy", "gem_fan": "gym_electric_motor"}
HERE = pathlib.Path(__file__).parent


def improved(asked, name, seed):
    """What the command has written, or its last words."""
    result = asked.folder / f"{name}_{seed}.json"
    result.unlink(missing_ok=True)
    motor = f"exec:{shlex.quote(sys.executable)} {shlex.quote(str(HERE / name))}.py"
    command = [asked.truing, "improve", "--motor", motor, "--config", HERE / f"{name}.toml", "--image", asked.image]
    command += ["--seed", str(seed), "--budget-s", asked.budget_s, "--out", asked.folder / f"{name}_{seed}", "--json", result]
    # Small systems of equations: threads only wait for one another.
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    return json.loads(result.read_text()) if result.exists() else (done.stderr.strip() or done.stdout.strip())


def errors(found):
    """Each motion: before, after, degrees. What was not kept has changed nothing."""
    tried = [entry["trial"]["motions"] for entry in found["entries"] if entry["trial"]]
    kept = [entry["trial"]["motions"] for entry in found["entries"] if entry["trial"] and entry["kept"]]
    degrees = lambda rms: math.degrees(statistics.fmean(rms))
    first = kept[0] if kept else tried[0] if tried else []
    last = kept[-1] if kept else []
    return [(old["motion"]["name"], degrees(old["old_rms_rad"]), degrees(last[k]["new_rms_rad"] if last else old["old_rms_rad"])) for k, old in enumerate(first)]


def row(name, seed, found):
    """A line of the table, and whether the motor was left worse."""
    if isinstance(found, str):
        return f"| {name}, {seed} | – | failed: {found.splitlines()[-1]} | – | – | – |", False
    # A later round begins from the names of those before.
    names = next((entry["names"] for entry in reversed(found["entries"]) if entry["names"]), [])
    motions = errors(found)
    cells = [f"{before:.3f} → {after:.3f} ({before / after:.1f})" for _, before, after in motions] or ["–", "–"]
    outcome = ("kept: " if found["improved"] else "as it was: ") + found["why"]
    worse = any(after > before for _, before, after in motions)
    return f"| {name}, {seed} | {', '.join(names) or '–'} | {outcome} | {found['motor_s']:.1f} | {' | '.join(cells)} |", worse


def main():
    ask = argparse.ArgumentParser()
    ask.add_argument("--truing", required=True)
    ask.add_argument("--image", required=True)
    ask.add_argument("--folder", type=pathlib.Path, required=True)
    ask.add_argument("--budget-s", default="60")
    ask.add_argument("--runs", type=int, default=1)
    asked = ask.parse_args()
    print("| motor, seed | named | outcome | motor time, s | sine, ° (smaller) | crawl, ° (smaller) |\n|---|---|---|---|---|---|", flush=True)
    worse = 0
    for name, package in MOTORS.items():
        if importlib.util.find_spec(package) is None:
            print(f"skipped: {name}, because {package} is not installed")
            continue
        for seed in range(1, asked.runs + 1):
            line, is_worse = row(name, seed, improved(asked, name, seed))
            print(line, flush=True)
            worse += is_worse
    print(f"\n{worse} left worse.")
    sys.exit(worse > 0)


main()
