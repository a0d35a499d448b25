"""What `ksl loads` refuses, and what stands in the folder of results and in pipes where something fails."""

import errno
import functools
import io
import math
import os
import signal
import subprocess
import time
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from ksl.output import OutputError, staged
from ksl_command import run_ksl
from loads_runs import SLIDE, console_script, ordinary, refused, run


def test_a_second_run_replaces_the_first(ur5, tmp_path):
    out = tmp_path / "o"
    assert run("loads", *ur5, "-o", out).returncode == 0
    first = (out / "wrenches.parquet").read_bytes()
    (out / "mine.txt").write_text("keep")
    assert run("loads", *ur5, "-o", out, "--payload", "1", "--on-link", "tool0").returncode == 0
    assert (out / "wrenches.parquet").read_bytes() != first and (out / "mine.txt").read_text() == "keep"


def test_a_second_run_leaves_no_results_of_the_first(two, tmp_path):
    out = tmp_path / "o"
    assert run("loads", *two, "-o", out, "--csv").returncode == 0
    assert (out / "wrenches.csv").exists()
    assert run("loads", *two, "-o", out).returncode == 0
    assert sorted(f.name for f in out.iterdir()) == ["report.html", "summary.csv", "wrenches.parquet"]


BAD_OPTIONS = {
    "side": (["--on", "both"], ["--on both: expected", "'child', 'parent'"]),
    "order": (["--order", "lin"], ["--order lin: expected", "'lin_ang', 'ang_lin'"]),
    "point": (["--at", "hand"], ["--at hand: expected", "tool0"]),
    "offset": (["--at", "1,2"], ["--at 1,2", "3 finite numbers"]),
    "axes": (["--axes", "hand"], ["--axes hand: expected", "tool0"]),
    "gravity": (["--gravity", "9.81"], ["--gravity 9.81", "3 finite numbers"]),
    "gravity of words": (["--gravity", "0,0,down"], ["--gravity 0,0,down"]),
    "gravity without end": (["--gravity", "0,0,inf"], ["--gravity 0,0,inf", "3 finite numbers"]),
    "payload without link": (["--payload", "2"], ["--on-link"]),
    "payload of two numbers": (["--payload", "2,1", "--on-link", "tool0"], ["--payload 2,1", "1 or 4 finite numbers"]),
    "two payloads on a link": (["--payload", "2", "--on-link", "tool0"] * 2, ["--on-link tool0", "more than once"]),
    "payload on no link": (["--payload", "2", "--on-link", "hand"], ["--on-link hand: no such link; the links of ur5 are", "tool0"]),
    "payload on a misspelt link": (["--payload", "2", "--on-link", "tol0"], ["--on-link tol0: no such link; did you mean tool0?"]),
    "negative payload": (["--payload=-2", "--on-link", "tool0"], ["tool0", "not negative"]),
    "mimic": (["--mimic", "yes"], ["--mimic yes: expected", "'independent'"]),
    "no external file": (["--external", "absent.csv"], ["absent.csv", "can't be read"]),
}


@pytest.mark.parametrize("what", BAD_OPTIONS)
def test_options_that_are_refused(ur5, tmp_path, what):
    options, words = BAD_OPTIONS[what]
    refused(tmp_path, run("loads", *ur5, "-o", tmp_path / "q", *options), *words)


def test_files_that_are_refused(ur5, tmp_path):
    robot, motion = ur5
    out = ("-o", tmp_path / "q")
    refused(tmp_path, run("loads", tmp_path / "absent.urdf", motion, *out), "absent.urdf")
    refused(tmp_path, run("loads", robot, tmp_path / "absent.csv", *out), "absent.csv", "can't be read")
    refused(tmp_path, run("loads", motion, motion, *out), "ur5_pick.csv")
    refused(tmp_path, run("loads", robot, robot, *out), "ur5.urdf")
    lines = motion.read_text().splitlines()
    lines[100] = lines[100].replace("-", "x", 1)
    (tmp_path / "bad.csv").write_text("\n".join(lines))
    refused(tmp_path, run("loads", robot, tmp_path / "bad.csv", *out), "bad.csv:101: column")
    refused(tmp_path, run("loads", robot, motion, *out, "--floating-base"), "floating_base.x")


