"""What KSL writes is the earlier or the later result, whatever stops it, and nothing is left behind.

Copies of this process kill themselves before each change that they make to a folder, so that every state on the way is seen.
`make test-faults` kills all commands at random moments, and fills small disks."""

import errno
import os
import resource
import shutil
import signal
import sys
from contextlib import contextmanager
from collections.abc import Iterator
from pathlib import Path

import ended_sweeps
import killing
import pytest
import sweeps_here
import writers

import ksl
from ksl.commands.app import end_on_signals
from ksl.output import OutputError, stage, staged, swap, whole_file
from ksl.output.parts import write_part
from ksl.output.locks import LockedError, lock

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no copies of processes here")

RESULTS = ("table", "extra", "report", "summary")
EARLIER = {"table": "earlier table", "extra": "earlier extra", "summary": "earlier summary"}
LATER = {"table": "later table", "report": "later report", "summary": "later summary"}


def write_set(folder: Path, files: dict[str, str] = LATER) -> None:
    with staged(folder, RESULTS) as part:
        for name, text in files.items():
            (part / name).write_text(text)


def texts(folder: Path) -> dict[str, str]:
    """What a reader finds: links are followed, and those that lead nowhere are not there."""
    return {f.name: f.read_text() for f in folder.iterdir() if f.is_file() and f.name[0] != "."} if folder.is_dir() else {}


def folder_with(path: Path, files: dict[str, str]) -> Path:
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir()
    for name, text in files.items():
        (path / name).write_text(text)
    return path


def faults_of(write, folder: Path, earlier: dict[str, str], later: dict[str, str], before=lambda: None, torn_until_settled=False, step=1) -> list[str]:
    """Kills `write` before each of its changes; what a reader then finds amiss, at once and after the next run."""
    folder_with(folder, earlier)
    _, changes = killing.in_a_copy(lambda: write(folder), before=before)
    assert changes > 2
    faults = []
    for number in range(1, changes + 1, step):
        folder_with(folder, earlier)
        status, _ = killing.in_a_copy(lambda: write(folder), kill_at=number, before=before)
        assert status == -signal.SIGKILL
        found = texts(folder)
        if found not in (earlier, later) and not torn_until_settled:
            faults.append(f"killed before change {number}: {found}")
        with staged(folder):
            pass
        if texts(folder) not in (earlier, later) or (texts(folder) != found and not torn_until_settled):
            faults.append(f"settled after change {number}: {texts(folder)}")
        if killing.everything(folder) != set(texts(folder)):
            faults.append(f"left behind after change {number}: {killing.everything(folder)}")
    return faults


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


def no_links() -> None:
    """As on a memory stick."""

    def refuse(*arguments, **options):
        raise OSError(errno.EPERM, "Operation not permitted")

    os.symlink = os.link = refuse


def test_without_links_the_next_run_ends_what_a_killed_one_began(tmp_path):
    assert faults_of(write_set, tmp_path / "out", EARLIER, LATER, no_links, torn_until_settled=True) == []
    before = folder_with(tmp_path / "out", EARLIER)
    assert killing.in_a_copy(lambda: write_set(before), before=no_links)[0] == 0 and texts(before) == LATER == texts(before)


@pytest.mark.parametrize("before", [lambda: None, no_links], ids=["links", "no links"])
def test_what_a_killed_run_leaves_is_not_taken_for_files_of_others(tmp_path, before):
    """The next run writes into the folder, without --force, wherever the first one was killed."""
    run = ksl.loads(Path(__file__).parents[2] / "examples/robots/ur5.urdf", Path(__file__).parents[2] / "examples/motions/ur5_pick.csv")
    out = folder_with(tmp_path / "out", {"notes": "the user's"})
    run.write(out)
    names = killing.everything(out)
    folder_with(out, {"notes": "the user's"})
    _, changes = killing.in_a_copy(lambda: run.write(out), before=before)
    for number in range(1, changes + 1, 6):
        folder_with(out, {"notes": "the user's"})
        assert killing.in_a_copy(lambda: run.write(out), kill_at=number, before=before)[0] == -signal.SIGKILL
        run.write(out)
        assert killing.everything(out) == names


# Planted faults: what the tests above must notice.


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


# Signals


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


# Several at once


def test_of_two_runs_into_one_folder_the_later_one_stays_whole(tmp_path):
    with staged(tmp_path, RESULTS) as first:
        (first / "table").write_text("first")
        (first / "extra").write_text("first")
        write_set(tmp_path)
        assert texts(tmp_path) == LATER and first.is_dir(), "the stage of a run that lives is not removed"
    assert texts(tmp_path) == {"table": "first", "extra": "first"} and killing.everything(tmp_path) == {"table", "extra"}


