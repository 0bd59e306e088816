"""A model and a log in, a verdict out: by file, by table, by dictionary."""

import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.csv
import pytest
import truing


def without_time(text: str) -> str:
    return re.sub(r'"runtime_s": [0-9.e-]+', "", text)


def test_a_result_has_names_sizes_and_an_extended_model(found: truing.Result) -> None:
    assert "dead_zone" in found.names
    size = found["dead_zone"].parameters
    assert all(value.sigma and value.sigma < value.value and value.unit for value in size.values())
    before, after = found.fit_percent
    assert before is not None and after is not None and before < after
    assert "dead_zone" in tomllib.loads(found.model)["known"]
    assert found.verdict in str(found)
    frame = found.to_frame()
    assert list(frame.columns) == ["effect", "parameter", "value", "sigma", "unit"]
    assert set(frame["effect"]) == set(found.names)


def test_the_report_is_one_page_in_a_frame_of_its_own(found: truing.Result) -> None:
    shown = found._repr_html_()
    assert shown.startswith("<iframe") and "srcdoc=" in shown and "dead_zone" in shown
    assert "<script>" not in shown.split("srcdoc=")[0]
    assert "/" not in re.findall(r"truing\.gap\('([^']*)'", found.html)[0]


READERS: dict[str, Callable[[Path], Any]] = {
    "pandas": pd.read_csv,
    "polars": lambda path: pl.read_csv(path, infer_schema_length=None),
    "pyarrow": pyarrow.csv.read_csv,
    "batches": lambda path: pyarrow.csv.read_csv(path).to_reader(max_chunksize=100),
    "dictionary": lambda path: {name: column.to_numpy() for name, column in pd.read_csv(path).items()},
}


@pytest.mark.parametrize("library", READERS)
def test_a_table_is_answered_as_its_file_is(library: str, rig: Path, found: truing.Result) -> None:
    read = READERS[library]
    names = [str(rig / "log.csv"), str(rig / "holdout.csv")]
    by_table = truing.gap(
        rig / "model.toml", read(rig / "log.csv"), holdout=[read(rig / "holdout.csv")], names=names
    )
    assert without_time(by_table.json) == without_time(found.json)
    assert by_table.model == found.model


def test_whole_numbers_missing_cells_and_times_of_a_frame_are_read(case: truing.Case) -> None:
    frame = case.log.to_frame()
    plain = truing.gap(case.model, frame)
    stamped = frame.assign(t_s=pd.Timestamp("2026-01-05T10:00:00Z") + pd.to_timedelta(frame["t_s"], unit="s"))
    output = next(name for name in case.log if name.startswith(("omega", "theta", "q_", "v_")))
    stamped.loc[[40, 400], output] = None
    result = truing.gap(case.model, stamped)
    assert (result.verdict, result.names) == (plain.verdict, plain.names)
    assert any(note.startswith("2 of ") and "empty" in note for note in result.notes), result.notes
    assert any("Seconds since" in note and "t_s" in note for note in result.notes), result.notes


def test_a_model_may_be_a_text_a_dictionary_or_what_start_wrote(case: truing.Case) -> None:
    by_text = truing.gap(case.model, case.log)
    by_dictionary = truing.gap(tomllib.loads(case.model), case.log)
    assert without_time(by_dictionary.json) == without_time(by_text.json)
    begun = truing.start(case.log, voltage=12, kt="23.5 mNm/A")
    assert begun.text.startswith("# Written by") and "0.0235" in begun.text
    assert truing.gap(begun, case.log).verdict
    assert truing.gap(by_text.model, case.log).verdict == "nothing_missing"


def test_a_look_proposes_columns_that_gap_takes(case: truing.Case) -> None:
    frame = case.log.to_frame()
    output = next(name for name in case.log if name.startswith("omega"))
    odd = frame.rename(columns={"t_s": "clock", output: "spin", "u_v": "drive"})
    seen = truing.look(odd, name="bench.csv")
    assert seen.refused and seen["rows"] == len(odd) and "bench.csv" in repr(seen)
    columns = f"t_s=clock,{output}=spin,u_v=drive"
    assert truing.look(odd, columns=columns).refused is None
    assert truing.gap(case.model, odd, columns=columns).names == truing.gap(case.model, frame).names


def test_a_simulation_follows_the_extended_model(case: truing.Case) -> None:
    result = truing.gap(case.model, case.log)
    output = next(name for name in case.holdout if name.startswith("omega"))
    measured = np.asarray(case.holdout[output])

    def rms(model: str) -> float:
        simulated = truing.simulate(model, case.holdout)
        assert simulated.rows == len(measured)
        return float(np.sqrt(np.nanmean((simulated["omega_rad_s"] - measured) ** 2)))

    assert rms(result.model) < rms(case.model)


def test_effects_and_cases_are_those_of_the_command_line() -> None:
    effects = {effect.name: effect for effect in truing.effects()}
    assert effects["dead_zone"].equation and effects["dead_zone"].parameters[0].unit == "V"
    drawn = list(truing.cases("pair", 2, seed=11, rows=700))
    assert [case.name for case in drawn] == ["case-00011", "case-00012"]
    assert all(len(case.answer["hidden"]) == 2 and case.log.rows >= 600 for case in drawn)


def test_the_outcome_is_the_json(found: truing.Result, tmp_path: Path) -> None:
    folder = found.save(tmp_path / "result")
    assert json.loads((folder / "outcome.json").read_text()) == found.outcome
    assert (folder / "report.html").read_text() == found.html
    assert truing.gap(folder / "model.extended.toml", pa.table(dict(truing.simulate(found.model, tmp_log())))).verdict


def tmp_log() -> dict[str, Any]:
    time = np.arange(0, 4, 0.01)
    return {"t_s": time, "u_v": 6 * np.sign(np.sin(2 * time)) * (1 + 0.5 * np.sin(7 * time))}
