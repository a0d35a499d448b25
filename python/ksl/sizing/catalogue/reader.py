"""Checks the tables of files that people write of components: keys, forms and numbers, with the line in every message."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from ksl.base.errors import SizingError, near_names, unknown_name
from ksl.base.toml_lines import line_of
from ksl.sizing.catalogue.catalogue import FLANGE, KINDS, Key, ComponentKind
from ksl.sizing.catalogue.catalogue_numbers import COMPONENTS_OF_STRESS, FORMS, LARGEST, fault_of, in_millimetres, is_number, numbers_in


class Reader:
    """Checks the tables of a file.  lines: of its keys, as `toml_lines` has them."""

    def __init__(self, file: str, tables: Mapping[str, Any], lines: dict[Any, int]) -> None:
        self.file, self.tables, self.lines = file, tables, lines

    def at(self, *path: str | int) -> str:
        line = line_of(self.lines, *path)
        return f"{self.file}:{line}" if line else self.file

    def fail(self, sentence: str, *path: str | int) -> SizingError:
        return SizingError(f"{self.at(*path)}: {sentence}")

    def known(self, names: Iterable[str], allowed: Iterable[str], what: str, *path: str | int) -> None:
        for name in names:
            kind = name.replace("_", " ")
            if what == "top-level" and kind in KINDS:
                raise self.fail(f'components are tables [[component]] with kind = "{kind}", not [[{name}]]', *path, name)
            if name not in set(allowed):
                raise SizingError(unknown_name(self.at(*path, name), f"{what} key", name, allowed))

    def optional_number(self, x: Any, *path: str | int) -> float | None:
        if x is None:
            return None
        if not is_number(x) or not 0 < x <= LARGEST:
            raise self.fail(f"{path[-1]} = {x!r}: expected a positive number", *path)
        return float(x)

    def values(self, entry: Mapping[str, Any], keys: Iterable[Key], path: tuple[str | int, ...], table: str, refused: dict[str, str]) -> dict[str, Any]:
        return {key.name: self.value(key, entry[key.name], (*path, key.name), table + key.name, refused) for key in keys if key.name in entry}

    def value(self, key: Key, x: Any, path: tuple[str | int, ...], name: str, refused: dict[str, str]) -> Any:
        """A checked value.  One of the wrong type is an error, one of the wrong sign is noted in `refused`."""
        if key.shape == "table":
            if not isinstance(x, Mapping):
                raise self.fail(f"{name} = {x!r}: expected a table with {', '.join(k.name for k in key.keys)}", *path)
            self.known(x, [k.name for k in key.keys], name, *path)
            return self.values(x, key.keys, path, f"{name}.", refused)
        if key.shape == "word":
            if not isinstance(x, str) or (key.choices and x not in key.choices):
                near = near_names(x, key.choices)
                raise self.fail(f"{name} = {x!r}: {near}expected {' or '.join(map(repr, key.choices)) or 'text in quotes'}", *path)
            return x
        if key.shape == "numbers by name" and isinstance(x, Mapping):
            self.known(x, COMPONENTS_OF_STRESS, name, *path)
        numbers = numbers_in(key, x)
        if numbers is None:
            unit = f", {key.unit}" if key.unit and key.shape == "number" else ""
            raise self.fail(f"{name} = {x!r}: expected {FORMS[key.shape]}{unit}", *path)
        if in_millimetres(key, numbers):
            raise self.fail(f"{name} = {x!r}: {in_millimetres(key, numbers)}", *path)
        fault = fault_of(key, numbers)
        if fault and key.essential:
            raise self.fail(f"{name} = {x!r} {fault}", *path)
        if fault:
            refused[name] = f"{self.at(*path)}: {name} = {x!r} {fault}"
        return numbers[0] if key.shape == "number" else x

    def whole(self, kind: ComponentKind, values: Mapping[str, Any], path: tuple[str | int, ...]) -> None:
        """Refuses a component without the keys that it needs, and one that contradicts itself."""
        for key in (key for key in kind.keys if key.needed):
            if key.name not in values:
                mend = f"; write a table [component.{key.name}]" if key.shape == "table" else ""
                raise self.fail(f"{kind.name} without {key.name}{mend}", *path)
            for inner in (inner.name for inner in key.keys if inner.needed and inner.name not in values[key.name]):
                raise self.fail(f"{key.name} without {inner}", *path, key.name)
        tables = [key.name for key in kind.keys if key.shape == "table"]
        if len(tables) == 2 and values[tables[0]]["position"] == values[tables[1]]["position"]:
            where = "at the same position, where they carry no moment; give both positions on the axis, m"
            raise self.fail(f"{' and '.join(tables)} are {where}", *path, tables[1], "position")
        if kind is FLANGE:
            self.flange(values, path)

    def flange(self, values: Mapping[str, Any], path: tuple[str | int, ...]) -> None:
        circle = {"bolts", "circle_diameter"} & values.keys()
        if ("points" in values) == bool(circle):
            raise self.fail("a bolted flange needs bolts and circle_diameter, or points", *path)
        if len(circle) == 1:
            raise self.fail("a bolt circle needs both bolts and circle_diameter", *path)
        if (len(values["points"]) if "points" in values else values["bolts"]) < 3:
            raise self.fail("a flange needs at least three bolts", *path)