def test_many_processes_into_one_folder_do_not_mix(tmp_path):
    copies = []
    for tag in "abcd":
        copies.append(os.fork())
        if not copies[-1]:
            try:
                for k in range(15):
                    write_set(tmp_path, dict.fromkeys(RESULTS[: 2 + k % 3], f"{tag}{k}"))
                os._exit(0)
            finally:
                os._exit(1)
    assert [os.waitpid(copy, 0)[1] for copy in copies] == [0, 0, 0, 0]
    assert len(set(texts(tmp_path).values())) == 1 and killing.everything(tmp_path) == set(texts(tmp_path))


def test_a_run_that_waits_too_long_says_for_whom(tmp_path, monkeypatch):
    held = lock(tmp_path / stage.LOCK)
    monkeypatch.setattr(stage, "PATIENCE", 0.02)
    with pytest.raises(OutputError, match=f"process {os.getpid()} on .* has been putting its results there"):
        write_set(tmp_path)
    held.release()
    write_set(tmp_path)
    assert texts(tmp_path) == LATER and killing.everything(tmp_path) == set(LATER)


def test_a_lock_ends_with_its_process(tmp_path):
    killing.in_a_copy(lambda: (lock(tmp_path / "l"), os.kill(os.getpid(), signal.SIGKILL)))
    assert (tmp_path / "l").exists()
    held = lock(tmp_path / "l")
    with pytest.raises(LockedError, match=str(os.getpid())):
        lock(tmp_path / "l")
    held.release()
    assert not (tmp_path / "l").exists()


def test_where_there_are_no_locks_nothing_is_taken_for_stale(tmp_path, monkeypatch):
    from ksl.output import locks

    monkeypatch.setattr(locks, "fcntl", None)
    (tmp_path / f"{stage.PREFIX}00000000" / "new").mkdir(parents=True)
    write_set(tmp_path)
    assert texts(tmp_path) == LATER and killing.everything(tmp_path) - set(LATER) == {f"{stage.PREFIX}00000000", f"{stage.PREFIX}00000000/new"}


def test_a_copy_of_the_process_does_not_remove_the_stage(tmp_path):
    with staged(tmp_path) as part:
        (part / "table").write_text("later")
        copy = os.fork()
        if not copy:
            stage._end_open_stages()
            os._exit(0)
        os.waitpid(copy, 0)
    assert texts(tmp_path) == {"table": "later"}


# Places


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
    "half a character": b'["\\ud800"]', "not UTF-8": b'["\xff"]', "deep": b"[" * 200_000, "long": b'["table"' + b" " * (64 << 20) + b"]",
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
    (forged / "todo.json").write_bytes(PLANS[plan].replace(b"/VICTIM", os.fsencode(tmp_path / "victim")))
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


def test_the_file_of_a_sweep_does_not_follow_a_link_at_its_unfinished_name(tmp_path):
    (tmp_path / "mine").write_text("mine")
    (tmp_path / ".table.part").symlink_to("mine")
    write_part(tmp_path / "table", b"later")
    assert texts(tmp_path) == {"table": "later", "mine": "mine"} and killing.everything(tmp_path) == {"table", "mine"}


def test_modes_are_those_of_new_files(tmp_path):
    mask = os.umask(0o027)
    try:
        write_set(tmp_path)
    finally:
        os.umask(mask)
    assert {f.stat().st_mode & 0o777 for f in tmp_path.iterdir()} == {0o640}


@pytest.mark.parametrize("name", ["null", "full"])
def test_devices_are_written_to_and_not_replaced(tmp_path, name):
    device = Path("/dev") / name
    if not device.is_char_device():
        pytest.skip("no such device")
    (tmp_path / "out").symlink_to(device)
    if name == "null":
        ksl.load(writers_urdf(tmp_path)).to_urdf(tmp_path / "out")
    else:
        with pytest.raises(OutputError, match=r"can't be written \(No space left on device\); free some space"):
            ksl.load(writers_urdf(tmp_path)).to_urdf(tmp_path / "out")
    assert device.is_char_device() and (tmp_path / "out").is_symlink()


def writers_urdf(folder: Path) -> Path:
    (folder / "arm.urdf").write_text(writers.ARM)
    return folder / "arm.urdf"


def test_files_reach_the_disk_before_their_names_do(tmp_path, monkeypatch):
    order: list[str] = []
    flush, replace = swap.flush, os.replace
    monkeypatch.setattr(swap, "flush", lambda file: (order.append(f"flush {Path(file).name}"), flush(file)))
    monkeypatch.setattr(os, "replace", lambda a, b: (order.append(f"replace {Path(b).name}"), replace(a, b)))
    write_set(tmp_path)
    turned = max(k for k, what in enumerate(order) if what == "replace now")
    assert {f"flush {name}" for name in LATER} <= set(order[:turned]) and order[-1] == f"flush {tmp_path.name}"


