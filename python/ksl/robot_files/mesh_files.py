"""Mesh files that robots name: where they are, and how large the mesh is.  Only as much of a file is read as the
answer needs."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from ksl.base.limits import MESH_ARCHIVE, megabytes

Array = NDArray[np.float64]

SEARCHED = (("ROS_PACKAGE_PATH", ""), ("AMENT_PREFIX_PATH", "share"), ("CMAKE_PREFIX_PATH", "share"), ("GAZEBO_MODEL_PATH", ""), ("GZ_SIM_RESOURCE_PATH", ""))
"""Environment variables that hold folders of packages, and where below each folder the packages are."""

PACKED = (b"PK\x03\x04", b"\x1f\x8b", b"BZh", b"\xfd7zXZ")
"""How archives and compressed files begin."""

SAMPLED = 3000
"""Triangles of an STL file, spread evenly, that its extent is taken from."""
TEXT_READ = 1 << 20
"""Bytes of a text file of vertices that its extent is taken from."""


def package_of(uri: str) -> tuple[str, str] | None:
    """(package, path in it) of package://NAME/PATH and model://NAME/PATH, also with a slash too many; None of other
    names."""
    scheme, separator, rest = uri.partition("://")
    if not separator or scheme not in ("package", "model"):
        return None
    package, _, path = rest.lstrip("/").partition("/")
    return package, path


def path_of_uri(uri: str, on_windows: bool = os.name == "nt") -> str:
    """The path of file://PATH, whose %20 and the like stay.  On Windows file:///C:/arm.stl is C:/arm.stl."""
    path = uri.removeprefix("file://")
    return path[1:] if on_windows and path[:1] == "/" and path[2:3] == ":" else path


def package_folders(package: str, robot: Path, package_paths: Sequence[str | os.PathLike[str]] = ()) -> list[Path]:
    """Folders of a ROS package that exist, in this order: below a given path, or that path itself; around the robot
    file; in
    ROS_PACKAGE_PATH and AMENT_PREFIX_PATH (and their likes of catkin and Gazebo)."""
    environment = tuple(os.environ.get(variable, "") for variable, _ in SEARCHED)
    return _package_folders(package, robot, tuple(map(Path, package_paths)), environment)


def forget_folders() -> None:
    """Packages are looked for again: folders may have come or gone."""
    _package_folders.cache_clear()
    _declares.cache_clear()


@lru_cache(maxsize=1024)
def _package_folders(package: str, robot: Path, package_paths: tuple[Path, ...], environment: tuple[str, ...]) -> list[Path]:
    candidates: list[Path] = []
    for path in package_paths:
        candidates += [path / package, path / "share" / package]
    for folder in robot.resolve().parents:
        candidates += [folder / package] + ([folder] if folder.name == package or _declares(folder, package) else [])
    for (_, below), value in zip(SEARCHED, environment):
        for path in map(Path, filter(None, value.split(os.pathsep))):
            candidates += [path / below / package] + ([path] if path.name == package else [])
    candidates += package_paths  # a folder that is named is the package where nothing better is
    return [folder for folder in dict.fromkeys(candidates) if _is_folder(folder)] if package else []


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:  # a name too long
        return False


@lru_cache(maxsize=1024)
def _declares(folder: Path, package: str) -> bool:
    """Whether package.xml of this folder says that it is the package."""
    try:
        return f"<name>{package}</name>" in (folder / "package.xml").read_text(encoding="utf-8", errors="replace")[:10_000]
    except OSError:
        return False


def find_mesh(uri: str, robot: Path, package_paths: Sequence[str | os.PathLike[str]] = ()) -> Path | None:
    """The file that a mesh's name in a robot file means, or None: package://, model://, file://, an absolute path, or
    one relative to
    the robot file.  A path relative to a package path is found too."""
    named = package_of(uri)
    if named:
        candidates = [folder / named[1] for folder in package_folders(named[0], robot, package_paths)]
    elif uri.startswith("file://"):
        candidates = [Path(unquote(path_of_uri(uri))), Path(path_of_uri(uri))]
    else:
        uri = uri.replace("\\", "/") if "/" not in uri else uri  # written on Windows
        candidates = [robot.parent / uri, *(Path(path) / uri for path in package_paths)]
    try:
        return next((path for path in candidates if path.is_file()), None)
    except (OSError, ValueError):  # a name too long, or with a zero byte
        return None


def same_but_for_capitals(missing: Path) -> Path | None:
    """A file of this name in other capitals, in folders that may have other capitals too; None if there isn't exactly
    one way."""
    there = Path(missing.anchor)
    try:
        for part in missing.parts[1:]:
            if not (there / part).exists():
                near = [name for name in os.listdir(there) if name.lower() == part.lower()]
                if len(near) != 1:
                    return None
                part = near[0]
            there = there / part
        return there if there != missing and there.is_file() else None
    except (OSError, ValueError):  # a name too long, or with a zero byte
        return None


