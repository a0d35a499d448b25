"""The robot of results of `ksl loads`, as their metadata describe it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from ksl.base.errors import MotionError
from ksl.load_cases.case_files.case_file import read_cases
from ksl.load_cases.results_table import AGAIN, SavedCase, beside, reading_of
from ksl.mechanism.requests import names_in_order
from ksl.mechanism.states import Array
from ksl.mechanism.calls import Calls
from ksl.model.model import Model
from ksl.model.surgery import with_body, with_compliances
from ksl.motions.reading import read_external
from ksl.robot_files.loading import load

DIFFERENT = 1e-6
"""Wrenches of the table that differ by more than this share of the largest are not those of the robot, payloads and wrenches at hand."""


def as_described(model: Model, description: Mapping[str, Any]) -> Model:
    """A robot as its file has it, with the payloads, weights of drives and stiffnesses of a load case."""
    for p in description.get("payloads", []):
        model = with_body(model, p["link"], float(p["mass"]), p["center"], np.reshape(p["inertia"], (3, 3)) if "inertia" in p else None)
    weights = description.get("drive_weights")
    if weights and list(model.drives or ()) == description["drives"]:
        model = model.with_drives(dict(zip(description["drives"], weights, strict=True)))
    return with_compliances(model, description["compliance"]) if description.get("compliance") else model


def loops_of(results: SavedCase) -> str:
    """The file of the joints that close loops, or that those of the robot's file were cut."""
    if results.made_by.get("options", {}).get("loops") == "cut":
        return "cut"
    files = [f["file"] for f in results.made_by.get("inputs", []) if f["role"] == "loops"]
    return str(beside(results, files[0])) if files else ""


def model_of_results(results: SavedCase, file: str, robot: str | os.PathLike[str] | None = None) -> Model:
    """The robot of a load case of results, from the file that they name.

    file: the results, for messages.  robot: another file, where that one has moved.  Raises MotionError and DescriptionError.
    """
    made, options = results.description, results.made_by.get("options", {})
    if options.get("xacro") is not None and robot is None:
        raise MotionError(f"{file}: the robot was made by a xacro file, which is a program; give the robot as a file that xacro has expanded, robot= (--robot)")
    named = [f["file"] for f in results.made_by.get("inputs", []) if f["role"] == "robot"]
    if robot is None and not named:
        raise MotionError(f"{file}: the results name no robot file, since a program made the robot; give it: robot= (--robot)")
    path = Path(robot) if robot is not None else beside(results, named[0])
    if not path.is_file():
        raise MotionError(
            f"{file}: {'no robot file' if robot is not None else 'the robot file that the results name has moved'}: {path}; give it: robot= (--robot)"
        )
    width = options.get("friction_width")
    loaded = load(
        path, bool(options.get("floating_base")), options.get("mimic") or "coupled", gravity=made.get("gravity"), model=options.get("model") or None,
        physics=made.get("physics") or None, friction_width=float(width) if width else 0.01, loops=loops_of(results) or None, drives=made.get("drives") or None,
    )  # fmt: skip
    return as_described(loaded, made)


def external_of_results(model: Calls, results: SavedCase, time: Array) -> tuple[dict[str, Array], str]:
    """The external wrenches of the load case, or why they can't be read again."""
    if not results.description.get("external"):
        return {}, ""
    constant = results.description.get("external_wrenches", {})
    if isinstance(constant, dict) and set(constant) == set(results.description["external"]):
        return {link: np.broadcast_to(np.asarray(w, dtype=float), (len(time), 6)) for link, w in constant.items()}, ""
    described = [f["file"] for f in results.made_by.get("inputs", []) if f["role"] == "cases"]
    if described and beside(results, described[0]).is_file():
        return _of_case_file(cast("Model", model), results, beside(results, described[0])), ""
    files = [f["file"] for f in results.made_by.get("inputs", []) if f["role"] == "external"]
    if len(files) == 1 and beside(results, files[0]).is_file():
        return dict(read_external(model, beside(results, files[0]), time)), ""
    why = (
        "results don't hold those that load cases or programs give as they change"
        if not files
        else "there are several files of them"
        if len(files) > 1
        else "the file that they were read from is not found"
    )
    return {}, why


def _of_case_file(model: Model, results: SavedCase, file: Path) -> dict[str, Array]:
    """The external wrenches that the file of load cases says, read again with its motions."""
    motion = results.description.get("motion")
    cases, _ = read_cases(model, file, motion=beside(results, motion) if motion else None, reading=reading_of(results))
    found = next((case for case in cases if case.name == results.case), None)
    if found is None or len(found.motion.time) != len(results.time):
        raise MotionError(f"{file}: has no load case {results.case} with {len(results.time)} samples, which the results hold; {AGAIN}")
    return dict(found.external)


def require_same(model: Model, results: SavedCase, file: str, states: tuple[Array, Array, Array], external: Mapping[str, Array]) -> None:
    """Raises MotionError where this robot gives other wrenches than the results hold: it has changed since."""
    joints: dict[tuple[str, str, str], list[str]] = {}
    for name, w in results.wrenches.items():
        joints.setdefault((w.on, w.at, w.axes), []).append(name)
    largest, worst = 1e-9, (0.0, "")
    for (on, at, axes), names in joints.items():
        point = at if not at.startswith("joint + ") else [float(x) for x in at.removeprefix("joint + ").split()]
        try:
            found = model.reactions(*states, dict(external) or None, on=on, at=point, axes=axes, joints=names_in_order(names, "joints"))  # type: ignore[arg-type]
        except ValueError as e:
            raise MotionError(f"{file}: the results don't fit the robot: {e}; {AGAIN}") from None
        for i, name in enumerate(names):
            held = results.wrenches[name].total[:, :3]
            largest = max(largest, float(np.abs(held).max()))
            worst = max(worst, (float(np.abs(held - found[:, i, :3]).max()), name))
    if not worst[0] <= DIFFERENT * largest:
        raise MotionError(
            f"{file}: forces of the results differ by up to {worst[0]:.3g} N at {worst[1]} from what the robot file gives: robot, payloads, stiffnesses or external wrenches have changed since; {AGAIN}"
        )
