"""`ksl.compute_loads`: every wrench of a robot along a motion, or in load cases."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ksl.base.errors import MotionError
from ksl.base.files_read import InputFile
from ksl.load_cases.case_file import read_cases
from ksl.load_cases.given_cases import MotionGiven, checked, one_case, robot_file
from ksl.load_cases.load_case import LoadCase, Placement
from ksl.load_cases.provenance import provenance_of
from ksl.robot_files.loading import load
from ksl.model.model import Model
from ksl.mechanism.requests import names_in_order, three_numbers
from ksl.mechanism.states import External, Order, Point, Side
from ksl.motions.reading_options import check_options
from ksl.report.loads_run import Run


def compute_loads(
    model: Model | str | os.PathLike[str],
    motion: MotionGiven | None = None,
    cases: str | os.PathLike[str] | Sequence[LoadCase] | None = None,
    *,
    payloads: Mapping[str, tuple[float, Sequence[float]]] | None = None,
    external: External | None = None,
    on: Side = "child",
    at: Point | Mapping[str, Sequence[float]] = "joint",
    axes: str = "joint",
    order: Order = "lin_ang",
    joints: str | Sequence[str] = (),
    reading: Mapping[str, Any] | None = None,
) -> Run:
    """Every wrench of a robot along a motion, or in several load cases, as one object: what `ksl loads` does.

    model: a model, or the robot's file.  motion: a file; time (n), q (n, nq) and, if known, v and a (n, nv); or a table
    of pandas, polars or pyarrow with the columns of a file: `time`, the joints' positions and, if known, rates.
    cases: a file of load cases (TOML; docs/cases.md), where `motion` is that of cases that name none; or load cases.
    payloads: {link: (mass in kg, point in the link's frame in m)}, point masses beside what the model carries; for one motion.
    external: {link: (n, 6), or (6) for all samples}: wrenches of the environment, at the link's origin, in its axes; for one motion.
    on, at, axes, order: as in :meth:`Model.reactions`; `at` may also be {joint: (x, y, z)}: points of single joints, others
    have theirs at "joint".  joints: one or several, whose wrenches are wanted; all by default.
    reading: arguments of :func:`ksl.read_motion`, for example {"degrees": True, "smooth": 20}.
    Raises MotionError, DescriptionError or ValueError, and says how to mend it.  Needs the extra `ksl[loads]`.

        run = ksl.compute_loads("robot.urdf", "motion.csv", payloads={"tool0": (2.0, (0, 0, 0.05))})
        print(run.verdict.headline)
        table = run.wrenches.to_pandas()
        run.write("results")
    """
    robot = model if isinstance(model, Model) else load(model)
    if reading is not None and not isinstance(reading, Mapping):
        raise MotionError(f"reading is {type(reading).__name__}; expected a mapping with arguments of ksl.read_motion")
    check_options("reading", reading or {})
    placement = _placement(robot, on, at, axes, order, joints)
    found, files = _cases(robot, motion, cases, placement, payloads, external, reading)
    options = {"on": on, "at": at if isinstance(at, str) else str(at), "axes": axes, "order": order, "joints": list(placement.joints), **(reading or {})}
    run = Run(found, provenance_of(found, [*robot_file(robot), *files], options))
    run.compute()
    return run


def _placement(model: Model, on: Side, at: Point | Mapping[str, Sequence[float]], axes: str, order: Order, joints: str | Sequence[str]) -> Placement:
    """How wrenches are expressed, checked.  `at` is one point for all joints, or the points of single ones."""
    common: Point = at if not isinstance(at, Mapping) else "joint"
    points = {joint: three_numbers(point, f"at: the point of {joint}") for joint, point in at.items()} if isinstance(at, Mapping) else {}
    return checked(model, Placement(on, common, axes, order, points, (joints,) if isinstance(joints, str) else tuple(names_in_order(joints, "joints") or ())))


def _cases(
    model: Model,
    motion: MotionGiven | None,
    cases: str | os.PathLike[str] | Sequence[LoadCase] | None,
    placement: Placement,
    payloads: Mapping[str, tuple[float, Sequence[float]]] | None,
    external: External | None,
    reading: Mapping[str, Any] | None,
) -> tuple[list[LoadCase], list[InputFile]]:
    """The load cases, one at least, and the files that they come from."""
    found: list[LoadCase]
    if cases is None:
        if motion is None:
            raise MotionError("compute_loads needs a motion, or load cases")
        case, files = one_case(model, motion, placement, payloads, external, reading)
        return [case], files
    if isinstance(cases, (str, os.PathLike)):
        found, files = read_cases(model, cases, placement, motion if isinstance(motion, (str, os.PathLike)) else None, reading=reading)
    elif all(isinstance(case, LoadCase) for case in cases):
        found, files = [replace(case, placement=placement) for case in cases], []
    else:
        raise MotionError("cases: expected a file of load cases, or a list of ksl.load_cases.load_case.LoadCase")
    if not found:
        raise MotionError("compute_loads: no load cases")
    return found, files
