"""Locks that the system releases when their process ends, however it ends."""

from __future__ import annotations

import contextlib
import errno
import os
import platform
from pathlib import Path
from types import ModuleType

fcntl: ModuleType | None
try:
    import fcntl
except ModuleNotFoundError:  # Windows
    fcntl = None

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
        with contextlib.suppress(OSError):  # its folder may be gone
            if _is_file_of(self.path, self._handle):
                os.unlink(self.path)
        self.abandon()

    def abandon(self) -> None:
        """Releases the lock; the file stays."""
        handle, self._handle = self._handle, -1
        if handle >= 0:
            os.close(handle)


def lock(path: Path) -> Lock | None:
    """Takes the lock whose file is `path`, and makes that file.  None where the file system, or Windows, has no locks.

    Does not wait: raises LockedError where the lock is held, and OSError where the file can't be made.  The locks are those of flock(2).
    The system releases them when their process ends, which it would not do for a process number in a file.  They also work between
    containers and, on NFS, between machines.
    """
    if fcntl is None:
        return None
    while True:
        handle = _opened(path)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_file_of(path, handle):
                _sign(handle)
                return Lock(path, handle)
        except BlockingIOError:
            holder = os.pread(handle, 200, 0).decode(errors="replace").strip()
            os.close(handle)
            raise LockedError(holder or "another process") from None
        except OSError as e:
            os.close(handle)
            if e.errno in WITHOUT_LOCKS:
                return None
            raise
        os.close(handle)  # the holder removed the file before the lock was taken: once more, with a new file


def _opened(path: Path) -> int:
    flags = os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
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
        os.pwrite(handle, f"process {os.getpid()} on {platform.node()}\n".encode(), 0)
