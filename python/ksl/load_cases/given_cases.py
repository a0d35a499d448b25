"""Load cases as calls are given them: a motion of any form, and how wrenches are expressed."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from ksl.base.errors import name_among
from ksl.base.files_read import InputFile, recorded
from ksl.base.printable import one_line, sentence
from ksl.load_cases.load_case import LoadCase, Payload, Placement
from ksl.load_cases.motion_given import motion_given
from ksl.load_cases.wrench_table import wrenches_of_arrays
from ksl.model.model import Model
from ksl.mechanism.states import External
from ksl.model.surgery import with_body
from ksl.motions.motion import Motion

MotionGiven = str | os.PathLike[str] | Motion | Sequence[ArrayLike] | Any
"""`Any`: a table of pandas, polars or pyarrow."""


def checked(model: Model, placement: Placement) -> Placement:
    """The same placement, with joints by their plain names.  Raises ValueError for unknown sides, points, axes, orders and joints, and for points of joints that aren't wanted."""
    loops = model.loop_names
    plain = {joint: loop if (loop := name_among(loops, joint, "joint")) in loops else model.joint(joint).name for joint in (*placement.joints, *placement.points)}
    placement = replace(placement, joints=tuple(plain[j] for j in placement.joints), points={plain[j]: point for j, point in placement.points.items()})
    for joint in placement.points:
        if not placement.wanted(joint):
            raise ValueError(sentence(f"at: a point of {joint!r}, which is none of the joints that are wanted: {', '.join(placement.joints)}; add it there, or leave out the point"))
    for point in (placement.at, *placement.points.values()):
        model.reaction_request(placement.on, point, placement.axes, placement.order, "total", [])
    return placement


def robot_file(model: Model) -> list[InputFile]:
    """The files that a model was read from, with the hashes of what was read."""
    return list(model.inputs)


def one_case(
    model: Model,
    motion: MotionGiven,
    placement: Placement,
    payloads: Mapping[str, tuple[float, Sequence[float]]] | None = None,
    external: External | None = None,
    reading: Mapping[str, Any] | None = None,
) -> tuple[LoadCase, list[InputFile]]:
    """The load case of one motion, and the files that it comes from."""
    from ksl.mechanism.given import payload_points
    from ksl.motions.reading import read_motion

    points = payload_points(payloads)
    for link, mass, center in points:
        model = with_body(model, link, mass, center)
    carried = [Payload(model.link(link).name, mass, (x, y, z)) for link, mass, (x, y, z) in points]
    if isinstance(motion, (str, os.PathLike)):
        file = os.fspath(motion)
        with recorded() as ledger:
            moved = read_motion(model, file, **(reading or {}))
        name, inputs = one_line(Path(file).stem), ledger.files
    else:
        file, name, inputs = "", "motion", []
        moved = motion_given(model, motion)
    wrenches = wrenches_of_arrays(external, len(moved.time))
    return LoadCase(model, moved, placement, wrenches, name, file, carried), inputs
