"""Sets of results that tests write: what a reader finds of them, and writers that are killed before each of their changes."""

import errno
import os
import resource
import shutil
import signal
import sys
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "faults"))
import killing

from ksl.output import staged

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


def no_links() -> None:
    """As on a memory stick."""

    def refuse(*arguments, **options):
        raise OSError(errno.EPERM, "Operation not permitted")

    os.symlink = os.link = refuse


@contextmanager
def files_of_at_most(size: int):
    """The limit of the system for the size of files; Python ignores its signal, so that writes fail."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
