"""Which files an MJCF file reads besides itself: other MJCF that it includes or attaches, and meshes and height fields, which give inertia.

MuJoCo doesn't say what it has read.  These are all files that exist where it may look, so that none is missed: beside the first file,
beside the file that names them, in the folders of its compiler's options, with and without the path in their names.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from io import BytesIO
from xml.etree import ElementTree

from ksl.base.files_read import InputFile, changed, note, sha256_of, state_of

XML = ("include", "model")
"""Elements that name other MJCF."""

DRAWN = ("texture", "skin", "material")
"""Elements whose files are only drawn."""

FOLDERS = ("meshdir", "assetdir", "texturedir")


class FilesOfMjcf:
    """What a file reads, before MuJoCo reads it; `inputs` are their hashes, if they are the same afterwards."""

    def __init__(self, file: str, contents: bytes, text: bool) -> None:
        """text: `contents` are no file's, and other files are looked for in the current folder."""
        self._file = file
        own = [] if text else [("robot", file)]
        named = [*own, *_named_by("" if text else file, contents)]
        states = [(role, path, state_of(path)) for role, path in named]
        self._files = [(role, path, state, None if state is None else sha256_of(state)) for role, path, state in states]

    def inputs(self, error: type[ValueError]) -> tuple[InputFile, ...]:
        """Raises `error` if one has changed since."""
        for _, path, state, _ in self._files:
            if state is not None and state_of(path) != state:
                raise error(changed(path, "while it was read"))
        found = tuple(InputFile(role, path, sha256) for role, path, _, sha256 in self._files)
        for one in found:
            note(one, error)
        return found


def _named_by(file: str, contents: bytes) -> Iterable[tuple[str, str]]:
    """(role, path) of the files that exist, each once."""
    main = os.path.dirname(file)
    waiting, folders, names = [(main, contents)], {main}, []
    found: dict[str, str] = {}
    while waiting:
        beside, xml = waiting.pop()
        for element in _elements(xml):
            folders |= {os.path.join(main, element.get(key, "")) for key in FOLDERS if element.get(key)}
            given = [value for key, value in element.items() if key.startswith("file") and value]
            if element.tag in XML:
                for path in _existing(given, {main, beside}):
                    if path not in found:
                        found[path] = "included"
                        waiting.append((os.path.dirname(path), _bytes(path)))
            elif element.tag not in DRAWN:
                names += [(beside, value) for value in given]
    for beside, value in names:
        for path in _existing([value], {beside, *folders}):
            found.setdefault(path, "mesh")
    found.pop(os.path.normpath(file), None)
    return ((role, path) for path, role in found.items())


def _elements(xml: bytes) -> list[ElementTree.Element]:
    try:
        return [element for _, element in ElementTree.iterparse(BytesIO(xml), events=("start",))]
    except (ElementTree.ParseError, ValueError, LookupError):
        return []  # MuJoCo says what is wrong with it


def _existing(names: Iterable[str], folders: Iterable[str]) -> list[str]:
    """Paths of files with these names, or with their last parts, in these folders."""
    tried = (
        os.path.normpath(os.path.join(folder, part)) for name in names for part in dict.fromkeys((name, os.path.basename(name))) for folder in sorted(folders)
    )
    return [path for path in dict.fromkeys(tried) if "\0" not in path and os.path.isfile(path)]


def _bytes(path: str) -> bytes:
    try:
        with open(path, "rb") as source:
            return source.read()
    except OSError:
        return b""
