"""`ksl.hold`: every wrench of a robot at rest, in one pose or in the worst one for a joint."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, cast

from ksl.base.files_read import InputFile
from ksl.load_cases.closed_poses import closed_pose, named_joints
from ksl.load_cases.case_files.given_cases import checked
from ksl.load_cases.holding import Pose, given_pose, worst_pose
from ksl.load_cases.load_case import LoadCase, Payload, Placement
from ksl.load_cases.poses import held_still, neutral, pose_of
from ksl.load_cases.provenance import provenance_of
from ksl.load_cases.reaction_joints import has_drive
from ksl.robot_files.loading import load
from ksl.model.model import Model
from ksl.mechanism.states import Order, Point, Side
from ksl.report.loads_run import Run


def held_by(model: Model) -> str:
    """What holds a robot at rest, in words."""
    if any(has_drive(model, joint) for joint in model.joints):
        return "held at rest by the drives"
    return "held at rest by the structure itself: it has no drives and no freedoms"  # one with freedoms and no drives can't be held


def hold(
    model: Model | str | os.PathLike[str],
    pose: Pose | None = None,
    worst: str | None = None,
    quantity: str = "effort",
    *,
    payloads: Sequence[Payload] = (),
    on: Side = "child",
    at: Point = "joint",
    axes: str = "joint",
    order: Order = "lin_ang",
    seed: int = 0,
    inputs: Sequence[InputFile] = (),
    options: Mapping[str, Any] | None = None,
    command: str = "",
) -> Run:
    """Efforts and every wrench of a robot at rest in one pose, as a run with one sample.

    model: a model, or the robot's file.  pose: {joint: position}, rad or m, or q (nq); joints that are not named are at zero, or as near
    to it as limits let them; in a mechanism with loops they follow those that are named.  worst: a joint; the pose is then searched in which its `quantity` is largest in magnitude, within the
    limits of all joints with one coordinate that `pose` doesn't name (angles without limits: a whole turn; slides without limits stay).
    quantity: "effort"; a component fx … tz of the wrench as expressed by on, at and axes; or, of its joint's axis, "axial_force",
    "radial_force", "axial_moment", "bending_moment"; or "force", "moment", magnitudes.
    payloads: what the model carries already, for the provenance; nothing is added to the model.  on, at, axes, order: as in :meth:`Model.reactions`.

    The search tries 4096 random poses of that seed at once, and refines the 12 best by a quasi-Newton method within bounds (L-BFGS-B);
    it is reproducible, and finds the largest value unless that has a very narrow peak.  How many of the 12 came to the same value is in `run.cases[0].kind`,
    the pose is `run.cases[0].motion.q[0]`.
    Raises MotionError or ValueError.  inputs, options, command: for the provenance, files beside those of the robot, what made the model, and who asked.

        run = ksl.hold("robot.urdf", {"elbow": 1.5})
        worst = ksl.hold("robot.urdf", worst="elbow").cases[0].motion.q[0]
    """
    if isinstance(payloads, Mapping) or not all(isinstance(p, Payload) for p in payloads):
        said = "payloads only describe what the model carries already, each as a ksl.load_cases.load_case.Payload"
        raise ValueError(f"{said}; to add some, give {{link: (mass, point)}} to ksl.load, or use Model.with_payload")
    robot = model if isinstance(model, Model) else load(model)
    placement = checked(robot, Placement(on, at, axes, order))
    named = isinstance(pose, Mapping)
    q = neutral(robot) if pose is None else pose_of(robot, cast("Mapping[str, Any]", pose)) if named else given_pose(robot, pose)
    closing = None
    if robot.loops:
        q, closing = closed_pose(robot, q, named_joints(robot, pose))
    name, kind = "pose", held_by(robot)
    if worst is not None:
        fixed = set(named_joints(robot, pose)) if named else set()
        search = worst_pose(robot, worst, quantity, placement, q, fixed, seed)
        q = search.q
        name, kind = f"worst {quantity} of {worst}", f"{kind}, in the pose with the largest {quantity} of {worst} (seed {seed}; {search})"
    case = LoadCase(robot, held_still(robot, q, closing), placement, name=name, payloads=payloads, kind=kind, static=True)
    run = Run([case], provenance_of([case], [*robot.inputs, *inputs], options or {}, command))
    run.compute()
    return run
