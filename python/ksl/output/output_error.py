"""Errors about results that can't be written, and their words."""

from __future__ import annotations

import errno
import os

FULL = (errno.ENOSPC, errno.EDQUOT)
OPEN_ELSEWHERE = (32, 33)
"""Windows' numbers of the errors that a file, or a part of it, is in use by another program."""


class OutputError(OSError):
    """Results can't be written.  Names the folder or file, what is wrong and how to mend it."""


def cannot_write(error: OSError) -> str:
    """Says why results can't be written to a folder, and what mends it."""
    return f"results can't be written there ({what(error)}); {mend(error, 'folder that can be written with -o', 'folder with -o')}"


def what(error: OSError) -> str:
    """The system's words for an error."""
    return os.strerror(error.errno) if error.errno else str(error)


def mend(error: OSError, writable: str, other: str) -> str:
    """What the user can do about an error.

    writable: what to give instead where there are no rights to write.  other: what to give instead where there is no space.
    """
    if getattr(error, "winerror", None) in OPEN_ELSEWHERE and error.filename:
        return f"close {os.path.basename(error.filename)} in the program that has it open, and run it again"
    if error.errno in FULL:
        return f"free some space, or give another {other}"
    if error.errno == errno.EFBIG:
        return f"raise the limit of the size of files (ulimit -f), or give another {other}"
    if error.errno == errno.ENAMETOOLONG:
        return "give a shorter name"
    return f"give a {writable}"
