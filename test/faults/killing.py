"""Copies of this process that run a command and are killed, interrupted, or run out of disk; and what they leave."""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path

CHANGES = ("os.rename", "os.link", "os.symlink", "os.mkdir", "os.remove", "os.rmdir", "os.truncate", "os.chmod")
"""Events of Python's audit hooks, which come before the call: whatever function makes it, these change names in a folder."""
WAITING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
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
    sys.stdout.flush()
    sys.stderr.flush()
    signal.pthread_sigmask(signal.SIG_BLOCK, WAITING)  # those that a user sends come while the action runs, and not before
    copy = os.fork()
    if copy == 0:
        status = 70
        try:
            os.close(read)
            _print_to(output)
            changes = _count(kill_at)
            before()
            status = _status(action)
            os.write(write, str(changes[0]).encode())
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stderr.flush()
            os._exit(status)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, WAITING)
    os.close(write)
    if end is not None:
        time.sleep(end[1])
        os.kill(copy, end[0])
    _, waited = os.waitpid(copy, 0)
    changed = os.read(read, 20)
    os.close(read)
    return os.waitstatus_to_exitcode(waited), int(changed or b"0")


def _print_to(output: Path | None) -> None:
    place = os.open(output or os.devnull, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(place, 1)
    os.dup2(place, 2)
    sys.stdout, sys.stderr = os.fdopen(1, "w", closefd=False), os.fdopen(2, "w", closefd=False)


def _count(kill_at: int) -> list[int]:
    count = [0]

    def hook(event: str, given: tuple) -> None:
        if event in CHANGES or (event == "open" and isinstance(given[2], int) and given[2] & WRITES):
            count[0] += 1
            if count[0] == kill_at:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(hook)
    return count


def _status(action: Callable[[], object]) -> int:
    """As the interpreter would end: with the functions that are registered for its end."""
    from ksl.output import stage

    try:
        try:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, WAITING)
            action()
        finally:
            signal.pthread_sigmask(signal.SIG_BLOCK, WAITING)
        status = 0
    except SystemExit as e:
        status = e.code if isinstance(e.code, int) else int(e.code is not None)
    except KeyboardInterrupt:
        status = 130
    stage._end_open_stages()
    sys.stdout.flush()
    sys.stderr.flush()
    return status


def command(*arguments: object) -> Callable[[], object]:
    """`ksl ARGUMENTS`, to be run in a copy."""

    def run() -> None:
        from ksl.commands import app

        sys.argv = ["ksl", *map(str, arguments)]
        app(prog_name="ksl")

    return run


def hear_signals() -> None:
    """To run first in a copy: SIGINT and SIGTERM end it as they end `ksl`."""
    from ksl.commands.app import end_on_signals

    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell lets commands in the background ignore it
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
