"""Load cases as calls are given them: a motion of any form, what the robot carries, and how wrenches are expressed."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from numpy.typing import ArrayLike

from ksl.base.errors import ArgumentError, name_among
from ksl.base.files_read import InputFile, recorded
from ksl.base.printable import one_line
from ksl.load_cases.load_case import LoadCase, Payload, Placement
from ksl.load_cases.case_files.motion_given import motion_given
from ksl.load_cases.wrench_table import wrenches_of_arrays
from ksl.mechanism.given import payload_points
from ksl.mechanism.requests import names_in_order, three_numbers
from ksl.mechanism.states import External, Order, Point, Side
from ksl.model.model import Model
from ksl.model.surgery import with_body
from ksl.motions.motion import Motion
from ksl.motions.reading import read_motion, read_wrenches

MotionGiven = str | os.PathLike[str] | Motion | Sequence[ArrayLike] | Any
"""`Any`: a table of pandas, polars or pyarrow."""
PayloadsGiven = Mapping[str, tuple[float, Sequence[float]]] | Sequence[Payload]
"""{link: (mass, point)}, to be added; or what the model carries already."""
PointsGiven = Point | Mapping[str, Sequence[float]] | Mapping[str | None, Any]
"""One point for all joints; or {joint: point} of single ones, where that of all others is at None."""
ExternalGiven = External | str | os.PathLike[str]
"""{link: wrenches}, or a table with `time` and LINK.fx … LINK.tz."""


class PlacementError(ArgumentError):
    """A joint of a placement is none of the robot's, or has a point although its wrench isn't wanted."""

    argument: Literal["at", "joints"]
    """Which names it."""
    joint: str
    """As it was given."""
    left_out: bool
    """Is it one that `joints` leaves out?"""

    def __init__(self, said: str, argument: Literal["at", "joints"], joint: str, left_out: bool = False) -> None:
        super().__init__(said)
        self.argument, self.joint, self.left_out = argument, joint, left_out


def placement_of(model: Model, on: Side, at: PointsGiven, axes: str, order: Order, joints: str | Sequence[str]) -> Placement:
    """How wrenches are expressed, checked."""
    given: Mapping[Any, Any] = at if isinstance(at, Mapping) else {None: at}
    points = {joint: three_numbers(point, f"at: the point of {joint}") for joint, point in given.items() if joint is not None}
    names = (joints,) if isinstance(joints, str) else tuple(names_in_order(joints, "joints") or ())
    return checked(model, Placement(on, given.get(None, "joint"), axes, order, points, names))


def checked(model: Model, placement: Placement) -> Placement:
    """The placement that is given, with joints by their plain names.  Raises ValueError for unknown sides, points, axes, orders and joints, and for points of joints that aren't wanted."""
    points = {_plain(model, "at", joint): point for joint, point in placement.points.items()}
    placement = replace(placement, points=points, joints=tuple(_plain(model, "joints", joint) for joint in placement.joints))
    for joint in points:
        if not placement.wanted(joint):
            said = f"at: a point of {joint!r}, which is none of the joints that are wanted: {', '.join(placement.joints)}; add it there, or leave out the point"
            raise PlacementError(said, "at", joint, left_out=True)
    for point in (placement.at, *points.values()):
        model.reaction_request(placement.on, point, placement.axes, placement.order, "total", [])
    return placement


def _plain(model: Model, argument: Literal["at", "joints"], joint: str) -> str:
    loop: str = name_among(model.loop_names, joint, "joint")
    try:
        return loop if loop in model.loop_names else model.joint(joint).name
    except ValueError as e:
        raise PlacementError(str(e), argument, joint) from None


def with_payloads(model: Model, payloads: PayloadsGiven | None) -> tuple[Model, list[Payload]]:
    """The model with point masses, and all that it carries, as load cases record it."""
    if isinstance(payloads, (list, tuple)) and all(isinstance(p, Payload) for p in payloads):
        return model, list(payloads)
    points = payload_points(payloads)  # type: ignore[arg-type]  # it refuses what is no mapping
    for link, mass, center in points:
        model = with_body(model, link, mass, center)
    return model, list(model.payloads)


def one_case(
    model: Model, motion: MotionGiven, placement: Placement, carried: Sequence[Payload], external: ExternalGiven | None, reading: Mapping[str, Any]
) -> tuple[LoadCase, list[InputFile]]:
    """The load case of one motion, and the files that it comes from."""
    file = os.fspath(motion) if isinstance(motion, (str, os.PathLike)) else None
    name = "motion" if file is None else "standard input" if file == "-" else one_line(Path(file).stem)
    with recorded() as ledger:
        moved = motion_given(model, motion) if file is None else read_motion(model, file, **reading)
        if isinstance(external, (str, os.PathLike)):
            wrenches, doubts = read_wrenches(model, external, moved.time)
            moved = replace(moved, doubts=[*moved.doubts, *doubts])
        else:
            wrenches = wrenches_of_arrays(external, len(moved.time))
    return LoadCase(model, moved, placement, wrenches, name, file or "", carried), ledger.files
