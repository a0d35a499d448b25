"""Folders that are made for results, and removed again if no results come."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from ksl.output.output_error import OutputError


class MadeFolders:
    """The folders that one run has made."""

    def __init__(self) -> None:
        self._made: list[Path] = []

    def make(self, directory: Path) -> None:
        """Makes a folder, and what is missing above it.  Raises OSError, and OutputError where something else has a name on the way."""
        for folder in (*reversed(directory.parents), directory):
            if not os.path.lexists(folder):
                folder.mkdir()
                self._made.append(folder)
            elif not folder.is_dir():
                raise OutputError(f"{folder}: is no folder, so results can't be written there; move it away, or give another folder with -o")

    def keep(self) -> None:
        """The folders that were made hold results now, and stay."""
        self._made.clear()

    def remove_empty(self) -> None:
        """Removes those that are still empty."""
        for folder in reversed(self._made):
            with contextlib.suppress(OSError):  # it holds something, perhaps of another program
                folder.rmdir()
        self._made.clear()
