"""Rules of mechanisms with loops: whether they close, which constraints are redundant, singular positions, drives.

They look at the loaded model.  A file that is refused has what the loader says, and its loops are not looked at.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from ksl.checks.loop_advice import Advice, Group, advice, components, groups, is_across_a_plane, turn_about_one_direction
from ksl.checks.description.loop_positions import LoopPositions, moving
from ksl.checks.description.robot import RobotFile
from ksl.checks.rule import Broken, rule
from ksl.mechanism.freedoms import idle_bodies, leads
from ksl.mechanism.loops import TOLERANCES
from ksl.mechanism.mechanism import Joint, Loop
from ksl.mechanism.joint_kinds import units_of
from ksl.mechanism.states import Array

PARALLEL = TOLERANCES["rank"]
"""Angle between two axes, rad, below which they are parallel."""
ROUNDED = 2 * TOLERANCES["few_digits"]
"""Errors of loops, as a share of the mechanism's length, and angles, rad, that are likely due to few digits."""
CLOSED = TOLERANCES["closed"]
"""A share of the mechanism's length: errors up to there are closed loops, as of Model.close."""
SINGULAR = TOLERANCES["nearly_singular"]
"""The smallest singular value that counts, relative to the largest term of the equations, below which a position is near a singular one."""
FEW_DIGITS = "Angles of few digits: 1.5708 stands for π/2."
DEAD_CENTRE = "Crank and rod are in line, for example: the drives don't move the rest there, and inverse dynamics is refused."
SURPLUS = "Motors that work together or against each other, or a passive joint that is named as a drive."
PLANAR = "Parallel axes: a planar linkage, as nearly all are built. What is redundant acts across its plane, where play and elasticity take it up; rigid bodies don't determine it."
NAMES = 5
"""So many names stand in a sentence."""


@rule(
    "loop-frames",
    "error",
    condition="Where nothing turns one side of a loop joint against the other, its axis has one direction on both sides.",
    cause="The frame or the axis of one side was written for another position, or in the axes of the other link.",
    repair="Correct the rotation of one of the frames, or give the axis of each side in the axes of its own link (parent_axis and child_axis of <constraint>).",
)
def loop_frames(robot: RobotFile) -> Iterator[Broken]:
    loops = robot.loops
    if loops is None:
        return
    for loop in loops.model.loops:
        if loop.turned or loop.moved:
            found = (
                f"its frames were off by {_angle(loop.turned)} and {loop.moved:.3g} m, and have been made exact: the loop closes only where they fit exactly"
            )
            cause = f"{FEW_DIGITS} Or lengths of few digits."
            yield Broken(
                found, _line(robot, loop.name), "joint", loop.name, loop.turned or loop.moved, cause, "Give angles and lengths with all digits.", "note"
            )
    if loops.failed is None:
        return  # the joints turn the axes into each other
    for loop, angle in _apart(loops):
        rounded = f"{FEW_DIGITS} The loop closes only where its axes are parallel exactly." if angle < ROUNDED else None
        repair = "Give the angles with all digits, or use a kind of joint that has no axis there: spherical." if angle < ROUNDED else None
        yield Broken(
            f"the axes of both sides are {_angle(angle)} apart at the zero position", _line(robot, loop.name), "joint", loop.name, angle, rounded, repair
        )


def _apart(loops: LoopPositions) -> list[tuple[Loop, float]]:
    angles = [(loop, loops.frames_apart(loop)) for loop in loops.model.loops]
    return [(loop, angle) for loop, angle in angles if angle is not None and angle > PARALLEL]


