"""Programs of other libraries in processes of their own: their answers, their ends, and signals to the commands that wait for them."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from ksl.base import own_process

READS_ON = 'import time\nsay(pid=os.getpid(), ask="go on?")\nsys.stdin.readline()\ntime.sleep(1000)\n'
KSL = [sys.executable, "-m", "ksl"]


def is_there(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_questions_are_answered_and_the_last_word_is_the_result():
    program = 'say(ask="x")\na = json.loads(sys.stdin.readline())\nprint("not an answer")\nos.write(2, b"a library says")\nsay(got=a + given["b"])\n'
    assert own_process.run(program, {"b": 2}, lambda question: 40 if question["ask"] == "x" else 0) == {"got": 42, "printed": "a library says"}


@pytest.mark.parametrize(
    ("program", "why"),
    [("sys.exit(3)", "it ended with status 3"), ("os.kill(os.getpid(), 9)", "memory ran out"), ("os.kill(os.getpid(), 11)", "it crashed (signal 11, SIGSEGV)")],
)
def test_why_a_process_ended_without_an_answer(program, why):
    with pytest.raises(own_process.Ended) as e:
        own_process.run(program, {})
    assert why in str(e.value)


def test_a_process_ends_after_its_share_of_processor_time():
    pytest.importorskip("resource")
    with pytest.raises(own_process.Ended, match="it took more than 1 s of processor time, which are the most that it gets"):
        own_process.run("while True:\n    pass\n", {}, seconds=1)


def test_an_exception_while_it_waits_ends_the_process():
    pids = []

    def interrupt(question):
        pids.append(question["pid"])
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        own_process.run(READS_ON, {}, interrupt)
    assert not is_there(pids[0])


def test_commands_want_processes():
    own_process.want()
    assert own_process.is_wanted()


def test_what_a_command_wants_ends_with_its_test():
    assert not own_process.is_wanted()


FILES = {
    "xacro": ("r.xacro", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r"><xacro:include filename="{}"/></robot>', ["--xacro", ""]),
    "mujoco": ("r.xml", '<mujoco><include file="{}"/></mujoco>', []),
    "pxr": ("r.usda", "#usda 1.0\n(\n subLayers = [@./never.usda@, @./{}@]\n)\n", []),
}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
@pytest.mark.parametrize(
    ("library", "name"), [("xacro", "SIGINT"), ("xacro", "SIGTERM"), ("mujoco", "SIGINT"), ("mujoco", "SIGHUP"), ("pxr", "SIGINT"), ("pxr", "SIGTERM")]
)
def test_signals_end_a_command_while_another_library_works(tmp_path: Path, library: str, name: str):
    """The library waits for a file that nobody writes; KSL, which looks at the sublayers of USD from the last one on, gives up the one that is opened here, and waits for the next."""
    pytest.importorskip(library)
    file, text, options = FILES[library]
    pipe = f"pipe{os.path.splitext(file)[1]}"
    for path in (pipe, pipe.replace("pipe", "never")):
        os.mkfifo(tmp_path / path)
    (tmp_path / file).write_text(text.format(pipe))
    heard = lambda: signal.signal(getattr(signal, name), signal.SIG_DFL)
    process = subprocess.Popen([*KSL, "info", file, *options], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heard)  # noqa: PLW1509 - it calls signal.signal and no more
    with open(tmp_path / pipe, "w"):  # open returns when the library has opened the other end
        process.send_signal(getattr(signal, name))
        said = process.communicate(timeout=120)
    assert process.returncode == 128 + getattr(signal, name), said
    assert "refuses" not in said[1] and "fault" not in said[1]
