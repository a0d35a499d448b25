"""Compiled code in the user's cache folder: KEY.so, or KEY.cubin for a graphics card, and, beside it, its SHA-256.

What lies there is loaded into the process.  So the folder is the user's own, and nobody else may write to it; a library that belongs to somebody
else, or that isn't what was written, is not loaded.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from ksl.base.errors import CompilerError

VARIABLE = "KSL_CACHE"
MOST_BYTES = 256 << 20
"""All libraries together have so many; those that were used longest ago go first."""
SUFFIX = ".dll" if sys.platform == "win32" else ".so"
CARD_SUFFIX = ".cubin"


def cache_folder() -> Path:
    """The folder, made if it is missing.  Raises CompilerError where it isn't the user's own."""
    folder = Path(os.environ.get(VARIABLE) or _usual())
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.stat()
    except OSError as error:
        raise CompilerError(f"{folder}: {error.strerror}; name another folder for compiled code in the variable {VARIABLE}") from None
    if hasattr(os, "getuid"):
        if found.st_uid != os.getuid():
            raise CompilerError(f"{folder}: belongs to somebody else; code isn't loaded from there. Name a folder of your own in the variable {VARIABLE}")
        if found.st_mode & 0o077:
            folder.chmod(0o700)
            if found.st_mode & 0o022:  # somebody else could have put code there
                for path in folder.iterdir():
                    _remove(path)
    return folder


def _usual() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData/Local") / "ksl" / "code"
    if sys.platform == "darwin":
        return Path.home() / "Library/Caches/ksl/code"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ksl" / "code"


def cached(key: str, make: Callable[[Path, Path, Path], None], text: str, suffix: str = SUFFIX) -> Path:
    """The library of this key; make(source, library, kept) compiles it where it isn't there, or isn't what was written.  kept: where the source stays if
    that fails; "" has none."""
    folder = cache_folder()
    library = folder / f"{key}{suffix}"
    if _is_whole(library):
        with contextlib.suppress(OSError):
            os.utime(library)
        return library
    try:
        with tempfile.TemporaryDirectory(dir=folder, prefix="making-") as place:
            source, made = Path(place) / "code.c", Path(place) / f"code{suffix}"
            source.write_text(text, encoding="ascii", newline="\n")
            kept = folder / f"failed-{key[:16]}.c"
            try:
                make(source, made, kept)
            except CompilerError:
                if text:
                    os.replace(source, kept)
                raise
            _said(library).write_text(_hash(made), encoding="ascii")
            os.replace(made, library)  # whole, or not at all: other processes may load it
    except OSError as error:
        raise CompilerError(
            f"{error.filename2 or error.filename or folder}: {error.strerror}; make room there, or name another folder for compiled code in the variable {VARIABLE}"
        ) from None
    _forget_oldest(folder, library)
    return library


def _said(library: Path) -> Path:
    return library.with_suffix(".sha256")


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _is_whole(library: Path) -> bool:
    """Is it a file of this user's that has the bytes that were written?"""
    try:
        found = library.lstat()
        own = not hasattr(os, "getuid") or found.st_uid == os.getuid()
        return stat.S_ISREG(found.st_mode) and own and _said(library).read_text(encoding="ascii") == _hash(library)
    except (OSError, UnicodeDecodeError):
        return False


def _forget_oldest(folder: Path, but: Path) -> None:
    """Keeps the cache below its bound."""
    kept: list[tuple[float, int, Path]] = []
    for path in (*folder.glob(f"*{SUFFIX}"), *folder.glob(f"*{CARD_SUFFIX}")):
        with contextlib.suppress(OSError):
            found = path.stat()
            kept.append((found.st_mtime, found.st_size, path))
    size = sum(bytes_ for _, bytes_, _ in kept)
    for _, bytes_, path in sorted(kept):
        if size <= MOST_BYTES:
            return
        if path != but:
            _remove(path)
            _remove(_said(path))
            size -= bytes_


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):
        path.unlink()
