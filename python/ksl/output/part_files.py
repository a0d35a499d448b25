"""Single files in a folder whose lock the process already holds, so that no other process writes there."""

from __future__ import annotations

import os
from pathlib import Path

from ksl.output.output_error import OutputError, cannot_write
from ksl.output.signals import uninterrupted
from ksl.output.swap import flush, flush_folder

ENDING = ".part"


def write_part(path: Path, contents: bytes) -> None:
    """Writes a file that is there completely or not at all.  Raises OutputError.

    `whole_file` would also do.  But it takes a lock and lists the folder each time, and a sweep has thousands of files there.
    """
    part = path.with_name(f".{path.name}{ENDING}")
    try:
        with uninterrupted():
            try:
                part.unlink(missing_ok=True)  # what a killed process has left, or a link, which is not followed
                with part.open("xb") as file:
                    file.write(contents)
                flush(part)
                os.replace(part, path)
            finally:
                part.unlink(missing_ok=True)
        flush_folder(path.parent)
    except OSError as error:
        raise OutputError(f"{path}: {cannot_write(error)}") from None


def remove_parts(folder: Path) -> None:
    """Removes unfinished files that a killed process has left."""
    for part in folder.glob(f".*{ENDING}"):
        part.unlink(missing_ok=True)