def test_a_failure_leaves_earlier_results_alone(ur5, tmp_path):
    out = tmp_path / "kept"
    assert run("loads", *ur5, "-o", out).returncode == 0
    before = {f.name: f.read_bytes() for f in out.iterdir()}
    refused(tmp_path, run("loads", *ur5, "-o", out, "--axes", "hand"))
    refused(tmp_path, run("loads", ur5[0], ur5[0], "-o", out))
    assert {f.name: f.read_bytes() for f in out.iterdir()} == before


def test_an_output_that_can_t_be_a_folder(ur5, tmp_path):
    (tmp_path / "file").write_text("mine")
    refused(tmp_path, run("loads", *ur5, "-o", tmp_path / "file"), "file")
    refused(tmp_path, run("loads", *ur5, "-o", tmp_path / "file" / "below"), "file")
    assert (tmp_path / "file").read_text() == "mine" and [f.name for f in tmp_path.iterdir()] == ["file"]


def test_an_output_without_a_name_is_not_the_current_folder(ur5, tmp_path):
    for command in (["loads", *ur5], ["size", tmp_path, tmp_path], ["hold", ur5[0]], ["sweep", *ur5], ["motion", ur5[0], "--kind", "chirp"]):
        refused(tmp_path, run(*command, "-o", ""), "--output: the name is empty; give one, or . for the current folder")
    refused(tmp_path, run("motion", ur5[0], "--kind", "chirp", "-o", "x.csv/"), "--output x.csv/: is the name of a folder; give that of a file")


def test_empty_words_are_not_left_out(ur5, tmp_path):
    refused(tmp_path, run("size", ""), "the name of the results is empty; give their folder, or . for the current one")
    refused(tmp_path, run("loads", *ur5, "-o", tmp_path / "o", "--fail-on", ""), "--fail-on with an empty word: expected limits")


def test_a_folder_where_a_result_belongs_is_found_before_computing(two, tmp_path):
    out = tmp_path / "out"
    (out / "report.html").mkdir(parents=True)
    refused(tmp_path, run("loads", *two, "-o", out), f"{out / 'report.html'}: a folder where a result file belongs", "-o")
    assert [f.name for f in out.iterdir()] == ["report.html"]


def test_an_output_that_can_t_be_made_or_written(two, tmp_path):
    refused(tmp_path, run("loads", *two, "-o", "/proc/ksl"), "/proc/ksl: results can't be written there", "with -o")
    if os.getuid():
        (tmp_path / "closed").mkdir(mode=0o555)
        refused(tmp_path, run("loads", *two, "-o", tmp_path / "closed"), "closed: results can't be written there", "Permission denied", "with -o")


def test_results_are_staged_inside_the_folder(tmp_path):
    """Beside it there may be no right to write, or another file system."""
    out = tmp_path / "a" / "b"
    with staged(out, ["x", "y"]) as stage:
        assert stage.parent.parent == out and stage.parent.name.startswith(".") and [f.name for f in out.parent.iterdir()] == ["b"]
        (stage / "x").write_text("new")
    assert {f.name: f.read_text() for f in out.iterdir()} == {"x": "new"}


@pytest.mark.parametrize("there", [(), ("a",), ("a", "b")])
def test_a_failure_removes_the_folders_that_it_made(tmp_path, there):
    tmp_path.joinpath(*there).mkdir(parents=True, exist_ok=True)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(KeyError), staged(tmp_path / "a" / "b") as stage:
        (stage / "x").write_text("half")
        raise KeyError
    assert sorted(tmp_path.rglob("*")) == before


