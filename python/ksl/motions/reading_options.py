"""What reading a motion can be told besides its file, and what each of these must be."""

from __future__ import annotations

import os
from collections.abc import Mapping

from ksl.base.errors import MotionError, near_names

WORDS, FLAGS, NUMBERS = ("time_unit", "topic"), ("degrees", "ignore_extra", "positions_only"), ("resample", "start", "stop", "smooth")
OPTIONS = ("map", *WORDS, *FLAGS, *NUMBERS)
"""Arguments of `ksl.read_motion`; also keys in files of load cases and sweeps."""


def check_options(where: str, options: Mapping[str, object]) -> None:
    """Raises MotionError for options that there aren't, and for values that can't be: TOML files and programs hold anything."""
    for name, x in options.items():
        if name not in OPTIONS:
            raise MotionError(f"{where}: unknown key {name!r}; {near_names(name, OPTIONS)}expected {', '.join(OPTIONS)}")
        if name in FLAGS:
            if type(x).__name__ not in ("bool", "bool_"):  # that of Python or of NumPy
                raise MotionError(f"{where}: {name} is {x!r}; expected true or false")
        elif x is None:
            continue
        elif name in NUMBERS:
            if isinstance(x, (bool, str)) or not hasattr(x, "__float__"):
                raise MotionError(f"{where}: {name} is {x!r}; expected a number")
        elif name in WORDS and not isinstance(x, str):
            raise MotionError(f"{where}: {name} is {x!r}; expected a word in quotes")
        elif name == "map" and not isinstance(x, (str, os.PathLike, Mapping)):
            raise MotionError(f"{where}: map is {x!r}; expected a file, or joints by the names of columns")
