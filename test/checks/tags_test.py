"""Tags that are not closed: what is found, in which line, and what the file is taken for."""

import re
from xml.etree import ElementTree

import pytest
from files import ARM

from ksl.checks.tags import balanced
from ksl.checks.vocabulary import ELEMENTS
from processor_time import usual_seconds


def without(tag, n=1):
    """The arm without its n-th closing tag of a name, and the line of that."""
    end = list(re.finditer(f"</{tag}>", ARM))[n - 1]
    return ARM[: end.start()] + ARM[end.end() :], ARM.count("\n", 0, end.start()) + 1


def test_a_sound_file_stays_as_it_is():
    assert balanced(ARM, ELEMENTS) == (ARM, [], False)


@pytest.mark.parametrize("tag", ["inertial", "collision", "geometry", "link", "joint"])
def test_an_element_that_is_not_closed_ends_with_its_parent(check, tag):
    text, line = without(tag)
    mended, (note,), cut = balanced(text, ELEMENTS)
    assert f"<{tag}> of line" in note.found and note.line >= line and not cut
    assert mended.count("\n") == ARM.count("\n") and mended.count(f"</{tag}>") == ARM.count(f"</{tag}>")
    findings = check(text)
    assert findings.rules == {"xml-syntax": 1} and findings[0].line == note.line


def test_a_tag_that_closes_nothing(check):
    text = ARM.replace("</inertial>", "</inertial></mass>", 1)
    assert balanced(text, ELEMENTS)[0] == ARM
    assert [f.found for f in check(text)] == ["</mass> closes nothing"]


def test_comments_and_other_parts_are_left_alone():
    text = ARM.replace("<!-- an arm -->", "<!-- <link> --><![CDATA[<x>]]><?y <z> ?>").replace(
        'name="arm"', 'name="a/>rm"'
    )
    assert balanced(text, ELEMENTS) == (text, [], False)


def test_a_file_that_ends_too_early():
    for text in (ARM[: ARM.index("</link>")], ARM[: ARM.index("<mass") + 8]):
        mended, notes, cut = balanced(text, ELEMENTS)
        assert (
            cut
            and len(notes) == 1
            and notes[0].found.startswith("the file ends before <robot>")
            and ElementTree.fromstring(mended).tag == "robot"
        )
    assert balanced("<!-- never ended", {})[1][0].found == "<!-- is not ended by -->"


def test_what_is_missing_behind_the_end_is_not_reported(check):
    findings = check(ARM[: ARM.index('<joint name="elbow"')])
    assert findings.rules == {"xml-syntax": 1} and "link-unreachable" in findings.not_checked[0]


def test_time_is_linear_in_length():
    def seconds(text):
        """The least of three: other programs only add to it."""
        return min(usual_seconds(lambda: balanced(text, ELEMENTS)) for _ in range(3))

    for pattern in (
        ("<a",),
        ("<a b='",),
        ("<!--",),
        ('<a b="c>',),
        ("</a>",),
        ("<a>",),
        ("<a>", "</b>"),
        ("<a>", "</a>"),
    ):
        short, long = ("".join(part * n for part in pattern) for n in (1_500, 15_000))
        assert seconds(long) < max(0.1, 40 * seconds(short)), pattern
