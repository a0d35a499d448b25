"""The components file: which component sits on which joint, with its catalogue numbers."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ksl.errors import SizingError, near_names, unknown_name
from ksl.sizing.catalogue import COMMON, KINDS, Key, Kind
from ksl.sizing.life import RELIABILITY
from ksl.sizing.results import Spectrum
from ksl.toml_files import read_toml
from ksl.toml_lines import line_of, toml_lines

TOP = ("robot", "required_life_h", "reliability", "iso_281", "cases", "shares", "component")

LARGEST = 1e30
"""Magnitudes beyond this one, or below its inverse, are no catalogue numbers, and their powers would overflow."""
LARGEST_EXPONENT = 100.0
AT_MOST_1 = ("gear_efficiency", "efficiency", "load_introduction", "load_factor")
GEOMETRY = ("bolts", "circle_diameter", "points", "contact_angle_deg")


@dataclass(frozen=True)
class Part:
    """A component with checked values: numbers are finite; those of the wrong sign are in `refused`, and why."""

    kind: Kind
    name: str
    joints: tuple[str, ...]
    values: Mapping[str, Any]
    refused: Mapping[str, str] = field(default_factory=dict)
    """{key: sentence} of numbers that can't be used; keys of inner tables are dotted."""
    where: str = ""
    """File and line of its joints."""

    def get(self, key: str) -> Any:
        """A value, or its default, or None."""
        table, _, name = key.rpartition(".")
        inside: Mapping[str, Any] = self.values.get(table, {}) if table else self.values
        known = {k.name: k for k in (self.kind.by_name[table].keys if table else self.kind.keys)}
        return None if key in self.refused else inside.get(name, known[name].default)

    def why_absent(self, key: str) -> str:
        """Why there is no value."""
        return self.refused.get(key) or f"{key} is not given"


@dataclass(frozen=True)
class Components:
    """A components file."""

    file: str
    parts: tuple[Part, ...]
    robot: str | None = None
    required_life_h: float | None = None
    reliability: float = 90.0
    edition: int = 2007
    spectrum: Spectrum = Spectrum()
    case_lines: Mapping[str, int | None] = field(default_factory=dict)


def read_components(path: str | os.PathLike[str]) -> Components:
    """Reads and checks a components file.  Raises SizingError with the line."""
    file = os.fspath(path)
    tables = read_toml(file, SizingError, "components: `ksl size --example` prints one")
    return _Reader(file, tables, toml_lines(Path(file).read_text(encoding="utf-8-sig"))).components()


def components_of(tables: Mapping[str, Any], file: str = "components") -> Components:
    """The same from tables that a program has: {"component": [{"joint": …, "kind": …}, …], …}."""
    return _Reader(file, _as_toml(tables), {}).components()