@rule(
    "loop-open",
    "error",
    condition="The loops close in some position near the zero position of the file, to 1e-12 of the mechanism's length.",
    cause="A length, an origin or a joint's place is wrong, or links are too short to meet.",
    repair="Correct the origins of the joints of this loop.",
)
def loop_open(robot: RobotFile) -> Iterator[Broken]:
    loops = robot.loops
    if loops is None or loops.failed is None:
        return
    explained = {loop.name for loop, _ in _apart(loops)}
    for loop, at_zero, left in zip(loops.model.loops, loops.open_by, loops.failed.left):
        if left <= CLOSED * loops.length or loop.name in explained:
            continue
        found = f"open by {at_zero:.3g} m at the zero position; the search for a closed one ends with {left:.3g} m ({loops.failed.reason})"
        few = left < ROUNDED * loops.length
        cause = (
            "Numbers of few digits: the loops have more equations than the motion needs, and close only where the dimensions agree exactly." if few else None
        )
        repair = f"Give the numbers with all digits, or make {loop.name} a joint of a kind with fewer equations, a spherical one for example." if few else None
        yield Broken(found, _line(robot, loop.name), "joint", loop.name, float(left), cause, repair)


@rule(
    "loop-open-at-zero",
    "note",
    condition="The loops are closed where all joints are at zero.",
    cause="Origins and axes are those of single parts, or of another position. KSL closes the loops from there.",
    repair="Nothing is wrong. Take positions from Model.close, or give the joints' origins in a closed position.",
)
def loop_open_at_zero(robot: RobotFile) -> Iterator[Broken]:
    loops = robot.loops
    if loops is None or loops.near is None or loops.open_by.max() <= CLOSED * loops.length:
        return
    worst = int(np.argmax(loops.open_by))
    distance = np.abs(loops.moved(loops.near))
    joint = max((j for j in loops.model.joints if j.nv), key=lambda j: float(distance[j.v_index : j.v_index + j.nv].max()))
    k = int(np.argmax(distance[joint.v_index : joint.v_index + joint.nv]))
    most, unit = float(distance[joint.v_index + k]), units_of(joint)[1][k]
    where = "the nearest closed position" if loops.is_beside else "a closed position, found from random ones,"
    loop = loops.model.loops[worst]
    cause = "Numbers of few digits. KSL closes the loops from there." if loops.open_by[worst] < ROUNDED * loops.length else None
    yield Broken(
        f"open by {loops.open_by[worst]:.3g} m at zero; {where} has {joint.name} {most:.3g} {unit} from there",
        _line(robot, loop.name),
        "joint",
        loop.name,
        float(loops.open_by[worst]),
        cause,
    )


@rule(
    "loop-singular",
    "warning",
    condition="At the closed position nearest to zero the loops' equations have the rank that they have around it, and no singular value below 0.001 of their largest term.",
    cause="Links in one line, or flat on each other, as mechanisms are often drawn. Motions and reactions are not determined there, or very large.",
    repair="Give the file another position, or start motions elsewhere: Model.close from a position away from it.",
)
def loop_singular(robot: RobotFile) -> Iterator[Broken]:
    loops = robot.loops
    if loops is None or loops.near is None:
        return
    here, around = loops.near_freedoms, loops.freedoms
    loop = loops.model.loops[0]
    if here.rank < around.rank:
        more = here.mobility - around.mobility
        found = f"{here.mobility} freedoms at the closed position nearest to zero, {more} more than around it"
        yield Broken(found, _line(robot, loop.name), "joint", loop.name, float(more))
    elif here.rank and here.smallest < SINGULAR and here.smallest < 0.1 * around.smallest:
        found = f"the smallest singular value is {here.smallest:.2g} of the largest term at the closed position nearest to zero, and {around.smallest:.2g} beside it"
        yield Broken(found, _line(robot, loop.name), "joint", loop.name, here.smallest)


@rule(
    "loop-redundant",
    "note",
    condition="No constraint of the loops follows from the others.",
    cause="More bearings than needed, or a mechanism that moves only because of its dimensions: any error of them jams it, and rigid bodies don't determine all components of the reactions.",
    repair="No other kind of a single joint keeps the motion with fewer constraints. Give stiffnesses if the reactions are needed.",
)
def loop_redundant(robot: RobotFile) -> Iterator[Broken]:
    loops = robot.loops
    if loops is None or loops.near is None or not loops.freedoms.redundant:
        return
    model, q = loops.model, loops.ordinary
    joints: list[Joint | Loop] = [*moving(model.joints), *model.loops]
    patterns = model.reactions_null_basis(q, [joint.name for joint in joints])
    rows = Counter(name for name, _ in loops.freedoms.redundant_rows)
    for group in groups(patterns, joints):
        loop = next(joint for joint in group.joints if isinstance(joint, Loop))
        repair, cause = _advised(advice(model, group.patterns, group.joints)), None
        axes = [loops.axes(joint, q) for joint in group.joints]
        planar = is_across_a_plane(group.patterns, axes) and turn_about_one_direction(group.joints, axes)
        if planar:
            cause, repair = PLANAR, f"Nothing, unless reactions across the plane are needed. Then: {repair or 'Give stiffnesses.'}"
        yield Broken(
            _redundant(group, rows), _line(robot, loop.name), "joint", loop.name, float(len(group.patterns)), cause, repair, "note" if planar else "warning"
        )


