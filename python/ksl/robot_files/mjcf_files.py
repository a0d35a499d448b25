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
from ksl.robot_files.mjcf_amounts import KINDS, Amount, Kind, asked, copies_of

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
        self.amounts: list[Amount] = []
        """What its text, or the PNG files that it names, ask MuJoCo to make."""
        named = [*own, *_named_by("" if text else file, contents, self.amounts)]
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


def _named_by(file: str, contents: bytes, amounts: list[Amount]) -> Iterable[tuple[str, str]]:
    """(role, path) of the files that exist, each once.  amounts: takes what they ask for."""
    main = os.path.dirname(file)
    waiting, folders, names = [(main, contents, 1)], {main}, []
    pictures: list[tuple[Kind, str, str, str]] = []
    found: dict[str, str] = {}
    while waiting:
        beside, xml, outer = waiting.pop()
        elements = _elements(xml)
        for element, copies in elements:
            folders |= {os.path.join(main, element.get(key, "")) for key in FOLDERS if element.get(key)}
            given = [value for key, value in element.items() if key.startswith("file") and value]
            amounts += asked(element, copies * outer, len(elements))
            if element.tag in KINDS:
                pictures += [(KINDS[element.tag], element.get("name", ""), beside, value) for value in given]
            if element.tag in XML:
                for path in _existing(given, {main, beside}):
                    if path not in found:
                        found[path] = "included"
                        waiting.append((os.path.dirname(path), _bytes(path), copies * outer))
            elif element.tag not in DRAWN:
                names += [(beside, value) for value in given]
    for beside, value in names:
        for path in _existing([value], {beside, *folders}):
            found.setdefault(path, "mesh")
    for kind, name, beside, value in pictures:
        amounts += [Amount(kind, name, _size_of_png(path)) for path in _existing([value], {beside, *folders})]
    found.pop(os.path.normpath(file), None)
    return ((role, path) for path, role in found.items())


def _size_of_png(path: str) -> tuple[int, int]:
    """Rows and columns by its header; zeros of what is no PNG, whose files are as long as their numbers."""
    header = _bytes(path, 24)
    return (int.from_bytes(header[20:24], "big"), int.from_bytes(header[16:20], "big")) if header.startswith(b"\x89PNG\r\n\x1a\n") else (0, 0)


def _elements(xml: bytes) -> list[tuple[ElementTree.Element, int]]:
    """All elements, with the number of copies that those around them make of them."""
    found, copies = [], [1]
    try:
        for event, element in ElementTree.iterparse(BytesIO(xml), events=("start", "end")):
            if event == "end":
                copies.pop()
            else:
                found.append((element, copies[-1]))
                copies.append(copies[-1] * copies_of(element))
    except (ElementTree.ParseError, ValueError, LookupError):
        return []  # MuJoCo says what is wrong with it
    return found


def _existing(names: Iterable[str], folders: Iterable[str]) -> list[str]:
    """Paths of files with these names, or with their last parts, in these folders."""
    tried = (
        os.path.normpath(os.path.join(folder, part)) for name in names for part in dict.fromkeys((name, os.path.basename(name))) for folder in sorted(folders)
    )
    return [path for path in dict.fromkeys(tried) if "\0" not in path and os.path.isfile(path)]


def _bytes(path: str, most: int = -1) -> bytes:
    try:
        with open(path, "rb") as source:
            return source.read(most)
    except OSError:
        return b""
