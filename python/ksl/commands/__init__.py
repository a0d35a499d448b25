"""The command line.  Each command is a file, whose import adds it to `app`."""

from ksl.commands import (
    check,
    compare,
    hold,
    info,
    loads,
    motion,
    simulate,
    size,
    sweep,
    view,
)
from ksl.commands.app import app

__all__ = [
    "app",
    "check",
    "compare",
    "hold",
    "info",
    "loads",
    "motion",
    "simulate",
    "size",
    "sweep",
    "view",
]
