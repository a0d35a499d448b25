"""What results may replace: earlier results, and never a file that the same run reads."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path

from ksl.output.output_error import OutputError, cannot_write

LISTED = 3
"""How many files a message names."""


def refuse_inputs(places: Collection[Path], inputs: Collection[str | os.PathLike[str]]) -> None:
    """Raises OutputError if one of the places is a file that the run reads: it would be lost, and the results could not be made again.

    places: of all files that are written, and of those that are removed since they are from an earlier run.
    """
    found = [(place, given) for place in places for given in inputs if _is_same(place, Path(given))]
    if found:
        place, given = found[0]
        raise OutputError(f"{given}: this run reads it, and would replace or remove it as {place}; give another place for the results")


def refuse_folders(folder: Path, results: Collection[str]) -> None:
    """Raises OutputError if the folder holds a folder with the name of a result file: none is replaced."""
    for name in results:
        if (folder / name).is_dir():
            raise OutputError(f"{folder / name}: a folder where a result file belongs; move it away, or give another folder with -o")


def refuse_unknown(folder: Path, results: Collection[str], mark: str) -> None:
    """Raises OutputError if the folder holds files with names of results: they are somebody else's, since nothing marks them as results.

    For the argument `check` of :func:`staged`, after the caller has looked for its mark, and not found it.  mark: its words, as in "wrenches.parquet of KSL".
    """
    refuse_folders(folder, results)
    try:
        held = sorted(name for name in results if os.path.lexists(folder / name))
    except OSError as e:
        raise OutputError(f"{folder}: {cannot_write(e)}") from None
    if held:
        names = ", ".join(held[:LISTED]) + (f" and {len(held) - LISTED} more" if len(held) > LISTED else "")
        raise OutputError(f"{folder}: holds {names}, and no {mark}, which earlier results have; give another folder with -o, or replace them with --force")


def _is_same(place: Path, given: Path) -> bool:
    try:
        return os.path.samefile(place, given)
    except (OSError, ValueError):  # one of them is not there
        return False
