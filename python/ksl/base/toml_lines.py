"""Lines of keys in a TOML file: the parser of the standard library does not tell them, and messages should."""

from __future__ import annotations

import re

KEY = r"""(?:[\w-]+|"[^"]*"|'[^']*')"""
HEADER = re.compile(rf"\s*(\[\[?)\s*({KEY}(?:\s*\.\s*{KEY})*)\s*\]\]?")
ASSIGNMENT = re.compile(rf"\s*({KEY}(?:\s*\.\s*{KEY})*)\s*=")
PART = re.compile(KEY)

Path = tuple["str | int", ...]


def toml_lines(text: str) -> dict[Path, int]:
    """{path: line}, lines from 1, of tables and keys; tables of an array have their index in the path.

    For text that a TOML parser has accepted.  Keys inside of inline tables are not found; the line of their table is.
    Inside strings of several lines, what looks like a key is taken for one.  O(length).
    """
    lines: dict[Path, int] = {}
    counts: dict[Path, int] = {}
    table: Path = ()
    for number, line in enumerate(text.splitlines(), 1):
        header = HEADER.match(line)
        if header:
            table = _resolved(_parts(header[2]), counts, header[1] == "[[")
            lines.setdefault(table, number)
            continue
        assignment = ASSIGNMENT.match(line)
        if assignment:
            lines.setdefault((*table, *_parts(assignment[1])), number)
    return lines


def line_of(lines: dict[Path, int], *path: str | int) -> int | None:
    """The line of a key, or of the innermost table around it that has one."""
    for end in range(len(path), 0, -1):
        if path[:end] in lines:
            return lines[path[:end]]
    return None


def _parts(dotted: str) -> list[str]:
    return [part.strip("\"'") for part in PART.findall(dotted)]


def _resolved(parts: list[str], counts: dict[Path, int], appended: bool) -> Path:
    """The path of a table with the index of every array of tables on the way: its last element so far."""
    path: Path = ()
    for k, part in enumerate(parts):
        path = (*path, part)
        if appended and k == len(parts) - 1:
            counts[path] = counts.get(path, -1) + 1
        if path in counts:
            path = (*path, counts[path])
    return path
