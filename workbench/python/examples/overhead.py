"""What a search costs more here than in the command line, which is built with --release: `python overhead.py target/release/truing`."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import truing

CASES = 100

if __name__ == "__main__":
    program = str(Path(sys.argv[1]).resolve())
    command = [program, "gap", "--model", "model.toml", "--log", "log.csv", "--holdout", "holdout.csv", "--json", "-"]
    cpu, wall = [], []
    for case in truing.cases("single", CASES, seed=8100, rows=2000):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "model.toml").write_text(case.model)
            frames = [case.log.to_frame(), case.holdout.to_frame()]
            for frame, name in zip(frames, ("log", "holdout")):
                frame.to_csv(Path(folder) / f"{name}.csv", index=False)
            before, began = os.times(), time.perf_counter()
            subprocess.run(command, cwd=folder, capture_output=True, check=True)
            between, middle = os.times(), time.perf_counter()
            truing.gap(Path(folder) / "model.toml", frames[0], holdout=frames[1:])
            after, ended = os.times(), time.perf_counter()
        children = between.children_user + between.children_system - before.children_user - before.children_system
        cpu.append((children, after.user + after.system - between.user - between.system))
        wall.append((middle - began, ended - middle))
    alone, here = (sum(pair[side] for pair in cpu) for side in (0, 1))
    print(f"CPU of {CASES} searches: command {alone:.2f} s, package {here:.2f} s, {100 * (here / alone - 1):+.1f} %")
    print(f"wall time, median of the differences: {1000 * median(b - a for a, b in wall):+.1f} ms")
