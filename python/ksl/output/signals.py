"""Signals that wait until files are in place."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

NAMES = ("SIGINT", "SIGTERM", "SIGHUP")
"""What ends a command by an exception, which could be raised at any line."""


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Handlers of SIGINT, SIGTERM and SIGHUP are called at the end of the block, and not within it.

    For some milliseconds of work that must not be left half done.  Signals that end the process without a handler still do.
    Masks of the system would not help: a signal that another thread receives is handled by the main thread, too.
    """
    if threading.current_thread() is not threading.main_thread():  # handlers run in the main thread only
        yield
        return
    came: list[int] = []
    inside = True
    handlers: dict[int, Callable[[int, FrameType | None], Any]] = {}

    def note(number: int, frame: FrameType | None) -> None:
        if inside:
            came.append(number)
        else:  # while the handlers are put back
            handlers[number](number, frame)

    try:
        for number in [getattr(signal, name) for name in NAMES if hasattr(signal, name)]:
            handler = signal.getsignal(number)
            if callable(handler):
                handlers[number] = handler
                signal.signal(number, note)
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        inside = False
        if came:
            signal.raise_signal(came[0])
