"""Kills every command that writes at random moments and before each of its changes, interrupts it, and fills its disk.

    python test/faults/kill_at_random.py [--moments 100] [--sizes 20] [--only NAME] [--seed 1] [--no-record]

Prints what is amiss and the figures, and writes the record of the promise `results-files`.  About a quarter of an hour."""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

sys.path[:0] = map(str, Path(__file__).resolve().parents[:2])

import ended_sweeps
import full_disks
import killing
import sweeps_here
import writers

ROOT = Path(__file__).resolve().parents[2]


def killed_at_moments(writer: writers.Writer, out: Path, moments: list[float]) -> tuple[list[str], int]:
    """Kills at shares of the time that a run takes.  Returns what is amiss, and how many runs had not ended yet."""
    earlier = writers.earlier_results(writer, out)
    saved = _saved(out)
    took, later = _time(writer, out), killing.visible(out)
    faults, killed = [], 0
    for moment in moments:
        _again(saved, out)
        status, _ = killing.in_a_copy(writer.later(out), end=(signal.SIGKILL, moment * took))
        killed += status == -signal.SIGKILL
        faults += writers.amiss(out, earlier, later, f"{writer.name}: killed after {moment:.3f} of its time")
    return faults, killed


def interrupted(writer: writers.Writer, out: Path, moments: list[float]) -> tuple[list[str], int]:
    """The same with SIGINT and SIGTERM: nothing may be left behind, without another run."""
    earlier = writers.earlier_results(writer, out)
    saved = _saved(out)
    usual, _ = killing.in_a_copy(writer.later(out))
    took, later = _time(writer, out), killing.visible(out)
    faults, ended = [], 0

    for k, moment in enumerate(moments):
        _again(saved, out)
        number = (signal.SIGINT, signal.SIGTERM)[k % 2]
        status, _ = killing.in_a_copy(writer.later(out), end=(number, moment * took), before=killing.hear_signals)
        ended += status != usual
        found, when = killing.visible(out), f"{writer.name}: {number.name} after {moment:.3f} of its time"
        if status not in (usual, 128 + number, -number):
            faults.append(f"{when}: status {status}")
        if found not in (earlier, later) or killing.everything(out) != set(found):
            faults.append(f"{when}: leaves {sorted(killing.everything(out))}")
    return faults, ended


def _time(writer: writers.Writer, out: Path) -> float:
    """Seconds of a run, the middle of three."""
    took = []
    for _ in range(3):
        start = time.perf_counter()
        killing.in_a_copy(writer.later(out))
        took.append(time.perf_counter() - start)
    return sorted(took)[1]


def _saved(out: Path) -> Path:
    saved = out.with_name(out.name + "-saved")
    shutil.rmtree(saved, ignore_errors=True)
    shutil.copytree(out, saved)
    return saved


def _again(saved: Path, out: Path) -> None:
    shutil.rmtree(out)
    shutil.copytree(saved, out)


def real_processes_killed(work: Path, moments: list[float]) -> tuple[list[str], int]:
    """`python -m ksl loads` itself, as a user starts it; results differ in their date, so the earlier ones are known by their bytes."""
    out = work / "real"
    command = [sys.executable, "-m", "ksl", "loads", work / "arm.urdf", work / "b.csv", "-o", out]
    subprocess.run([*command[:4], work / "arm.urdf", work / "a.csv", "-o", out, "--csv"], check=True, capture_output=True)
    earlier, saved = killing.visible(out), _saved(out)
    start = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    took, names = time.perf_counter() - start, set(killing.visible(out))
    faults, killed = [], 0
    for moment in moments:
        _again(saved, out)
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(moment * took)
        process.kill()
        killed += process.wait() == -signal.SIGKILL
        found = killing.visible(out)
        if found != earlier and (set(found) != names or set(found.items()) & set(earlier.items())):
            faults.append(f"ksl loads as a process: killed after {moment:.3f} of its time: {sorted(found)}")
        faults += writers.amiss(out, found, found, "ksl loads as a process")
    return faults, killed


def planted(work: Path) -> dict[str, str]:
    """The check sees a writer that replaces one file after the other, and a sweep that writes a partition under its name."""
    from ksl.output import OutputError, cannot_write, stage
    from ksl.sweeps import store

    def one_after_the_other(part: Path, results) -> None:
        for file in sorted((part / "new").iterdir()):
            os.replace(file, part.parent / file.name)

    def under_its_name(path: Path, contents: bytes) -> None:
        try:
            path.write_bytes(contents)
        except OSError as error:
            raise OutputError(f"{path}: {cannot_write(error)}") from None

    swept = ended_sweeps.undisturbed(work)
    loads = next(w for w in writers.prepare(work) if w.name == "loads")
    with replaced(stage.swap, "swap", one_after_the_other):
        torn = writers.killed_at_changes(loads, work / "planted")
    with replaced(store, "write_part", under_its_name):
        cut = full_disks.of_sweep(work, swept, 6).faults
    return {
        "results replaced one file after the other": "caught" if any("torn" in fault for fault in torn) else "NOT CAUGHT",
        "a partition of a sweep written under its name": "caught" if any("are not of the sweep" in fault for fault in cut) else "NOT CAUGHT",
    }


