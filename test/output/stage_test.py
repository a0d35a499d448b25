"""A set of files is the earlier or the later one, whatever stops the program, and nothing is left behind.

Copies of this process kill themselves before each change that they make to a folder, so that every state on the way is seen."""

import errno
import os
import re
import shutil
import signal
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from each_case import each
from sets import EARLIER, LATER, RESULTS, faults_of, files_of_at_most, folder_with, killing, no_links, texts, write_set

from ksl.commands.app import end_on_signals
from ksl.output import OutputError, refuse_unknown, stage, staged, swap, whole_file

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no copies of processes here")


SETS = {
    "replaced, added and removed": (EARLIER, LATER),
    "all new": ({"notes": "the user's"}, {"notes": "the user's", **LATER}),
    "one replaced": ({"table": "earlier"}, {"table": "later"}),
    "one replaced, one removed": ({"table": "earlier", "extra": "earlier"}, {"table": "later"}),
}


@pytest.mark.parametrize("kind", SETS)
def test_a_set_that_is_killed_at_any_change_is_the_earlier_or_the_later_one(tmp_path, kind):
    earlier, later = SETS[kind]
    given = {name: text for name, text in later.items() if name in RESULTS}
    assert faults_of(lambda out: write_set(out, given), tmp_path / "out", earlier, later) == []


def test_without_links_the_next_run_ends_what_a_killed_one_began(tmp_path):
    assert faults_of(write_set, tmp_path / "out", EARLIER, LATER, no_links, torn_until_settled=True) == []
    before = folder_with(tmp_path / "out", EARLIER)
    assert killing.in_a_copy(lambda: write_set(before), before=no_links)[0] == 0 and texts(before) == LATER == texts(before)


def one_after_the_other(folder: Path) -> None:
    """As it was written once: through a hidden folder, but each file renamed by itself."""
    part = folder / ".part"
    part.mkdir()
    for name, text in LATER.items():
        (part / name).write_text(text)
    for name in LATER:
        os.replace(part / name, folder / name)
    (folder / "extra").unlink(missing_ok=True)
    part.rmdir()


def in_place(folder: Path) -> None:
    for name, text in LATER.items():
        with open(folder / name, "w") as file:
            file.write(text)
    (folder / "extra").unlink(missing_ok=True)


@pytest.mark.parametrize("write", [one_after_the_other, in_place])
def test_a_writer_that_tears_results_is_noticed(tmp_path, write):
    faults = faults_of(write, tmp_path / "out", EARLIER, LATER, step=2)
    assert any(fault.startswith("killed") for fault in faults)


def test_a_stage_that_stays_is_noticed(tmp_path, monkeypatch):
    monkeypatch.setattr(stage, "settle_stale", lambda folder: None)
    faults = faults_of(write_set, tmp_path / "out", EARLIER, LATER, step=6)
    assert any(fault.startswith("left behind") for fault in faults)


class Interrupt:
    """Sends this process a signal when a certain line of the module `ksl.output` is reached."""

    def __init__(self, at: int, number: int) -> None:
        self.lines, self.at, self.number = 0, at, number

    def __call__(self, frame, event, argument):
        if "/ksl/output/" not in frame.f_code.co_filename and "contextlib" not in frame.f_code.co_filename:
            return None
        if event == "line":
            self.lines += 1
            if self.lines == self.at:
                os.kill(os.getpid(), self.number)
        return self


