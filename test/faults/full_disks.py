"""Commands whose disk runs full: disks of memory of many sizes, which only the process that mounts them sees."""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import ended_sweeps
import killing
import writers

NEW_USERS, NEW_MOUNTS = 0x10000000, 0x00020000  # of <linux/sched.h>
REMOUNT, PRIVATE = 32, (1 << 18) | (1 << 14)  # of <linux/mount.h>: for this process and its copies alone
PAGE = 4096
"""A disk of memory gives space in these."""


@dataclass(frozen=True)
class Found:
    """What is amiss, how many runs met a full disk, and why none could be filled."""

    faults: list[str]
    full: int = 0
    note: str = ""


def of_writer(writer: writers.Writer, work: Path, sizes: int) -> Found:
    """The space beside the earlier results is 0 to a little more than needed: a run changes nothing, or all."""
    return _in_a_copy(work, lambda disk: _writer_on(disk, writer, sizes))


def of_sweep(work: Path, swept: killing.Seen, sizes: int) -> Found:
    """The space is 0 to a little more than a sweep needs, into an empty folder: what is there is whole, and the next run, with space, completes it."""
    return _in_a_copy(work, lambda disk: _sweep_on(disk, work, swept, sizes))


class Disk:
    """A file system of memory at `folder`, whose size can be changed."""

    def __init__(self, folder: Path) -> None:
        self.folder, self._libc = folder, _own_mounts()
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        self._mount(0, "1g")

    def resize(self, size: int | None) -> None:
        """size: bytes; None: more than is ever needed."""
        self._mount(REMOUNT, "1g" if size is None else str(max(PAGE, size)))

    def _mount(self, flags: int, size: str) -> None:
        if self._libc.mount(b"none", os.fsencode(self.folder), b"tmpfs", flags, f"size={size}".encode()):
            raise OSError(ctypes.get_errno(), f"no file system of {size} bytes can be mounted here")

    def used(self) -> int:
        s = os.statvfs(self.folder)
        return (s.f_blocks - s.f_bfree) * s.f_frsize

    def sizes(self, run: Callable[[], object], count: int) -> list[int]:
        """From what is used now to a little more than the run needs, evenly spread: old and new are there together.  It has run afterwards."""
        before = self.used()
        killing.in_a_copy(run)
        needed = max(self.used(), before, 8 * PAGE) + 4 * PAGE
        return [before + PAGE * round(k * needed / PAGE / (count - 1)) for k in range(count)]


def _in_a_copy(work: Path, fill: Callable[[Disk], Found]) -> Found:
    """Mounts are those of a copy of this process and end with it."""
    answer, log = work / "answer", work / "log"
    answer.unlink(missing_ok=True)

    def run() -> None:
        found = fill(Disk(work / "disk"))
        answer.write_text(json.dumps({"faults": found.faults, "full": found.full}))

    if killing.in_a_copy(run, output=log)[0]:
        return Found([], 0, "No disk was filled: " + log.read_text().strip().splitlines()[-1])
    return Found(**json.loads(answer.read_text()))


def _writer_on(disk: Disk, writer: writers.Writer, sizes: int) -> Found:
    faults, full, out = [], 0, disk.folder
    (out / writer.user_file).write_text("the user's")
    killing.in_a_copy(writer.earlier(out))
    earlier = killing.visible(out)
    with tempfile.TemporaryDirectory() as elsewhere:
        kept, log = Path(elsewhere) / "kept", Path(elsewhere) / "log"
        shutil.copytree(out, kept)
        spaces = disk.sizes(writer.later(out), sizes)
        later = killing.visible(out)
        for space in spaces:
            disk.resize(None)
            for name in killing.everything(out):
                (out / name).unlink()
            shutil.copytree(kept, out, dirs_exist_ok=True)
            disk.resize(space)
            status, _ = killing.in_a_copy(writer.later(out), output=log)
            found, when = killing.visible(out), f"{writer.name}: {space} bytes: status {status}"
            done = found == later and status != 2
            if not done:
                full += 1
                faults += _said_amiss(log, when, plain=writer.name not in ("to_urdf", "Run.report"))  # of these two, which are Python, a traceback is right
            if found != (later if done else earlier) or killing.everything(out) != set(found):
                faults.append(f"{when}, leaves {sorted(killing.everything(out))}")
    return Found(faults, full)


def _sweep_on(disk: Disk, work: Path, swept: killing.Seen, sizes: int) -> Found:
    faults, full, out, log = [], 0, disk.folder / "swept", work / "sweep_log"
    run = writers.sweep_of(work, "b")(out)
    spaces = disk.sizes(run, sizes)
    shutil.rmtree(out)
    for space in spaces:
        disk.resize(space)
        status, _ = killing.in_a_copy(run, output=log)
        when = f"sweep: {space} bytes: status {status}"
        if status:
            full += 1
            faults += _said_amiss(log, when)
        faults += ended_sweeps.left_amiss(out, swept, when)
        disk.resize(None)
        faults += ended_sweeps.not_completed(run, out, swept, when)
        shutil.rmtree(out)
    return Found(faults, full)


def _said_amiss(log: Path, when: str, plain: bool = True) -> list[str]:
    """What is wrong with what a command says whose disk is full; plain: no traceback."""
    said = log.read_text()
    wrong = "No space left on device" not in said or (plain and "Traceback" in said)
    return [f"{when}, says {said[-300:]!r}"] if wrong else []


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
