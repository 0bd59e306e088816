"""What may be given for a model and for a log."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np

from . import _truing

if TYPE_CHECKING:
    import pandas
    from numpy.typing import NDArray


class ArrowStream(Protocol):
    """A table behind the Arrow C stream: pandas, Polars, pyarrow, DuckDB and others."""

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...


Log: TypeAlias = "str | os.PathLike[str] | ArrowStream | Mapping[str, Any]"
Model: TypeAlias = "str | os.PathLike[str] | Mapping[str, Any] | Any"

#: What a log is called that has no name.
UNNAMED = "log"


class Table(Mapping[str, "NDArray[np.float64]"]):
    """Columns of numbers by name."""

    def __init__(self, columns: Mapping[str, Any]) -> None:
        self._columns = {name: np.asarray(values, dtype=np.float64) for name, values in columns.items()}

    @classmethod
    def of_csv(cls, text: str) -> Table:
        """Reads a table whose first line holds the names; an empty cell is NaN."""
        header, *rows = csv.reader(io.StringIO(text))
        cells = zip(*rows, strict=True)
        numbers = ([float(cell) if cell else float("nan") for cell in column] for column in cells)
        return cls(dict(zip(header, numbers, strict=True)))

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self._columns.values()), ()))

    def to_frame(self) -> pandas.DataFrame:
        """As a pandas frame."""
        import pandas

        return pandas.DataFrame(self._columns)

    def __repr__(self) -> str:
        return f"Table({self.rows} rows: {', '.join(self._columns)})"


def given(log: Log) -> Any:
    """What the engine takes: a word for a file, a stream, or names with lists of numbers."""
    if isinstance(log, str | os.PathLike):
        return "file"
    if hasattr(log, "__arrow_c_stream__"):
        return log
    if isinstance(log, Mapping):
        return [(str(name), np.asarray(values, dtype=np.float64).ravel().tolist()) for name, values in log.items()]
    raise _truing.InputError(
        f"a log is a path, a table of pandas, Polars or pyarrow, or a mapping of columns, not a {type(log).__name__}"
    )


def name_of(log: Log, index: int, names: Sequence[str]) -> str:
    """What messages call a log: its path, the name that was given, or its place among the logs."""
    if isinstance(log, str | os.PathLike):
        return os.fspath(log)
    if index < len(names):
        return names[index]
    return UNNAMED if index == 0 else f"{UNNAMED} {index + 1}"


def text_of(model: Model) -> tuple[str, str]:
    """The name and the text of a model: a path, a text, a dictionary, or what `start` returned."""
    if isinstance(model, Mapping):
        return "model", _truing.toml_(json.dumps(model))
    if not isinstance(model, str | os.PathLike):
        return "model", str(getattr(model, "text", model))
    if isinstance(model, str) and ("\n" in model or "=" in model):
        return "model", model
    try:
        return os.fspath(model), Path(model).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise _truing.InputError(f"{os.fspath(model)}: cannot be read: {error}; truing.start writes a model") from error