def _redundant(group: Group, rows: Mapping[str, int]) -> str:
    """How many equations of which loop joints are redundant, and what that leaves open, in words."""
    loops = [(i, joint) for i, joint in enumerate(group.joints) if isinstance(joint, Loop)]
    i, first = loops[0]
    closing = [joint for _, joint in loops if rows[joint.name]] or [first]
    equations, count = sum(joint.equations for joint in closing), len(group.patterns)
    whose = f"its {equations} equations" if closing == [first] else f"the {equations} equations of {_list(joint.name for joint in closing)}"
    others = [joint.name for joint in group.joints if joint is not first]
    also = f"; of {_list(others)} some, too" if others else ""
    of_first = components(first, group.patterns[:, i]) + (f" of {first.name}" if len(closing) > 1 else "")
    return f"{count} of {whose} follow{'s' if count == 1 else ''} from the others; not determined are {of_first}{also}"


def _advised(found: Advice) -> str | None:
    """What to do in words; None where no change helps."""
    if not found.changes:
        return None
    words = []
    for change in found.changes[:NAMES]:
        axis = "" if change.second_axis is None else f" with the second axis {' '.join(f'{x:g}' for x in change.second_axis)}"
        words.append(f"{change.joint} {change.kind}{axis} ({change.fewer} fewer)")
    more = f", and {len(found.changes) - NAMES} more" if len(found.changes) > NAMES else ""
    left = "nothing is redundant then" if not found.left else f"{found.left} stay{'s' if found.left == 1 else ''} redundant"
    return f"Make {' and '.join(words)}{more}: the mechanism moves as before, and {left}. Or give stiffnesses."


@rule(
    "loop-rigid",
    "note",
    condition="The mechanism moves: it has at least one freedom.",
    cause="A truss, or one joint too many. Statics and reactions are computed.",
    repair="Nothing, if it shall not move. Otherwise remove a joint, or use kinds with more freedoms.",
)
def loop_rigid(robot: RobotFile) -> Iterator[Broken]:
    loops = robot.loops
    if loops is None or loops.near is None or loops.freedoms.mobility:
        return
    loop = loops.model.loops[0]
    rows = sum(each.equations for each in loops.model.loops)
    yield Broken(
        f"{loops.model.nv} coordinates, {loops.freedoms.rank} independent equations of {rows}: no freedom is left",
        _line(robot, loop.name),
        "joint",
        loop.name,
        0.0,
    )


@rule(
    "loop-drives-unknown",
    "note",
    condition="The file of a mechanism with loops says which joints have motors.",
    cause="URDF names them by <transmission> or <ros2_control>, MJCF by <actuator>, SDF not at all, and this file names none. Inverse dynamics and reactions need to know them.",
    repair="Name as many drives as there are freedoms when the file is loaded: --drives, drives= in Python.",
)
def loop_drives_unknown(robot: RobotFile) -> Iterator[Broken]:
    loops = robot.loops
    if loops is None or loops.near is None or loops.model.drives is not None or not loops.freedoms.mobility:
        return
    loop = loops.model.loops[0]
    freedoms = loops.freedoms.mobility
    motions = loops.motions(loops.ordinary)
    names = [joint.name for joint in moving(loops.model.joints) if _rank(motions[joint.v_index : joint.v_index + joint.nv])]
    candidates = _list(names, "or")
    found = f"{freedoms} freedom{'s' if freedoms > 1 else ''}, and no drive is named; candidates: {candidates}"
    yield Broken(found, _line(robot, loop.name), "joint", loop.name, float(freedoms))


