"""What cannot be used is told with its place and with what mends it."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
import truing

MODEL = {
    "schema": "truing-model/1",
    "model": {"kind": "first_order", "gain_rad_s_per_v": 10.0, "time_constant_s": 0.1},
    "supply": {"nominal_v": 12.0},
}


def log(**changes: Any) -> dict[str, Any]:
    time = np.arange(0, 8, 0.01)
    return {"t_s": time, "u_v": 6 * np.sin(time), "omega_rad_s": 60 * np.sin(time)} | changes


WRONG: dict[str, tuple[dict[str, Any], list[str]]] = {
    "a word": ({"log": pd.DataFrame(log()).astype(object).assign(u_v="much")}, ["row 1", "u_v", "much"]),
    "an infinite number": ({"log": log(u_v=np.where(np.arange(800) == 41, np.inf, 1.0))}, ["row 42", "u_v", "inf"]),
    "columns of two lengths": ({"log": log(u_v=np.ones(3))}, ["u_v", "3 rows", "800"]),
    "no output": ({"log": {key: value for key, value in log().items() if key != "omega_rad_s"}}, ["omega_rad_s"]),
    "a list": ({"log": [1, 2, 3]}, ["pandas", "list"]),
    "no file": ({"log": "nowhere.csv"}, ["nowhere.csv"]),
    "no model": ({"model": "nowhere.toml"}, ["nowhere.toml", "truing.start"]),
    "a key that is none": ({"model": MODEL | {"supply": {"nominal": 12}}}, ["nominal", "nominal_v"]),
    "an effect that is none": ({"without": ["dead_zome"]}, ["dead_zome", "dead_zone"]),
    "a name given twice": ({"holdout": [log()], "names": ["a", "a"]}, ["same name", "names="]),
    "a crop that is none": ({"from_s": 3, "to_s": 1}, ["from", "to"]),
}


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_argument_names_place_and_remedy(what: str) -> None:
    changes, words = WRONG[what]
    with pytest.raises(truing.InputError) as told:
        truing.gap(**({"model": MODEL, "log": log()} | changes))
    text = str(told.value)
    assert all(word in text for word in words), text
    assert "Traceback" not in text and "panicked" not in text
    assert isinstance(told.value, ValueError)


def test_a_unit_that_is_none_is_told_with_its_option() -> None:
    with pytest.raises(truing.InputError, match="voltage"):
        truing.start(log(), voltage="12 parsecs")
    with pytest.raises(truing.InputError, match="colour"):
        truing.start(log(), colour="red")


def test_a_log_in_another_unit_is_a_verdict_and_says_what_mends_it() -> None:
    result = truing.gap(MODEL, log(omega_rad_s=60 * 9.5493 * np.sin(np.arange(0, 8, 0.01))))
    assert result.verdict == "data"
    assert "rpm" in result.data[0]["what"] and "--columns" in result.data[0]["remedy"]
