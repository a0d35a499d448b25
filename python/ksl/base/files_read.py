"""Files as they were read: their hashes are taken while they are read, and a file that changes meanwhile is refused.

    with recorded() as ledger:        # whoever says later what results were made of
        ...
        with being_read("motion", file, MotionError):    # in each reader
            ...
    ledger.files

Without a ledger nothing is hashed: programs that only read pay nothing.
"""

from __future__ import annotations

import hashlib
import os
import stat
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

from ksl.base.input_files import failed_read, what_os_says

SMALL = 1 << 20
"""Bytes of a file that is hashed at once; a thread does it for larger ones, while they are read."""


@dataclass(frozen=True)
class InputFile:
    """A file that a result depends on."""

    role: str
    """robot, included, mesh, loops, motion, map, external, cases, pose, components or results."""
    file: str
    sha256: str | None
    """The hash of its bytes, in hexadecimal digits.  None for what can't be read twice, such as a pipe."""


State = tuple[tuple[str, int, int, int, int, int], ...]
"""For each file: its name, the numbers of device and node, its size, and the times of the last changes of contents and node, ns."""


@dataclass
class Ledger:
    """The files that were read while it was the current one."""

    _by_path: dict[str, InputFile | None] = field(default_factory=dict)
    _open: set[str] = field(default_factory=set)

    @property
    def files(self) -> list[InputFile]:
        """In the order in which they were read first."""
        return [file for file in self._by_path.values() if file is not None]

    def expect(self, file: str) -> None:
        """Keeps a place for this file: what is read inside its block comes after it."""
        self._by_path.setdefault(os.path.abspath(file), None)

    def add(self, file: InputFile, error: type[ValueError]) -> None:
        """Raises `error` if another content of the file was read before."""
        path = os.path.abspath(file.file)
        before = self._by_path.get(path) or file
        self._by_path[path] = before
        if before.sha256 != file.sha256:
            raise error(changed(file.file, "since it was read first"))


_current: ContextVar[Ledger | None] = ContextVar("ledger", default=None)


@contextmanager
def recorded() -> Iterator[Ledger]:
    """Until the end of the block, files that are read enter this ledger, and then the one around it."""
    outer, ledger = _current.get(), Ledger()
    token = _current.set(ledger)
    try:
        yield ledger
    finally:
        _current.reset(token)
    if outer is not None:
        for file in ledger.files:
            outer.add(file, ValueError)


@contextmanager
def being_read(role: str, path: str | os.PathLike[str], error: type[ValueError]) -> Iterator[None]:
    """The block reads this file, or this folder's files.  Raises `error` if they change meanwhile, or if the system can't read them.

    A block inside another of the same file does nothing.
    """
    try:
        with _noted(role, path, error):
            yield
    except OSError as e:
        if not failed_read(e) or e.filename is not None:
            raise
        raise error(unreadable(os.fspath(path), e)) from None


@contextmanager
def _noted(role: str, path: str | os.PathLike[str], error: type[ValueError]) -> Iterator[None]:
    """`being_read` for the ledger."""
    ledger, file = _current.get(), os.fspath(path)
    if ledger is None or file in ledger._open:
        yield
        return
    ledger.expect(file)
    before = state_of(file)
    if before is None:
        yield
        ledger.add(InputFile(role, file, None), error)
        return
    ledger._open.add(file)
    digest = _Digest(before)
    try:
        yield
    except BaseException:
        digest.give_up()  # a file of gigabytes is refused at once
        raise
    finally:
        ledger._open.discard(file)
    sha256 = digest.result()
    if digest.failure is not None:
        raise digest.failure
    if sha256 is None or state_of(file) != before:
        raise error(changed(file, "while it was read"))
    ledger.add(InputFile(role, file, sha256), error)


def note(file: InputFile, error: type[ValueError]) -> None:
    """Enters a file whose bytes the reader itself has hashed."""
    ledger = _current.get()
    if ledger is not None:
        ledger.add(file, error)


def changed(file: str, when: str) -> str:
    """The sentence about a file that is another one now."""
    return f"{file}: has changed {when}; wait until it is complete, and run again"


def unreadable(file: str, failure: OSError) -> str:
    """The sentence about a file that the system can't read to its end."""
    return f"{file}: can't be read ({what_os_says(failure)}); copy it to a disk that can be read, and give the copy"


def state_of(file: str) -> State | None:
    """The state of a regular file, or of those in a folder.  None for what can't be read twice, or isn't there."""
    try:
        found = os.stat(file)
        names = [os.path.join(file, name) for name in sorted(os.listdir(file))] if stat.S_ISDIR(found.st_mode) else [file]
        states = [(name, os.stat(name)) for name in names]
    except (OSError, ValueError):
        return None
    if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):
        return None
    regular = [(name, s) for name, s in states if stat.S_ISREG(s.st_mode)]
    return tuple((name, s.st_dev, s.st_ino, s.st_size, s.st_mtime_ns, s.st_ctime_ns) for name, s in regular)


def sha256_of(files: State, given_up: threading.Event | None = None) -> str | None:
    """The SHA-256 of the bytes of all of them, one after the other.  None if it is given up, or if one isn't there any more."""
    digest = hashlib.sha256()
    try:
        for name, *_ in files:
            with open(name, "rb") as f:
                while chunk := f.read(1 << 20):
                    if given_up is not None and given_up.is_set():
                        return None
                    digest.update(chunk)
    except OSError as e:
        if failed_read(e) and e.filename is None:  # it was opened
            raise
        return None
    return digest.hexdigest()


class _Digest:
    """The hash of files, which a thread computes if they are large."""

    def __init__(self, files: State) -> None:
        self._files = files
        self._found: str | None = None
        self.failure: OSError | None = None
        self._given_up = threading.Event()
        large = sum(size for _, _, _, size, _, _ in files) > SMALL
        self._thread = threading.Thread(target=self._compute, daemon=True) if large else None
        if self._thread is not None:
            self._thread.start()

    def _compute(self) -> None:
        try:
            self._found = sha256_of(self._files, self._given_up)
        except OSError as e:
            self.failure = e

    def give_up(self) -> None:
        self._given_up.set()
        if self._thread is not None:
            self._thread.join()

    def result(self) -> str | None:
        if self._thread is None:
            self._compute()
        else:
            self._thread.join()
        return self._found
