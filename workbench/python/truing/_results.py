"""What a search, a look and a start return."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._tables import Table

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Value:
    """A fitted number with one standard deviation; `sigma` is None where the log does not determine it."""

    value: float
    sigma: float | None
    unit: str

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.value:.4g}{unit}" if self.sigma is None else f"{self.value:.4g} ± {self.sigma:.2g}{unit}"


def _values(values: Mapping[str, Any]) -> dict[str, Value]:
    return {name: Value(one["value"], one["std"], one["unit"]) for name, one in values.items()}


@dataclass(frozen=True)
class Named:
    """An effect that the model is missing, with its sizes."""

    name: str
    parameters: dict[str, Value]
    #: Figures that follow from the parameters and the rest of the model.
    derived: dict[str, Value]
    #: Root mean square of the held-out residual without it, and with it.
    gap_before: float
    gap_after: float
    #: One sentence a person understands.
    evidence: str

    @classmethod
    def of(cls, effect: Mapping[str, Any]) -> Named:
        """From the JSON of a result."""
        return cls(
            effect["name"],
            _values(effect["parameters"]),
            _values(effect.get("derived", {})),
            effect["gap_before"],
            effect["gap_after"],
            effect["evidence"],
        )

    def __getitem__(self, parameter: str) -> Value:
        return self.parameters[parameter] if parameter in self.parameters else self.derived[parameter]


@dataclass(frozen=True)
class Tie:
    """Explanations that the log cannot tell apart, and the experiment that would."""

    rivals: tuple[tuple[str, ...], ...]
    separated_by: str


class Result:
    """What `gap` found."""

    #: The same bytes as the file that `truing gap --json` writes.
    json: str
    #: The report: one HTML page that loads nothing.
    html: str
    #: The extended model, as the text of a TOML file.
    model: str
    #: Verdict, how sure it is, the named effects and the ties.
    verdict: str
    grade: str
    effects: list[Named]
    ties: list[Tie]
    notes: list[str]
    #: Everything that the JSON holds.
    outcome: dict[str, Any]

    def __init__(self, outcome: str, page: str, model: str, told: str) -> None:
        self.json, self.html, self.model = outcome, page, model
        # Colours are for a terminal.
        self._told = re.sub(r"\x1b\[[0-9;]*m", "", told)
        self.outcome = json.loads(outcome)
        self.verdict, self.grade = self.outcome["verdict"], self.outcome["grade"]
        self.effects = [Named.of(effect) for effect in self.outcome["effects"]]
        self.ties = [Tie(tuple(map(tuple, tie["rivals"])), tie["separated_by"]) for tie in self.outcome["ties"]]
        self.notes = self.outcome["notes"]

    @property
    def names(self) -> list[str]:
        """Names of the effects, in the order in which they were found."""
        return [effect.name for effect in self.effects]

    @property
    def fit_percent(self) -> tuple[float | None, float | None]:
        """NRMSE fit of the held-out data, %, with the model as given and with the extended one."""
        held = self.outcome["holdout"]
        return held["fit_percent_before"], held["fit_percent_after"]

    @property
    def data(self) -> list[dict[str, Any]]:
        """What is wrong with the files, where the verdict is ``"data"``."""
        return list(self.outcome.get("data", []))

    def __getitem__(self, name: str) -> Named:
        for effect in self.effects:
            if effect.name == name:
                return effect
        raise KeyError(f"{name}; named are {', '.join(self.names) or 'none'}")

    def __iter__(self) -> Iterator[Named]:
        return iter(self.effects)

    def to_frame(self) -> pandas.DataFrame:
        """One row for each number of each effect."""
        import pandas

        rows = [
            (effect.name, name, value.value, value.sigma, value.unit)
            for effect in self.effects
            for name, value in effect.parameters.items()
        ]
        return pandas.DataFrame(rows, columns=["effect", "parameter", "value", "sigma", "unit"])

    def save(self, folder: str | Path) -> Path:
        """Writes outcome.json, report.html and model.extended.toml into a folder."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        texts = {"outcome.json": self.json, "report.html": self.html, "model.extended.toml": self.model}
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")
        return folder

    def __str__(self) -> str:
        return self._told

    def __repr__(self) -> str:
        return f"Result({self.verdict}: {', '.join(self.names) or 'no effect'})"

    def _repr_html_(self) -> str:
        # In a frame of its own: a report has its own styles and scripts.
        frame = "width:100%;height:720px;border:1px solid #8884;border-radius:6px"
        page = html.escape(self.html, quote=True)
        return f'<iframe title="Report" srcdoc="{page}" style="{frame}" sandbox="allow-scripts"></iframe>'


