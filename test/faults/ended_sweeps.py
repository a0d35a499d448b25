"""Sweeps that are killed or interrupted: what they leave belongs to the sweep that sweep.json describes, and the next run completes it."""

from __future__ import annotations

import shutil
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import killing
import writers


@dataclass(frozen=True)
class Ended:
    """What is amiss, and how many runs ended before their time."""

    faults: list[str]
    ended: int


def undisturbed(work: Path) -> killing.Seen:
    """What a sweep leaves that nothing disturbs."""
    killing.in_this_process(writers.sweep_of(work, "b")(work / "undisturbed"))
    return killing.visible(work / "undisturbed")


def killed_at_changes(work: Path, swept: killing.Seen, force: bool, places: int | None = None) -> Ended:
    """Kills a sweep before its changes: all of them, or so many.  force: over another sweep."""
    return _ended(work, swept, force, lambda changes, took: [{"kill_at": number} for number in writers.chosen(changes, places)])


def killed_at_moments(work: Path, swept: killing.Seen, force: bool, moments: list[float]) -> Ended:
    """The same at shares of the time that a sweep takes."""
    return _ended(work, swept, force, lambda changes, took: [{"end": (signal.SIGKILL, moment * took)} for moment in moments])


def interrupted(work: Path, swept: killing.Seen, force: bool, moments: list[float]) -> Ended:
    """The same with SIGINT and SIGTERM: no unfinished file stays, also without another run."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    ways = [(numbers[k % 2], moment) for k, moment in enumerate(moments)]
    return _ended(work, swept, force, lambda changes, took: [{"end": (number, moment * took), "before": killing.hear_signals} for number, moment in ways])


def _ended(work: Path, swept: killing.Seen, force: bool, ways: Callable[[int, float], list[dict]]) -> Ended:
    of_other: killing.Seen = {}
    if force:
        killing.in_this_process(writers.sweep_of(work, "a")(work / "other"))
        of_other = killing.visible(work / "other")
    out, faults, ended = work / "swept", [], 0

    def fresh() -> None:
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(work / "other", out) if force else out.mkdir()

    fresh()
    run = writers.sweep_of(work, "b", "--force")(out)
    start = time.perf_counter()
    _, changes = killing.in_a_copy(run)
    took = time.perf_counter() - start
    for way in ways(changes, took):
        fresh()
        status, _ = killing.in_a_copy(run, **way)
        ended += status != 0
        number = way.get("end", (signal.SIGKILL,))[0]
        when = f"sweep, {way}: status {status}"
        faults += [] if status in (0, -number, 128 + number) else [when]
        faults += left_amiss(out, swept, when, of_other, hidden=number == signal.SIGKILL)
        faults += not_completed(run, out, swept, when)
    return Ended(faults, ended)


def left_amiss(out: Path, swept: killing.Seen, when: str, of_other: killing.Seen | None = None, hidden: bool = False) -> list[str]:
    """What is wrong with a folder of a sweep that has ended before its time; hidden: unfinished files may be there."""
    found = killing.visible(out)
    whole = swept if found.get("sweep.json") == swept["sweep.json"] else of_other or {}
    faults = [] if found.items() <= whole.items() else [f"{when}: {sorted(found)} are not of the sweep that sweep.json describes"]
    left = killing.everything(out) - {*found, "cases"}
    return faults + ([f"{when}: left behind: {sorted(left)}"] if left and not hidden else [])


def not_completed(run: Callable[[], object], out: Path, swept: killing.Seen, when: str) -> list[str]:
    """What is wrong after the next run."""
    status, _ = killing.in_a_copy(run)
    whole = not status and killing.visible(out) == swept and killing.everything(out) == {*swept, "cases"}
    return [] if whole else [f"{when}: the next run has status {status} and leaves {sorted(killing.everything(out))}"]
