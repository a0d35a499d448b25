"""Kills every command that writes at random moments and before each of its changes, interrupts it, and fills its disk.

    python test/faults/kill_at_random.py [--moments 100] [--sizes 20] [--only NAME] [--seed 1] [--no-record]

Prints what is amiss and the figures, and writes the record of the promise `results-files`.  About ten minutes."""

from __future__ import annotations

import argparse
import ctypes
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import killing
import writers

ROOT = Path(__file__).resolve().parents[2]
NEW_USERS, NEW_MOUNTS = 0x10000000, 0x00020000  # of <linux/sched.h>
REMOUNT, PRIVATE = 32, (1 << 18) | (1 << 14)  # of <linux/mount.h>: for this process and its copies alone


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
    from ksl.commands.app import end_on_signals

    earlier = writers.earlier_results(writer, out)
    saved = _saved(out)
    usual, _ = killing.in_a_copy(writer.later(out))
    took, later = _time(writer, out), killing.visible(out)
    faults, ended = [], 0

    def heard() -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell lets commands in the background ignore it
        end_on_signals()

    for k, moment in enumerate(moments):
        _again(saved, out)
        number = (signal.SIGINT, signal.SIGTERM)[k % 2]
        status, _ = killing.in_a_copy(writer.later(out), end=(number, moment * took), before=heard)
        ended += status != usual
        found, when = killing.visible(out), f"{writer.name}: {number.name} after {moment:.3f} of its time"
        if status not in (usual, 128 + number, -number):
            faults.append(f"{when}: status {status}")
        if found not in (earlier, later) or killing.everything(out) != set(found):
            faults.append(f"{when}: leaves {sorted(killing.everything(out))}")
    return faults, ended


def on_full_disks(writer: writers.Writer, out: Path, sizes: int, answer: Path) -> None:
    """In a copy: fills disks of memory, whose space beside the earlier results is 0 to a little more than needed.  Writes faults as JSON."""
    faults, full = [], 0
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    libc = _own_mounts()
    if libc.mount(b"none", os.fsencode(out), b"tmpfs", 0, b"size=1g"):
        raise OSError(ctypes.get_errno(), "no file system can be mounted here")
    (out / writer.user_file).write_text("the user's")
    killing.in_a_copy(writer.earlier(out))
    earlier = killing.visible(out)
    with tempfile.TemporaryDirectory() as elsewhere:
        kept = Path(elsewhere) / "kept"
        shutil.copytree(out, kept)
        peak = _peak(writer, out)
        later, log = killing.visible(out), Path(elsewhere) / "log"
        for k in range(sizes):
            libc.mount(b"none", os.fsencode(out), b"tmpfs", REMOUNT, b"size=1g")
            for name in killing.everything(out):
                (out / name).unlink()
            shutil.copytree(kept, out, dirs_exist_ok=True)
            space = _used(out) + 4096 * round(k * peak / 4096 / (sizes - 1))
            if libc.mount(b"none", os.fsencode(out), b"tmpfs", REMOUNT, b"size=%d" % max(4096, space)):
                raise OSError(ctypes.get_errno(), "can't be made smaller")
            status, _ = killing.in_a_copy(writer.later(out), output=log)
            said, found = log.read_text(), killing.visible(out)
            if found == later and status != 2:
                expected = later
            else:
                expected, full = earlier, full + 1
                raw = "Traceback" in said and writer.name not in ("to_urdf", "Run.report")  # of these two, which are Python, it is right
                if raw or "No space left on device" not in said:
                    faults.append(f"{writer.name}: {space} bytes: status {status}, says {said[-300:]!r}")
            if found != expected or killing.everything(out) != set(found):
                faults.append(f"{writer.name}: {space} bytes: status {status}, leaves {sorted(killing.everything(out))}")
    answer.write_text(json.dumps({"faults": faults, "full": full}))


def _own_mounts() -> ctypes.CDLL:
    """The C library, when what this process mounts is seen by itself alone.  Users that are not root become root of a namespace of their own."""
    libc, user, group = ctypes.CDLL(None, use_errno=True), os.geteuid(), os.getegid()
    if libc.unshare(NEW_MOUNTS | (NEW_USERS if user else 0)):
        raise OSError(ctypes.get_errno(), "no namespaces here")
    if user:
        for name, text in (("setgroups", "deny"), ("uid_map", f"0 {user} 1"), ("gid_map", f"0 {group} 1")):
            Path(f"/proc/self/{name}").write_text(text)
    elif libc.mount(b"none", b"/", None, PRIVATE, None):
        raise OSError(ctypes.get_errno(), "mounts can't be kept private")
    return libc


