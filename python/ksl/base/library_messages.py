"""What other libraries say while they read a file: their warnings and lines of their logs, which would stand on standard error without a word of where they come from."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def heard(*libraries: str, harmless: tuple[str, ...] = ()) -> Iterator[list[str]]:
    """The sentences that libraries say in the block, each once, "LIBRARY says: …".  Warnings of others are passed on.

    harmless: beginnings of what says nothing of what is read.
    """
    said: list[str] = []

    def add(library: str, text: str) -> None:
        line = f"{library} says: {' '.join(text.split())}"
        if line not in said and not text.startswith(harmless):
            said.append(line)

    class Lines(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            add(record.name.partition(".")[0], record.getMessage())

    handler = Lines(logging.WARNING)
    logs = [logging.getLogger(library) for library in libraries]
    before = [log.propagate for log in logs]
    for log in logs:
        log.addHandler(handler)
        log.propagate = False
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            yield said
    finally:
        for log, propagate in zip(logs, before, strict=True):
            log.removeHandler(handler)
            log.propagate = propagate
        for each in caught:
            of = next((library for library in libraries if f"/{library}/" in each.filename.replace("\\", "/")), "")
            if of:
                add(of, str(each.message))
            else:
                warnings.warn_explicit(each.message, each.category, each.filename, each.lineno)
