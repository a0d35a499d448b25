"""Notes have a kind, and errors name their argument; both keep them in another process."""

import pickle

import pytest
from ksl.base.errors import ArgumentError, SizingError, of_argument
from ksl.base.notes import NoteKind, Note, not_of_kind, not_used, of_kind


def test_a_note_is_a_string_with_a_kind():
    content = Note(NoteKind.VISUALS, "visual (3 links)", "visual (3 links)")
    note = not_used(content)
    assert note == "in the file and not used: visual (3 links)" and (note.kind, note.of) == (NoteKind.VISUALS, "visual (3 links)")
    again = pickle.loads(pickle.dumps(note))
    assert again == note and again.kind is note.kind and again.of == note.of
    assert of_kind(["plain", note], NoteKind.VISUALS) == [note] and not_of_kind(["plain", note], NoteKind.VISUALS) == ["plain"]
    with pytest.raises(AttributeError):
        note.kind = NoteKind.COLUMN


@pytest.mark.parametrize("error", [of_argument(ArgumentError, "axes", ": no such link", "tip"), of_argument(SizingError, "at", ": no joint named 'a'")])
def test_an_error_keeps_its_argument_in_another_process(error):
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.argument, again.shown, again.rest) == (type(error), str(error), error.argument, error.shown, error.rest)