# Disks that are full


@contextmanager
def files_of_at_most(size: int):
    """The limit of the system for the size of files; Python ignores its signal, so that writes fail."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("size", range(0, 100_000, 5_000))
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


# Every command that writes


@pytest.fixture(scope="module")
def work(tmp_path_factory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("writers")
    with writers.stand_ins_end():
        writers.same_date()
        sweeps_here.sweep_here()
        writers.export_a_small_page()
        yield folder


@pytest.fixture(scope="module")
def all_writers(work) -> dict[str, writers.Writer]:
    found = {w.name: w for w in writers.prepare(work)}
    for name, writer in found.items():
        (work / "warm" / name).mkdir(parents=True)
        killing.in_this_process(writer.later(work / "warm" / name))
    return found


NAMES = ["loads", "loads into an empty folder", "size", "motion", "motion as Parquet", "check --fix", "view --export", "to_urdf", "Run.report"]
PLACES = 4
"""So many of its changes each command is killed at; `make test-faults` takes all."""


def test_no_writer_is_forgotten(all_writers):
    assert list(all_writers) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_command_that_is_killed_leaves_the_earlier_or_the_later_results(all_writers, work, name):
    assert writers.killed_at_changes(all_writers[name], work / "out", PLACES) == []


@pytest.mark.parametrize("name", ["loads", "size", "motion", "check --fix", "view --export"])
def test_a_command_on_a_full_disk_says_so_and_changes_nothing(all_writers, work, name):
    writer, out = all_writers[name], work / "out"
    earlier = writers.earlier_results(writer, out)
    for size in (0, 300):
        with files_of_at_most(size):
            status, _ = killing.in_a_copy(writer.later(out), output=None)
        assert status == 2 and killing.visible(out) == earlier and killing.everything(out) == set(earlier), (size, status)


def test_the_sentence_about_a_full_disk(all_writers, work, capsys):
    writer, out = all_writers["motion"], work / "out"
    writers.earlier_results(writer, out)
    with files_of_at_most(100), pytest.raises(SystemExit):
        writer.later(out)()
    assert "m.csv: can't be written (File too large); raise the limit of the size of files" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["motion", "motion as Parquet", "check --fix", "view --export", "to_urdf", "Run.report"])
def test_a_folder_of_a_file_is_not_made(all_writers, work, name):
    """Only folders of results are: a slip of the pen in the name of a file would otherwise make folders."""
    status, _ = killing.in_a_copy(all_writers[name].later(work / "no" / "where"), output=work / "log")
    said = (work / "log").read_text()
    assert status and "there is no" in said and "folder" in said and ("Traceback" not in said or "OutputError: " in said)
    assert not (work / "no").exists()


# Sweeps


@pytest.fixture(scope="module")
def swept(all_writers, work) -> killing.Seen:
    return ended_sweeps.undisturbed(work)


@pytest.mark.parametrize("force", [False, True], ids=["into an empty folder", "over another sweep"])
def test_a_sweep_that_is_killed_goes_on(work, swept, force):
    """What is there belongs to the sweep that sweep.json describes, and the next run completes it."""
    assert ended_sweeps.killed_at_changes(work, swept, force, PLACES).faults == []


def test_a_sweep_that_is_interrupted_leaves_no_unfinished_file(work, swept):
    assert ended_sweeps.interrupted(work, swept, False, [0.2, 0.4, 0.6, 0.8]).faults == []


def test_a_sweep_on_a_full_disk_says_so_and_goes_on_with_space(work, swept):
    """A file of at most 5,000 bytes: the description fits, partitions don't."""
    out = work / "full"
    with files_of_at_most(5000):
        assert killing.in_a_copy(writers.sweep_of(work, "b")(out), output=None)[0] == 2
    assert ended_sweeps.left_amiss(out, swept, "full") == [] and set(killing.visible(out)) == {"sweep.json"}
    assert ended_sweeps.not_completed(writers.sweep_of(work, "b")(out), out, swept, "full") == []


def test_two_sweeps_into_one_folder(work, swept):
    out = work / "one"
    out.mkdir()
    held = lock(out / ".ksl-sweep")
    assert killing.in_a_copy(writers.sweep_of(work, "b", "--force")(out), output=work / "log")[0] == 2
    said = (work / "log").read_text()
    assert f"{out}: process {os.getpid()} on " in said and "is running a sweep into this folder; wait for its end" in said
    held.release()
    assert killing.in_a_copy(writers.sweep_of(work, "b")(out))[0] == 0 and killing.visible(out) == swept


def test_a_sweep_that_is_refused_leaves_no_folder(work, swept):
    with files_of_at_most(10):
        assert killing.in_a_copy(writers.sweep_of(work, "b")(work / "x" / "y"), output=None)[0] == 2
    assert not (work / "x").exists()
