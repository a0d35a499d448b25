"""Signals that wait until files are in place."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

NAMES = ("SIGINT", "SIGTERM", "SIGHUP")
"""Signals whose handlers end a command by an exception.  It may be raised at any line."""


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Delays the handlers of SIGINT, SIGTERM and SIGHUP to the end of the block.

    For work of some milliseconds that must not be left half done.  Signals without a handler in Python still end the process at once.
    Blocking them with pthread_sigmask would not help: another thread may receive the signal, and Python calls the handler in the main
    thread all the same.
    """
    if threading.current_thread() is not threading.main_thread():  # handlers run in the main thread only
        yield
        return
    received: list[int] = []
    inside = True
    handlers: dict[int, Callable[[int, FrameType | None], Any]] = {}

    def note(number: int, frame: FrameType | None) -> None:
        if inside:
            received.append(number)
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
        if received:
            signal.raise_signal(received[0])
