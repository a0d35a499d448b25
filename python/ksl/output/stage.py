"""A hidden folder in which results are written, and from which they get into their places in one step."""

from __future__ import annotations

import atexit
import contextlib
import os
import shutil
import stat
import threading
import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from ksl.output import swap
from ksl.output.errors import OutputError, cannot_write
from ksl.output.locks import Lock, LockedError, lock
from ksl.output.signals import uninterrupted

PREFIX = ".ksl-stage-"
LOCK = ".ksl-lock"
"""Held for some milliseconds: while a stage is made, and while results are put into their places."""
PATIENCE = 60.0
"""Seconds after which a run gives up that waits for this lock."""


@contextmanager
def staged(directory: Path, results: Collection[str] = ()) -> Iterator[Path]:
    """A folder for the block to write files into.  If the block ends without an exception, they replace those of `directory` in one step.

    Files of the names `results` that the block did not write are then removed: they would be those of an earlier run.
    `directory` is made if it is missing.  What fails on the way, or a signal, leaves it as it was, absent if it was absent; what a process
    leaves behind that is killed, the next one that writes there settles and removes.  Of two processes that write at the same time
    the files of the later one stay, all of them.  Raises OutputError: before the block where `directory` can't hold
    files, and for every OSError of the block.
    """
    try:
        with stage_in(directory, results) as files:
            yield files
    except OutputError:
        raise
    except OSError as e:
        raise OutputError(f"{directory}: {cannot_write(e)}") from None


@contextmanager
def stage_in(directory: Path, results: Collection[str] = ()) -> Iterator[Path]:
    """As `staged`, but errors of the system are those of the system."""
    stage = _Stage(directory.absolute())
    try:
        stage.make(results)
        yield stage.files
        stage.put(results)
    except FileNotFoundError:
        if not stage.is_there():
            raise OutputError(f"{directory}: was removed while results were written into it; run it again") from None
        raise
    finally:
        stage.end()


def flush_early(file: Path) -> None:
    """Begins to write a file of a stage to the disk, beside what is computed meanwhile.  For files of many megabytes."""

    def begin() -> None:
        with contextlib.suppress(OSError):  # the swap does it again, and says what fails
            swap.flush(file)

    threading.Thread(target=begin, daemon=True).start()


class _Stage:
    """A stage, the lock of its folder while that is needed, and the folders that were made for it."""

    def __init__(self, directory: Path) -> None:
        self.path: Path | None = None
        self._directory, self._made = directory, list[Path]()
        self._alone: Lock | None = None  # in the folder
        self._alive: Lock | None = None  # says to others that the stage is in use
        self._process = os.getpid()  # a copy of it, which forked, must not touch the stage

    @property
    def files(self) -> Path:
        """Where the block writes."""
        assert self.path is not None
        return self.path / swap.NEW

    def is_there(self) -> bool:
        return self.path is None or self.path.exists()

    def make(self, results: Collection[str]) -> None:
        _open_stages.add(self)
        with uninterrupted():
            self._make_folders()
        for name in results:
            if (self._directory / name).is_dir():
                raise OutputError(f"{self._directory / name}: a folder where a result file belongs; move it away, or give another folder with -o")
        self._wait()
        with uninterrupted():
            settle_stale(self._directory)
            path = self._directory / f"{PREFIX}{os.urandom(4).hex()}"
            path.mkdir()  # by its mode others may read it: for some microseconds results are read through it
            self.path = path
            self._alive = lock(path / "lock")
            self.files.mkdir()
            self._give_way()

    def put(self, results: Collection[str]) -> None:
        """The files into their places."""
        self._wait()
        with uninterrupted():
            assert self.path is not None
            swap.swap(self.path, results)
            self._made.clear()
            self._remove()
            self._give_way()

    def end(self) -> None:
        """Removes what is left, in whatever state it is."""
        if self._process != os.getpid():
            return
        with uninterrupted():
            self._remove()
            self._give_way()
            for folder in reversed(self._made):
                try:
                    folder.rmdir()
                except OSError:  # somebody else has put something there
                    break
            self._made.clear()
            _open_stages.discard(self)

    def _make_folders(self) -> None:
        for folder in (*reversed(self._directory.parents), self._directory):
            if not os.path.lexists(folder):
                folder.mkdir()
                self._made.append(folder)
            elif not folder.is_dir():
                raise OutputError(f"{folder}: is no folder, so results can't be written there; move it away, or give another folder with -o")

    def _wait(self) -> None:
        """Until no other process makes a stage here, or puts results into their places."""
        until = time.monotonic() + PATIENCE
        while True:
            try:
                with uninterrupted():
                    self._alone = lock(self._directory / LOCK)
                return
            except LockedError as e:
                if time.monotonic() > until:
                    raise OutputError(f"{self._directory}: {e} has been putting its results there for {PATIENCE:g} s; wait for its end, or give another folder with -o") from None
            time.sleep(0.005)

    def _give_way(self) -> None:
        if self._alone is not None:
            self._alone.release()
            self._alone = None

    def _remove(self) -> None:
        """Also after a swap that failed: then the folder is as it was, or all is new.  A stage that can't be settled is left to the next run."""
        if self._alive is not None:
            self._alive.abandon()
            self._alive = None
        if self.path is not None:
            with contextlib.suppress(OSError):
                swap.settle(self.path)
                shutil.rmtree(self.path, ignore_errors=True)
        self.path = None


_open_stages: set[_Stage] = set()


@atexit.register
def _end_open_stages() -> None:
    """Of blocks that were never entered, since a signal came when their stage had just been made."""
    for stage in list(_open_stages):
        stage.end()


def settle_stale(directory: Path) -> None:
    """Ends the swaps and removes the stages of processes that are dead.

    A stage that is locked is in use.  Where there are no locks nothing can be told, and nothing is removed.  Nor are stages of other users,
    who could otherwise have files removed that are not theirs.
    """
    try:
        stages = [Path(entry) for entry in os.scandir(directory) if entry.name.startswith(PREFIX)]
    except PermissionError:  # files may be made there, but not listed
        return
    for stage in stages:
        with contextlib.suppress(OSError, LockedError):
            made = stage.lstat()
            if not stat.S_ISDIR(made.st_mode) or (hasattr(os, "geteuid") and made.st_uid != os.geteuid()):
                continue
            dead = lock(stage / "lock")
            if dead is None:
                continue
            try:
                swap.settle(stage)
                shutil.rmtree(stage, ignore_errors=True)
            finally:
                dead.abandon()
