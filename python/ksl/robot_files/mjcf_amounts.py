"""What a few words of an MJCF file ask MuJoCo to make: height fields, textures, copies and grids of any size, for which its compiler takes any amount of memory."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import prod
from typing import NamedTuple
from xml.etree.ElementTree import Element

from ksl.base.limits import HEIGHT_FIELD, MJCF_COPIES, TEXTURE


class Kind(NamedTuple):
    what: str
    of: str
    most: int
    """For all of a file together."""
    mend: str


FIELD = Kind("height field", "numbers", HEIGHT_FIELD, "make it coarser, or leave it out: it has no mass")
TEXTURES = Kind("texture", "points", TEXTURE, "make it smaller, or leave it out: it is only drawn")
COPIES = Kind("replicate", "elements", MJCF_COPIES, "make fewer copies")
GRID = Kind("grid", "points", MJCF_COPIES, "make it coarser")
USER = Kind("size", "user's numbers", HEIGHT_FIELD, "make nuser_… and nkey smaller")
KINDS = {"hfield": FIELD, "texture": TEXTURES}
"""Kinds of amounts that pictures have, by the element."""


class Amount(NamedTuple):
    kind: Kind
    name: str
    factors: tuple[int, ...]


def asked(element: Element, copies: int, elements: int) -> Iterator[Amount]:
    """What one element asks for.  copies: how many `replicate` makes of it; elements: how many the text has."""
    name = element.get("name", "")
    rows, columns, width, height = (_whole(element.get(key, "")) for key in ("nrow", "ncol", "width", "height"))
    if element.tag == "hfield":
        yield Amount(FIELD, name, (rows, columns))
    elif element.tag == "texture" and element.get("builtin", "none") != "none":
        yield Amount(TEXTURES, name, (width, height) if element.get("type") == "2d" else (6, width, width))
    elif element.tag in ("composite", "flexcomp"):
        yield Amount(GRID, f"{element.tag} {name or element.get('prefix', '')}".strip(), tuple(max(1, _whole(x)) for x in element.get("count", "").split()))
    elif element.tag == "size":
        yield from (Amount(USER, key, (_whole(x), elements)) for key, x in element.items() if key.startswith("nuser_") or key == "nkey")
    if copies > 1:
        yield Amount(COPIES, "", (copies,))


def too_much(amounts: Iterable[Amount]) -> str:
    """Amounts of a kind are added up: a sentence about the first one with which the sum is more than is read; empty if none is."""
    sums: dict[Kind, int] = {}
    for kind, name, factors in amounts:
        sums[kind] = sums.get(kind, 0) + prod(factors)
        if sums[kind] > kind.most:
            alone = prod(factors) > kind.most
            size = " × ".join(f"{x:,}" for x in (factors if alone else (sums[kind],)))
            return f"the {kind.what}{f' {name}' if name else ''} has {'' if alone else 'with those before it '}{size} {kind.of}, and {kind.most:,} are the most that are read; {kind.mend}"
    return ""


def _whole(text: str) -> int:
    """A whole number that is not negative; 0 for what is none, of which MuJoCo says what is wrong."""
    try:
        return max(0, int(text))
    except ValueError:
        return 0


def copies_of(element: Element) -> int:
    """How many copies of what is in it an element makes."""
    return max(1, _whole(element.get("count", ""))) if element.tag == "replicate" else 1
