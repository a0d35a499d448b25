"""Contents of files that users name: regular files only, and no more than a limit."""

from __future__ import annotations

import errno
import os
import re
import stat
import sys
from typing import BinaryIO

from ksl.base import limits

STANDARD_INPUT = "-"
_DESCRIPTOR = re.compile(r"/dev/stdin|/dev/fd/\d+|/proc/(self|\d+)/fd/\d+")


PIECE = 1 << 24
"""Bytes that are asked for at a time."""
OF_DAMAGE = (None, errno.EINVAL)
"""What the system says where a reader of a damaged file goes before its beginning, or nothing: what damage is, readers themselves find."""


class Unreadable(Exception):
    """Why a file can't be read, as the second half of a sentence.  Each reader raises its own error with it."""


def path_given(path: object, what: str, argument: str = "path") -> str:
    """A path as text.  Raises ValueError for what is none."""
    try:
        return os.fsdecode(path)  # type: ignore[arg-type]
    except TypeError:
        raise ValueError(f"{argument} is {type(path).__name__}; expected the path of {what}") from None


def check_path(file: str) -> None:
    """Raises Unreadable for paths that no file can have."""
    if "\0" in file:
        raise Unreadable("can't be read: its path holds a null character")


def is_descriptor(file: str) -> bool:
    """Whether it is a file that the shell has opened, as it does for `<(COMMAND)`."""
    return _DESCRIPTOR.fullmatch(file) is not None


def check_regular(file: str) -> None:
    """Raises Unreadable unless it is a regular file of any size, for libraries that open paths themselves."""
    opened(file, sys.maxsize).close()


def opened(file: str, limit: int) -> BinaryIO:
    """A regular file of at most `limit` bytes, opened for reading.  Raises Unreadable: also for a named pipe, which could block for ever.

    The file is judged after it was opened, so that nobody can replace it in between.
    """
    check_path(file)
    try:  # without O_NONBLOCK, opening a named pipe waits for a writer
        handle = os.open(file, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0))
    except (OSError, ValueError) as e:
        raise Unreadable(f"can't be read ({what_os_says(e)})") from None
    try:
        found = os.fstat(handle)
        _check_kind(file, found.st_mode)
        if stat.S_ISREG(found.st_mode) and found.st_size > limit:
            raise Unreadable(f"has {limits.megabytes(found.st_size)}, and is larger than {limits.megabytes(limit)}, the most that is read")
        if hasattr(os, "O_NONBLOCK"):  # Windows has set_blocking without it, for pipes alone
            os.set_blocking(handle, True)
        return os.fdopen(handle, "rb")
    except BaseException:
        os.close(handle)
        raise


def _check_kind(file: str, mode: int) -> None:
    if stat.S_ISREG(mode):
        return
    if stat.S_ISDIR(mode):
        raise Unreadable("can't be read: it is a folder")
    if stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode):
        if is_descriptor(file):
            return
        raise Unreadable(f"is a pipe, which may never end; write it to a file, or where a motion is read give it as standard input: - < {file}")
    if os.path.realpath(file) == os.path.realpath(os.devnull):
        return  # readers say that it is empty
    if is_descriptor(file) and stat.S_ISCHR(mode) and os.path.realpath(file).startswith(("/dev/pts/", "/dev/tty")):
        return  # a terminal: a person types
    raise Unreadable("is a device, not a file")


def contents(file: str, limit: int) -> bytes:
    """The bytes of a regular file, or of a pipe that the shell has opened.  Raises Unreadable."""
    with opened(file, limit) as source:
        return bounded(source, limit)


def standard_input(limit: int) -> bytes:
    """All of standard input.  Raises Unreadable."""
    if sys.stdin is None:  # the shell has closed it
        raise Unreadable("is closed")
    return bounded(sys.stdin.buffer, limit)


def bounded(source: BinaryIO, limit: int, what: str = "is") -> bytes:
    """The rest of a stream.  Raises Unreadable if that is more than the limit: files can grow, and pipes have no size.

    Python allocates all that read() is asked for before it reads, so it is asked for the size of the file, or for pieces where there is none.
    """
    pieces, left = list[bytes](), limit + 1
    try:
        while left and (piece := source.read(min(left, max(_size(source) + 1, PIECE)))):
            pieces.append(piece)
            left -= len(piece)
        data = b"".join(pieces)
    except MemoryError:
        raise Unreadable("can't be read: it is larger than the memory that is left") from None
    except (OSError, ValueError) as e:
        raise Unreadable(f"can't be read ({what_os_says(e)})") from None
    if len(data) > limit:
        raise Unreadable(f"{what} larger than {limits.megabytes(limit)}, the most that is read")
    return data


def _size(source: BinaryIO) -> int:
    """Bytes of a stream's file; 0 where it has none."""
    try:
        return os.fstat(source.fileno()).st_size
    except (AttributeError, OSError, ValueError):
        return 0


def text(data: bytes) -> str:
    """UTF-8, with or without a byte-order mark.  Raises Unreadable."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as e:
        line = data.count(b"\n", 0, e.start) + 1
        raise Unreadable(f"is not text: byte 0x{data[e.start]:02x} in line {line} is not UTF-8") from None


def failed_read(error: BaseException | None) -> OSError | None:
    """What the system said where it could not read: a disk that fails, a server that is gone.  None where the file is there, and another than it should be.

    Libraries call such a file damaged: then it is behind their error.
    """
    while error is not None:
        if isinstance(error, OSError) and error.errno not in OF_DAMAGE:
            return error
        error = error.__context__
    return None


def what_os_says(error: Exception) -> str:
    if isinstance(error, OSError) and error.errno:
        return os.strerror(error.errno)
    return "no file can have this path" if isinstance(error, ValueError) else str(error)
