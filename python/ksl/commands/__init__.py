"""The command line.  Each command is a file, whose import adds it to `app`."""

from ksl.commands import check, info, loads, sweep
from ksl.commands.app import app

__all__ = ["app", "check", "info", "loads", "sweep"]
from ksl.commands import info, loads, size, sweep
from ksl.commands.app import app

__all__ = ["app", "info", "loads", "size", "sweep"]
from ksl.commands import info, loads, view
from ksl.commands.app import app

__all__ = ["app", "info", "loads", "view"]
