"""The command line.  Each command is a file, whose import adds it to `app`.

Files: the command: a file for each command, which calls a public function, and `print_…` for what it prints; `app.py` and `options.py` are what they share.
"""

from ksl.commands import actuation, check, compare, free_bodies, generate, hold, info, loads, modes, motion, simulate, size, sweep, view
from ksl.commands.app import app

__all__ = ["actuation", "app", "check", "compare", "free_bodies", "generate", "hold", "info", "loads", "modes", "motion", "simulate", "size", "sweep", "view"]
