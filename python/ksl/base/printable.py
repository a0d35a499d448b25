"""Text of files on a terminal: names must not move the cursor, change colours, or turn the direction of reading.

What is replaced: the control characters of ASCII and C1, separators of lines and paragraphs, marks and overrides of the
direction (U+202E and its like, see Unicode Technical Report 36), invisible characters, and surrogates, by which Python represents
bytes of paths that are not UTF-8.  Each becomes its number, `\\x1b` or `\\u202e`.  The second form stands for the same character in
JSON and TOML, which `ksl` prints too.
"""

from __future__ import annotations

import re
from typing import Any

from ksl.base.limits import MESSAGE_LENGTH

_INVISIBLE = "\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb\ud800-\udfff"
_UNSAFE = re.compile(f"[\\x00-\\x08\\x0b-\\x1f\\x7f-\\x9f{_INVISIBLE}]")
_UNSAFE_IN_LINE = re.compile(f"[\\x00-\\x1f\\x7f-\\x9f{_INVISIBLE}]")


def _number(found: re.Match[str]) -> str:
    code = ord(found[0])
    return f"\\x{code:02x}" if code < 0x20 else f"\\u{code:04x}"


def printable(text: str) -> str:
    """The text for a terminal.  Line ends and tabs stay.  O(length)."""
    return _UNSAFE.sub(_number, text)


def one_line(text: str) -> str:
    """The text for a terminal, as one line: line ends and tabs become numbers, too."""
    return _UNSAFE_IN_LINE.sub(_number, text)


def sentence(text: str) -> str:
    """A message: as :func:`one_line`, and of at most `MESSAGE_LENGTH` characters, whatever names it holds.  O(length)."""
    line = one_line(text)
    if len(line) <= MESSAGE_LENGTH:
        return line
    tail = MESSAGE_LENGTH // 4
    head = MESSAGE_LENGTH - tail - 50  # for the words between them
    return f"{line[:head]} … ({len(line) - head - tail:,} characters) … {line[-tail:]}"


class PrintableStream:
    """A stream of text that makes all that is written to it printable.  Rich, which writes colours, uses the stream behind it."""

    def __init__(self, stream: Any) -> None:
        self.rich_proxied_file = stream
        """The name by which rich looks for it."""

    def write(self, text: str) -> int:
        self.rich_proxied_file.write(printable(text))
        return len(text)

    def writelines(self, lines: Any) -> None:
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.rich_proxied_file, name)
