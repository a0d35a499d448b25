"""Runs that write into one folder at the same time take turns, and locks end with their processes."""

import os
import signal

import pytest
from sets import LATER, RESULTS, killing, texts, write_set

from ksl.output import OutputError, stage, staged
from ksl.output.locks import LockedError, lock

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no copies of processes here")


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
