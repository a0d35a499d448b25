"""Several files of a folder replaced in one step (docs/decisions/0013-output-files.md).

A stage is a hidden folder in the folder of the results:

    lock    held while its process lives
    new/    the new files, complete
    old/    the files of the earlier run that will be replaced or removed, as hard links
    now     a link to `old` or `new`

First each name in the folder becomes a link to STAGE/now/NAME, which is still the earlier file.  Then `now` is changed from `old` to
`new`: in this one step all names change.  Then each name becomes a plain file again.  Wherever this is stopped, either all names lead to
the earlier files or all lead to the new ones.  `settle` then makes them plain files.

Where the file system has no links, the list of files to be removed is written first.  Then each new file is renamed.  If this is stopped,
`settle` does the rest.

A folder of results may come from somebody else, and with it a stage that nobody's run has made.  So `settle` takes only what `swap` writes:
a list of plain names, and a `now` that leads to `old` or `new`, which are folders and no links.  It then changes only this folder and its stage.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import stat
from collections.abc import Collection
from pathlib import Path

from ksl.output.patience import patiently

NEW, OLD, NOW, TODO = "new", "old", "now", "todo.json"
PLAN_BYTES = 64 << 20
"""A longer list of files to be removed is none of `swap`."""

WITHOUT_LINKS = (errno.EPERM, errno.EACCES, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP, errno.EINVAL, errno.EMLINK, errno.EXDEV)
"""Errors of file systems that have no links.  Linux also refuses hard links to files of other users with them."""


def swap(stage: Path, results: Collection[str]) -> None:
    """Moves the files in STAGE/new into the folder of the stage, and removes those of `results` that are not among them.

    Raises OSError.  The folder is then as it was, or `settle` can still move all new files.
    """
    folder = stage.parent
    written = sorted(entry.name for entry in os.scandir(stage / NEW) if entry.is_file(follow_symlinks=False))
    removed = sorted(name for name in set(results).difference(written) if os.path.lexists(folder / name))
    for name in written:
        flush(stage / NEW / name)
    if os.name == "nt":
        _require_free(folder, [*written, *removed])
    if len(written) + len(removed) == 1:  # a single rename is one step
        _put(stage / NEW / (written or removed)[0], folder / (written or removed)[0])
    else:
        try:
            _link(stage, [*written, *removed])
        except (OSError, NotImplementedError) as e:
            _put_linked(stage, [*written, *removed])
            if isinstance(e, OSError) and e.errno not in WITHOUT_LINKS:
                raise
            _plan(stage, removed)
            _do_what_is_planned(stage, removed)
        else:
            _point(stage, NEW)
            _put_linked(stage, [*written, *removed])
    flush_folder(folder)


def settle(stage: Path) -> None:
    """Ends the swap of a process that was killed: all new files, or all earlier ones, become plain files of the folder.

    Raises OSError, before any change, where the stage is not as `swap` leaves it: it is no stage of a run, and should stay as it is.
    """
    folder = stage.parent
    _check_folders(stage)
    removed = _planned(stage)
    if os.path.lexists(stage / NOW):
        _put_linked(stage, [entry.name for entry in os.scandir(folder) if entry.is_symlink()])
    if removed is not None:
        _do_what_is_planned(stage, removed)


def _check_folders(stage: Path) -> None:
    """Raises OSError if the stage's links lead anywhere but into the stage."""
    if any((stage / name).is_symlink() for name in (OLD, NEW)):
        raise _no_stage(stage)
    if os.path.lexists(stage / NOW) and os.readlink(stage / NOW) not in (OLD, NEW):
        raise _no_stage(stage)


def _planned(stage: Path) -> list[str] | None:
    """The list of files to be removed, None if there is none.  Raises OSError if it is not one that `_plan` writes."""
    plan = stage / TODO
    if not os.path.lexists(plan):
        return None
    found = plan.lstat()
    if not stat.S_ISREG(found.st_mode) or found.st_size > PLAN_BYTES:
        raise _no_stage(stage)
    try:
        removed = json.loads(plan.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):
        raise _no_stage(stage) from None
    if not isinstance(removed, list) or not all(map(_is_plain_name, removed)):
        raise _no_stage(stage)
    return removed


def _is_plain_name(name: object) -> bool:
    """Whether this is the name of a file in the folder, and leads nowhere else."""
    if not isinstance(name, str) or name in ("", "..") or "\0" in name or Path(name).name != name:
        return False
    try:
        os.fsencode(name)
    except UnicodeEncodeError:  # half of a character, which JSON can hold
        return False
    return True


def _no_stage(stage: Path) -> OSError:
    return OSError(errno.EINVAL, "no stage of a run", os.fspath(stage))


def _link(stage: Path, names: list[str]) -> None:
    """Replaces the names in the folder by links to their earlier files.  Links of files that were not there lead nowhere yet."""
    if os.name == "nt":  # a link to a folder is another thing there than one to a file, and few may make either
        raise NotImplementedError
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
    """Makes `now` lead to `to`, in one step."""
    os.symlink(to, stage / "next")
    os.replace(stage / "next", stage / NOW)
    flush_folder(stage)


def _put_linked(stage: Path, names: list[str]) -> None:
    """Replaces links into the stage by the files to which they lead.  Links that lead nowhere are removed."""
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
    """Moves a file to its place.  If there is no such file, removes what is at the place."""
    if os.path.lexists(source):
        patiently(os.replace, source, place)
    else:
        place.unlink(missing_ok=True)


def _require_free(folder: Path, names: list[str]) -> None:
    """Raises OSError if another program has one of the files open, which Windows then doesn't replace: so all stay as they are."""
    for name in names:
        with contextlib.suppress(FileNotFoundError):
            patiently(os.rename, folder / name, folder / name)


def _plan(stage: Path, removed: list[str]) -> None:
    """Writes the list of files to be removed, in one step: from then on `settle` ends the swap."""
    (stage / "plan").write_text(json.dumps(removed), encoding="utf-8")
    flush(stage / "plan")
    flush_folder(stage / NEW)
    os.replace(stage / "plan", stage / TODO)
    flush_folder(stage)


def _do_what_is_planned(stage: Path, removed: list[str]) -> None:
    """Renames the new files, and removes those of the list.  Can be repeated after it was stopped."""
    folder = stage.parent
    for name in os.listdir(stage / NEW):
        patiently(os.replace, stage / NEW / name, folder / name)
    for name in removed:
        (folder / name).unlink(missing_ok=True)
    os.unlink(stage / TODO)


def flush(file: Path) -> None:
    """Waits until a file is on the disk.  Raises OSError: some file systems report a full disk only here."""
    handle = os.open(file, os.O_RDWR if os.name == "nt" else os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def flush_folder(folder: Path) -> None:
    """Waits until the names in a folder are on the disk.  Some systems can't do that."""
    with contextlib.suppress(OSError):
        flush(folder)
