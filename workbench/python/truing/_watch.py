"""Shows that a search lives."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple


class Progress(NamedTuple):
    """How far a search is. Nobody knows how long it takes."""

    seconds: float
    candidates: int
    text: str

    def __str__(self) -> str:
        return f"{self.seconds:.0f} s, {self.candidates} candidates fitted, {self.text}"


Told = Callable[[float, int, str], object]


@contextmanager
def watcher(progress: bool | Callable[[Progress], object] | None) -> Iterator[Told | None]:
    """What the engine calls while it searches."""
    if callable(progress):
        yield lambda *told: progress(Progress(*told))
        return
    show = _notebook() or (_terminal() if progress or sys.stderr.isatty() else None)
    if progress is False or show is None:
        yield None
        return
    shown = _Line(show)
    try:
        yield shown
    finally:
        shown.close()


#: Seconds before anything is shown, and between two lines: faster is only flicker.
BEAT = 0.2


class _Line:
    """One line that is written anew."""

    def __init__(self, show: Callable[[str], object]) -> None:
        self.show, self.next = show, BEAT

    def __call__(self, seconds: float, candidates: int, text: str) -> None:
        if seconds >= self.next:
            self.show(str(Progress(seconds, candidates, text)))
            self.next = seconds + BEAT

    def close(self) -> None:
        if self.next > BEAT:
            self.show("")


def _terminal() -> Callable[[str], object]:
    def show(text: str) -> None:
        sys.stderr.write("\r\033[K" + text)
        sys.stderr.flush()

    return show


def _notebook() -> Callable[[str], object] | None:
    """The display of a notebook, where the call comes from one."""
    shell: Any = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if shell is None or not hasattr(shell, "kernel"):
        return None
    import IPython.display

    HTML: Any = IPython.display.HTML  # noqa: N806
    display: Any = IPython.display.display
    handle = display(HTML(""), display_id=True)

    def show(text: str) -> None:
        handle.update(HTML(f"<small>{text}</small>" if text else ""))

    return show
