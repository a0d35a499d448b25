"""Tags that are not closed, or close nothing.

The XML parser's own recovery closes the wrong element at the first such mistake, so that all that follows is in the
wrong place.
An element that is not closed nearly always ends where its parent does, or where an element begins that can't stand in
it: in URDF a
<link> in a <link>.  So it is closed there, and the rest can be checked.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping

from ksl.checks.description.robot import Note

TOKEN = re.compile(r"<!--|<!\[CDATA\[|<\?|<!|</([A-Za-z_][\w:.\-]*)\s*>|<([A-Za-z_][\w:.\-]*)(?![\w:.\-])((?:\"[^\"<]*\"|'[^'<]*'|[^\"'<>])*)>")
SKIPPED = {"<!--": "-->", "<![CDATA[": "]]>", "<?": "?>", "<!": ">"}


def balanced(text: str, vocabulary: Mapping[str, Collection[str]]) -> tuple[str, list[Note], bool]:
    """(text with tags closed where they were not, what was found, whether the file ends before its root element does).

    vocabulary: {element: elements that may stand in it}; of elements that it lacks anything may.
    Nothing moves to another line.  Cost: O(length).
    """
    plain = _balanced(text, {})
    if not plain[1]:
        return plain
    by_words = _balanced(text, vocabulary)
    return by_words if len(by_words[1]) <= len(plain[1]) else plain


def end_of_root(data: bytes) -> int:
    """Where the root element of a well-formed file ends: behind the last tag that is in no comment or instruction.  O(length)."""
    text = data.decode("iso-8859-1")  # a character for each byte
    at = end = 0
    while token := TOKEN.search(text, at):
        at = token.end()
        if token[0] in SKIPPED:
            at = text.find(SKIPPED[token[0]], at) + 1 or len(text)
        else:
            end = at
    return end


def elements(text: str) -> Iterator[tuple[str, str, int]]:
    """(name, attributes as they are written, line) of all opening tags that are in no comment.  O(length)."""
    at, line, counted = 0, 1, 0
    while token := TOKEN.search(text, at):
        line += text.count("\n", counted, token.start())
        counted, at = token.start(), token.end()
        if token[0] in SKIPPED:
            at = text.find(SKIPPED[token[0]], at) + 1 or len(text)
        elif token[2]:
            yield token[2], token[3], line


class _Mender:
    """Copies a text, and closes what is open where that is asked for."""

    def __init__(self, text: str) -> None:
        self.text, self.parts, self.done = text, list[str](), 0
        self.notes: list[Note] = []
        self.open: list[tuple[str, int]] = []
        self.opened: dict[str, int] = {}
        """How many elements of each name are open."""

    def begin(self, name: str, line: int) -> None:
        self.open.append((name, line))
        self.opened[name] = self.opened.get(name, 0) + 1

    def end(self) -> tuple[str, int]:
        name, line = self.open.pop()
        self.opened[name] -= 1
        return name, line

    def copy_to(self, end: int) -> None:
        self.parts.append(self.text[self.done : end])
        self.done = end

    def close_down_to(self, depth: int, place: int, line: int, before: str) -> None:
        """Closes the elements that are open beyond a depth, at a place of the text."""
        if len(self.open) > depth:
            self.copy_to(place)
        while len(self.open) > depth:
            name, opened = self.end()
            self.notes.append(Note(line, f"<{name}> of line {opened} is not closed before {before}"))
            self.parts.append(f"</{name}>")


def _balanced(text: str, vocabulary: Mapping[str, Collection[str]]) -> tuple[str, list[Note], bool]:
    mend = _Mender(text)
    at, line, counted = 0, 1, 0
    while token := TOKEN.search(text, at):
        line += text.count("\n", counted, token.start())
        counted, at = token.start(), token.end()
        closing, opening, attributes = token.groups()
        if token[0] in SKIPPED:
            end = text.find(SKIPPED[token[0]], at)
            if end < 0:
                mend.notes.append(Note(line, f"{token[0]} is not ended by {SKIPPED[token[0]]}"))
                mend.copy_to(token.start())
                mend.done = len(text)
                break
            at = end + len(SKIPPED[token[0]])
        elif opening:
            mend.close_down_to(_depth_for(opening, mend.open, vocabulary), token.start(), line, f"<{opening}>")
            if not attributes.endswith("/"):
                mend.begin(opening, line)
        else:
            if not mend.opened.get(closing):
                mend.notes.append(Note(line, f"</{closing}> closes nothing", removed=True))
                mend.copy_to(token.start())
                mend.done = at
            else:
                depth = next(i for i in range(len(mend.open), 0, -1) if mend.open[i - 1][0] == closing)
                mend.close_down_to(depth, token.start(), line, f"</{closing}>")
                mend.end()
    return _ended(mend)


def _depth_for(name: str, opened: list[tuple[str, int]], vocabulary: Mapping[str, Collection[str]]) -> int:
    """How many of the open elements stay open when an element of this name begins: down to one in which it may
    stand."""
    for depth in range(len(opened), max(0, len(opened) - 8), -1):
        allowed = vocabulary.get(opened[depth - 1][0])
        if allowed is None:
            return len(opened)  # whatever it is, it may stand in an element that the vocabulary doesn't know
        if name in allowed:
            return depth
    return len(opened)


def _ended(mend: _Mender) -> tuple[str, list[Note], bool]:
    """The end of the text, closed if it was cut off."""
    text, rest = mend.text, mend.text[mend.done :]
    if not mend.open:
        return "".join([*mend.parts, rest]), mend.notes, False
    last = text.count("\n") + (not text.endswith("\n"))
    root, opened = mend.open[0]
    mend.notes.append(Note(last, f"the file ends before <{root}> of line {opened} is closed"))
    whole = rest.rfind("<") if rest.rfind("<") > rest.rfind(">") else len(rest)  # without a tag that is cut off
    return "".join([*mend.parts, rest[:whole], *(f"</{name}>" for name, _ in reversed(mend.open))]), mend.notes, True
