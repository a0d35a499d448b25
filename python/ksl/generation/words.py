"""Names from a robot's file in C, CMake and Markdown.  They are hostile: none of them ends a comment or a string, or becomes code."""

from __future__ import annotations

import re
import unicodedata

WIDTH = 116
"""So many characters a line of generated comments and tables has at most, its indent apart."""
_PLAIN_IN_TEXT = re.compile(r"[A-Za-z0-9_ .,:;()+=\-]")
_PLAIN_IN_STRING = re.compile(rb"[A-Za-z0-9_ .,:;()+=\-/]")
_ASCII = str.maketrans({"–": "-", "−": "-", "…": "...", "≤": "<=", "⁻": "-", "×": "x", "·": " ", "’": "'", "Λ": "Lambda", "½": "1/2", "⊕": "(+)", "⊖": "(-)"})


def comment(name: str) -> str:
    """A name in a comment or a page: characters that could end it or join its lines are written as their numbers, `<U+002A>`."""
    return "".join(c if _PLAIN_IN_TEXT.fullmatch(c) else f"<U+{ord(c):04X}>" for c in name)


def string(name: str) -> str:
    """The inside of a C string: bytes of UTF-8, in octal where C could take them for something else, as `??/`."""
    raw = name.encode("utf-8", "surrogateescape")
    return "".join(chr(byte) if _PLAIN_IN_STRING.fullmatch(bytes([byte])) else f"\\{byte:03o}" for byte in raw)


def string_bytes(name: str) -> int:
    """What the string needs with its end."""
    return len(name.encode("utf-8", "surrogateescape")) + 1


def ascii_text(text: str) -> str:
    """Our own sentences for compilers that know ASCII alone."""
    return unicodedata.normalize("NFKD", text.translate(_ASCII)).translate(_ASCII).encode("ascii", "replace").decode("ascii")