class Look(Mapping[str, Any]):
    """What is seen in a log. Its entries are those of ``truing look --json``."""

    def __init__(self, seen: dict[str, Any]) -> None:
        self._seen = seen

    @property
    def columns(self) -> str:
        """What `columns=` has to say; empty where the names say everything."""
        return str(self._seen["columns_argument"])

    @property
    def refused(self) -> str | None:
        """Why the log cannot be read as it is."""
        refused: str | None = self._seen["refused"]
        return refused

    @property
    def notes(self) -> list[str]:
        """How the log was read."""
        return list(self._seen["notes"])

    def __getitem__(self, key: str) -> Any:
        return self._seen[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._seen)

    def __len__(self) -> int:
        return len(self._seen)

    def __repr__(self) -> str:
        told = [f"{self['file']}: {self['rows']} rows"]
        told += [f"  {column['name']}: {column['seems'] or 'not used'}" for column in self["columns"]]
        told += [f"refused: {self.refused}"] if self.refused else []
        told += [f"columns={self.columns!r}"] if self.columns else []
        return "\n".join(told + self.notes)


@dataclass(frozen=True)
class Start:
    """A model that `start` wrote; it can be given wherever a model is asked for."""

    text: str
    notes: list[str]

    def save(self, path: str | Path) -> Path:
        """Writes the model file."""
        Path(path).write_text(self.text, encoding="utf-8")
        return Path(path)

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Export:
    """A model as a file of another program."""

    #: The file; an FMU is an archive, the others are UTF-8 texts.
    content: bytes
    #: Files that belong to it: what is added to the stem of its name (``_helper.py``), and the text.
    beside: dict[str, str]
    #: What the format does not hold, and what that costs on the log that was given.
    lost: list[str]

    @property
    def text(self) -> str:
        """The file as a text."""
        return self.content.decode("utf-8")

    def save(self, path: str | Path) -> list[Path]:
        """Writes the file and those beside it: ``servo.xml`` has ``servo_helper.py``."""
        path = Path(path)
        path.write_bytes(self.content)
        others = [path.with_name(path.stem + ending) for ending in self.beside]
        for other, text in zip(others, self.beside.values(), strict=True):
            other.write_text(text, encoding="utf-8")
        return [path, *others]


@dataclass(frozen=True)
class Parameter:
    """A number that an effect has."""

    name: str
    unit: str
    default: float | None


@dataclass(frozen=True)
class Effect:
    """A physical effect of the library."""

    name: str
    summary: str
    equation: str
    parameters: tuple[Parameter, ...]
    signature: str
    confusable_with: tuple[str, ...]
    separated_by: str
    source: str

    @classmethod
    def of(cls, effect: Mapping[str, Any]) -> Effect:
        """From the JSON of the library."""
        parameters = tuple(Parameter(**parameter) for parameter in effect["parameters"])
        return cls(**{**effect, "parameters": parameters, "confusable_with": tuple(effect["confusable_with"])})


@dataclass(frozen=True)
class Case:
    """A drawn case; `answer` is what hides in it."""

    name: str
    model: str
    log: Table
    holdout: Table
    answer: dict[str, Any]
