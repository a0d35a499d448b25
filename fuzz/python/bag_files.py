"""Bags as files, since the library that reads them opens them by name.  Import it behind `guide`."""

from __future__ import annotations

import io
import os
import shutil
import tempfile
import zipfile
from functools import cache
from pathlib import Path

import rosbags.typesys
from motion_files import read_path

rosbags.typesys.get_typestore = cache(rosbags.typesys.get_typestore)  # a hundredth of a second each time
FOLDER = Path(tempfile.gettempdir()) / f"ksl_fuzz_bag_{os.getpid()}"


def read_bag(data: bytes) -> None:
    """Reads a bag of one file, or the folder that a zip archive holds."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir()
    try:
        if not data.startswith(b"PK"):
            (FOLDER / "bag").write_bytes(data)
            read_path(str(FOLDER / "bag"))
            return
        for name, inside in files_of(data).items():
            (FOLDER / name).write_bytes(inside)
        read_path(str(FOLDER))
    finally:
        shutil.rmtree(FOLDER, ignore_errors=True)


def files_of(data: bytes) -> dict[str, bytes]:
    """What an archive holds, by names that lead to nowhere else; nothing if it is damaged."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            inside = {Path(each.filename).name: each for each in archive.infolist() if each.compress_type == zipfile.ZIP_STORED}
            return {name.replace("\0", "")[:80]: archive.read(each) for name, each in inside.items() if name.strip(".\0")}
    except (zipfile.BadZipFile, ValueError, EOFError, OSError, NotImplementedError, RuntimeError):
        return {}
