"""What all targets in Python share: the promise that a reader keeps for any text, and how a target is run.

A reader either takes a text, and its numbers are finite, or refuses it by one of KSL's errors: one line without control
characters, of bounded length, in time that is linear in the text.  Where the text is a file that may be packed, its memory is bounded, too.
Everything else ends the target with a report.
"""

from __future__ import annotations

import gc
import os
import resource
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable

import atheris
import guided
import numpy as np
from mutate import Mutator

from ksl.base.limits import MESSAGE_LENGTH

SLOWEST = 2e-6
"""Seconds for each byte.  Twice the promised 1 s/MB, since counting coverage takes time as well."""
LEAST = 0.5
"""Seconds that any text may take besides: other programs run on the same machine."""
FAULT = "KSL_FUZZ_FAULT"
"""Names a fault that is planted into the readers: a run that does not find it shows nothing."""
TAKEN = "text that is taken"
"""The fault that shows itself only for texts that the reader takes: the mutations must not break them all."""
MUCH = "much memory"
"""The fault of readers whose memory is bounded."""
FAULTS = ("raw error", "control character", "slow", "not finite", TAKEN, MUCH)


class BrokenPromise(BaseException):
    """Not an Exception, so that no reader catches it."""


def kept(read: Callable[[bytes], object], errors: tuple[type[Exception], ...], memory: int | None = None) -> Callable[[bytes], None]:
    """The test of one text.  memory: bytes that one text may take beyond what texts before it took."""
    planted = os.environ.get(FAULT, "")
    if planted and planted not in FAULTS:
        sys.exit(f"{FAULT}={planted}: expected one of {', '.join(FAULTS)}")

    def test(data: bytes) -> None:
        start, before = time.process_time(), most_memory()
        try:
            if planted:
                plant(planted, data)
            read(data)
            if planted == TAKEN and b"(" in data:
                raise KeyError("planted behind the reader")
        except errors as e:
            check_message(str(e))
        except Exception as e:  # whatever it is, it is a broken promise
            traceback.print_exception(e)
            raise BrokenPromise(f"broken promise: {type(e).__name__} is no error of KSL: {e}") from e
        took = time.process_time() - start
        if took > LEAST + SLOWEST * len(data):
            raise BrokenPromise(f"broken promise: {took:.2f} s for {len(data)} bytes")
        if memory is not None and most_memory() - before > memory:
            raise BrokenPromise(f"broken promise: {(most_memory() - before) / 2**20:.0f} MB for {len(data)} bytes")

    return test


def most_memory() -> int:
    """Bytes that the process has held at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def check_message(text: str) -> None:
    if not text or len(text) > MESSAGE_LENGTH:
        raise BrokenPromise(f"broken promise: a message of {len(text)} characters: {text[:400]!r}")
    check_characters(text)


def check_characters(text: str) -> None:
    if not (text.isprintable() or all(map(_may_be_printed, text))):
        raise BrokenPromise(f"broken promise: text that can't be printed: {text[:400]!r}")


def _may_be_printed(c: str) -> bool:
    """Blanks of other scripts, joiners of emoji, and characters that Python's Unicode tables lack are no danger."""
    code = ord(c)
    turns = 0x2028 <= code <= 0x202E or 0x2060 <= code <= 0x206F or code in (0x61C, 0x200B, 0x200E, 0x200F, 0xFEFF)
    return c.isprintable() or (code >= 0xA0 and not turns and not 0xD800 <= code <= 0xDFFF)


def finite(numbers: object, what: str) -> None:
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
    if fault == MUCH:
        b"(" * (1 << 28)  # written, so that the system gives it


def run(read: Callable[[bytes], object], mutator: Mutator, *errors: type[Exception], memory: int | None = None) -> None:
    """Runs a target with the arguments of libFuzzer.  errors: those that the reader may raise; memory: as `kept` takes it."""
    warnings.simplefilter("ignore")
    guided.register()
    gc.freeze()  # what was imported is no garbage, and need not be looked at again and again
    with tempfile.NamedTemporaryFile(suffix=".dict") as words:
        words.write(guided.dictionary())
        words.flush()
        atheris.Setup([*sys.argv, f"-dict={words.name}"], kept(read, errors, memory), custom_mutator=mutator)
        atheris.Fuzz()