class _Reader:
    """Checks the tables of a file."""

    def __init__(self, file: str, tables: Mapping[str, Any], lines: dict[Any, int]) -> None:
        self.file, self.tables, self.lines = file, tables, lines

    def at(self, *path: str | int) -> str:
        line = line_of(self.lines, *path)
        return f"{self.file}:{line}" if line else self.file

    def fail(self, sentence: str, *path: str | int) -> SizingError:
        return SizingError(f"{self.at(*path)}: {sentence}")

    def known(self, names: Iterable[str], allowed: Iterable[str], what: str, *path: str | int) -> None:
        for name in names:
            if name not in set(allowed):
                raise SizingError(unknown_name(self.at(*path, name), f"{what} key", name, allowed))

    def components(self) -> Components:
        t = self.tables
        self.known(t, TOP, "top-level")
        entries = t.get("component", [])
        if not isinstance(entries, list) or not entries:
            raise self.fail("holds no components; write a table [[component]] with joint and kind for each, `ksl size --example` prints some", "component")
        life = self.optional_number(t.get("required_life_h"), "required_life_h")
        reliability = self.optional_number(t.get("reliability", 90.0), "reliability") or 90.0
        edition = t.get("iso_281", 2007)
        if not isinstance(edition, int) or edition not in RELIABILITY:
            raise self.fail(f"iso_281 = {edition!r}: expected the edition 2007 or 1990", "iso_281")
        self.reliability(reliability, edition, "reliability")
        robot = t.get("robot")
        if robot is not None and not isinstance(robot, str):
            raise self.fail(f"robot = {robot!r}: expected the robot's name in quotes", "robot")
        parts = tuple(self.part(k, entry, edition) for k, entry in enumerate(entries))
        return Components(self.file, parts, robot, life, reliability, edition, self.spectrum(), {c: line_of(self.lines, w, c) for w in ("cases", "shares") for c in t.get(w, {})})

    def reliability(self, value: float, edition: int, *path: str | int) -> None:
        if value not in RELIABILITY[edition]:
            known = ", ".join(f"{r:g}" for r in RELIABILITY[edition])
            raise self.fail(f"reliability = {value:g}: ISO 281:{edition} has factors for {known} %", *path)

    def spectrum(self) -> Spectrum:
        found = {}
        for which in ("cases", "shares"):
            table = self.tables.get(which, {})
            if not isinstance(table, Mapping):
                raise self.fail(f"{which} must be a table: [{which}] and a line NAME = NUMBER for each case", which)
            for case, x in table.items():
                if not _is_number(x) or not 0 <= x <= LARGEST:
                    raise self.fail(f"{which}.{case} = {x!r}: expected a number, 0 or more", which, case)
            found[which] = {case: float(x) for case, x in table.items()}
        if found["cases"] and found["shares"]:
            raise self.fail("[cases] and [shares] are both given; repetitions or shares of time, one of them", "shares")
        if found["shares"] and not sum(found["shares"].values()) > 0:
            raise self.fail("[shares] are all 0; one case at least must have a share of the time", "shares")
        return Spectrum(found["cases"], found["shares"])

    def optional_number(self, x: Any, *path: str | int) -> float | None:
        if x is None:
            return None
        if not _is_number(x) or not 0 < x <= LARGEST:
            raise self.fail(f"{path[-1]} = {x!r}: expected a positive number", *path)
        return float(x)

    def part(self, k: int, entry: Any, edition: int) -> Part:
        path = ("component", k)
        if not isinstance(entry, Mapping):
            raise self.fail("component must be a table: [[component]], then lines KEY = VALUE", *path)
        word = entry.get("kind")
        if word is None:
            raise self.fail(f"component without kind; known: {', '.join(KINDS)}", *path)
        if not isinstance(word, str) or word not in KINDS:
            raise SizingError(unknown_name(self.at(*path, "kind"), "kind of component", word, KINDS))
        kind = KINDS[word]
        self.known(entry, (*COMMON, *kind.by_name), word, *path)
        name = entry.get("name", word)
        if not isinstance(name, str):
            raise self.fail(f"name = {name!r}: expected text in quotes", *path, "name")
        refused: dict[str, str] = {}
        values = self.values(entry, kind.keys, path, "", refused)
        if "reliability" in values:
            self.reliability(values["reliability"], edition, *path, "reliability")
        self.whole(kind, values, path)
        return Part(kind, name, self.part_joints(entry, path), values, refused, self.at(*path, "joints" if "joints" in entry else "joint"))

    def part_joints(self, entry: Mapping[str, Any], path: tuple[str | int, ...]) -> tuple[str, ...]:
        given = entry.get("joints", entry.get("joint"))
        joints = [given] if isinstance(given, str) else given
        if ("joint" in entry) == ("joints" in entry) or not isinstance(joints, list) or not joints or not all(isinstance(j, str) for j in joints):
            raise self.fail('expected joint = "NAME", or joints = ["NAME", "NAME"]', *path, "joints" if "joints" in entry else "joint")
        return tuple(dict.fromkeys(joints))

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
        numbers = self.numbers_of(key, x, name, path)
        wrong = ""
        if not all(math.isfinite(v) for v in numbers):
            wrong = "must be finite"
        elif key.sign != "any" and any(v < 0 or (v == 0 and key.sign == "positive") for v in numbers) and key.shape != "curve":
            wrong = "must be positive" if key.sign == "positive" else "must be 0 or more"
        elif name in AT_MOST_1 and numbers[0] > 1 and key.meaning[:2] != "fw":
            wrong = "must be at most 1"
        elif any(v != 0 and not 1 / LARGEST <= abs(v) <= LARGEST for v in numbers):
            wrong = f"is out of range: magnitudes are between {1 / LARGEST:g} and {LARGEST:g}"
        elif name in ("k", "torque_exponent") and numbers[0] > LARGEST_EXPONENT:
            wrong = f"must be at most {LARGEST_EXPONENT:g}"
        if wrong and (key.sign == "any" or key.name in GEOMETRY):  # without these nothing could be said of the component
            raise self.fail(f"{name} = {x!r} {wrong}", *path)
        if wrong:
            refused[name] = f"{self.at(*path)}: {name} = {x!r} {wrong}"
        return x if key.shape == "numbers by name" else float(x) if key.shape == "number" else x

    def numbers_of(self, key: Key, x: Any, name: str, path: tuple[str | int, ...]) -> list[float]:
        """All numbers in a value whose form has been checked."""
        form = {
            "number": "a number", "count": "a whole number", "vector": "three numbers [x, y, z]", "points": "pairs of numbers [[x, y], …]",
            "curve": "pairs [[speed, torque], …] with increasing speeds, 0 or more", "numbers by name": "factors { tx = 1.0, … }",
        }[key.shape]  # fmt: skip
        if key.shape == "numbers by name":
            allowed = ("fx", "fy", "fz", "tx", "ty", "tz", "effort")
            found = list(x.values()) if isinstance(x, Mapping) and x else None
            if found is not None:
                self.known(x, allowed, name, *path)
        elif key.shape in ("points", "curve"):
            pairs = x if isinstance(x, list) and len(x) > 0 and all(isinstance(p, list) and len(p) == 2 for p in x) else None
            found = None if pairs is None else [v for p in pairs for v in p]
        else:
            found = x if isinstance(x, list) and key.shape == "vector" and len(x) == 3 else [x] if key.shape in ("number", "count") else None
        right = found is not None and all(_is_number(v) for v in found) and (key.shape != "count" or isinstance(x, int))
        if right and key.shape == "curve":
            speeds = [p[0] for p in x]
            right = speeds[0] >= 0 and all(a < b for a, b in zip(speeds, speeds[1:], strict=False)) and all(p[1] >= 0 for p in x)
        if not right or found is None:
            raise self.fail(f"{name} = {x!r}: expected {form}" + (f", {key.unit}" if key.unit and key.shape == "number" else ""), *path)
        return [float(v) for v in found]

    def whole(self, kind: Kind, values: Mapping[str, Any], path: tuple[str | int, ...]) -> None:
        """What must be there for a component to mean anything, and what contradicts itself."""
        if kind.name == "bolted flange" and ("points" in values) == ("bolts" in values or "circle_diameter" in values):
            raise self.fail("a bolted flange needs bolts and circle_diameter, or points", *path)
        if kind.name == "bolted flange" and "points" not in values and not {"bolts", "circle_diameter"} <= values.keys():
            raise self.fail("a bolt circle needs both bolts and circle_diameter", *path)
        if kind.name == "bolted flange" and (len(values["points"]) if "points" in values else values["bolts"]) < 3:
            raise self.fail("a flange needs at least three bolts", *path)
        for table in [key for key in kind.keys if key.shape == "table"]:
            inside = values.get(table.name)
            if inside is None:
                raise self.fail(f"{kind.name} without {table.name}; write a table [component.{table.name}]", *path)
            for needed in [key.name for key in table.keys if key.name in ("position", "type")]:
                if needed not in inside:
                    raise self.fail(f"{table.name} without {needed}", *path, table.name)
        for a, b in (("locating", "floating"), ("a", "b")):
            if kind.name != "motor" and a in values and b in values and values[a]["position"] == values[b]["position"]:
                raise self.fail(f"{a} and {b} are at the same position, where they carry no moment; give both positions on the axis, m", *path, b, "position")
        for needed, of in (("arrangement", "opposed angular contact bearings"), ("stress", "fatigue")):
            if kind.name == of and needed not in values:
                raise self.fail(f"{of} without {needed}", *path)
        if kind.name in ("bearing pair",) and any(values[t].get("type") == "angular contact pair" and values[t].get("contact_angle_deg", 40.0) not in (20, 25, 30, 35, 40, 45) for t in ("locating", "floating")):
            raise self.fail("contact_angle_deg must be 20, 25, 30, 35, 40 or 45", *path)
        if kind.name == "opposed angular contact bearings" and values.get("contact_angle_deg", 40.0) not in (20, 25, 30, 35, 40, 45):
            raise self.fail(f"contact_angle_deg = {values['contact_angle_deg']:g}: expected 20, 25, 30, 35, 40 or 45", *path, "contact_angle_deg")


def _as_toml(x: Any) -> Any:
    """Tuples and NumPy's arrays and numbers as a TOML file would have them."""
    if isinstance(x, Mapping):
        return {k: _as_toml(v) for k, v in x.items()}
    if isinstance(x, (list, tuple)):
        return [_as_toml(v) for v in x]
    return x.tolist() if hasattr(x, "tolist") else x


def _is_number(x: object) -> bool:
    """Of integers those that fit a float; NaN and infinities count."""
    return isinstance(x, float) or (isinstance(x, int) and not isinstance(x, bool) and abs(x) < 1e300)
