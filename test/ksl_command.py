"""`ksl ARGUMENTS` in a copy of this process: a tenth of a second, where a new Python takes one.

What belongs to the process itself, the console script, signals, closed streams, encodings, is tested with processes of its own."""

from __future__ import annotations

import contextlib
import functools
import importlib
import os
import signal
import subprocess
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable

from sweeps_here import sweep_here

WAITING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
IMPORTED = (
    "ksl.__main__", "ksl.commands", "ksl.checks", "ksl.commands.print_info", "ksl.report.compute_loads", "ksl.robot_files.loading", "ksl.robot_files.mesh_files", "ksl.mechanism.model_tables", "ksl.motions.generate", "ksl.report",
    "ksl.sizing", "ksl.small_motions.frequencies", "ksl.viewer", "scipy.interpolate", "scipy.signal", "scipy.optimize", "pandas", "pyarrow.compute", "pyarrow.parquet", "pyarrow.csv", "lxml.etree", "pydantic",
    "rich.padding", "rich.table", "tomllib", "typer._adapters", "viser", "xml.etree.ElementTree", "zoneinfo",
)  # fmt: skip
"""Before the first copy is made, so that copies need not do so."""
CHANGING = ("COLUMNS", "FORCE_COLOR")
"""Variables that change what is printed."""


@functools.cache
def warm() -> None:
    """What every command does first, so that copies need not: modules, and the tree of commands, which typer makes again at each call."""
    for name in IMPORTED:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    import typer.main

    import ksl.commands

    typer.main.get_command = functools.cache(typer.main.get_command)
    typer.main.get_command(ksl.commands.app)


def run_ksl(
    *arguments: object, cwd: str | os.PathLike[str] | None = None, text: bool = True, timeout: int = 60, **environment: str
) -> subprocess.CompletedProcess:
    """The command with its output, as from `subprocess.run(..., capture_output=True)`.  A sweep starts no processes.

    environment: variables that are set for it; those that Python itself reads as it starts have no effect."""
    given = [os.fsdecode(a) if isinstance(a, bytes) else str(a) for a in arguments]
    warm()
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:

        def start() -> None:
            signal.alarm(timeout)
            print_to(out.fileno(), err.fileno())
            _as_in_a_new_python()
            os.environ.update(environment)
            if given[:1] == ["sweep"]:
                sweep_here()
            os.chdir(cwd or ".")

        copy = copied(lambda: status_of(ksl_main(*given)), start)
        status = os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1])
        said = []
        for file in (out, err):
            file.seek(0)
            said.append(file.read().decode("utf-8") if text else file.read())
    return subprocess.CompletedProcess(["ksl", *given], status, *said)


def ksl_main(*arguments: object) -> Callable[[], object]:
    """`ksl ARGUMENTS`, to be run in a copy."""

    def run() -> None:
        from ksl.__main__ import main

        sys.argv = ["ksl", *map(str, arguments)]
        main()

    return run


def copied(status: Callable[[], int], start: Callable[[], object]) -> int:
    """The number of a copy of this process, which calls `start`, and ends with what `status` returns.  Signals that it is sent before are kept."""
    sys.stdout.flush()
    sys.stderr.flush()
    signal.pthread_sigmask(signal.SIG_BLOCK, WAITING)  # those that a user sends come while the action runs, and not before
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # newer Pythons warn of the threads that a copy lacks
        copy = os.fork()
    if copy == 0:
        ends = 70
        try:
            start()
            ends = status()
        except KeyboardInterrupt:  # between what is run and its end, as Python itself would end
            ends = 130
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stderr.flush()
            os._exit(ends)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, WAITING)
    return copy


def print_to(out: int, err: int) -> None:
    """Makes these files the standard output and error of this process."""
    os.dup2(out, 1)
    os.dup2(err, 2)
    sys.stdout = open(1, "w", encoding="utf-8", closefd=False)
    sys.stderr = open(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False)


def _as_in_a_new_python() -> None:
    """Without what pytest has set: it records warnings, which Python prints."""
    importlib.reload(warnings)
    for name in CHANGING:
        os.environ.pop(name, None)


def status_of(action: Callable[[], object]) -> int:
    """As the interpreter would end: with the functions that are registered for its end."""
    from ksl.output import stage

    try:
        try:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, WAITING)
            action()
        finally:
            signal.pthread_sigmask(signal.SIG_BLOCK, WAITING)
        status = 0
    except SystemExit as e:
        status = e.code if isinstance(e.code, int) else int(e.code is not None)
        if isinstance(e.code, str):
            print(e.code, file=sys.stderr)
    except KeyboardInterrupt:
        status = 130
    stage._end_open_stages()
    sys.stdout.flush()
    sys.stderr.flush()
    return status
