"""How joints give way by the components that sit on them: gears, bearings, bolted interfaces."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ksl.base.errors import SizingError
from ksl.sizing.catalogue.components import read_components
from ksl.sizing.catalogue.parts import Components, Part

WAY_OUT = "give it in a table [stiffness.JOINT], and leave the components' out"


class _Row(NamedTuple):
    """A bearing on the joint's axis; None: it is rigid in that direction."""

    position: float
    radial: float | None
    tilting: float | None


def component_stiffnesses(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The stiffnesses of a components file, {joint: as calls take them}: those of its components, and those of [stiffness].

    Gears give way along the joint's motion, in the classes of their maker.  Bearings side by side on a joint are springs beside each other, which
    have one middle: the radial stiffnesses add up there, and tilting is Σ k (x − middle)² and their own.  Raises SizingError.

        component_stiffnesses("components.toml")["elbow"]["radial"]             # N/m
    """
    components = read_components(path)
    found: dict[str, dict[str, Any]] = {}
    for joint in dict.fromkeys(joint for part in components.parts for joint in part.joints):
        own: dict[str, Any] = {}
        for more in _of_joint(components, joint):
            if own.keys() & more.keys():
                raise SizingError(
                    f"{components.file}: joint {joint}: {', '.join(sorted(own.keys() & more.keys()))}: two components give a stiffness there; {WAY_OUT}"
                )
            own |= more
        if own:
            found[joint] = own
    for joint, given in components.stiffness.items():
        own = found.get(joint, {})
        if own and (not isinstance(given, Mapping) or own.keys() & given.keys()):
            raise SizingError(f"{components.file}: joint {joint}: its stiffness is given by a component and in [stiffness]; keep one of them")
        found[joint] = {**own, **given} if isinstance(given, Mapping) else given
    if not found:
        raise SizingError(
            f"{components.file}: no component in it has a stiffness; gears take K1 … or torsional_stiffness, bearings axial_stiffness …, or write [stiffness.JOINT]"
        )
    return found


def _of_joint(components: Components, joint: str) -> list[dict[str, Any]]:
    parts = [part for part in components.parts if joint in part.joints]
    bearings = [part for part in parts if part.kind.name in _ROWS]
    return [
        *(_of_gear(part) for part in parts if part.kind.name in ("strain wave gear", "planetary gear")),
        *(_of_interface(part) for part in parts if part.kind.name == "bolted flange"),
        _of_bearings(joint, bearings),
    ]


def _of_gear(part: Part) -> dict[str, Any]:
    if part.kind.name == "planetary gear":
        k = part.get("torsional_stiffness")
        _judged(part, "torsional_stiffness")
        return {} if k is None else {"motion": k}
    _judged(part, "K1", "T1", "K2", "T2", "K3")
    K = [part.get(key) for key in ("K1", "K2", "K3")]
    T = [part.get(key) for key in ("T1", "T2")]
    given = [x for x in K if x is not None]
    limits = [x for x in T if x is not None]
    if not given and not limits:
        return {}
    if len(limits) != len(given) - 1 or None in K[: len(given)] or None in T[: len(limits)] or limits != sorted(limits):
        raise SizingError(f"{part.where}: {part.name}: its stiffness has K1; or K1, T1 and K2; or K1, T1, K2, T2 and K3, T1 below T2; give all of one of them")
    return {"motion": {"stiffness": given, "effort": limits} if limits else given[0]}


def _of_interface(part: Part) -> dict[str, Any]:
    names = {"axial_stiffness": "axial", "radial_stiffness": "radial", "tilting_stiffness": "tilting", "torsional_stiffness": "torsional"}
    _judged(part, *names)
    found: dict[str, Any] = {name: part.get(key) for key, name in names.items() if part.get(key) is not None}
    if not found:
        return {}
    if part.get("on") == "parent":
        raise SizingError(f"{part.where}: {part.name}: stiffnesses are those on the child's side; give `at` and `normal` there, and leave out on")
    return {**found, "axis": part.get("normal") or [0.0, 0.0, 1.0], "at": part.get("at")}


def _crossed(part: Part) -> list[_Row]:
    return [_Row(part.get("position"), part.get("radial_stiffness"), part.get("tilting_stiffness"))]


def _pair(part: Part, one: str, other: str) -> list[_Row]:
    """Two bearings, which resist tilting by their distance alone."""
    if "axial_stiffness" in part.values.get("floating", {}):
        raise SizingError(f"{part.where}: {part.name}: axial_stiffness of the floating bearing, which moves along the axis; leave it out")
    return [_Row(part.get(f"{row}.position"), part.get(f"{row}.radial_stiffness"), 0.0) for row in (one, other)]


_ROWS = {
    "crossed roller bearing": (_crossed, "axial_stiffness", ("axial_stiffness", "radial_stiffness", "tilting_stiffness")),
    "bearing pair": (
        lambda part: _pair(part, "locating", "floating"), "locating.axial_stiffness",
        ("locating.axial_stiffness", "locating.radial_stiffness", "floating.radial_stiffness"),
    ),
    "opposed angular contact bearings": (lambda part: _pair(part, "a", "b"), "axial_stiffness", ("axial_stiffness", "a.radial_stiffness", "b.radial_stiffness")),
}  # fmt: skip
"""{kind of bearing: its rows, the key of its axial stiffness, and all of its keys}."""


def _of_bearings(joint: str, parts: Sequence[Part]) -> dict[str, Any]:
    """What bearings beside each other are together."""
    rows: list[_Row] = []
    axial: list[float] = []
    rigid_along = False
    for part in parts:
        rows_of, along, keys = _ROWS[part.kind.name]
        _judged(part, *keys)
        if all(part.get(key) is None for key in keys):
            continue
        rows += rows_of(part)
        rigid_along |= part.get(along) is None
        axial += [part.get(along)] if part.get(along) is not None else []
    if not rows:
        return {}
    for what in ("radial", "tilting"):
        if len({getattr(row, what) is None for row in rows}) > 1:
            said = ", ".join(dict.fromkeys(part.name for part in parts))
            raise SizingError(f"{parts[0].where}: {said}: {what} stiffnesses are given of some bearings of joint {joint}, and not of others; give all, or none")
    found: dict[str, Any] = {} if rigid_along else {"axial": sum(axial)}
    radial = [row.radial for row in rows if row.radial is not None]
    total = sum(radial)
    middle = sum(k * row.position for k, row in zip(radial, rows)) / total if total > 0 else sum(row.position for row in rows) / len(rows)
    if radial:
        found["radial"] = total
    if rows[0].tilting is not None and (radial or len({row.position for row in rows}) == 1):  # rigid ones at two places don't tilt
        own = sum(row.tilting for row in rows if row.tilting is not None)
        found["tilting"] = own + sum(k * (row.position - middle) ** 2 for k, row in zip(radial, rows))
    return {**found, "position": middle} if found.keys() & {"radial", "tilting"} else found


def _judged(part: Part, *keys: str) -> None:
    """Refuses numbers of the wrong sign, which sizing would only leave out."""
    for key in keys:
        if key in part.refused:
            raise SizingError(part.refused[key])
