"""What is asked of a catalogue: the tables [[choose]] of a components file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ksl.base.errors import SizingError, unknown_name
from ksl.sizing.catalogue.catalogue import KINDS
from ksl.sizing.catalogue.catalogue_key import Key
from ksl.sizing.catalogue.parts import Request
from ksl.sizing.catalogue.reader import Reader

MARGIN = Key("margin", "", "every utilisation is at most its inverse", "1.25", default=1.0)
AT = Key("at", "m", "where on the link its mass is", "[0, 0, 0]", "vector", sign="any", default=[0.0, 0.0, 0.0])
OWN = ("joint", "kind", "margin", "by", "link", "at")
NOT_CHOSEN = ("fatigue", "bolted flange")
"""Kinds that a catalogue doesn't have: sections of a part, and flanges, whose bolts have names."""


def requests_of(reader: Reader, entries: Any) -> tuple[Request, ...]:
    """The requests of a file.  Raises SizingError with the line."""
    if not isinstance(entries, list):
        raise reader.fail("choose must be tables: [[choose]], then lines KEY = VALUE", "choose")
    found = tuple(_request(reader, k, entry) for k, entry in enumerate(entries))
    seen: dict[tuple[str, str], Request] = {}
    for request in found:
        if (request.joint, request.kind.name) in seen:
            raise SizingError(f"{request.where}: a second {request.kind.name} is to be chosen for {request.joint}; ask for one of each kind")
        seen[request.joint, request.kind.name] = request
    return found


def _request(reader: Reader, k: int, entry: Any) -> Request:
    path: tuple[str | int, ...] = ("choose", k)
    if not isinstance(entry, Mapping):
        raise reader.fail("choose must be a table: [[choose]], then lines KEY = VALUE", *path)
    word = entry.get("kind")
    known = [name for name in KINDS if name not in NOT_CHOSEN]
    if not isinstance(word, str) or word not in known:
        raise (
            reader.fail(f"choose without kind; known: {', '.join(known)}", *path)
            if word is None
            else SizingError(unknown_name(reader.at(*path, "kind"), "kind of component to choose", word, known))
        )
    kind = KINDS[word]
    keys = [key for key in kind.keys if key.name not in OWN]
    reader.known(entry, (*OWN, *(key.name for key in keys)), word, *path)
    joint, link, by = entry.get("joint"), entry.get("link"), entry.get("by", "mass")
    if not isinstance(joint, str):
        raise reader.fail('a choice is for one joint; write joint = "NAME"', *path, "joint")
    if by not in ("mass", "price"):
        raise reader.fail(f'by = {by!r}: expected "mass" or "price"', *path, "by")
    if link is not None and not isinstance(link, str):
        raise reader.fail(f"link = {link!r}: expected the link's name in quotes", *path, "link")
    if link is None and "at" in entry:
        raise reader.fail("at is a point of a link; name the link that carries what is chosen, or leave out the point", *path, "at")
    refused: dict[str, str] = {}
    values = reader.values(entry, (MARGIN, AT, *keys), path, "", refused)
    if refused:
        raise SizingError(next(iter(refused.values())))
    x, y, z = values.pop("at", (0.0, 0.0, 0.0))
    return Request(joint, kind, values.pop("margin", 1.0), by, link, (x, y, z), values, reader.at(*path, "joint"))
