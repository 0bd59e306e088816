"""Names what a motor model is missing.

A model and a measured log go in; a verdict, the missing effects with their sizes, and an extended model come out:

    >>> import truing
    >>> result = truing.gap("motor.toml", frame, holdout=[other])   # doctest: +SKIP
    >>> result.verdict, [effect.name for effect in result.effects]  # doctest: +SKIP

A model is a path, the text of a TOML file, or a dictionary. A log is a path, a pandas, Polars or pyarrow table, or a
mapping from names to numbers. Column names state quantity and unit (``t_s``, ``u_v``, ``omega_rpm``); ``columns=`` says what
other names mean, as ``--columns`` does on the command line.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from . import _truing
from ._results import Case, Effect, Export, Look, Named, Parameter, Result, Start, Tie, Value
from ._tables import Log, Model, Table, given, name_of, text_of
from ._truing import InputError, __version__
from ._watch import Progress, watcher

__all__ = [
    "Case",
    "Effect",
    "Export",
    "InputError",
    "Log",
    "Look",
    "Model",
    "Named",
    "Parameter",
    "Progress",
    "Result",
    "Start",
    "Table",
    "Tie",
    "Value",
    "__version__",
    "cases",
    "effects",
    "export",
    "fleet_check",
    "gap",
    "import_model",
    "look",
    "simulate",
    "start",
]

Format = Literal["mjcf", "urdf", "sysid-constants", "fmu3", "fmu2"]
Set = Literal["nothing", "single", "pair", "triple", "outside"]


def gap(
    model: Model,
    log: Log,
    *,
    holdout: Sequence[Log] = (),
    final: Sequence[Log] = (),
    columns: str = "",
    from_s: float | None = None,
    to_s: float | None = None,
    without: Sequence[str] = (),
    accept_data: bool = False,
    names: Sequence[str] = (),
    progress: bool | Callable[[Progress], object] | None = None,
) -> Result:
    """Compares a model with a log, names what is missing, and extends the model.

    holdout: logs that are never fitted; they may refuse a name. Without them a quarter of the log is held out.
    final: logs that are predicted at the very end, and choose nothing.
    columns: what the columns of the logs are, where their names do not say it.
    from_s, to_s: the part of the log that is read, s, on the axis that `look` shows.
    without: names of effects that are not offered.
    accept_data: go on although the files look wrong.
    names: what messages call the tables: the log's, then those of the held-out and final logs.
    progress: True shows a line, a function is called about twenty times a second; by default a line is shown where
        somebody sees it: in a terminal or a notebook.

    Raises InputError where model, log or argument cannot be used. A log that looks wrong is no error: its verdict is
    ``"data"``, and ``data`` says what mends it.
    """
    logs = [log, *holdout, *final]
    called = [name_of(one, index, names) for index, one in enumerate(logs)]
    if len(set(called)) < len(called):
        raise InputError(f"two logs have the same name ({', '.join(called)}); give each its own with names=")
    model_name, model_text = text_of(model)
    words = ["--model", model_name, "--log", called[0]]
    held, kept = called[1 : 1 + len(holdout)], called[1 + len(holdout) :]
    for option, values in (("--holdout", held), ("--final", kept), ("--without", list(without))):
        words += [option, *values] if values else []
    words += _rows(columns, from_s, to_s) + (["--accept-data"] if accept_data else [])
    call = _call(model_name, called[0], held, kept, columns)
    with watcher(progress) as watch:
        texts = _truing.gap_(
            words, (model_name, model_text), [(n, given(one)) for n, one in zip(called, logs, strict=True)], call, watch
        )
    return Result(*texts)


def look(log: Log, *, columns: str = "", model: Model | None = None, name: str | None = None) -> Look:
    """Shows what is in a log before any model is asked, and proposes ``columns=`` for it."""
    called = name_of(log, 0, [name] if name else [])
    stated = None if model is None else text_of(model)
    return Look(json.loads(_truing.look_([called, *_rows(columns, None, None)], stated, (called, given(log)))))


def start(
    log: Log | None = None,
    *,
    columns: str = "",
    from_s: float | None = None,
    to_s: float | None = None,
    name: str | None = None,
    **printed: float | str | bool,
) -> Start:
    """Writes a model from a log and from what is printed on a motor.

    printed: the options of ``truing start``, as numbers in SI units or as texts with a unit: ``voltage=12``,
        ``no_load_rpm=3000``, ``stall_current="5 A"``, ``stall_torque="1.2 kgcm"``, ``resistance``, ``kt``, ``ke``,
        ``inertia="10.5 gcm2"``, ``gear``, ``counts_per_rev``, ``printed_at_output=True``, ``encoder_at_output=True``.
    """
    words = ["--out", "model.toml", *_rows(columns, from_s, to_s)]
    for key, value in printed.items():
        option = "--" + key.replace("_", "-")
        words += ([option] if value else []) if isinstance(value, bool) else [f"{option}={value}"]
    if log is None:
        return Start(*_truing.start_(words, None))
    called = name_of(log, 0, [name] if name else [])
    return Start(*_truing.start_([*words, "--log", called], (called, given(log))))


def simulate(model: Model, input: Log, *, columns: str = "", name: str | None = None) -> Table:  # noqa: A002
    """Runs a model on the input of a log; the table has the columns of ``truing simulate``."""
    called = name_of(input, 0, [name] if name else [])
    return Table.of_csv(_truing.simulate_(columns, text_of(model), (called, given(input))))


def export(
    model: Model,
    to: Format,
    *,
    ranges: bool = False,
    log: Log | None = None,
    columns: str = "",
    fmu_library: str | os.PathLike[str] | None = None,
) -> Export:
    """Writes a model as a file of another program, as ``truing export`` does.

    ranges: ranges for domain randomisation come with it, as Python: ± two standard deviations, for mjlab and IsaacLab.
    log: on its input it is told what the loss of an effect costs that the format does not hold.
    fmu_library: the library that an FMU carries; without it the one of this package.
    """
    name, text = text_of(model)
    library = fmu_library or next(Path(__file__).parent.glob("*truing_fmu.*"), None)
    words = [name, "--to", to, *_rows(columns, None, None)] + (["--ranges"] if ranges else [])
    words += [] if library is None else ["--fmu-library", os.fspath(library)]
    driven = None if log is None else (name_of(log, 0, []), given(log))
    content, beside, lost = _truing.export_(words, (name, text), driven)
    return Export(content, dict(beside), lost)


def import_model(file: str | os.PathLike[str]) -> Start:
    """Reads a nominal model out of an MJCF or URDF file, as ``truing import`` does."""
    path = Path(file)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error})") from error
    return Start(_truing.import_(path.name, text), [])


def effects() -> list[Effect]:
    """The library of physical effects with their equations."""
    return [Effect.of(effect) for effect in json.loads(_truing.effects_())]


def cases(
    set: Set = "single",  # noqa: A002
    count: int = 10,
    *,
    seed: int = 1,
    rows: int = 3000,
    current: bool | None = None,
) -> Iterator[Case]:
    """Draws cases in which effects are hidden: model, log, held-out log and the answer."""
    for one in range(seed, seed + count):
        model, log, held, answer = _truing.case_(set, one, rows, current)
        yield Case(f"case-{one:05}", model, Table.of_csv(log), Table.of_csv(held), json.loads(answer))


def fleet_check(
    *,
    model: str | os.PathLike[str],
    log: str | os.PathLike[str],
    unit: str,
    at: str,
    into: str | os.PathLike[str],
) -> Literal["there", "unchanged", "searched"]:
    """Judges one log of a fleet against what its unit was before, as ``truing fleet check`` does, and writes the same bytes.

    unit: the motor's name. at: when the log was taken, ``2026-03-01`` or ``2026-03-01T08:30:00Z``. into: the folder of results.

    Returns ``"there"`` where the result was written before, ``"unchanged"`` where the unit's earlier names explain the log and
    no number moved, else ``"searched"``. The logs of a unit go in the order of time; `truing.fleet.run` sees to that.
    """
    return _truing.fleet_check_(unit, at, [os.fspath(path) for path in (model, log, into)])


def _rows(columns: str, from_s: float | None, to_s: float | None) -> list[str]:
    words = [f"--columns={columns}"] if columns else []
    for option, seconds in (("--from", from_s), ("--to", to_s)):
        words += [] if seconds is None else [f"{option}={seconds}"]
    return words


def _call(model: str, log: str, held: Sequence[str], kept: Sequence[str], columns: str) -> str:
    """The call as the report tells it."""
    lists = [f"{key}={list(value)!r}" for key, value in (("holdout", held), ("final", kept)) if value]
    mapped = [f"columns={columns!r}"] if columns else []
    return f"truing.gap({', '.join([repr(_told(model)), repr(_told(log)), *lists, *mapped])})"


def _told(name: str) -> str:
    """A report tells nobody's folders."""
    return Path(name).name if Path(name).is_absolute() else name


def __getattr__(name: str) -> Any:
    """`truing.fleet` is loaded when it is asked for: it may want Ray."""
    if name == "fleet":
        import importlib

        return importlib.import_module(".fleet", __name__)
    raise AttributeError(f"module 'truing' has no attribute {name!r}")