def _used(folder: Path) -> int:
    s = os.statvfs(folder)
    return (s.f_blocks - s.f_bfree) * s.f_frsize


def _peak(writer: writers.Writer, out: Path) -> int:
    """Bytes that the later run needs beside the earlier results, about: old and new are there together."""
    before = _used(out)
    killing.in_a_copy(writer.later(out))
    return max(_used(out), before, 8 * 4096) + 4 * 4096


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


def planted(work: Path) -> str:
    """The check sees a writer that replaces one file after the other."""
    from ksl.output import stage

    def one_after_the_other(part: Path, results) -> None:
        for file in sorted((part / "new").iterdir()):
            os.replace(file, part.parent / file.name)

    real = stage.swap.swap
    stage.swap.swap = one_after_the_other
    try:
        found = writers.killed_at_changes(next(w for w in writers.prepare(work) if w.name == "loads"), work / "planted")
    finally:
        stage.swap.swap = real
    return "caught" if any("torn" in fault for fault in found) else "NOT CAUGHT"


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
    found = Found([*faults, *more, *writers.killed_at_changes(writer, work / "out")], killed, ended)
    answer, log = work / "answer", work / "log"
    answer.unlink(missing_ok=True)
    status, _ = killing.in_a_copy(lambda: on_full_disks(writer, work / "disk", sizes, answer), output=log)
    if status:
        found.notes.append("No file system could be mounted, so that no disk was filled: " + log.read_text().strip().splitlines()[-1])
    else:
        said = json.loads(answer.read_text())
        found.faults += said["faults"]
        found.full = said["full"]
    print(f"{writer.name}: {killed} killed, {ended} interrupted, {found.full} disks full; {len(found.faults)} faults", flush=True)
    return found


def of_sweeps(work: Path, moments: Callable[[int], list[float]], count: int) -> list[str]:
    """What is amiss with sweeps that are killed, into an empty folder and over another sweep."""
    killing.in_this_process(writers.sweep_of(work, "b")(work / "undisturbed"))
    swept, faults = killing.visible(work / "undisturbed"), []
    for force in (False, True):
        faults += writers.sweep_killed_at_changes(work, swept, force)
        faults += writers.sweep_killed_at_moments(work, swept, force, moments(count))
    return faults


def prepared(work: Path, only: str) -> list[writers.Writer]:
    """The writers whose names hold `only`, with all modules imported, so that the time of a run is that of its work."""
    writers.same_date()
    writers.sweeps_in_this_process()
    writers.export_a_small_page()
    chosen = [w for w in writers.prepare(work) if only in w.name]
    for writer in chosen:
        (work / "warm" / writer.name).mkdir(parents=True)
        killing.in_this_process(writer.later(work / "warm" / writer.name))
    return chosen


def record(figures: dict[str, int], kept: bool, seen: str, notes: list[str]) -> None:
    parts = [part for name, value in figures.items() for part in ("--figure", f"{name}={value}")]
    parts += ["--planted", f"results replaced one file after the other={seen}", *(part for note in notes for part in ("--note", note))]
    to_record("--kept" if kept else "--broken", *parts)


def to_record(*arguments: str) -> None:
    subprocess.run([sys.executable, str(ROOT / "scripts/trust/record.py"), "results-files", "--command", "make test-faults", *arguments], check=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moments", type=int, default=100, help="of each command, at random")
    parser.add_argument("--sizes", type=int, default=20, help="of disks, for each command")
    parser.add_argument("--only", default="", metavar="NAME", help="the writers whose names hold this, and no sweeps; nothing is recorded")
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
        if not given.only:
            faults, killed = real_processes_killed(work, moments(given.moments, 0.2))
            results += [Found(faults, killed), Found(of_sweeps(work, moments, given.moments // 2))]
        seen = planted(work)
    faults = [fault for found in results for fault in found.faults]
    notes = [note for found in results for note in found.notes][:1]
    for fault in faults:
        print(fault)
    figures = {
        "commands and functions that write": len(every) + (not given.only),
        "random moments of kill -9, each": given.moments,
        "runs that kill -9 met": sum(found.killed for found in results),
        "runs ended by SIGINT or SIGTERM": sum(found.interrupted for found in results),
        "disk sizes, each": 0 if notes else given.sizes,
        "runs that met a full disk": sum(found.full for found in results),
        "torn or left behind": len(faults),
    }
    met = all(found.killed and found.interrupted and found.full for found in results[: len(every)])
    kept = not faults and seen == "caught" and not notes and met
    print(figures, seen, notes)
    if recorded:
        record(figures, kept, seen, notes)
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
