"""What all targets in Python share: the promise that a reader keeps for any text, and how a target is run.

A reader either takes a text, and its numbers are finite, or refuses it by one of KSL's errors: one line without control
characters, of bounded length, in time that is linear in the text.  Everything else ends the target with a report.
"""

from __future__ import annotations

import os
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path

import atheris

from ksl.limits import MESSAGE_LENGTH

ROOT = Path(__file__).resolve().parents[2]
SLOWEST = 2e-6
"""Seconds for each byte.  Twice the promised 1 s/MB, since counting coverage takes time as well."""
LEAST = 0.5
"""Seconds that any text may take besides: other programs run on the same machine."""
FAULT = "KSL_FUZZ_FAULT"
"""Names a fault that is planted into the readers: a run that does not find it shows nothing."""
FAULTS = ("raw error", "control character", "slow", "not finite")


class BrokenPromise(BaseException):
    """Not an Exception, so that no reader catches it."""


def kept(read: Callable[[bytes], object], errors: tuple[type[Exception], ...]) -> Callable[[bytes], None]:
    """The test of one text."""
    planted = os.environ.get(FAULT, "")
    if planted and planted not in FAULTS:
        sys.exit(f"{FAULT}={planted}: expected one of {', '.join(FAULTS)}")

    def test(data: bytes) -> None:
        start = time.process_time()
        try:
            if planted:
                plant(planted, data)
            read(data)
        except errors as e:
            check_message(str(e))
        except Exception as e:  # whatever it is, it is a broken promise
            traceback.print_exception(e)
            raise BrokenPromise(f"broken promise: {type(e).__name__} is no error of KSL: {e}") from e
        took = time.process_time() - start
        if took > LEAST + SLOWEST * len(data):
            raise BrokenPromise(f"broken promise: {took:.2f} s for {len(data)} bytes")

    return test


def check_message(text: str) -> None:
    if not text or len(text) > MESSAGE_LENGTH or any(not c.isprintable() for c in text if c not in ALLOWED):
        raise BrokenPromise(f"broken promise: a message of {len(text)} characters that can't be printed: {text[:400]!r}")


REPLACED = frozenset((0x61C, 0x200B, 0x200E, 0x200F, 0xFEFF, *range(0x2028, 0x202F), *range(0x2060, 0x2070), *range(0xD800, 0xE000)))
"""Marks of direction, invisible characters and surrogates, which no message may hold."""
ALLOWED = frozenset(chr(c) for c in range(0xA0, 0x110000) if not chr(c).isprintable() and c not in REPLACED)
"""Characters that Python does not call printable, but that are: blanks of other scripts, joiners of emoji, and what its Unicode tables lack."""


def finite(numbers: object, what: str) -> None:
    import numpy as np

    if not np.isfinite(np.asarray(numbers, dtype=float)).all():
        raise BrokenPromise(f"broken promise: {what} of a text that was taken are not finite")


def plant(fault: str, data: bytes) -> None:
    """Plants a fault.  It shows only for texts that hold a certain character, as faults of readers do."""
    if b"(" not in data:
        return
    if fault == "raw error":
        raise KeyError("planted")
    if fault == "control character":
        check_message("name '\x1b[31m'")
    if fault == "slow":
        time.sleep(0)
        end = time.process_time() + LEAST + 0.3
        while time.process_time() < end:
            pass
    if fault == "not finite":
        finite([float("nan")], "planted numbers")


def run(read: Callable[[bytes], object], *errors: type[Exception]) -> None:
    """Runs a target with the arguments of libFuzzer."""
    warnings.simplefilter("ignore")
    atheris.Setup(sys.argv, kept(read, errors))
    atheris.Fuzz()