@lru_cache(maxsize=4096)
def mesh_fault(path: Path) -> str | None:
    """What makes a mesh file unreadable, from its size and first bytes; None if nothing does."""
    try:
        if path.exists() and not path.is_file():  # a pipe would block
            return "is a folder" if path.is_dir() else "is a pipe or device, not a file"
        with open(path, "rb") as file:
            head, size = file.read(512), os.fstat(file.fileno()).st_size
    except OSError as e:
        return f"can't be read ({os.strerror(e.errno) if e.errno else e})"
    if not size:
        return "is empty"
    if head.startswith(b"version https://git-lfs"):
        return "is a pointer of Git LFS, not the mesh; fetch it with git lfs pull"
    if head.startswith(PACKED) and (fault := _archive_fault(path, head)):
        return fault
    suffix = path.suffix.lower()
    if suffix == ".stl":
        return _stl_fault(head, size)
    if suffix == ".dae" and b"<COLLADA" not in head and b"<?xml" not in head:
        return "is no Collada file: it doesn't begin as XML"
    if suffix == ".obj" and b"\0" in head:
        return "is no OBJ file: it is not text"
    if suffix in (".glb",) and head[:4] != b"glTF":
        return "is no glTF file"
    return None


def _archive_fault(path: Path, head: bytes) -> str | None:
    """3MF and zipped Collada are archives, too; they may unpack to any size."""
    if not head.startswith(PACKED[0]):
        return "is compressed; unpack it"
    try:
        with zipfile.ZipFile(path) as archive:  # no more is unpacked of a member than this says
            unpacked = sum(member.file_size for member in archive.infolist())
    except (zipfile.BadZipFile, OSError, ValueError):
        return "is a broken archive; export it again"
    return (
        f"is an archive of {megabytes(unpacked)}, and {megabytes(MESH_ARCHIVE)} are the most that are unpacked; export it as STL or OBJ"
        if unpacked > MESH_ARCHIVE
        else None
    )


def _stl_fault(head: bytes, size: int) -> str | None:
    if _is_binary_stl(head, size):
        return None
    if head.lstrip()[:5].lower() == b"solid":
        return None
    if size < 84:
        return f"is no STL file: it has {size} bytes, expected at least 84"
    count = int.from_bytes(head[80:84], "little")
    return f"is cut short or no STL file: {count} triangles take {84 + 50 * count} bytes, it has {size}"


def _is_binary_stl(head: bytes, size: int) -> bool:
    """By the size that the number of triangles asks for: the first word of a binary file may be "solid", too."""
    return len(head) >= 84 and 84 + 50 * int.from_bytes(head[80:84], "little") <= size and not _is_text(head)


def _is_text(head: bytes) -> bool:
    return head.lstrip()[:5].lower() == b"solid" and b"facet" in head


@lru_cache(maxsize=4096)
def mesh_bounds(path: Path) -> Array | None:
    """(2, 3): least and largest coordinates in the file's own units and axes, of STL and OBJ files, from a sample of
    the vertices.

    None for other formats (Collada places its meshes by transformations), and for files without vertices.
    """
    try:
        suffix = path.suffix.lower()
        if suffix == ".stl":
            points = _stl_points(path)
        elif suffix == ".obj":
            points = _text_points(path, b"v ")
        else:
            return None
    except (OSError, ValueError):
        return None
    points = points[np.isfinite(points).all(axis=1)]
    return None if not len(points) else np.array([points.min(axis=0), points.max(axis=0)], dtype=float)


def _stl_points(path: Path) -> Array:
    with open(path, "rb") as file:
        head, size = file.read(512), os.fstat(file.fileno()).st_size
    if not _is_binary_stl(head, size):
        return _text_points(path, b"vertex ")
    count = int.from_bytes(head[80:84], "little")
    triangle = np.dtype([("normal", "<f4", 3), ("points", "<f4", (3, 3)), ("attribute", "<u2")])
    triangles = np.memmap(path, triangle, "r", 84, (count,)) if count else np.empty(0, triangle)
    return np.asarray(triangles[:: max(1, count // SAMPLED)]["points"], dtype=float).reshape(-1, 3)


def _text_points(path: Path, word: bytes) -> Array:
    """Vertices of lines that begin with a word.  Of a long file, those in 16 windows spread over it."""
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        if size <= TEXT_READ:
            lines = file.read().splitlines()
        else:
            lines = []
            for start in np.linspace(0, size - TEXT_READ // 16, 16).astype(int):
                file.seek(start)
                lines += file.read(TEXT_READ // 16).splitlines()[1:-1]
    rows = [line.split()[1:4] for line in map(bytes.lstrip, lines) if line.startswith(word)]
    return np.array([row for row in rows if len(row) == 3], dtype=float).reshape(-1, 3)
