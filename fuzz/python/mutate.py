"""Mutations that keep a text what it is: bytes that are changed at random mostly break a tag or a quote, which the reader
then says, and sees no more.  Some texts are changed by bytes all the same."""

from __future__ import annotations

import re
from collections.abc import Callable
from copy import copy
from random import Random
from typing import Any

import atheris
import guided
from lxml import etree

NUMBERS = ["0", "-1", "1", "2.5", "1e308", "-1e308", "1e-400", "1e400", "5e-324", "inf", "nan", "100000", "-0.0", "9.999"]
NAMES = ["a", "b", "A", " a", "", "left_a", "right_a", "world", "time", "true", "mesh.stl", "package://p/mesh.stl", "m.csv", "é", "＝1", "hip (deg)", "# [rad]"]
VALUES = [*NUMBERS, *NAMES, "0 0 1", "1 0 0", "0 0 0", "1e308 1e308 0", "0 0 0 1", "0 0 1e-300", "1,5"]
"""Numbers at the ends of their ranges, names, vectors."""
OF_TOML = ["[]", "[0, 1]", "[1, 2, 3]", "[1, 2, 3, 4, 5, 6]", "{}", "{ a = 1 }", '"a"', "''", "true", "false", "1979-05-27", "07:32:00", "0x10"]
TOKEN = re.compile(r"""\"[^"\n]*"|'[^'\n]*'|[+-]?\.?\d[\w.+-]*|\w+|\s+|.""")
PARSER = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, remove_comments=True, remove_pis=True)
BYTES = 6
"""One text of so many is changed by bytes."""

Mutator = Callable[[bytes, int, int], bytes]
_random = Random(1)


def of_text(data: bytes, most: int, seed: int) -> bytes:
    """Lines and words of TOML and CSV are removed, repeated, moved and replaced."""
    _random.seed(seed)
    if seed % BYTES == 0 or not data:
        return atheris.Mutate(data, most)
    lines = data.decode("utf-8", "surrogateescape").split("\n")
    for _ in range(_random.randint(1, 3)):
        at, other = _random.randrange(len(lines)), _random.choice(lines)
        way = _random.randrange(10)
        if way == 0 and len(lines) > 1:
            del lines[at]
        elif way == 1:
            lines.insert(at, other)
        elif way == 2:
            lines[at] = other
        else:
            lines[at] = _with_another_word(lines[at], other)
    made = "\n".join(lines).encode("utf-8", "surrogateescape")
    return made if 0 < len(made) <= most else atheris.Mutate(data, most)


def _with_another_word(line: str, other: str) -> str:
    """A word becomes one of its kind, mostly; or a value of TOML becomes another one, all of it."""
    tokens = TOKEN.findall(line)
    places = [i for i, token in enumerate(tokens) if token[0].isalnum() or token[0] in "\"'_+-."]
    if not places:
        return other
    at, way = _random.choice(places), _random.randrange(8)
    token = tokens[at]
    if way == 0:
        tokens[at : at + 2] = []
    elif way == 1 and "=" in line:
        return line.partition("=")[0] + "= " + _random.choice(OF_TOML)
    elif way == 2 and "=" in line and "=" in other:
        return line.partition("=")[0] + "=" + other.partition("=")[2]
    elif way == 3:
        tokens.insert(at, _random.choice(TOKEN.findall(other) or [","]))
    elif token[0] in "\"'":
        tokens[at] = f'"{_random.choice(guided.words() if way < 6 else NAMES)}"'
    elif token[0].isdigit() or token[0] in "+-.":
        tokens[at] = _random.choice(NUMBERS)
    else:
        tokens[at] = _random.choice(guided.words() if way < 6 else NAMES)
    return "".join(tokens)


def of_xml(data: bytes, most: int, seed: int) -> bytes:
    """Elements and attributes are removed, repeated, moved, renamed and replaced."""
    _random.seed(seed)
    if seed % BYTES:
        try:
            root = etree.fromstring(data, PARSER)
            for _ in range(_random.randint(1, 3)):
                _change(root)
            made: bytes = etree.tostring(root)
            if len(made) <= most:
                return made
        except (etree.XMLSyntaxError, ValueError):
            pass
    return atheris.Mutate(data, most)


def _change(root: Any) -> None:
    """One change.  Raises ValueError for words that XML can't have there."""
    elements = list(root.iter("*"))
    node, other = _random.choice(elements), _random.choice(elements)
    way = _random.randrange(10)
    if way == 0 and node is not root:
        node.getparent().remove(node)
    elif way in (1, 2):
        other.insert(0 if way == 1 else len(other), copy(node))
    elif way == 3 and other is not root:
        other.addnext(copy(node))
    elif way == 4:
        node.tag = other.tag
    elif way == 5:
        node.set(*_attribute(other))
    elif way == 6:
        node.set(_random.choice(guided.words()), _random.choice(VALUES))
    elif node.attrib and way < 9:
        name = _random.choice(list(node.attrib))
        node.set(name, _another_value(node.get(name), other))
    elif len(node) == 0:
        node.text = _another_value(node.text or "", other)


def _attribute(node: Any) -> tuple[str, str]:
    return _random.choice(node.items() or [("name", "a")])


def _another_value(value: str, other: Any) -> str:
    way = _random.randrange(5)
    if way == 0:
        return _attribute(other)[1]
    if way == 1:
        return _random.choice(guided.words())
    if way == 2:
        return atheris.Mutate(value.encode(), len(value.encode()) + 8).decode("utf-8", "ignore")
    if way == 3 and value:  # one word of several: a number of a vector
        words = value.split() or [""]
        words[_random.randrange(len(words))] = _random.choice(VALUES)
        return " ".join(words)
    return _random.choice(VALUES)
