"""What targets that read whole motions share: a robot, limits that small files reach, and what a motion is that was taken.

Import it behind `guide`: it imports what is to be counted.
"""

from __future__ import annotations

import atexit
import io
import os
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path

import ksl
import numpy as np
from ksl.base import limits
from target import BrokenPromise, finite

sys.path.append(str(Path(__file__).parents[1]))
import packed_seeds

warnings.simplefilter("ignore")
ROBOT = ksl.load_string(
    '<robot name="leg"><link name="a"/><link name="b"/><link name="c"/>'
    '<joint name="hip" type="revolute"><parent link="a"/><child link="b"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint>'
    '<joint name="slide" type="prismatic"><parent link="b"/><child link="c"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint></robot>',
    masses="optional",
)
limits.MOTION_BYTES, limits.MOTION_NUMBERS, limits.COLUMNS = 4 << 20, 1 << 16, 1 << 10
"""So that a bomb of a kilobyte passes a limit, and is seen where nothing holds it."""
MEMORY = 128 << 20
"""Bytes that one file may take beyond what files before it took: the limits, for what is unpacked, decoded and copied."""
FILE = Path(tempfile.gettempdir()) / f"ksl_fuzz_{os.getpid()}"
atexit.register(lambda: FILE.unlink(missing_ok=True))


def read_content(data: bytes, map: dict[str, object] | None = None) -> None:
    """Reads a motion from standard input or from a file, and checks it: Python reads these in different ways."""
    if len(data) % 2:
        sys.stdin = io.TextIOWrapper(io.BytesIO(data))
        read_path("-", map)
    else:
        FILE.write_bytes(data)
        read_path(str(FILE), map)


def read_path(path: str, map: dict[str, object] | None = None) -> None:
    motion = ksl.read_motion(ROBOT, path, map=map, ignore_extra=True)
    n = len(motion.time)
    if n < 2 or not (motion.q.shape == (n, 2) and motion.v.shape == motion.a.shape == (n, 2)):
        raise BrokenPromise(f"broken promise: {n} times, q {motion.q.shape}, v {motion.v.shape}, a {motion.a.shape}")
    for what in ("time", "q", "v", "a"):
        finite(getattr(motion, what), what)
    if not (np.diff(motion.time) > 0).all():
        raise BrokenPromise("broken promise: times of a motion that was taken do not increase")


def taken(format: str, read: Callable[[bytes], None]) -> Callable[[bytes], None]:
    """The reader, which has read all seeds of the format: what is imported late is there then, and is counted, and costs no text its time."""
    for _, data in packed_seeds.FORMATS[format]():
        read(data)
    return read
