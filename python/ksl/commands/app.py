"""The command line, its errors and signals."""

from __future__ import annotations

import os
import shlex
import signal
import sys
from types import FrameType
from typing import Annotated, Any, NoReturn

import typer
from rich.console import Console
from typer.core import TyperGroup


class Commands(TyperGroup):
    """The commands, whose words print on any terminal, which end on signals, and which say it where standard output can't be written."""

    def invoke(self, ctx: Any) -> Any:
        end_on_signals()
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            errors.print("ksl: interrupted")
            raise SystemExit(128 + signal.SIGINT) from None

    def main(self, *args: Any, **options: Any) -> Any:
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="replace")  # "?" for characters that the encoding lacks, rather than no output
        try:
            try:
                return super().main(*args, **options)
            finally:
                if sys.stdout is not None:  # None if the shell has closed it
                    sys.stdout.flush()  # an error at the end of the interpreter would be Python's to report
        except BrokenPipeError:  # nobody reads what is printed: as any command
            discard_output()
            sys.exit(1)
        except OSError as e:
            if e.filename is not None:  # of a file, and not of standard output
                raise
            errors.print(f"ksl: {unwritable(e)}")
            discard_output()
            sys.exit(2)


app = typer.Typer(cls=Commands, pretty_exceptions_enable=False, no_args_is_help=True, rich_markup_mode=None, help="Every wrench in a mechanism.")
errors = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)


def command_line() -> str:
    """As it was given, to be given again."""
    return shlex.join(["ksl", *sys.argv[1:]])


def console(width: int) -> Console:
    """Standard output; of that width where it is no terminal."""
    out = Console(highlight=False)
    if not out.is_terminal:
        out.width = width
    return out


def fail(sentence: object) -> NoReturn:
    """Ends the command with status 2.  By SystemExit: typer.Exit is a RuntimeError, which handlers of commands would say once more."""
    errors.print(f"ksl: {sentence}")
    raise SystemExit(2)


def unwritable(error: OSError) -> str:
    return f"standard output can't be written ({os.strerror(error.errno) if error.errno else error})"


def discard_output() -> None:
    """Discards what standard output still buffers.  Otherwise Python would try to write it again at exit, and end with status 120."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def end_on_signals() -> None:
    """Makes SIGTERM and SIGHUP leave by SystemExit, so that temporary files are removed."""

    def leave(number: int, _: FrameType | None) -> None:
        signal.signal(number, signal.SIG_IGN)  # once is enough
        sys.exit(128 + number)

    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)  # no SIGHUP on Windows
        if number is not None and signal.getsignal(number) == signal.SIG_DFL:  # nohup ignores SIGHUP
            signal.signal(number, leave)


@app.callback(invoke_without_command=True)
def root(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        from ksl._core import __version__

        print(f"ksl {__version__}")
        raise typer.Exit()
