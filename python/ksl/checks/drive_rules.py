"""Rules of joints that motors move through loops: whether the motors can give what their limits allow."""

from __future__ import annotations

from collections.abc import Iterator

from ksl.checks.description.robot import RobotFile
from ksl.checks.rule import Broken, rule
from ksl.drivetrain.actuation import Actuation
from ksl.drivetrain.judged_limits import JudgedLimit, judged_limits
from ksl.drivetrain.parts import driven_outputs

CARED_FOR = 0.05
"""A share of the range in which motors may give less than an effort or velocity limit says."""


@rule(
    "loop-limits",
    "warning",
    condition="Limits of a joint that motors move through loops are no larger than what the motors give: positions that they reach and hold, efforts and velocities within theirs.",
    cause="Limits of a serial model, or of a catalogue, that were kept when the mechanism was added. Simulators and controllers then ask for what the mechanism can't give.",
    repair="Give limits that the motors reach; ksl actuation shows what they give over the range, and writes limits for a serial model.",
)
def loop_limits(robot: RobotFile) -> Iterator[Broken]:
    loops = robot.loops
    if loops is None or loops.failed is not None or loops.model.drives is None:
        return
    for joints in driven_outputs(loops.model):
        try:
            judged = judged_limits(Actuation(loops.model, joints))
        except ValueError:  # no map: other rules say what is wrong with the drives
            continue
        yield from (_broken(robot, row) for row in judged if _is_too_large(row))


def _is_too_large(row: JudgedLimit) -> bool:
    return row.judgement == "too large" or (row.judgement == "partly too large" and row.share > CARED_FOR)


def _broken(robot: RobotFile, row: JudgedLimit) -> Broken:
    of_motors = row.what in ("effort", "velocity")
    given = f", {row.least:.4g} to {row.most:.4g}" if of_motors else ""
    found = f"its {row.what} limit, {row.given:.4g}, is {row.judgement}: {row.reason}{given}"
    return Broken(found, robot.lines_of_joints.get(row.joint), "joint", row.joint, row.given, severity="note" if of_motors else None)
