"""Notes, doubts and warnings: sentences with a kind, so that who shows one asks its kind and not its words."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum


class NoteKind(Enum):
    """What a note is about, where something depends on it.  Other notes are plain strings."""

    VISUALS = "visuals of the robot's file, which the model doesn't use"
    CONTENT = "other content of the robot's file that is not used"
    COLUMN = "a column of a motion that is not used"
    TIME_UNIT = "the unit in which times were taken"
    MASSES = "inertias that no rigid body can have, and moving links without mass"
    HELD = "a load case at rest"
    SIMULATED = "a load case whose motion is computed"
    QUATERNION = "a quaternion that was normalised"
    STIFFNESS = "a stiffness that a model made from another one doesn't have"


class Note(str):
    """A sentence, what it is about, and of what.

    It is a string, since `Model.warnings`, `Motion.source.notes`, `Run.notes` and their like hold lines of text: they are printed, compared, sorted
    and written to JSON as before, and a note without a kind stays a plain `str`.  Read-only; text that is made from it, as by `f"{case}: {note}"`,
    has no kind.
    """

    __slots__ = ("_kind", "_of")
    _kind: NoteKind
    _of: str

    def __new__(cls, kind: NoteKind, text: str, of: str = "") -> Note:
        note = super().__new__(cls, text)
        note._kind, note._of = kind, of
        return note

    @property
    def kind(self) -> NoteKind:
        return self._kind

    @property
    def of(self) -> str:
        """The part of the sentence that names what is noted: a column, or content of a file."""
        return self._of

    def __reduce__(self) -> tuple[type[Note], tuple[NoteKind, str, str]]:
        return Note, (self._kind, str(self), self._of)


def of_kind(notes: Iterable[str], *kinds: NoteKind) -> list[Note]:
    """The notes of these kinds, in order."""
    return [note for note in notes if isinstance(note, Note) and note.kind in kinds]


def not_of_kind(notes: Iterable[str], *kinds: NoteKind) -> list[str]:
    """The others."""
    return [note for note in notes if not (isinstance(note, Note) and note.kind in kinds)]


def not_used(content: Note) -> Note:
    """The note of a run about content of the robot's file that is ignored, which `Model.unused` lists."""
    return Note(content.kind, f"in the file and not used: {content}", str(content))
