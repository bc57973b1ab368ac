"""What a run says while it runs: a bar on a terminal, plain lines elsewhere, nothing in tests and notebooks."""

from __future__ import annotations

import os
from dataclasses import dataclass
from enum import StrEnum
from types import TracebackType
from typing import TYPE_CHECKING, Self, TextIO

if TYPE_CHECKING:
    from rich.console import Console


class Action(StrEnum):
    """What was done about an experiment."""

    COMPUTED = "computed"
    REUSED = "reused"
    FAILED = "failed"


@dataclass(frozen=True)
class Step:
    """One experiment of a run: what was done, why, how long it took when it ran, and the error if it failed."""

    name: str
    action: Action
    reason: str
    seconds: float
    error: str = ""

    def __str__(self) -> str:
        text = f"{self.action} {self.name}"
        if self.action is not Action.REUSED:
            text += f" in {self.seconds:.1f} s"
        return f"{text} ({self.reason}){self.error and f': {self.error}'}"


class Silent:
    """Follows a run as a context manager and says nothing of it; the others are made from this one."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Nothing to clean up."""

    def begin(self, total: int) -> None:
        """`total` experiments are going to be computed."""

    def step(self, step: Step) -> None:
        """One of them is done."""


def say(line: str, stream: TextIO) -> None:
    """Write a line at once. A reader who has left (`head`, a pager) ends no run: what follows goes nowhere."""
    try:
        print(line, file=stream, flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


class Plain(Silent):
    """One line per computed experiment, for logs."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._total = 0
        self._done = 0

    def begin(self, total: int) -> None:
        """Start counting."""
        self._total, self._done = total, 0

    def step(self, step: Step) -> None:
        """Write the line at once, also into a pipe."""
        self._done += 1
        say(f"[{self._done}/{self._total}] {step}", self._stream)


class Bar(Silent):
    """A progress bar, with the finished experiments scrolling by above it."""

    def __init__(self, console: Console) -> None:
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
        from rich.progress import Progress as RichProgress

        self._bar = RichProgress(
            TextColumn("experiments"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left:"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
        )
        self._task = self._bar.add_task("experiments", total=None)

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._bar.stop()

    def begin(self, total: int) -> None:
        """Set the length of the bar."""
        self._bar.update(self._task, total=total)

    def step(self, step: Step) -> None:
        """Advance the bar by one."""
        self._bar.console.print(str(step), markup=False, highlight=False)
        self._bar.advance(self._task)
