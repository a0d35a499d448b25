"""Programs of other libraries in a process of their own: it can be ended at any moment, and takes nothing with it when it runs out of memory or crashes.

What such a library computes in this process holds back signals until it returns.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from typing import IO, Any

_ENDS_WITH_PARENT = """
import json, os, signal, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the one who waits, and ends this process
given = json.loads(sys.stdin.readline())
sys.path[:] = given.pop("sys.path")
if sys.platform == "linux":
    import ctypes
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # where its parent is killed
seconds = given.pop("processor seconds")
if seconds is not None and sys.platform != "win32":
    import resource
    hardest = resource.getrlimit(resource.RLIMIT_CPU)[1]
    if hardest == resource.RLIM_INFINITY or seconds < hardest:
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, hardest))
answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
def say(**message):
    answers.write(json.dumps(message) + chr(10))
    answers.flush()
"""
"""Before each program: `given` is what it was given, `say` answers."""


class Ended(Exception):
    """A process that ended without an answer; why, as the end of a sentence."""


MOST_PRINTED = 1 << 16
"""Bytes of what a library prints that are kept."""
_is_wanted = False


def want() -> None:
    """From now on libraries whose work may take long compute in processes of their own.  Commands do so, which end on signals at any moment."""
    global _is_wanted
    _is_wanted = is_possible()


def is_wanted() -> bool:
    return _is_wanted


def is_possible() -> bool:
    """Whether this Python knows how to start another one; one inside of another program doesn't."""
    return bool(sys.executable)


def run(
    program: str,
    given: dict[str, Any],
    answer: Callable[[dict[str, Any]], object] | None = None,
    meanwhile: Callable[[], object] | None = None,
    seconds: int | None = None,
) -> dict[str, Any]:
    """What a Python program says last.  Raises :class:`Ended` where it says nothing; what interrupts the wait ends the process.

    answer: of questions that it asks by `say(ask=…)`, which it reads from standard input as a line of JSON.  meanwhile: called while it runs.
    seconds: of processor time, after which the system ends it, where it can.
    What the library prints on standard error, past Python, is in the result as `printed`.
    """
    with tempfile.TemporaryFile() as printed:
        last = _last_word(program, given | {"processor seconds": seconds}, answer, meanwhile, printed)
        printed.seek(0)
        return last | {"printed": printed.read(MOST_PRINTED).decode("utf-8", "replace")}


def _last_word(
    program: str, given: dict[str, Any], answer: Callable[[dict[str, Any]], object] | None, meanwhile: Callable[[], object] | None, printed: IO[bytes]
) -> dict[str, Any]:
    process = subprocess.Popen(
        [sys.executable, "-c", _ENDS_WITH_PARENT + program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=printed, encoding="utf-8"
    )
    try:
        assert process.stdin is not None and process.stdout is not None
        last: dict[str, Any] | None = None
        try:
            print(json.dumps(given | {"sys.path": sys.path}), file=process.stdin, flush=True)
            if meanwhile is not None:
                meanwhile()
            for line in process.stdout:
                last = json.loads(line)
                if answer is not None and "ask" in last:
                    print(json.dumps(answer(last)), file=process.stdin, flush=True)
        except BrokenPipeError:
            pass
        status = process.wait()
        if last is None or "ask" in last:
            raise Ended(_why(status, given["processor seconds"]))
        return last
    finally:
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                try:
                    stream.close()
                except OSError:  # what it was still to be told
                    pass


def _why(status: int, seconds: int | None) -> str:
    if seconds is not None and status < 0 and _name(-status) == "SIGXCPU":
        return f"it took more than {seconds} s of processor time, which are the most that it gets; give a smaller file"
    if status == -9:
        return "it was killed (signal 9), most likely since memory ran out; give a smaller file"
    if status < 0:
        return f"it crashed (signal {-status}{', ' + _name(-status) if _name(-status) else ''})"
    return f"it ended with status {status}"


def _name(number: int) -> str:
    import signal

    try:
        return signal.Signals(number).name
    except ValueError:
        return ""