@rule(
    "loop-drives",
    "warning",
    condition="A mechanism with loops has as many drives as freedoms, and they determine its motion.",
    cause="A motor that the file doesn't name, a rod that turns about itself between two ball joints and whose mass is to one side, or a passive joint that is named as a drive.",
    repair="Name the drives when the file is loaded (--drives, drives= in Python), or correct what the file says of them.",
)
def loop_drives(robot: RobotFile) -> Iterator[Broken]:
    loops = robot.loops
    if loops is None or loops.near is None or loops.model.drives is None or not loops.freedoms.mobility:
        return
    model, drives = loops.model, loops.model.drives
    held = [joint for joint in model.joints if joint.nv and leads(model, joint)]
    driven = [row for joint in held for row in range(joint.v_index, joint.v_index + joint.nv)]
    idle = idle_bodies(model)  # which need none
    least = [(motions.shape[1] - idle - _rank(motions[driven]), motions) for motions in map(loops.motions, loops.positions)]
    left, motions = min(least, key=lambda item: item[0])  # a dead centre of the drives is no lack of them
    loop = model.loops[0]
    named = f"{len(drives)} drive{'s' if len(drives) != 1 else ''}, {_list(drives)}, " if drives else "no drive "
    freedoms = motions.shape[1] - idle
    has = f"for {freedoms} freedom{'s' if freedoms != 1 else ''}"
    if left:
        loose = _left_moving(loops, motions, driven)
        found = f"{named}{has}: with the drives at rest {left} {'is' if left == 1 else 'are'} left, of {_list(loose)}"
        yield Broken(found, _line(robot, loop.name), "joint", loop.name, float(left))
    elif least[0][0] > loops.near_freedoms.mobility - loops.freedoms.mobility:
        loose = _left_moving(loops, least[0][1], driven)
        found = f"{named}{has}: a dead centre at the closed position nearest to zero, where {_list(loose)} can move with the drives at rest"
        yield Broken(found, _line(robot, loop.name), "joint", loop.name, float(least[0][0]), DEAD_CENTRE, "Start motions elsewhere.", "note")
    elif surplus := len(driven) - freedoms:
        repair = "Nothing, if the motors work against each other. Efforts are then those of least norm. Otherwise name fewer drives."
        found = f"{named}{has}: {surplus} more than the motion needs"
        yield Broken(found, _line(robot, loop.name), "joint", loop.name, float(-surplus), SURPLUS, repair, "note")


def _left_moving(loops: LoopPositions, motions: Array, driven: Sequence[int]) -> list[str]:
    """Joints that move while the drives don't."""
    kept = motions
    if driven:
        of_drives = motions[list(driven)]
        kept = motions @ np.linalg.svd(of_drives)[2][_rank(of_drives) :].T
    return [j.name for j in loops.model.joints if j.nv and np.abs(kept[j.v_index : j.v_index + j.nv]).max(initial=0.0) > TOLERANCES["rank"]]


def _rank(motions: Array) -> int:
    return int(np.linalg.matrix_rank(motions, tol=TOLERANCES["rank"])) if motions.size else 0


def _line(robot: RobotFile, loop: str) -> int | None:
    """In MJCF two of `connect` that make one joint have its name and more."""
    lines = robot.lines_of_joints
    return lines[loop] if loop in lines else next((line for name, line in lines.items() if robot.format == "mjcf" and name.startswith(loop)), None)


def _list(names: Iterable[str], last: str = "and") -> str:
    """`A, B and C`, of long lists the beginning."""
    given = list(names)
    if len(given) > NAMES:
        return f"{', '.join(given[:NAMES])} {last} {len(given) - NAMES} more"
    return f" {last} ".join(filter(None, [", ".join(given[:-1]), *given[-1:]]))


def _angle(angle: float) -> str:
    return f"{np.degrees(angle):.3g}°" if angle >= ROUNDED else f"{angle:.2g} rad"
