"""The catalogue that is chosen from: TOML, CSV or a workbook, with the keys of components, and mass, price and size."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ksl.base.errors import SizingError, unknown_name
from ksl.base.files_read import being_read
from ksl.base.input_files import path_given
from ksl.base.toml_files import read_text, toml_of
from ksl.base.toml_lines import toml_lines
from ksl.sizing.catalogue.catalogue import KINDS
from ksl.sizing.catalogue.catalogue_key import Key, ComponentKind
from ksl.sizing.catalogue.catalogue_numbers import as_toml
from ksl.sizing.catalogue.requests import NOT_CHOSEN
from ksl.sizing.choice.rows import rows_of_csv, rows_of_workbook, tables_of_rows
from ksl.sizing.catalogue.parts import Part, Request
from ksl.sizing.catalogue.reader import Reader

MASS = Key("mass", "kg", "of the part", "0.8", needed=True)
PRICE = Key("price", "", "in any currency", "260", sign="not negative")
OWN = ("kind", "name", "mass", "price", "size")
MEND = "give a catalogue, TOML with tables [[component]], CSV or xlsx with a row for each"


@dataclass(frozen=True)
class Offer:
    """An entry of a catalogue."""

    kind: ComponentKind
    name: str
    mass: float
    price: float | None
    size: str
    """The size as the maker calls it; it is shown and not used."""
    values: Mapping[str, Any]
    path: tuple[str | int, ...]


@dataclass(frozen=True)
class Catalogue:
    """Entries of one or several kinds."""

    reader: Reader
    offers: tuple[Offer, ...]
    parts: dict[tuple[str, str, str], Part] = field(default_factory=dict, compare=False)

    @property
    def file(self) -> str:
        return self.reader.file

    def of(self, request: Request) -> list[Offer]:
        """The entries of the kind that is asked for.  Raises SizingError where there is none, or one has no price and that counts."""
        found = [offer for offer in self.offers if offer.kind is request.kind]
        if not found:
            kinds = ", ".join(dict.fromkeys(offer.kind.name for offer in self.offers))
            raise SizingError(f"{self.file}: has no {request.kind.name}, which {request.where} asks for; it has: {kinds}")
        for offer in found:
            if request.by == "price" and offer.price is None:
                raise self.reader.fail(f'{offer.name} has no price, and {request.where} chooses by = "price"', *offer.path)
        return found

    def part(self, offer: Offer, request: Request) -> Part:
        """The component that an entry is on the joint of a request, whose numbers of the place join those of the catalogue."""
        key = (request.joint, request.kind.name, offer.name)
        if key not in self.parts:
            values = _joined(offer.values, request.values, f"{self.reader.at(*offer.path)}: {offer.name}", request.where)
            self.reader.whole(offer.kind, values, offer.path)
            self.parts[key] = Part(offer.kind, offer.name, (request.joint,), values, where=request.where)
        return self.parts[key]


def catalogue_given(given: str | os.PathLike[str] | Mapping[str, Any] | Catalogue) -> Catalogue:
    """A catalogue of a file, of its tables, or as it was read.  Raises SizingError with the line."""
    if isinstance(given, Catalogue):
        return given
    if isinstance(given, Mapping):
        return _catalogue(Reader("catalogue", as_toml(given), {}))
    file = path_given(given, "a catalogue", "choose")
    with being_read("catalogue", file, SizingError):
        rows = {".csv": rows_of_csv, ".xlsx": rows_of_workbook}.get(Path(file).suffix.lower())
        if rows is not None:
            return _catalogue(Reader(file, *tables_of_rows(file, rows(file, MEND), MEND)))
        text = read_text(file, SizingError, MEND)
    return _catalogue(Reader(file, toml_of(text, file, SizingError), toml_lines(text)))


def _catalogue(reader: Reader) -> Catalogue:
    reader.known(reader.tables, ("component",), "top-level")
    entries = reader.tables.get("component")
    if not isinstance(entries, list) or not entries:
        raise reader.fail(f"holds no components; {MEND}")
    offers = tuple(_offer(reader, k, entry) for k, entry in enumerate(entries))
    seen = set()
    for offer in offers:
        if (offer.kind.name, offer.name) in seen:
            raise reader.fail(f"a second {offer.kind.name} named {offer.name!r}; names tell the entries of a kind apart", *offer.path, "name")
        seen.add((offer.kind.name, offer.name))
    return Catalogue(reader, offers)


def _offer(reader: Reader, k: int, entry: Any) -> Offer:
    path: tuple[str | int, ...] = ("component", k)
    if not isinstance(entry, Mapping):
        raise reader.fail("component must be a table: [[component]], then lines KEY = VALUE", *path)
    known = [name for name in KINDS if name not in NOT_CHOSEN]
    word, name = entry.get("kind"), entry.get("name")
    if not isinstance(word, str) or word not in known:
        raise SizingError(unknown_name(reader.at(*path, "kind"), "kind in a catalogue", word, known))
    if not isinstance(name, str) or not name:
        raise reader.fail("an entry of a catalogue needs a name, text in quotes", *path, "name")
    kind = KINDS[word]
    reader.known(entry, (*OWN, *kind.by_name), word, *path)
    refused: dict[str, str] = {}
    values = reader.values(entry, (MASS, PRICE, *kind.keys), path, "", refused)
    if refused:
        raise SizingError(next(iter(refused.values())))
    if "mass" not in values:
        raise reader.fail(f"{name} has no mass, kg", *path)
    size = entry.get("size", "")
    return Offer(kind, name, values.pop("mass"), values.pop("price", None), str(size), values, path)


def _joined(offered: Mapping[str, Any], asked: Mapping[str, Any], offer: str, request: str) -> dict[str, Any]:
    """Values of both; tables inside of them, too.  Raises SizingError for a number that both give."""
    found = dict(offered)
    for key, value in asked.items():
        if isinstance(value, Mapping) and isinstance(found.get(key), Mapping):
            found[key] = _joined(found[key], value, offer, request)
        elif key in found:
            raise SizingError(f"{offer}: {key} is a number of the catalogue, and {request} gives it, too; leave it out there")
        else:
            found[key] = value
    return found
