"""Stages: hidden folders in which results are written, and from which they are moved to their places in one step."""

from __future__ import annotations

import atexit
import contextlib
import os
import shutil
import stat
import threading
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from ksl.output import swap
from ksl.output.folders import MadeFolders
from ksl.output.locks import Lock, LockedError, lock
from ksl.output.output_error import OutputError, cannot_write
from ksl.output.replaced import refuse_folders
from ksl.output.signals import uninterrupted

PREFIX = ".ksl-stage-"
LOCK = ".ksl-lock"
"""Lock of a folder.  Held for some milliseconds: while a stage is made, and while results are moved to their places."""
PATIENCE = 60.0
"""Seconds that a run waits for this lock."""


@contextmanager
def staged(directory: Path, results: Collection[str] = (), check: Callable[[], None] | None = None) -> Iterator[Path]:
    """A folder for the block to write files into.  If the block ends without an exception, its files replace those of `directory` in one step.

    results: names of files that are removed if the block did not write them, since they are those of an earlier run.
    check: is called before the block, when what killed runs have left is settled.  It raises an exception if `directory` must not be written to.
    `directory` is made if it is missing.  After an error or a signal it is as it was before, absent if it was absent.  What a killed process
    leaves behind is settled and removed by the next process that writes there.  Where two processes write at the same time, all
    files are those of the one that ends later.

    Raises OutputError: before the block where `directory` can't hold files, and for every OSError of the block.
    """
    try:
        with stage_in(directory, results, check) as files:
            yield files
    except OutputError:
        raise
    except OSError as e:
        raise OutputError(f"{directory}: {cannot_write(e)}") from None


@contextmanager
def stage_in(directory: Path, results: Collection[str] = (), check: Callable[[], None] | None = None) -> Iterator[Path]:
    """As `staged`, but an OSError is raised as it is, for callers that name a file in their message."""
    stage = _Stage(directory.absolute())
    try:
        stage.make(results, check)
        yield stage.files
        stage.put(results)
    except FileNotFoundError:
        if not stage.is_there():
            raise OutputError(f"{directory}: was removed while results were written into it; run it again") from None
        raise
    finally:
        stage.end()


def flush_early(file: Path) -> None:
    """Begins to flush a file of a stage to the disk, in another thread.  For files of many megabytes: the swap then waits less."""

    def begin() -> None:
        with contextlib.suppress(OSError):  # the swap flushes it once more, and reports errors
            swap.flush(file)

    threading.Thread(target=begin, daemon=True).start()


class _Stage:
    """A stage, its locks, and the folders that were made for it."""

    def __init__(self, directory: Path) -> None:
        self.path: Path | None = None
        self._directory, self._made = directory, MadeFolders()
        self._folder_lock: Lock | None = None  # while files of the folder change
        self._stage_lock: Lock | None = None  # as long as the stage is in use
        self._process = os.getpid()  # a fork of this process must not remove the stage

    @property
    def files(self) -> Path:
        """Where the block writes."""
        assert self.path is not None
        return self.path / swap.NEW

    def is_there(self) -> bool:
        return self.path is None or self.path.exists()

    def make(self, results: Collection[str], check: Callable[[], None] | None) -> None:
        _open_stages.add(self)
        with uninterrupted():
            self._made.make(self._directory)
        refuse_folders(self._directory, results)
        self._lock_folder()
        with uninterrupted():
            settle_stale(self._directory)
        if check is not None:
            check()
        with uninterrupted():
            path = self._directory / f"{PREFIX}{os.urandom(4).hex()}"
            path.mkdir()  # readable as other folders are: during the swap, readers of results follow links into it
            self.path = path
            self._stage_lock = lock(path / "lock")
            self.files.mkdir()
            self._release_folder()

    def put(self, results: Collection[str]) -> None:
        """Moves the files to their places."""
        self._lock_folder()
        with uninterrupted():
            assert self.path is not None
            refuse_folders(self._directory, os.listdir(self.files))
            swap.swap(self.path, results)
            self._made.keep()
            self._remove()
            self._release_folder()

    def end(self) -> None:
        """Removes what is left of the stage, however far it got."""
        if self._process != os.getpid():
            return
        with uninterrupted():
            self._remove()
            self._release_folder()
            self._made.remove_empty()
            _open_stages.discard(self)

    def _lock_folder(self) -> None:
        """Waits while another process makes a stage here or moves results.  Raises OutputError after `PATIENCE` seconds."""
        until = time.monotonic() + PATIENCE
        while True:
            try:
                with uninterrupted():
                    self._folder_lock = lock(self._directory / LOCK)
                return
            except LockedError as e:
                if time.monotonic() > until:
                    said = f"{e} has been putting its results there for {PATIENCE:g} s; wait for its end, or give another folder with -o"
                    raise OutputError(f"{self._directory}: {said}") from None
            time.sleep(0.005)

    def _release_folder(self) -> None:
        if self._folder_lock is not None:
            self._folder_lock.release()
            self._folder_lock = None

    def _remove(self) -> None:
        """Removes the stage, after a swap that failed too: `settle` first makes links of the folder plain files.  If that fails, the next run does it."""
        if self._stage_lock is not None:
            self._stage_lock.abandon()
            self._stage_lock = None
        if self.path is not None:
            with contextlib.suppress(OSError):
                swap.settle(self.path)
                shutil.rmtree(self.path, ignore_errors=True)
        self.path = None


_open_stages: set[_Stage] = set()


@atexit.register
def _end_open_stages() -> None:
    """Ends stages whose blocks were never entered, since a signal came just after they had been made."""
    for stage in list(_open_stages):
        stage.end()


def settle_stale(directory: Path) -> None:
    """Ends the swaps of dead processes, and removes their stages.

    A stage that is locked is in use.  Without locks nobody can tell, so nothing is removed.  Stages of other users stay as well: their
    list of files to be removed could name files of this user.  So does a folder that only has the name of a stage, and is not as `swap` leaves it.
    """
    try:
        stages = [Path(entry) for entry in os.scandir(directory) if entry.name.startswith(PREFIX)]
    except PermissionError:  # files may be made in this folder, but not listed
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
            shutil.rmtree(stage, ignore_errors=True)  # Windows keeps a file that is open, and its folder
