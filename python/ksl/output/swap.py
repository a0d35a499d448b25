"""Several files of a folder replaced in one step (docs/decisions/0013-output-files.md).

A stage is a hidden folder in the folder of the results:

    lock    held while its process lives
    new/    the new files, complete
    old/    the files of the earlier run that will be replaced or removed, as hard links
    now     a link to `old` or `new`

Each name in the folder becomes a link to STAGE/now/NAME, which still is the earlier file.  Then `now` is turned from `old` to `new`: the
step in which all names change.  Then each name becomes a plain file again.  Whatever stops this on the way, every name leads to the earlier
files or every name to the new ones, and `settle` makes them plain files.

Where the file system has no links, a list of what is to be done is written first, and `settle` does what is left of it.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
from collections.abc import Collection
from pathlib import Path

NEW, OLD, NOW, TODO = "new", "old", "now", "todo.json"

WITHOUT_LINKS = (errno.EPERM, errno.EACCES, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP, errno.EINVAL, errno.EMLINK, errno.EXDEV)
"""What file systems answer that have no links; Linux also for hard links to files of other users."""


def swap(stage: Path, results: Collection[str]) -> None:
    """Puts the files in STAGE/new into the folder of the stage, and removes those of `results` that are not among them.

    Where it raises an OSError, the folder is as it was, or `settle` can still bring all new files into their places.
    """
    folder = stage.parent
    written = sorted(entry.name for entry in os.scandir(stage / NEW) if entry.is_file(follow_symlinks=False))
    removed = sorted(name for name in set(results).difference(written) if os.path.lexists(folder / name))
    for name in written:
        flush(stage / NEW / name)
    if len(written) + len(removed) == 1:  # one step anyway
        _put(stage / NEW / (written or removed)[0], folder / (written or removed)[0])
    else:
        try:
            _link(stage, [*written, *removed])
        except (OSError, NotImplementedError) as e:
            _put_linked(stage, [*written, *removed])
            if isinstance(e, OSError) and e.errno not in WITHOUT_LINKS:
                raise
            _plan(stage, removed)
            _do_what_is_planned(stage)
        else:
            _point(stage, NEW)
            _put_linked(stage, [*written, *removed])
    flush_folder(folder)


def settle(stage: Path) -> None:
    """Ends the swap of a process that was killed: all new files, or all earlier ones, become plain files of the folder."""
    folder = stage.parent
    if os.path.lexists(stage / NOW):
        _put_linked(stage, [entry.name for entry in os.scandir(folder) if entry.is_symlink()])
    if (stage / TODO).exists():
        _do_what_is_planned(stage)


def _link(stage: Path, names: list[str]) -> None:
    """Names of the folder become links to what they were; those of files that were not there lead nowhere yet."""
    folder = stage.parent
    (stage / OLD).mkdir()
    for name in names:
        if os.path.lexists(folder / name):
            os.link(folder / name, stage / OLD / name, follow_symlinks=False)
    _point(stage, OLD)
    flush_folder(stage / NEW)
    flush_folder(stage)  # after a loss of power, links must not lead into a folder that was never written
    for name in names:
        os.symlink(_linked(stage, name), stage / "link")
        os.replace(stage / "link", folder / name)


def _point(stage: Path, to: str) -> None:
    """Turns `now`, in one step."""
    os.symlink(to, stage / "next")
    os.replace(stage / "next", stage / NOW)
    flush_folder(stage)


def _put_linked(stage: Path, names: list[str]) -> None:
    """Names of the folder that are links into the stage become the files to which they lead; those that lead nowhere go."""
    folder = stage.parent
    for name in names:
        try:
            linked = os.readlink(folder / name) == _linked(stage, name)
        except OSError:  # no link, or nothing
            continue
        if linked:
            _put(stage / NOW / name, folder / name)


def _linked(stage: Path, name: str) -> str:
    return f"{stage.name}/{NOW}/{name}"


def _put(source: Path, place: Path) -> None:
    """The file gets another place; where there is none, what is there goes."""
    if os.path.lexists(source):
        os.replace(source, place)
    else:
        place.unlink(missing_ok=True)


def _plan(stage: Path, removed: list[str]) -> None:
    (stage / "plan").write_text(json.dumps(removed), encoding="utf-8")
    flush(stage / "plan")
    flush_folder(stage / NEW)
    os.replace(stage / "plan", stage / TODO)
    flush_folder(stage)


def _do_what_is_planned(stage: Path) -> None:
    folder = stage.parent
    removed = json.loads((stage / TODO).read_text(encoding="utf-8"))
    for name in os.listdir(stage / NEW):
        os.replace(stage / NEW / name, folder / name)
    for name in removed:
        (folder / name).unlink(missing_ok=True)
    os.unlink(stage / TODO)


def flush(file: Path) -> None:
    """Waits until a file is on the disk.  A full disk that was not noticed before is noticed here."""
    handle = os.open(file, os.O_RDWR if os.name == "nt" else os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def flush_folder(folder: Path) -> None:
    """Waits until the names in a folder are on the disk.  Some systems can't do that."""
    with contextlib.suppress(OSError):
        flush(folder)
