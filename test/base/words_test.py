"""Words of messages: numbers of things, lists of names that are cut, and where the methods of higher rooms are."""

import pytest

from ksl.base import higher_rooms
from ksl.base.words import count, listed, of_cases


def test_one_thing_and_several():
    assert [count(n, "sample") for n in (0, 1, 2)] == ["0 samples", "1 sample", "2 samples"]


def test_long_lists_say_how_many_more_there_are():
    assert listed(["a", "b"]) == "a, b" and listed(iter("abc"), 2) == "a, b and 1 more"
    assert listed(map(str, range(5000)), 1) == "0 and 4,999 more"


def test_a_function_of_a_higher_room_is_imported_when_it_is_used(monkeypatch):
    monkeypatch.setitem(higher_rooms.FUNCTIONS, "root", "math:sqrt")
    assert higher_rooms.function_of("root")(4) == 2
    with pytest.raises(KeyError):
        higher_rooms.function_of("no such method")


@pytest.mark.parametrize(("count", "said"), [(1, "a: x"), (4, "a, b, c, d: x"), (5, "a, b, c, d and 1 more: x"), (6, "x")])
def test_cases_that_say_something(count, said):
    """Are named, unless all of them say it."""
    assert of_cases([(name, "x") for name in "abcdef"[:count]], 6) == [said]
