"""A model goes into other programs, and a nominal one comes back."""

import os
import re
import subprocess
import zipfile
from pathlib import Path

import pytest
import truing

PROGRAM = os.environ.get("TRUING_PROGRAM")


def dateless(text: str) -> str:
    return re.sub(r"\d{4}-\d\d-\d\d", "", text)


@pytest.mark.skipif(PROGRAM is None, reason="TRUING_PROGRAM names no `truing`; `cargo xtask wheel --check` builds it")
@pytest.mark.parametrize("to", ["mjcf", "urdf", "sysid-constants"])
def test_a_file_is_that_of_the_command_line(to: truing.Format, found: truing.Result, tmp_path: Path) -> None:
    (tmp_path / "model.toml").write_text(found.model)
    options = ["export", "model.toml", "--to", to, "--ranges", "--out", "by_command.txt"]
    subprocess.run([str(PROGRAM), *options], cwd=tmp_path, capture_output=True, check=True)
    written = truing.export(tmp_path / "model.toml", to, ranges=True).save(tmp_path / "by_package.txt")
    assert len(written) >= 2
    for path in written:
        twin = path.with_name(path.name.replace("by_package", "by_command"))
        assert dateless(path.read_text()) == dateless(twin.read_text())


def test_an_fmu_carries_the_plant_and_its_library(found: truing.Result, tmp_path: Path) -> None:
    [path] = truing.export(found.model, "fmu3").save(tmp_path / "motor.fmu")
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        assert archive.read("resources/model.toml").decode() == found.model
    assert "modelDescription.xml" in names
    assert any(name.startswith("binaries/") for name in names)


def test_what_is_not_held_is_told_with_its_cost(found: truing.Result, rig: Path) -> None:
    exported = truing.export(found.model, "urdf", log=rig / "log.csv")
    assert all("it costs" in line for line in exported.lost if "without a name" not in line)
    assert "<robot" in exported.text


def test_a_nominal_model_comes_back(found: truing.Result, tmp_path: Path) -> None:
    [path] = truing.export(found.model, "urdf").save(tmp_path / "servo.urdf")
    back = truing.import_model(path)
    assert "[model]" in back.text


def test_errors_name_what_is_wrong(found: truing.Result, tmp_path: Path) -> None:
    with pytest.raises(truing.InputError, match="stl"):
        truing.export(found.model, "stl")  # type: ignore[arg-type]
    with pytest.raises(truing.InputError, match=r"gone\.xml"):
        truing.import_model(tmp_path / "gone.xml")
