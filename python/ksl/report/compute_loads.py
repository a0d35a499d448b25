"""`ksl.compute_loads`: every wrench of a robot along a motion, or in load cases."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

from ksl.base.errors import MotionError
from ksl.base.files_read import InputFile
from ksl.load_cases.case_files.case_file import read_cases
from ksl.load_cases.case_files.given_cases import ExternalGiven, MotionGiven, PayloadsGiven, PointsGiven, one_case, placement_of, with_payloads
from ksl.load_cases.load_case import LoadCase, Placement
from ksl.load_cases.provenance import provenance_of
from ksl.robot_files.loading import load
from ksl.model.model import Model
from ksl.mechanism.requests import one_of
from ksl.mechanism.states import Order, Side
from ksl.motions.reading_options import check_options
from ksl.report.loads_run import Run


def compute_loads(
    model: Model | str | os.PathLike[str],
    motion: MotionGiven | None = None,
    cases: str | os.PathLike[str] | Sequence[LoadCase] | None = None,
    *,
    payloads: PayloadsGiven | None = None,
    external: ExternalGiven | None = None,
    on: Side = "child",
    at: PointsGiven = "joint",
    axes: str = "joint",
    order: Order = "lin_ang",
    joints: str | Sequence[str] = (),
    reading: Mapping[str, Any] | None = None,
    when: Literal["now", "asked"] = "now",
    inputs: Sequence[InputFile] = (),
    options: Mapping[str, Any] | None = None,
    command: str = "",
) -> Run:
    """Every wrench of a robot along a motion, or in several load cases, as one object: what `ksl loads` does.

    model: a model, or the robot's file.  motion: a file; time (n), q (n, nq) and, if known, v and a (n, nv); or a table
    of pandas, polars or pyarrow with the columns of a file: `time`, the joints' positions and, if known, rates.
    cases: a file of load cases (TOML; docs/cases.md), where `motion` is the file of cases that name none; or load cases.
    payloads: {link: (mass in kg, point in the link's frame in m)}, point masses beside what the model carries; or a list of
    ksl.load_cases.load_case.Payload, what it carries already, for the record.
    external: {link: (n, 6), or (6) for all samples}: wrenches of the environment, at the link's origin, in its axes; or a file
    with `time` and LINK.fx … LINK.tz.  For one motion.
    on, at, axes, order: as in :meth:`Model.reactions`; `at` may also be {joint: (x, y, z)}: points of single joints, others
    have theirs at "joint", or at the point that {None: point} gives.  joints: one or several, whose wrenches are wanted; all by default.
    reading: arguments of :func:`ksl.read_motion`, for example {"degrees": True, "smooth": 20}.
    when: results are computed "now", or when they are first "asked" for: a run that is only written is then computed once.
    inputs, options, command: for the provenance, files beside those of robot and load cases, what made the model, and who asked.
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
    one_of(when, "when", "now", "asked")
    placement = placement_of(robot, on, at, axes, order, joints)
    found, files = _cases(robot, motion, cases, placement, payloads, external, reading or {})
    said = {"on": on, "at": at if isinstance(at, str) else str(at), "axes": axes, "order": order, "joints": list(placement.joints), **(options or {})}
    said |= {name: os.fspath(x) if isinstance(x, os.PathLike) else x for name, x in (reading or {}).items() if x not in (None, False)}
    run = Run(found, provenance_of(found, [*robot.inputs, *inputs, *files], said, command))
    if when == "now":
        run.compute()
    return run


def _cases(
    model: Model,
    motion: MotionGiven | None,
    cases: str | os.PathLike[str] | Sequence[LoadCase] | None,
    placement: Placement,
    payloads: PayloadsGiven | None,
    external: ExternalGiven | None,
    reading: Mapping[str, Any],
) -> tuple[list[LoadCase], list[InputFile]]:
    """The load cases, one at least, and the files that they come from."""
    if cases is None and motion is None:
        raise MotionError("compute_loads needs a motion, or load cases")
    if cases is not None and external is not None:
        raise MotionError("external and cases: external wrenches of load cases are in their file, as external = [...], or in LoadCase.external")
    if cases is None or isinstance(cases, (str, os.PathLike)):
        loaded, carried = with_payloads(model, payloads)
        if cases is not None:
            return read_cases(loaded, cases, placement, motion if isinstance(motion, (str, os.PathLike)) else None, carried, reading)
        case, files = one_case(loaded, motion, placement, carried, external, reading)
        return [case], files
    if not all(isinstance(case, LoadCase) for case in cases):
        raise MotionError("cases: expected a file of load cases, or a list of ksl.load_cases.load_case.LoadCase")
    if payloads:
        raise MotionError("payloads and cases: each load case has the model that carries its payloads; give them there")
    if not cases:
        raise MotionError("compute_loads: no load cases")
    return [replace(case, placement=placement) for case in cases], []
