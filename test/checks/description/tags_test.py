"""Tags that are not closed: what is found, in which line, and what the file is taken for."""

import re
from xml.etree import ElementTree

import pytest
from files import ARM

from growth import assert_linear, work
from ksl.checks.description import tags
from ksl.checks.description.tags import balanced
from ksl.checks.description.vocabulary import ELEMENTS
from regex_steps import count_patterns


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
    text = ARM.replace("<!-- an arm -->", "<!-- <link> --><![CDATA[<x>]]><?y <z> ?>").replace('name="arm"', 'name="a/>rm"')
    assert balanced(text, ELEMENTS) == (text, [], False)


def test_a_file_that_ends_too_early():
    for text in (ARM[: ARM.index("</link>")], ARM[: ARM.index("<mass") + 8], ARM[: ARM.index("<axis")].rstrip() + "\n"):
        mended, notes, cut = balanced(text, ELEMENTS)
        assert (
            cut
            and len(notes) == 1
            and notes[0].line == len(text.splitlines())
            and notes[0].found.startswith("the file ends before <robot>")
            and ElementTree.fromstring(mended).tag == "robot"
        )
    assert balanced("<!-- never ended", {})[1][0].found == "<!-- is not ended by -->"


def test_text_behind_the_last_tag_stays():
    assert balanced("<robot></x>abc", ELEMENTS)[0] == "<robot>abc</robot>" and balanced("<robot>abc", ELEMENTS)[0] == "<robot>abc</robot>"


def test_what_is_missing_behind_the_end_is_not_reported(check):
    findings = check(ARM[: ARM.index('<joint name="elbow"')])
    assert findings.rules == {"xml-syntax": 1} and "link-unreachable" in findings.not_checked[0]


@pytest.mark.parametrize("parts", [("<a",), ("<a b='",), ("<!--",), ('<a b="c>',), ("</a>",), ("<a>",), ("<a>", "</b>"), ("<a>", "</a>"), ("<", "a")])
def test_work_is_linear_in_length(parts, monkeypatch):
    text = lambda n: "".join(part * n for part in parts)
    assert_linear(lambda n: work(lambda: balanced(text(n), ELEMENTS)), 50)
    steps = count_patterns(monkeypatch, tags)

    def search(n: int) -> int:
        before = steps()
        balanced(text(n), ELEMENTS)
        return steps() - before

    assert_linear(search, 25)
