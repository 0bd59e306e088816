"""The package and the command line answer with the same bytes."""

import os
import re
import subprocess
from pathlib import Path

import pytest
import truing

PROGRAM = os.environ.get("TRUING_PROGRAM")
#: Drawn cases of each kind: a hundred in all.
COUNTS: dict[truing.Set, int] = {"single": 60, "pair": 15, "triple": 5, "nothing": 10, "outside": 10}


@pytest.mark.skipif(PROGRAM is None, reason="TRUING_PROGRAM names no `truing`; `cargo xtask wheel --check` builds it")
@pytest.mark.parametrize("kind", COUNTS)
def test_drawn_cases_are_answered_with_the_same_bytes(kind: truing.Set, tmp_path: Path) -> None:
    differ = []
    for case in truing.cases(kind, COUNTS[kind], seed=8100, rows=1200):
        folder = tmp_path / case.name
        folder.mkdir()
        (folder / "model.toml").write_text(case.model)
        for name, table in (("log", case.log), ("holdout", case.holdout)):
            table.to_frame().to_csv(folder / f"{name}.csv", index=False)
        options = ["gap", "--model", "model.toml", "--log", "log.csv", "--holdout", "holdout.csv", "--json", "-"]
        command = subprocess.run([str(PROGRAM), *options], cwd=folder, capture_output=True, text=True, check=True)
        frames = [table.to_frame() for table in (case.log, case.holdout)]
        package = truing.gap(folder / "model.toml", frames[0], holdout=frames[1:], names=["log.csv", "holdout.csv"])
        if timeless(command.stdout) != timeless(package.json):
            differ.append(case.name)
    assert not differ


def timeless(text: str) -> str:
    return re.sub(r'"runtime_s": [^,]+', "", text)
