"""A single output file that is written completely or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ksl.output.output_error import OutputError, mend, what
from ksl.output.stage import stage_in


def place_of(path: Path) -> Path:
    """Where a file is written: at `path`, or at the end of a symbolic link.  Raises OutputError where that is a folder, or where its folder is missing."""
    try:
        place = Path(os.path.realpath(path)) if path.is_symlink() else path
        if not place.absolute().parent.is_dir():
            raise OutputError(f"{path}: there is no folder {path.parent}; make it, or give a file in a folder that exists")
        if place.is_dir():
            raise OutputError(f"{path}: can't be written, since it is a folder; give the name of a file")
    except OutputError:
        raise
    except OSError as e:  # a name that is too long, or a folder that may not be searched
        raise _cannot_write(path, e) from None
    return place


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A path for the block to write to.  If the block ends without an exception, its file becomes `path`; otherwise nothing changes.

    The folder must exist: only folders of results are made where they are missing.  Where `path` is a symbolic link, the file to which it
    leads is replaced.  Devices and pipes are written to directly.  Raises OutputError, also for every OSError of the block.
    """
    place = place_of(path)
    try:
        if place.exists() and not place.is_file():
            yield place
        else:
            with stage_in(place.parent) as stage:
                yield stage / place.name
    except OutputError:
        raise
    except OSError as e:
        raise _cannot_write(path, e) from None


def _cannot_write(path: Path, e: OSError) -> OutputError:
    return OutputError(f"{path}: can't be written ({what(e)}); {mend(e, 'file in a folder that can be written', 'file')}")
