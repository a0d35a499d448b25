"""The command line, its errors and signals."""

from __future__ import annotations

import _thread
import os
import shlex
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterable
from types import FrameType
from typing import IO, Annotated, Any, NoReturn

import typer
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text
from typer.core import TyperCommand, TyperGroup

from ksl.base import own_process
from ksl.base.printable import PrintableStream, printable, sentence

TRACEBACK = "KSL_TRACEBACK"
"""Variable of the environment with which faults of KSL print where they happened."""


HANGING = "  "
"""Before all lines of a paragraph but the first."""
GROUPS = {
    "Load cases": {"--cases", "--case", "--payload", "--on-link", "--external", "--gravity", "--pose", "--time", "--worst", "--of", "--seed"},
    "Simulation": {
        "--until",
        "--from-time",
        "--velocity",
        "--controller",
        "--gains",
        "--brake-at",
        "--brake",
        "--dry-friction",
        "--bounce",
        "--rate",
        "--method",
        "--step",
    },
    "Wrenches": {"--on", "--at", "--axes", "--order", "--joints"},
    "Results": {
        "--output",
        "--deflection",
        "--csv",
        "--xlsx",
        "--mcap",
        "--mat",
        "--rrd",
        "--json",
        "--pdf",
        "--paper",
        "--components",
        "--fail-on",
        "--force",
        "--drives-only",
    },
    "Bodies": {"--links", "--apart", "--frame", "--robot"},
    "Instants": {"--times", "--peaks", "--section", "--stress", "--hull", "--most"},
    "Decks": {"--deck", "--mesh", "--set", "--radius", "--units", "--young", "--poisson", "--density", "--coupling", "--relief"},
    "Comparison": {"--with", "--states"},
    "Page": {"--export", "--mode", "--joint", "--case", "--port", "--browser"},
    "Robot": {
        "--floating-base",
        "--mimic",
        "--strict",
        "--model",
        "--physics",
        "--friction-width",
        "--package-path",
        "--loops",
        "--drives",
        "--stiffness",
        "--xacro",
        "--package",
    },
    "Motion": {"--map", "--degrees", "--time-unit", "--smooth", "--resample", "--from", "--to", "--ignore-extra", "--topic", "--positions-only"},
}
"""Options of commands that have many, by what they are about."""


class SafeConsole(Console):
    """Prints text as it is: it is no markup of rich, and control characters in it are made visible."""

    def __init__(self, **options: Any) -> None:
        super().__init__(highlight=False, markup=False, emoji=False, **options)

    @property
    def file(self) -> IO[str]:
        """The stream behind all that stand for it: `PrintableStream`, and that of rich while it shows a bar, would make colours visible, too."""
        found = super().file
        while hasattr(found, "rich_proxied_file"):
            found = found.rich_proxied_file
        return found

    @file.setter
    def file(self, stream: IO[str]) -> None:
        self._file = stream

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        for segment in super().render(renderable, options):  # here text has no colours yet, which are control characters too
            yield segment if segment.control else Segment(printable(segment.text), segment.style)


class Watched:
    """Standard output.  It notes what could not be written: the system names no file then, nor where a file that is open can't be read."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self.failure: OSError | None = None

    def write(self, text: str) -> int:
        return self._noted(self._stream.write, text)  # type: ignore[no-any-return]

    def writelines(self, lines: Iterable[str]) -> None:
        self._noted(self._stream.writelines, lines)

    def flush(self) -> None:
        self._noted(self._stream.flush)

    def _noted(self, call: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return call(*arguments)
        except OSError as e:
            self.failure = e
            raise

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def is_of_printing(e: Exception) -> bool:
    """Whether an error is that of standard output, and not of a file."""
    return getattr(sys.stdout, "failure", None) is e


class Sentences(SafeConsole):
    """For lines of text, which break between words where a terminal is narrow; what reads a pipe or a file gets each in one line."""

    def print(self, *objects: Any, **options: Any) -> None:
        if len(objects) == 1 and isinstance(objects[0], (str, Text)) and not options:
            paragraph(super().print, self, objects[0])
        else:
            super().print(*objects, **options)


def say(out: Console, text: str | Text) -> None:
    """Prints a line of text, which breaks between words where a terminal is narrow."""
    paragraph(out.print, out, text)


def paragraph(write: Callable[..., None], out: Console, text: str | Text) -> None:
    whole = Text(text) if isinstance(text, str) else text
    lines = whole.wrap(out, max(out.width - len(HANGING), 20)) if out.is_terminal else [whole]
    for i, line in enumerate(lines):
        line.rstrip()
        write(Text.assemble(HANGING, line) if i else line, soft_wrap=True)


class GroupedOptions(TyperCommand):
    """A command with many options: its help has them in groups."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        groups: dict[str, list[Any]] = {"Arguments": []} | {group: [] for group in GROUPS} | {"Other options": []}
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if record is not None:
                own = (group for group, names in GROUPS.items() if not names.isdisjoint(param.opts))
                groups["Arguments" if param.param_type_name == "argument" else next(own, "Other options")].append(record)
        for group, records in groups.items():
            if records:
                with formatter.section(group):
                    formatter.write_dl(records)


