"""Writes the list of data sets that every peer gets: the paper's motor, measured rigs, and drawn cases with their answers."""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import tomllib
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from common import Case

ROOT = Path(__file__).resolve().parents[2]
#: What the README of a rig says is there, in the words of the library: it is given to the peers that are told the structure.
KNOWN = {
    "emps_pulses": ["coulomb_asymmetric", "viscous_asymmetric"],
    "micromouse_left_starts": ["stribeck_friction"],
    "micromouse_right_starts": ["stribeck_friction"],
    "micromouse_left_sweep": ["dead_zone_asymmetric", "voltage_saturation_asymmetric"],
    "micromouse_right_sweep": ["dead_zone_asymmetric", "voltage_saturation_asymmetric"],
    "andromeda_drive": ["coulomb_friction", "sensor_lag"],
    "angel_drive": ["coulomb_friction", "sensor_lag"],
    "basebot_drive": ["coulomb_friction"],
    "durham_arm": ["coulomb_friction", "voltage_saturation"],
    "durham_elevator": ["coulomb_friction", "constant_load"],
    "eagle_swerve": ["stribeck_friction", "transport_delay"],
    "frc501_drive": ["coulomb_friction", "transport_delay"],
    "frc5409_drive": ["stribeck_friction", "transport_delay"],
    "laas_acc": ["coulomb_friction"],
    "spectrum_shooter": ["coulomb_friction", "transport_delay"],
    "thomas_drive": ["coulomb_friction"],
    "un_map": ["dead_zone", "voltage_saturation"],
    "xl330_pwm": ["gravity", "load_dependent_friction", "voltage_saturation"],
}
#: Tables of steady states.
STATIC = {"paper", "micromouse_left_sweep", "micromouse_right_sweep", "un_map"}
QUICK = {"micromouse_left_starts", "basebot_drive", "un_map"}
#: Drawn cases: 24 with one hidden effect and 6 with none. Nobody had looked at these seeds when they were chosen.
DRAWN = (("single", 24, 912_001), ("nothing", 6, 913_001))

Row = dict[str, str]


def rewritten(source: Path, target: Path, columns: dict[str, Callable[[Row], float]], keep: Callable[[int], bool]) -> Path:
    """A log in the columns that all peers read, from the rows that are kept."""
    head, *lines = source.read_text().splitlines()
    names = head.split(",")
    rows = [dict(zip(names, line.split(","))) for k, line in enumerate(lines) if keep(k)]
    target.parent.mkdir(parents=True, exist_ok=True)
    text = [",".join(f"{make(row):.9g}" for make in columns.values()) for row in rows]
    target.write_text("\n".join([",".join(columns), *text]) + "\n")
    return target


def number(name: str, factor: float = 1.0) -> Callable[[Row], float]:
    return lambda row: float(row[name]) * factor


def halves(name: str, source: Path, columns: dict[str, Callable[[Row], float]], out: Path) -> tuple[str, list[str]]:
    """A table without a second record: its even rows are fitted, the odd ones held out."""
    files = [
        rewritten(source, out / name / file, columns, lambda k, rest=rest: k % 2 == rest)  # type: ignore[misc]
        for rest, file in enumerate(("log.csv", "holdout.csv"))
    ]
    return str(files[0]), [str(files[1])]


def paper(out: Path) -> Case:
    columns = {"u_v": number("voltage_v"), "omega_rad_s": number("speed_rpm", 0.104719755)}
    log, holdouts = halves("paper", ROOT / "data/paper/table-3.1-speed-vs-voltage.csv", columns, out)
    model = str(ROOT / "data/paper/motor.toml")
    return Case("paper", "rig", model, log, holdouts, ["drive_gain", "voltage_saturation"], static=True)


def mapped(text: str, names: list[str]) -> dict[str, Callable[[Row], float]]:
    """The columns of a rig's `columns`, and the time."""
    columns: dict[str, Callable[[Row], float]] = {}
    for pair in text.split(","):
        ours, theirs = pair.split("=")
        if theirs != "none":
            name, _, factor = theirs.partition("*")
            columns[ours] = number(name, float(factor or 1))
    if "t_s=none" not in text:
        columns = {"t_s": number("t_s"), **columns}
    if "q_m" in names:
        columns["q_m"] = number("q_m")
    return columns


def rig(folder: Path, data: Path, out: Path) -> Case | None:
    """A rig, if its logs are there."""
    name = folder.name
    expect = tomllib.loads((folder / "expect.toml").read_text())
    files = [expect.get("log", "log.csv"), *expect.get("holdout", ["holdout.csv"])]
    paths = [folder / file if (folder / file).is_file() else data / file for file in files]
    if name not in KNOWN or not all(path.is_file() for path in paths):
        return None
    model = shutil.copy(folder / "model.toml", out / f"{name}.toml")
    if "columns" in expect:
        columns = mapped(expect["columns"], paths[0].open().readline().strip().split(","))
        if len(paths) == 1:
            log, holdouts = halves(name, paths[0], columns, out)
        else:
            made = [rewritten(path, out / name / f"{k}.csv", columns, lambda _: True) for k, path in enumerate(paths)]
            log, holdouts = str(made[0]), [str(path) for path in made[1:]]
    else:
        log, holdouts = str(paths[0]), [str(path) for path in paths[1:]]
    return Case(
        name, "rig", str(model), log, holdouts, KNOWN[name],
        accepted=expect.get("needed", []), wrong=expect.get("wrong", []), static=name in STATIC,
    )  # fmt: skip


def drawn(truing: Path, out: Path) -> list[Case]:
    cases = []
    for kind, count, seed in DRAWN:
        folder, answers = out / kind, out / f"{kind}-answers"
        shutil.rmtree(folder, ignore_errors=True)
        shutil.rmtree(answers, ignore_errors=True)
        arguments = ["--set", kind, "--count", str(count), "--seed", str(seed)]
        subprocess.run([truing, "cases", *arguments, "--out", folder, "--answers", answers], check=True)
        for place in sorted(folder.iterdir()):
            answer = json.loads((answers / f"{place.name}.json").read_text())
            truth = {
                "hidden": [effect["name"] for effect in answer["hidden"]],
                "visibility": min([effect["visibility"] for effect in answer["hidden"]], default=0.0),
                "parameters": {k: v for effect in answer["hidden"] for k, v in effect["parameters"].items()},
                "form_in_library": all(effect["form_in_library"] for effect in answer["hidden"]),
                "base": answer["base"],
            }
            files = [str(place / file) for file in ("model.toml", "log.csv", "holdout.csv")]
            cases.append(Case(place.name, "drawn", files[0], files[1], files[2:], truth["hidden"], truth))
    return cases


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--truing", type=Path, required=True)
    parser.add_argument("--data", type=Path, required=True, help="data that are published elsewhere")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--quick", action="store_true", help="three rigs alone")
    arguments = parser.parse_args()
    out = arguments.out / "data"
    out.mkdir(parents=True, exist_ok=True)
    found = [rig(folder, arguments.data, out) for folder in sorted((ROOT / "data/rigs").iterdir())]
    cases = [paper(out), *(case for case in found if case is not None)]
    if arguments.quick:
        cases = [case for case in cases if case.name in QUICK]
    else:
        cases += drawn(arguments.truing, out)
    (arguments.out / "cases.json").write_text(json.dumps([asdict(case) for case in cases], indent=1) + "\n")
    print(f"{len(cases)} data sets in {arguments.out / 'cases.json'}")


if __name__ == "__main__":
    main()
