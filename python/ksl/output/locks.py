"""Locks that the system releases when their process ends, however it ends."""

from __future__ import annotations

import contextlib
import errno
import os
import platform
from pathlib import Path
from types import ModuleType

from ksl.output.patience import patiently

fcntl: ModuleType | None
try:
    import fcntl
except ModuleNotFoundError:  # Windows
    fcntl = None
msvcrt: ModuleType | None
try:
    import msvcrt
except ModuleNotFoundError:  # all other systems
    msvcrt = None

BEYOND = 1 << 20
"""The byte that is locked on Windows, where nobody reads a byte that another process has locked: far behind the text."""
WITHOUT_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL)
"""Errors of file systems that have no locks."""


class LockedError(Exception):
    """Another process, or another lock of this one, holds the lock.  Says which process."""


class Lock:
    """A lock that is held, and its file."""

    def __init__(self, path: Path, handle: int) -> None:
        self.path, self._handle = path, handle

    def release(self) -> None:
        """Removes the file and releases the lock."""
        if self._handle < 0:
            return
        if fcntl is None:  # Windows removes no file that is open, here or, by the next holder, elsewhere
            self.abandon()
        with contextlib.suppress(OSError):  # its folder may be gone
            if fcntl is None or _is_file_of(self.path, self._handle):
                os.unlink(self.path)
        self.abandon()

    def abandon(self) -> None:
        """Releases the lock; the file stays."""
        handle, self._handle = self._handle, -1
        if handle >= 0:
            os.close(handle)


def lock(path: Path) -> Lock | None:
    """Takes the lock whose file is `path`, and makes that file.  None where the file system has no locks.

    Does not wait: raises LockedError where the lock is held, and OSError where the file can't be made.  The locks are those of flock(2), or of LockFile on Windows.
    The system releases them when their process ends, which it would not do for a process number in a file.  They also work between
    containers and, on NFS, between machines.
    """
    if fcntl is None and msvcrt is None:
        return None
    while True:
        handle = patiently(_opened, path, but=(PermissionError, FileNotFoundError))  # while its last holder removes it
        try:
            _take(handle)
            if _is_file_of(path, handle):
                _sign(handle)
                return Lock(path, handle)
        except BlockingIOError:
            os.lseek(handle, 0, os.SEEK_SET)
            holder = os.read(handle, 200).decode(errors="replace").strip()
            os.close(handle)
            raise LockedError(holder or "another process") from None
        except OSError as e:
            os.close(handle)
            if e.errno in WITHOUT_LOCKS:
                return None
            raise
        os.close(handle)  # the holder removed the file before the lock was taken: once more, with a new file


def _take(handle: int) -> None:
    """Locks a file.  Raises BlockingIOError where it is locked."""
    if fcntl is not None:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    elif msvcrt is not None:
        os.lseek(handle, BEYOND, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError as e:
            if e.errno in WITHOUT_LOCKS:
                raise
            raise BlockingIOError(*e.args) from None  # EACCES; Wine leaves whatever number there was


def _opened(path: Path) -> int:
    flags = os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    try:
        return os.open(path, os.O_RDWR | flags, 0o666)
    except PermissionError:  # another user's file: locking needs no right to write
        return os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0))


def _is_file_of(path: Path, handle: int) -> bool:
    try:
        return os.path.samestat(os.stat(path), os.fstat(handle))
    except FileNotFoundError:
        return False


def _sign(handle: int) -> None:
    """Writes which process holds the lock, for the messages of others.  On a full disk the lock is held without it."""
    with contextlib.suppress(OSError):
        os.ftruncate(handle, 0)
        os.lseek(handle, 0, os.SEEK_SET)
        os.write(handle, f"process {os.getpid()} on {platform.node()}\n".encode())
