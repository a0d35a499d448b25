"""Result files that are written completely or not at all."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path


class OutputError(OSError):
    """Results can't be written.  Names the folder, what is wrong and how to mend it."""


def cannot_write(error: OSError) -> str:
    """Says why results can't be written to a place, and what mends it."""
    what = os.strerror(error.errno) if error.errno else str(error)
    full = error.errno in (errno.ENOSPC, errno.EDQUOT)
    mend = "free some space, or give another folder with -o" if full else "give a folder that can be written with -o"
    return f"results can't be written there ({what}); {mend}"


@contextmanager
def staged(directory: Path, results: Collection[str] = ()) -> Iterator[Path]:
    """A hidden folder in `directory`.  If the block ends without an exception, its files are moved into `directory`.

    Files of the names `results` that the block did not write are then removed: they would be those of an earlier run.
    What fails on the way leaves `directory` as it was, absent if it was absent.  Raises OutputError: before the block
    where `directory` can't hold files, and for every OSError of the block.
    """
    absolute = directory.absolute()
    made: list[Path] = []
    try:
        stage = _stage(absolute, results, made)
        try:
            yield stage
            written = sorted(file.name for file in stage.iterdir())
            for name in written:
                os.replace(stage / name, absolute / name)
            for name in set(results).difference(written):
                (absolute / name).unlink(missing_ok=True)
        finally:
            shutil.rmtree(stage, ignore_errors=True)
        made.clear()
    except OutputError:
        raise
    except OSError as e:
        raise OutputError(f"{directory}: {cannot_write(e)}") from None
    finally:
        for folder in reversed(made):
            try:
                folder.rmdir()
            except OSError:  # somebody else has put something there
                break


def _stage(directory: Path, results: Collection[str], made: list[Path]) -> Path:
    """Creates `directory` if it is missing, adds the folders created to `made`, and returns an empty folder in it."""
    for folder in (*reversed(directory.parents), directory):
        if not os.path.lexists(folder):
            folder.mkdir()
            made.append(folder)
        elif not folder.is_dir():
            raise OutputError(f"{folder}: is no folder, so results can't be written there; move it away, or give another folder with -o")
    for name in results:
        if (directory / name).is_dir():
            raise OutputError(f"{directory / name}: a folder where a result file belongs; move it away, or give another folder with -o")
    return Path(tempfile.mkdtemp(prefix=".ksl-", dir=directory))
