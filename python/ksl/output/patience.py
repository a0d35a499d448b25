"""What Windows refuses for a moment: files that a virus scanner, an indexer or their last holder still has open."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")

MOMENT = 1.0
"""Seconds."""


def patiently(call: Callable[..., T], *given: Any, but: type[OSError] | tuple[type[OSError], ...] = PermissionError) -> T:
    """The result of the call.  On Windows an error of the kind `but` counts only when it is still there after a moment."""
    until = time.monotonic() + (MOMENT if os.name == "nt" else 0.0)
    while True:
        try:
            return call(*given)
        except but:
            if time.monotonic() >= until:
                raise
        time.sleep(0.002)
