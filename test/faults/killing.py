"""Copies of this process that run a command and are killed, interrupted, or run out of disk; and what they leave."""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

from ksl.commands.app import end_on_signals
from ksl_command import copied, print_to, status_of

CHANGES = ("os.rename", "os.link", "os.symlink", "os.mkdir", "os.remove", "os.rmdir", "os.truncate", "os.chmod")
"""Events of Python's audit hooks, which come before the call: whatever function makes it, these change names in a folder."""
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC


def in_a_copy(
    action: Callable[[], object],
    *,
    kill_at: int = 0,
    before: Callable[[], object] = lambda: None,
    output: Path | None = None,
    end: tuple[int, float] | None = None,
) -> tuple[int, int]:
    """Runs `action` in a copy of this process.  Returns its status, negative for the signal that ended it, and how many changes it made.

    kill_at: it kills itself before the change of this number, counted from 1.  before: runs in the copy first.  output: gets what it prints.
    end: a signal that it is sent, and after how many seconds.  A copy takes a hundredth of a second, where a new Python takes half a one.
    """
    read, write = os.pipe()
    changes = [0]

    def start() -> None:
        os.close(read)
        place = os.open(output or os.devnull, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        print_to(place, place)
        _count(changes, kill_at)
        before()

    def status() -> int:
        ends = status_of(action)
        os.write(write, str(changes[0]).encode())
        return ends

    copy = copied(status, start)
    os.close(write)
    if end is not None:
        time.sleep(end[1])
        os.kill(copy, end[0])
    _, waited = os.waitpid(copy, 0)
    changed = os.read(read, 20)
    os.close(read)
    return os.waitstatus_to_exitcode(waited), int(changed or b"0")


def _count(count: list[int], kill_at: int) -> None:
    def hook(event: str, given: tuple) -> None:
        if event in CHANGES or (event == "open" and isinstance(given[2], int) and given[2] & WRITES):
            count[0] += 1
            if count[0] == kill_at:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(hook)


def hear_signals() -> None:
    """To run first in a copy: SIGINT and SIGTERM end it as they end `ksl`."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell lets commands in the background ignore it
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # Ray leaves a handler of its own in the process that has used it
    end_on_signals()


Seen = dict[str, str]


def visible(folder: Path) -> Seen:
    """What a reader finds who opens the files that a folder shows: names, and SHA-256 of what is in them."""
    seen = {}
    for path in sorted(folder.rglob("*")) if folder.is_dir() else []:
        if path.is_file() and not any(part.startswith(".") for part in path.relative_to(folder).parts):
            seen[path.relative_to(folder).as_posix()] = hashlib.sha256(path.read_bytes()).hexdigest()
    return seen


def everything(folder: Path) -> set[str]:
    """All names in a folder, hidden ones, links and folders among them."""
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")} if folder.is_dir() else set()


def in_this_process(action: Callable[[], object]) -> None:
    """So that copies find all modules imported."""
    sink = io.StringIO()
    with contextlib.redirect_stdout(sink), contextlib.redirect_stderr(sink), contextlib.suppress(SystemExit):
        action()
