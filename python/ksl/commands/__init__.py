"""The command line.  Each command is a file, whose import adds it to `app`."""

from ksl.commands import info, loads, sweep
from ksl.commands.app import app

__all__ = ["app", "info", "loads", "sweep"]