class Commands(TyperGroup):
    """The commands.  They print no control characters, end on signals, and end with a sentence whatever happens."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Each command with the whole first sentence of its help."""
        commands = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl([(name, command.get_short_help_str(limit=1000)) for name, command in commands if command is not None and not command.hidden])

    def invoke(self, ctx: Any) -> Any:
        end_on_signals()
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            errors.print("ksl: interrupted")
            raise SystemExit(128 + signal.SIGINT) from None

    def main(self, *args: Any, **options: Any) -> Any:
        streams = sys.stdout, sys.stderr
        for stream in streams:
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="replace")  # "?" for characters that the encoding lacks, rather than no output
        sys.stdout, sys.stderr = (
            stream and PrintableStream(stream) for stream in (streams[0] and Watched(streams[0]), streams[1])
        )  # None if the shell has closed it
        try:
            return self._main(args, options)
        finally:
            if isinstance(getattr(sys.stdout, "failure", None), BrokenPipeError):  # typer ends by itself where nobody reads its help
                discard_output()
            sys.stdout, sys.stderr = streams

    def _main(self, args: tuple[Any, ...], options: dict[str, Any]) -> Any:
        try:
            try:
                return super().main(*args, **options)
            finally:
                if sys.stdout is not None:
                    sys.stdout.flush()  # an error at the end of the interpreter would be Python's to report
        except BrokenPipeError:  # nobody reads what is printed: as any command
            discard_output()
            sys.exit(1)
        except Exception as e:
            if _interrupts:  # while a module was imported, its author made another exception of it
                errors.print("ksl: interrupted")
                sys.exit(128 + signal.SIGINT)
            if os.environ.get(TRACEBACK):
                raise
            errors.print(f"ksl: {sentence(_last_resort(e))}")
            if is_of_printing(e):
                discard_output()
            sys.exit(2)


def _last_resort(e: Exception) -> str:
    """A sentence for errors that no command expects."""
    if isinstance(e, MemoryError):
        return "there is not enough memory for this; give smaller files, or a part of the motion"
    if isinstance(e, OSError):
        if is_of_printing(e):
            return unwritable(e)
        if e.errno is None and e.filename is None:  # a sentence already
            return str(e)
        why = os.strerror(e.errno) if e.errno else str(e)
        if e.filename is not None:
            return f"{e.filename}: can't be read or written ({why}); check the path and its rights"
        return f"one of the files can't be read or written ({why}); check the disk that they are on, or copy them to another"
    where = traceback.extract_tb(e.__traceback__)[-1]
    what = f"{type(e).__name__} in {os.path.basename(where.filename)}:{where.lineno}"
    return f"a fault in KSL: {what}: {sentence(str(e))[:300]}; please report it with its files; {TRACEBACK}=1 in the environment prints where it happened"


_interrupts: list[int] = []
"""The SIGINTs that the process has received since the command began."""


def _interrupt_again(lost: Any) -> None:
    """Python drops an exception that is raised in a finaliser or a callback.  An interrupt that comes just there comes once more."""
    if isinstance(lost.exc_value, KeyboardInterrupt):
        threading.Timer(0.02, _interrupt_main_thread).start()
    else:
        sys.__unraisablehook__(lost)


def _interrupt_main_thread() -> None:
    main = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main is not None:
        signal.pthread_kill(main, signal.SIGINT)  # it ends a wait, too
    else:
        _thread.interrupt_main()


app = typer.Typer(cls=Commands, pretty_exceptions_enable=False, no_args_is_help=True, rich_markup_mode=None, help="Every wrench in a mechanism.")
errors = Sentences(stderr=True, soft_wrap=True)


def command_line() -> str:
    """As it was given, to be given again."""
    words = ["ksl", *sys.argv[1:]]
    if os.name == "nt":  # where ' quotes nothing
        from subprocess import list2cmdline

        return list2cmdline(words)
    return shlex.join(words)


def console(width: int) -> Console:
    """Standard output; of that width where it is no terminal."""
    out = SafeConsole()
    if not out.is_terminal:
        out.width = width
    return out


def print_for_programs(text: str) -> None:
    """Prints JSON or TOML, which are UTF-8 wherever they are read; pipes and files on Windows have another encoding."""
    if sys.stdout is not None and not sys.stdout.isatty() and hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(encoding="utf-8", errors="replace")
    print(text, end="" if text.endswith("\n") else "\n")


def print_json(value: Any, indent: int = 2) -> None:
    import json

    print_for_programs(json.dumps(value, ensure_ascii=False, indent=indent))


def fail(said: object) -> NoReturn:
    """Ends the command with status 2.  By SystemExit: typer.Exit is a RuntimeError, which handlers of commands would say once more."""
    errors.print(f"ksl: {sentence(str(said))}")
    raise SystemExit(2)


def unwritable(error: OSError) -> str:
    return f"standard output can't be written ({os.strerror(error.errno) if error.errno else error})"


def discard_output() -> None:
    """Discards what standard output still buffers.  Otherwise Python would try to write it again at exit, and end with status 120."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def end_on_signals() -> None:
    """Makes SIGTERM and SIGHUP leave by SystemExit, so that temporary files are removed.  Notes SIGINT, which is a KeyboardInterrupt already."""

    own_process.want()
    _interrupts.clear()  # of a command before, where a program runs several

    def interrupt(number: int, _: FrameType | None) -> None:
        _interrupts.append(number)
        raise KeyboardInterrupt

    def leave(number: int, _: FrameType | None) -> None:
        signal.signal(number, signal.SIG_IGN)  # once is enough
        sys.exit(128 + number)

    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)  # no SIGHUP on Windows
        if number is not None and signal.getsignal(number) == signal.SIG_DFL:  # nohup ignores SIGHUP
            signal.signal(number, leave)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, interrupt)
        sys.unraisablehook = _interrupt_again


@app.callback(invoke_without_command=True)
def root(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        from ksl._core import __version__

        print(f"ksl {__version__}")
        raise typer.Exit()