def test_faults_of_the_system_are_one_sentence_with_the_folder(tmp_path):
    with pytest.raises(OutputError, match=r"o: results can't be written there \(No space left on device\); free some space"), staged(tmp_path / "o"):
        raise OSError(errno.ENOSPC, "full")
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_run_that_is_ended_leaves_nothing(tmp_path, two, name):
    robot, motion = two
    motion.write_text("time,slide\n" + "".join(f"{k / 1000},{math.sin(k / 1000)}\n" for k in range(400_000)))
    heard = functools.partial(signal.signal, getattr(signal, name), signal.SIG_DFL)  # tests that nohup or a shell has started in the background ignore some
    process = subprocess.Popen(
        [console_script(), "loads", robot, motion, "-o", tmp_path / "q", "--csv"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        preexec_fn=heard,  # noqa: PLW1509 - it calls signal.signal and no more
    )
    deadline = time.monotonic() + 60
    while process.poll() is None and time.monotonic() < deadline and not list(tmp_path.glob("q/.*/new/wrenches.csv")):
        time.sleep(0.002)
    process.send_signal(getattr(signal, name))
    process.communicate(timeout=60)
    assert process.returncode == 128 + getattr(signal, name), "ended before the signal, or by it and not by its own doing"
    assert not (tmp_path / "q").exists()


@pytest.mark.parametrize("name", ["-", "/dev/stdin"])
def test_a_motion_from_a_pipe(two, tmp_path, name):
    read, write = os.pipe()
    os.write(write, two[1].read_bytes())
    os.close(write)
    p = subprocess.run([console_script(), "loads", two[0], name, "-o", tmp_path / "q"], stdin=read, capture_output=True, text=True, timeout=60)
    os.close(read)
    assert p.returncode == 0, p.stderr
    assert run("loads", *two, "-o", tmp_path / "file").returncode == 0
    piped, read = (pq.read_table(tmp_path / folder / "wrenches.parquet").drop_columns("case") for folder in ("q", "file"))
    assert piped.equals(read), "but for the name of the case, which is the file's"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("environment", [{}, {"PYTHONUNBUFFERED": "1"}], ids=["buffered", "unbuffered"])
def test_a_standard_output_that_is_full(two, tmp_path, environment):
    sentence = "ksl: standard output can't be written (No space left on device)"

    def printed_into_a_full_disk(*arguments) -> str:
        with open("/dev/full", "w") as full:
            p = subprocess.run([console_script(), *arguments], stdout=full, stderr=subprocess.PIPE, text=True, env=ordinary(**environment), timeout=60)
        assert p.returncode == 2, (p.returncode, p.stderr)
        return p.stderr

    assert printed_into_a_full_disk("loads", *two, "-o", tmp_path / "o") == f"{sentence}; results are in {tmp_path / 'o'}\n"
    assert (tmp_path / "o" / "report.html").exists()
    for arguments in (["--version"], ["--help"], *([] if environment else [["info", two[0]], ["info", "--cpu"], ["loads", "--help"]])):
        assert printed_into_a_full_disk(*arguments) == f"{sentence}\n", arguments


READERS = {
    "two.urdf": ("check URDF", "info URDF", "loads URDF motion.csv -o p", "loads URDF --cases cases.toml -o p", "hold URDF --pose pose.toml",
                 "simulate URDF motion.csv -o p", "sweep URDF sweep.toml -o p", "view URDF o --export p.html", "view URDF motion.csv --export p.html", "compare URDF"),
    "two.usda": ("info two.usda",),
    "motion.csv": ("loads URDF motion.csv -o p", "simulate URDF motion.csv -o p", "view URDF motion.csv --export p.html"),
    "loops.toml": ("info URDF --loops loops.toml",),
    "pose.toml": ("hold URDF --pose pose.toml",),
    "cases.toml": ("loads URDF --cases cases.toml -o p",),
    "sweep.toml": ("sweep URDF sweep.toml -o p",),
    "parts.toml": ("size o parts.toml",),
    "wrenches.parquet": ("size o", "size o parts.toml"),
}  # fmt: skip
"""Files, and the commands that read them."""


@pytest.mark.parametrize("failing", READERS)
def test_a_file_that_fails_is_not_called_standard_output(two, tmp_path, monkeypatch, failing):
    """The system names no file where one that is open can't be read.  Every command that reads it says that a file can't, and not that it can't print."""

    class Failing(io.RawIOBase):
        def readable(self):
            return True

        def readinto(self, _):
            raise OSError(errno.EIO, "Input/output error")

    def hooked(call):
        def opened(file, *how, **more):
            name = os.readlink(f"/proc/self/fd/{file}") if isinstance(file, int) else os.fsdecode(file)
            return io.BufferedReader(Failing()) if name.endswith(failing) and not set("wxa+") & set((*how, "r")[0]) else call(file, *how, **more)

        return opened

    robot, motion = (tmp_path / name for name in ("two.urdf", "motion.csv"))
    robot.write_text(SLIDE)
    motion.write_bytes(two[1].read_bytes())
    if any(" o" in command.replace("-o", "") for command in READERS[failing]):
        assert run("loads", robot, motion, "-o", tmp_path / "o").returncode == 0
    for name in ("two.usda", "loops.toml", "pose.toml", "cases.toml", "parts.toml"):
        (tmp_path / name).write_text("#usda 1.0" if name.endswith("usda") else "a = 1")
    (tmp_path / "sweep.toml").write_text('[base]\nmotion = "motion.csv"\n[[vary]]\nkind = "speed"\nvalues = [1]\n')
    monkeypatch.setattr("builtins.open", hooked(open))
    monkeypatch.setattr("io.open", hooked(io.open))
    monkeypatch.setattr(os, "fdopen", hooked(os.fdopen))
    for command in READERS[failing]:
        p = run_ksl(*command.replace("URDF", "two.urdf").split(), cwd=tmp_path)
        assert "standard output" not in p.stderr and "a fault in KSL" not in p.stderr, (command, p.stderr)
        assert p.returncode == 2 and (f"{failing}: can't be read" in p.stderr or "one of the files can't be read" in p.stderr), (command, p.stderr)


@pytest.mark.parametrize("arguments", [["--version"], ["info"], ["loads", "-o"]], ids=lambda a: a[0])
def test_a_reader_that_has_gone(two, tmp_path, arguments):
    """Ends without a word and not with success, as any command does."""
    given = {"info": two[:1], "loads": [tmp_path / "o", *two]}.get(arguments[0], [])
    read, write = os.pipe()
    os.close(read)
    p = subprocess.run([console_script(), *arguments, *given], stdout=write, stderr=subprocess.PIPE, text=True, env=ordinary(), timeout=60)
    os.close(write)
    assert (p.returncode, p.stderr) == (1, "")


HUGE = {
    "wrenches": (
        [f"{k},{1e300 * math.sin(k)},{1e300},{1e308}" for k in range(4)],
        "sample 1 (time 0): inverse_dynamics_with_reactions: state 0: tau[0] is inf",
    ),
    "powers": ([f"{k},{k},{1e200},{1e200}" for k in range(4)], "sample 1 (time 0): power of slide is not finite"),
    "means": ([f"{k},{k},{1e-200},{1e160}" for k in range(4)], "summary: axial_force_rms of slide is not finite"),
}


@pytest.mark.parametrize("what", HUGE)
def test_results_that_are_not_finite_are_refused(two, tmp_path, what):
    robot, motion = two
    rows, sentence = HUGE[what]
    motion.write_text("\n".join(["time,slide,slide.v,slide.a", *rows]))
    refused(tmp_path, run("loads", robot, motion, "-o", tmp_path / "q"), f"two.csv: {sentence}", "check the", "units")
