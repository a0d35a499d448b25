"""The components file: which component sits on which joint, with its catalogue numbers."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from ksl.base.errors import SizingError, unknown_name
from ksl.base.files_read import being_read
from ksl.base.input_files import path_given
from ksl.base.toml_files import read_text, toml_of
from ksl.base.toml_lines import line_of, toml_lines
from ksl.sizing.bolt_names import named_bolt
from ksl.sizing.catalogue.bolt_numbers import FOR_BOLTS, numbers_of_bolt
from ksl.sizing.catalogue.catalogue import COMMON, FLANGE, KINDS
from ksl.sizing.catalogue.catalogue_numbers import LARGEST, as_toml, is_number
from ksl.sizing.catalogue.requests import requests_of
from ksl.sizing.life import RELIABILITY
from ksl.sizing.catalogue.parts import Components, Part
from ksl.sizing.catalogue.reader import Reader
from ksl.sizing.samples import Spectrum

TOP = ("robot", "required_life_h", "reliability", "iso_281", "cases", "shares", "component", "choose", "stiffness")


def read_components(path: str | os.PathLike[str]) -> Components:
    """Reads and checks a components file.  Raises SizingError with the line."""
    file = path_given(path, "a components file", "components")
    with being_read("components", file, SizingError):
        text = read_text(file, SizingError, "give a TOML file that describes components: `ksl size --example` prints one")
    return components_of_text(text, file)


def components_of_text(text: str, file: str = "components") -> Components:
    """Components from the text of such a file, which messages call by this name."""
    return _ComponentsReader(file, toml_of(text, file, SizingError), toml_lines(text)).components()


def components_of(tables: Mapping[str, Any], file: str = "components") -> Components:
    """Components from tables that a program has: {"component": [{"joint": …, "kind": …}, …], …}."""
    return _ComponentsReader(file, as_toml(tables), {}).components()


class _ComponentsReader(Reader):
    """Checks the tables of a components file."""

    def components(self) -> Components:
        t = self.tables
        self.known(t, TOP, "top-level")
        entries = t.get("component", [])
        requests = requests_of(self, t["choose"]) if "choose" in t else ()
        stiffness = t.get("stiffness", {})
        if not isinstance(stiffness, Mapping):
            raise self.fail("stiffness must be a table: [stiffness.JOINT], then lines KEY = VALUE", "stiffness")
        if not isinstance(entries, list) or not (entries or requests or stiffness):
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
        return Components(
            self.file,
            parts,
            robot,
            life,
            reliability,
            edition,
            self.spectrum(),
            requests,
            {c: line_of(self.lines, w, c) for w in ("cases", "shares") for c in t.get(w, {})},
            stiffness=stiffness,
            stiffness_lines={joint: line_of(self.lines, "stiffness", joint) for joint in stiffness},
        )

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
                if not is_number(x) or not 0 <= x <= LARGEST:
                    raise self.fail(f"{which}.{case} = {x!r}: expected a number, 0 or more", which, case)
            found[which] = {case: float(x) for case, x in table.items()}
        if found["cases"] and found["shares"]:
            raise self.fail("[cases] and [shares] are both given; repetitions or shares of time, one of them", "shares")
        if found["shares"] and not sum(found["shares"].values()) > 0:
            raise self.fail("[shares] are all 0; one case at least must have a share of the time", "shares")
        return Spectrum(found["cases"], found["shares"])

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
        derived, absent = self.of_bolt(values, refused, path) if kind is FLANGE else ({}, {})
        where = self.at(*path, "joints" if "joints" in entry else "joint")
        return Part(kind, name, self.part_joints(entry, path), values, refused, where, derived, absent)

    def of_bolt(self, values: dict[str, Any], refused: Mapping[str, str], path: tuple[str | int, ...]) -> tuple[dict[str, float], dict[str, str]]:
        """What follows from the bolt's name, and why what doesn't is absent.  The name itself becomes that of the standard."""
        if "bolt" not in values:
            lone = [key for key in FOR_BOLTS if key in values]
            if lone:
                raise self.fail(f'{lone[0]} without bolt; write bolt = "M8 8.8", or leave it out', *path, lone[0])
            return {}, {}
        try:
            bolt = named_bolt(values["bolt"])
        except ValueError as e:
            raise self.fail(f"bolt = {values['bolt']!r}: {e}", *path, "bolt") from None
        values["bolt"] = bolt.name
        if "clamp_length" not in refused and values.get("shank_length", 0.0) > values.get("clamp_length", float("inf")):
            raise self.fail("shank_length is more than clamp_length, of which it is a part", *path, "shank_length")
        given = {key.name: values.get(key.name, key.default) for key in FLANGE.keys if key.name not in refused}
        found, absent = numbers_of_bolt(bolt, given | {"tightening_factor": values.get("tightening_factor")})
        why = [refused[key] for key in FOR_BOLTS if key in refused]
        return found, {key: "; ".join([sentence, *why]) for key, sentence in absent.items()}

    def part_joints(self, entry: Mapping[str, Any], path: tuple[str | int, ...]) -> tuple[str, ...]:
        given = entry.get("joints", entry.get("joint"))
        joints = [given] if isinstance(given, str) else given
        if ("joint" in entry) == ("joints" in entry) or not isinstance(joints, list) or not joints or not all(isinstance(j, str) for j in joints):
            raise self.fail('expected joint = "NAME", or joints = ["NAME", "NAME"]', *path, "joints" if "joints" in entry else "joint")
        return tuple(dict.fromkeys(joints))