@contextmanager
def as_a_command():
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    try:
        for number in before:
            signal.signal(number, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        end_on_signals()
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("there", [True, False], ids=["over earlier results", "into a new folder"])
def test_a_signal_at_any_line_leaves_the_earlier_or_the_later_set(tmp_path, number, there):
    """Each seventh line, beginning elsewhere for each signal."""
    out, lines, interrupted = tmp_path / "a" / "out", 10**6, 0
    tracing = sys.gettrace()
    at = 1 + (number == signal.SIGTERM)
    while at < lines:
        shutil.rmtree(tmp_path / "a", ignore_errors=True)
        if there:
            (tmp_path / "a").mkdir()
            folder_with(out, EARLIER)
        interrupt = Interrupt(at, number)
        ended = None
        with as_a_command():
            sys.settrace(interrupt)
            try:
                write_set(out)
            except (KeyboardInterrupt, SystemExit) as e:
                ended = 130 if isinstance(e, KeyboardInterrupt) else e.code
            finally:
                sys.settrace(tracing)
        stage._end_open_stages()
        lines, at = interrupt.lines if ended is None else lines, at + 7
        assert ended in (None, 128 + number)
        interrupted += ended is not None
        assert texts(out) in ((EARLIER, LATER) if there else ({}, LATER)), (at, ended)
        assert killing.everything(out) == set(texts(out)), (at, ended)
        assert there or texts(out) or not (tmp_path / "a").exists(), "folders that were made are removed"
    assert interrupted > 10


def test_a_copy_of_the_process_does_not_remove_the_stage(tmp_path):
    with staged(tmp_path) as part:
        (part / "table").write_text("later")
        copy = os.fork()
        if not copy:
            stage._end_open_stages()
            os._exit(0)
        os.waitpid(copy, 0)
    assert texts(tmp_path) == {"table": "later"}


def test_a_link_to_a_folder_gets_the_results_and_stays(tmp_path):
    folder_with(tmp_path / "real", EARLIER)
    (tmp_path / "link").symlink_to("real")
    write_set(tmp_path / "link")
    assert (tmp_path / "link").is_symlink() and texts(tmp_path / "real") == LATER


@pytest.mark.skipif(not os.access("/dev/shm", os.W_OK), reason="no other file system here")
def test_another_file_system(tmp_path):
    other = Path(f"/dev/shm/ksl-test-{os.getpid()}")
    try:
        write_set(other)
        (tmp_path / "table").symlink_to(other / "table")
        assert texts(other) == LATER and killing.everything(other) == set(LATER)
        with whole_file(tmp_path / "table") as part:
            part.write_text("through a link")
        assert (tmp_path / "table").is_symlink() and (other / "table").read_text() == "through a link"
    finally:
        shutil.rmtree(other)


def test_a_folder_that_is_removed_meanwhile(tmp_path):
    with pytest.raises(OutputError, match="out: was removed while results were written into it; run it again"):
        with staged(tmp_path / "out") as part:
            (part / "table").write_text("x")
            shutil.rmtree(tmp_path / "out")
    with pytest.raises(OutputError, match="was removed"):
        with staged(tmp_path / "out") as part:
            shutil.rmtree(tmp_path / "out")
            (part / "table").write_text("x")
    assert not (tmp_path / "out").exists()


def test_what_is_the_user_s_stays(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "table").write_text("mine")
    (tmp_path / ".ksl-stage-notes").write_text("mine: no folder")
    (tmp_path / "dangling").symlink_to("nowhere")
    (tmp_path / "to notes").symlink_to("sub/table")
    (tmp_path / "table").symlink_to("sub/table")  # a result's name: the link is replaced, and not what it leads to
    before = killing.everything(tmp_path)
    write_set(tmp_path)
    assert killing.everything(tmp_path) == before | set(LATER) and (tmp_path / "sub" / "table").read_text() == "mine"
    assert os.readlink(tmp_path / "dangling") == "nowhere" and (tmp_path / "to notes").read_text() == "mine"


PLANS = {
    "a path": b'["../../victim"]', "a path of another place": b'["/VICTIM"]', "folders": b'["sub/mine"]', "dots": b'["..", "."]', "no name": b'[""]',
    "a number": b"[1]", "no list": b"1", "an object": b'{"table": 1}', "null": b"null", "no JSON": b"", "cut": b'["tab', "NUL": b'["table\\u0000"]',
    "half a character": b'["\\ud800"]', "not UTF-8": b'["\xff"]', "deep": b"[" * 200_000, "long": b'["table"LONG]',
}  # fmt: skip


@pytest.mark.parametrize("plan", PLANS)
def test_a_forged_plan_is_not_carried_out(tmp_path, plan):
    """A folder of results from somebody else, with a stage in it.  Nothing outside of the folder changes, and no run fails."""
    (tmp_path / "victim").write_text("mine")
    out = tmp_path / "a" / "out"
    (out / "sub").mkdir(parents=True)
    (out / "sub" / "mine").write_text("mine")
    forged = out / f"{stage.PREFIX}x"
    (forged / "new").mkdir(parents=True)
    (forged / "new" / "table").write_text("forged")
    (forged / "todo.json").write_bytes(PLANS[plan].replace(b"/VICTIM", os.fsencode(tmp_path / "victim")).replace(b"LONG", b" " * (64 << 20)))
    for _ in range(2):
        write_set(out)
        assert texts(out) == LATER and (tmp_path / "victim").read_text() == (out / "sub" / "mine").read_text() == "mine"
    assert (forged / "new" / "table").read_text() == "forged", "what is no stage of a run stays"


@pytest.mark.parametrize("kind", ["now", "now of another place", "new", "old", "plan"])
def test_links_of_a_forged_stage_are_not_followed(tmp_path, kind):
    elsewhere = folder_with(tmp_path / "elsewhere", {"f": "mine", "g": "mine"})
    forged = tmp_path / "out" / f"{stage.PREFIX}x"
    forged.mkdir(parents=True)
    (tmp_path / "out" / "f").symlink_to(f"{forged.name}/now/f")
    (forged / "now").symlink_to({"now": "../../elsewhere", "now of another place": elsewhere}.get(kind, "old" if kind == "old" else "new"))
    for name in ("new", "old"):
        if name == kind:
            (forged / name).symlink_to(elsewhere)
        else:
            (forged / name).mkdir()
    (elsewhere / "plan").write_text('["table"]')
    if kind == "plan":
        (forged / "todo.json").symlink_to(elsewhere / "plan")
    elif kind == "new":
        (forged / "todo.json").write_text("[]")
    write_set(tmp_path / "out")
    assert texts(elsewhere) == {"f": "mine", "g": "mine", "plan": '["table"]'} and texts(tmp_path / "out").items() >= LATER.items()
    assert (tmp_path / "out" / "f").is_symlink()


def test_a_plan_that_is_a_pipe_is_not_waited_for(tmp_path):
    forged = tmp_path / f"{stage.PREFIX}x"
    (forged / "new").mkdir(parents=True)
    os.mkfifo(forged / "todo.json")
    assert killing.in_a_copy(lambda: (signal.alarm(20), write_set(tmp_path)))[0] == 0 and texts(tmp_path) == LATER


def test_modes_are_those_of_new_files(tmp_path):
    mask = os.umask(0o027)
    try:
        write_set(tmp_path)
    finally:
        os.umask(mask)
    assert {f.stat().st_mode & 0o777 for f in tmp_path.iterdir()} == {0o640}


def test_files_reach_the_disk_before_their_names_do(tmp_path, monkeypatch):
    order: list[str] = []
    flush, replace = swap.flush, os.replace
    monkeypatch.setattr(swap, "flush", lambda file: (order.append(f"flush {Path(file).name}"), flush(file)))
    monkeypatch.setattr(os, "replace", lambda a, b: (order.append(f"replace {Path(b).name}"), replace(a, b)))
    write_set(tmp_path)
    turned = max(k for k, what in enumerate(order) if what == "replace now")
    assert {f"flush {name}" for name in LATER} <= set(order[:turned]) and order[-1] == f"flush {tmp_path.name}"


@each("size", range(0, 100_000, 5_000))
def test_a_full_disk_leaves_the_earlier_set(tmp_path, size):
    folder_with(tmp_path / "out", EARLIER)
    with files_of_at_most(size), pytest.raises(OutputError, match=r"out: results can't be written there \(File too large\); raise the limit"):
        write_set(tmp_path / "out", {"report": "r" * 1000, "table": "t" * 100_001})
    assert texts(tmp_path / "out") == EARLIER and killing.everything(tmp_path / "out") == set(EARLIER)


@pytest.mark.parametrize("call", ["link", "symlink", "replace", "mkdir", "fsync"])
def test_a_disk_that_is_full_for_names_leaves_the_earlier_set(tmp_path, monkeypatch, call):
    """Each call of this kind fails in turn, as on a disk without space for a longer folder."""
    real = getattr(os, call)
    for number in range(1, 50):
        calls = []

        def fail(*arguments, **options):
            calls.append(arguments)
            if len(calls) == number:
                raise OSError(errno.ENOSPC, "No space left on device")
            return real(*arguments, **options)

        out = folder_with(tmp_path / "out", EARLIER)
        monkeypatch.setattr(os, call, fail)
        try:
            write_set(out)
        except OutputError as e:
            assert "No space left on device" in str(e)
        monkeypatch.setattr(os, call, real)
        with staged(out):
            pass
        assert texts(out) in (EARLIER, LATER) and killing.everything(out) == set(texts(out)), (number, calls)
        if len(calls) < number:
            break
    assert number > (2 if call != "mkdir" else 1)


def test_a_folder_with_the_name_of_a_result_is_named_and_stays(tmp_path):
    """Also where the names are those that the block writes, and where nothing marks earlier results: --force doesn't replace it."""
    (tmp_path / "robot.c").mkdir()
    said = f"{tmp_path / 'robot.c'}: a folder where a result file belongs; move it away"
    for check in (None, lambda: refuse_unknown(tmp_path, ["robot.c"], "robot.c of KSL")):
        with pytest.raises(OutputError, match=re.escape(said)), staged(tmp_path, (), check) as folder:
            (folder / "robot.c").write_text("")
        assert [entry.name for entry in tmp_path.iterdir()] == ["robot.c"]
