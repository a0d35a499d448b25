"""What sentences of the compiled core are about.  It hands over text alone, so their words are looked at here and nowhere else in Python."""

from __future__ import annotations

import re
from collections.abc import Iterable

from ksl.base.notes import NoteKind, Note

_KINDS = (
    (NoteKind.MASSES, re.compile(r"link |none of the links")),
    (NoteKind.QUATERNION, re.compile(r"joint .*quaternion")),
    (NoteKind.STIFFNESS, re.compile(r"the stiffness of the joint that fixes link")),
)
"""How warnings begin."""
_NOT_EXPANDED = "run xacro first: xacro FILE > robot.urdf"


def warnings_of_core(lines: Iterable[str]) -> tuple[str, ...]:
    """Warnings of a model; those whose kind something depends on are notes."""
    return tuple(next((Note(kind, line) for kind, begin in _KINDS if begin.match(line)), line) for line in lines)


def unused_of_core(lines: Iterable[str]) -> tuple[Note, ...]:
    """Content of the robot's file that is not used, a note for each line."""
    return tuple(Note(NoteKind.VISUALS if line.startswith("visual (") else NoteKind.CONTENT, line, line) for line in lines)


def asks_for_xacro(error: ValueError) -> bool:
    """Is a file refused because it is a xacro that was not expanded?"""
    return str(error).endswith(_NOT_EXPANDED)


def lacks_link_of_payload(error: ValueError, link: str) -> bool:
    """Is a payload refused because the robot has no link of this name?"""
    return f"no link {link} to carry the payload" in str(error)


def with_file(file: str, error: ValueError) -> str:
    """The sentence of a refusal behind the name of the file.  The core's begin with it already, once the builder knows the file."""
    said = str(error)
    return said if not file or said.startswith(f"{file}:") else f"{file}: {said}"


def as_call(error: ValueError, was: str, call: str = "") -> str:
    """A sentence about one call, said of the call that made it, or of none."""
    return str(error).replace(f"{was}: ", f"{call}: " if call else "", 1)


def place_and_rest(refusal: str, file: str) -> tuple[int | None, str]:
    """The line of the file that a refusal names, or None, and what it says of it."""
    said = refusal.removeprefix(f"{file}:")
    line = re.match(r"(\d+):", said)
    return int(line[1]) if line else None, said[line.end() if line else 0 :].strip().removeprefix("file: ")