@contextmanager
def replaced(module: object, name: str, stand_in: object) -> Iterator[None]:
    original = getattr(module, name)
    setattr(module, name, stand_in)
    try:
        yield
    finally:
        setattr(module, name, original)


@dataclass
class Found:
    """What is amiss, how many runs were stopped, and why no disk could be filled."""

    faults: list[str] = field(default_factory=list)
    killed: int = 0
    interrupted: int = 0
    full: int = 0
    notes: list[str] = field(default_factory=list)


def of_one(writer: writers.Writer, work: Path, moments: list[float], sizes: int) -> Found:
    """One command: killed and interrupted at moments, killed before each of its changes, on full disks."""
    faults, killed = killed_at_moments(writer, work / "out", moments)
    more, ended = interrupted(writer, work / "out", moments)
    disks = full_disks.of_writer(writer, work, sizes)
    faults += [*more, *writers.killed_at_changes(writer, work / "out"), *disks.faults]
    return said(writer.name, Found(faults, killed, ended, disks.full, [disks.note] if disks.note else []))


def of_sweeps(work: Path, moments: list[float], sizes: int) -> Found:
    """The same of sweeps, into an empty folder and over another sweep: half of the moments each.  Disks are full in an empty folder."""
    swept, found = ended_sweeps.undisturbed(work), Found()
    for force, some in ((False, moments[::2]), (True, moments[1::2])):
        at_changes = ended_sweeps.killed_at_changes(work, swept, force)
        killed = ended_sweeps.killed_at_moments(work, swept, force, some)
        ended = ended_sweeps.interrupted(work, swept, force, some)
        found.faults += [*at_changes.faults, *killed.faults, *ended.faults]
        found.killed += killed.ended
        found.interrupted += ended.ended
    disks = full_disks.of_sweep(work, swept, sizes)
    found.faults += disks.faults
    found.full, found.notes = disks.full, [disks.note] if disks.note else []
    return said("sweep", found)


def said(name: str, found: Found) -> Found:
    print(
        f"{name}: {found.killed} killed, {found.interrupted} interrupted, {found.full} disks full; {len(found.faults)} faults",
        *found.faults,
        sep="\n  ",
        flush=True,
    )
    return found


def prepared(work: Path, only: str) -> list[writers.Writer]:
    """The writers whose names hold `only`, with all modules imported, so that the time of a run is that of its work."""
    writers.same_date()
    sweeps_here.sweep_here()
    writers.export_a_small_page()
    chosen = [w for w in writers.prepare(work) if only in w.name]
    for writer in chosen:
        (work / "warm" / writer.name).mkdir(parents=True)
        killing.in_this_process(writer.later(work / "warm" / writer.name))
    return chosen


def record(figures: dict[str, int], kept: bool, seen: dict[str, str], notes: list[str]) -> None:
    parts = [part for name, value in figures.items() for part in ("--figure", f"{name}={value}")]
    parts += [part for fault, outcome in seen.items() for part in ("--planted", f"{fault}={outcome}")]
    parts += [part for note in notes for part in ("--note", note)]
    to_record("--kept" if kept else "--broken", *parts)


def to_record(*arguments: str) -> None:
    subprocess.run([sys.executable, str(ROOT / "scripts/trust/record.py"), "results-files", "--command", "make test-faults", *arguments], check=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moments", type=int, default=100, help="of each command, at random")
    parser.add_argument("--sizes", type=int, default=20, help="of disks, for each command")
    parser.add_argument("--only", default="", metavar="NAME", help="the writers whose names hold this; nothing is recorded")
    parser.add_argument("--seed", type=int, default=1, help="of the random moments")
    parser.add_argument("--no-record", action="store_true")
    given = parser.parse_args()
    recorded = not given.no_record and not given.only
    if recorded:
        to_record("--begun")
    draw = random.Random(given.seed)

    def moments(count: int, first: float = 0.0) -> list[float]:
        return [draw.uniform(first, 1.05) for _ in range(count)]

    with tempfile.TemporaryDirectory(prefix="ksl-faults-") as folder:
        work = Path(folder)
        every = prepared(work, given.only)
        results = [of_one(writer, work, moments(given.moments), given.sizes) for writer in every]
        if given.only in "sweep":
            results.append(of_sweeps(work, moments(given.moments), given.sizes))
        met = all(found.killed and found.interrupted and found.full for found in results)
        if not given.only:
            results.append(said("ksl loads as a process", Found(*real_processes_killed(work, moments(given.moments, 0.2)))))
        seen = planted(work)
    faults = [fault for found in results for fault in found.faults]
    notes = [note for found in results for note in found.notes][:1]
    figures = {
        "commands and functions that write": len(every) + (given.only in "sweep"),
        "random moments of kill -9, each": given.moments,
        "runs that kill -9 met": sum(found.killed for found in results),
        "runs ended by SIGINT or SIGTERM": sum(found.interrupted for found in results),
        "disk sizes, each": 0 if notes else given.sizes,
        "runs that met a full disk": sum(found.full for found in results),
        "torn or left behind": len(faults),
    }
    kept = not faults and set(seen.values()) == {"caught"} and not notes and met
    print(figures, seen, notes)
    if recorded:
        record(figures, kept, seen, notes)
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
