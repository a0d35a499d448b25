"""Files of a folder that one process at a time writes into, since it holds a lock."""

from __future__ import annotations

import os
from pathlib import Path

from ksl.output.errors import OutputError, cannot_write
from ksl.output.signals import uninterrupted
from ksl.output.swap import flush, flush_folder

ENDING = ".part"


def write_part(path: Path, contents: bytes) -> None:
    """Writes a file that is there completely or not at all.  Raises OutputError.

    Without the locks and the stage of `whole_file`: those list the folder, which may hold thousands of files by then.
    """
    part = path.with_name(f".{path.name}{ENDING}")
    try:
        with uninterrupted():
            try:
                part.write_bytes(contents)
                flush(part)
                os.replace(part, path)
            finally:
                part.unlink(missing_ok=True)
        flush_folder(path.parent)
    except OSError as error:
        raise OutputError(f"{path}: {cannot_write(error)}") from None


def remove_parts(folder: Path) -> None:
    """Removes what a process that was killed has left of such files."""
    for part in folder.glob(f".*{ENDING}"):
        part.unlink(missing_ok=True)
