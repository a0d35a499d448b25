"""What KSL writes is the earlier or the later result, whatever stops it, and nothing is left behind.

Copies of this process kill themselves before each change that they make to a folder, so that every state on the way is seen.
`make test-faults` kills all commands at random moments, and fills small disks.  test/output has the tests of what all commands write with."""

import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "output"))
import ended_sweeps
import killing
import pytest
import sweeps_here
import writers
from sets import files_of_at_most, folder_with, no_links

import ksl
from ksl.output.locks import lock

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no copies of processes here")


@pytest.mark.parametrize("before", [lambda: None, no_links], ids=["links", "no links"])
def test_what_a_killed_run_leaves_is_not_taken_for_files_of_others(all_writers, work, tmp_path, before):
    """The next run writes into the folder, without --force, wherever the first one was killed."""
    run = ksl.compute_loads(work / "arm.urdf", work / "a.csv")
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
