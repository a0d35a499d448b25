"""Rules of joints: axes, mimic joints, damping and friction."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ksl.checks.description.findings import Repair
from ksl.checks.description.repair import digits, remove, set_attribute, shown
from ksl.checks.description.robot import ONE_COORDINATE, WITH_AXIS, FileJoint, Mimic, RobotFile
from ksl.checks.rule import Broken, rule
from ksl.checks.description.xml_file import children, line_of, to_float

CLOSES = "Positions of joints that close loops are no coordinates, and their efforts no drives'. Which joint of a loop that is doesn't change its motion."
CUT_ELSEWHERE = "State another joint of the loop as the one that closes it, and this one by <joint>; or name another drive, --drives."
"""What is said of a transmission of a joint that closes a loop."""
UNIT = 1e-3
"""How far the length of an axis may be from 1: three printed digits, 0.577 0.577 0.577, are rounded no further."""


@rule(
    "axis-zero",
    "error",
    condition="The axis of a moving joint has a direction.",
    cause="A template was not filled in, or the joint was meant to be fixed.",
    repair='Give the direction of motion, <axis xyz="0 0 1"/> for example, or make the joint fixed.',
)
def axis_zero(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        if joint.kind in WITH_AXIS and joint.axis is not None and not joint.axis.any():
            yield Broken("axis 0 0 0", joint.axis_line, "joint", joint.name, 0.0)


@rule(
    "axis-not-unit",
    "warning",
    condition=f"The axis of a moving joint has the length 1, to {UNIT:g}.",
    cause="Written as a direction only. KSL divides by the length; readers that don't scale the motion by it.",
    repair="Divide the axis by its length.",
    fix="divides the axis by its length",
)
def axis_not_unit(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        if joint.kind not in WITH_AXIS or joint.axis is None or not joint.axis.any():
            continue
        largest = float(abs(joint.axis).max())
        shape = joint.axis / largest  # the square of a large number may be beyond the range of numbers
        length = largest * float(np.linalg.norm(shape))
        if abs(length - 1) > UNIT:
            unit = " ".join(digits(x) for x in shape / np.linalg.norm(shape))
            given = " ".join(shown(x) for x in joint.axis)
            fix = set_attribute(joint.axis_element, "xyz", unit) if robot.format == "urdf" else None
            yield Broken(f"axis {given} has the length {length:.6g}", joint.axis_line, "joint", joint.name, length, fix=fix)


@rule(
    "axis-missing",
    "warning",
    condition="A joint that turns about an axis or slides along one says which.",
    cause="Left out. URDF then takes x, while many expect z.",
    repair='Add <axis xyz="1 0 0"/> if x is meant, or the axis that is meant.',
    fix='writes the axis that the format takes, <axis xyz="1 0 0"/>',
    formats=("urdf",),
    whole=True,
)
def axis_missing(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        if joint.kind in WITH_AXIS and joint.axis_element is None and joint.element is not None and joint.element.tag == "joint":
            yield Broken(f"{joint.kind} joint without <axis>", joint.line, "joint", joint.name, fix=_with_axis(joint))


def _with_axis(joint: FileJoint) -> Repair:
    def change() -> str:
        from lxml import etree

        assert joint.element is not None
        last = joint.element[-1] if len(joint.element) else None
        axis = etree.SubElement(joint.element, "axis", xyz="1 0 0")
        if last is not None:  # on a line of its own, as the elements before it
            axis.tail, last.tail = last.tail, joint.element.text
        return 'added <axis xyz="1 0 0"/>, the default of URDF'

    return change


SHOWN = 8
"""Joints of a chain that a message names: the first ones and the last."""


class Chain(NamedTuple):
    """What a mimic joint follows at the end: its position is multiplier · that of `lead` + offset."""

    lead: FileJoint
    multiplier: float
    offset: float
    length: int
    """Joints of the chain, with both ends."""


def _followed(robot: RobotFile, joint: FileJoint) -> FileJoint | None:
    return robot.joint_of.get(joint.mimic.leader) if joint.mimic else None


def _arrows(names: list[str], count: int | None = None) -> str:
    """a → b → c; of long chains the first joints, how many are left out, and the last.  count: of the whole chain, if `names` are not all."""
    more = (len(names) if count is None else count) - SHOWN
    return " → ".join(names) if more <= 0 else " → ".join([*names[: SHOWN - 1], f"… ({more} more)", names[-1]])


def _chains(robot: RobotFile) -> dict[int, Chain]:
    """{id of a mimic joint: its chain}, without joints of loops and of chains that end at a joint that is missing.

    O(joints): each joint is visited once.
    """
    chains: dict[int, Chain] = {}
    done: set[int] = set()
    for start in robot.joints:
        path: list[FileJoint] = []
        joint: FileJoint | None = start
        while joint is not None and joint.mimic and id(joint) not in done:
            done.add(id(joint))
            path.append(joint)
            joint = _followed(robot, joint)
        if joint is None:
            continue
        chain = Chain(joint, 1.0, 0.0, 1) if joint.mimic is None else chains.get(id(joint))
        for each in reversed(path) if chain else ():  # q = m (m' q' + o') + o
            assert chain and each.mimic
            m, o = each.mimic.multiplier, each.mimic.offset
            chain = chains[id(each)] = Chain(chain.lead, m * chain.multiplier, o + m * chain.offset, chain.length + 1)
    return chains


@rule(
    "mimic-unknown",
    "error",
    condition="A mimic joint follows a joint of the file.",
    cause="The joint was renamed or removed, or its name is misspelt.",
    repair="Correct the name, or remove <mimic>.",
    fix="corrects the name where only capitals or spaces at its ends differ",
    accept="takes the joint whose name ends like this one's leader and begins like its own",
    formats=("urdf", "sdf"),
    whole=True,
)
def mimic_unknown(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        if joint.mimic and joint.mimic.leader not in robot.joint_of:
            name = joint.mimic.leader
            same = robot.joint_names.same(name)
            prefixed = _with_prefix(robot, joint.name, name)
            fix = set_attribute(joint.mimic.element, "joint", same[0]) if len(same) == 1 and robot.format == "urdf" else None
            guess = set_attribute(joint.mimic.element, "joint", prefixed) if prefixed and robot.format == "urdf" else None
            repair = f"Did you mean {prefixed}?" if prefixed else robot.joint_names.suggest(name)
            found = f'it mimics joint "{name}", which does not exist'
            yield Broken(
                found, joint.mimic.line, "joint", joint.name, repair=repair, cause="A prefix was left out." if prefixed else None, fix=fix, guess=guess
            )


LONGEST_PREFIX = 200
"""Characters of a name that are tried as a prefix."""


def _with_prefix(robot: RobotFile, follower: str, leader: str) -> str | None:
    """left_thumb_1 for the leader thumb_1 of left_thumb_2: what a macro with a prefix that one name lacks was meant
    to say."""
    prefixes = [follower[:k] for k in range(min(len(follower), LONGEST_PREFIX) + 1)] if leader else []
    found = [p + leader for p in prefixes if p + leader in robot.joint_of and p + leader != follower]
    return found[0] if len(found) == 1 else None


@rule(
    "mimic-kind",
    "error",
    condition="A mimic joint and the joint that it follows have one coordinate each.",
    cause="One of them was made fixed, or has several coordinates.",
    repair="Remove <mimic>, or name a joint with one coordinate.",
)
def mimic_kind(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        leader = robot.joint_of.get(joint.mimic.leader) if joint.mimic else None
        if joint.mimic and joint.kind not in ("", "fixed", *ONE_COORDINATE):
            yield Broken(f"it mimics joint {joint.mimic.leader} and is {joint.kind}", joint.mimic.line, "joint", joint.name)
        elif joint.mimic and joint.kind != "fixed" and leader and leader.kind and leader.kind not in ONE_COORDINATE:
            yield Broken(f"it mimics joint {leader.name}, which is {leader.kind}", joint.mimic.line, "joint", joint.name)


@rule(
    "mimic-fixed",
    "warning",
    condition="A fixed joint mimics no other.",
    cause="The joint was made fixed and <mimic> was left. It has no effect; some readers refuse it.",
    repair="Remove <mimic>.",
    fix="removes <mimic> from all fixed joints",
    formats=("urdf",),
)
def mimic_fixed(robot: RobotFile) -> Iterator[Broken]:
    fixed = [joint for joint in robot.joints if joint.mimic and joint.kind == "fixed"]
    for joint in fixed[:1]:
        assert joint.mimic
        more = f", and so do {len(fixed) - 1} more fixed joints" if len(fixed) > 1 else ""
        yield Broken(f"it mimics joint {joint.mimic.leader}{more}", joint.mimic.line, "joint", joint.name, float(len(fixed)), fix=_without_mimic(fixed))


def _without_mimic(joints: list[FileJoint]) -> Repair:
    def change() -> str:
        for joint in joints:
            if joint.mimic and joint.mimic.element is not None and joint.element is not None:
                remove(joint.mimic.element)
        return f"<mimic> removed from {', '.join(joint.name for joint in joints)}"

    return change


@rule(
    "mimic-loop",
    "error",
    condition="Of joints that mimic each other one leads.",
    cause="Two joints name each other, or a joint names itself.",
    repair="Remove <mimic> from the joint that shall lead.",
)
def mimic_loop(robot: RobotFile) -> Iterator[Broken]:
    done: set[int] = set()
    for joint in robot.joints:
        path: dict[int, FileJoint] = {}
        at: FileJoint | None = joint
        while at is not None and id(at) not in done and id(at) not in path:
            path[id(at)] = at
            at = _followed(robot, at)
        done.update(path)
        if at is not None and id(at) in path:
            assert joint.mimic
            followed = list(path.values())
            found = f"it mimics {_arrows([*(j.name for j in followed[1:]), _leader(followed[-1])])}: no joint leads"
            yield Broken(found, joint.mimic.line, "joint", joint.name)


def _leader(joint: FileJoint) -> str:
    return joint.mimic.leader if joint.mimic else ""


@rule(
    "mimic-chain",
    "warning",
    condition="A mimic joint follows a joint that is none.",
    cause=(
        "Fingers with several joints, each written as a follower of the one before. KSL follows the "
        "chain; some readers take the first leader's position as it is, or refuse."
    ),
    repair="Name the joint that leads all of them, with the product of the multipliers.",
    fix="names the joint that leads all of them, with the product of the multipliers and the offset that belongs to it",
    formats=("urdf", "sdf"),
)
def mimic_chain(robot: RobotFile) -> Iterator[Broken]:
    chains = _chains(robot)
    for joint in robot.joints:
        if joint.mimic is None or id(joint) not in chains or chains[id(joint)].length < 3:
            continue
        lead, multiplier, offset, count = chains[id(joint)]
        direct = Mimic(joint.mimic.line, joint.mimic.element, lead.name, multiplier, offset)
        first: list[str] = []
        at = _followed(robot, joint)
        while at is not None and at is not lead and len(first) < SHOWN:
            first.append(at.name)
            at = _followed(robot, at)
        names = _arrows([*first, lead.name], count - 1)
        repair = f"Name {direct.leader} with the multiplier {shown(multiplier)} and the offset {shown(offset)}."
        yield Broken(f"it mimics {names}", joint.mimic.line, "joint", joint.name, repair=repair, fix=_direct(direct) if robot.format == "urdf" else None)


def _direct(mimic: Mimic) -> Repair:
    def change() -> str:
        element = mimic.element
        assert element is not None
        old = element.get("joint")
        for name, value in (("joint", mimic.leader), ("multiplier", digits(mimic.multiplier)), ("offset", digits(mimic.offset))):
            element.set(name, value)
        return f"<mimic> named {old}; now {mimic.leader}, multiplier {shown(mimic.multiplier)}, offset {shown(mimic.offset)}"

    return change


@rule(
    "dynamics-negative",
    "error",
    condition="Damping and friction are zero or more.",
    cause="A wrong sign. A negative damping drives the joint.",
    repair="Correct the sign or the number.",
)
def dynamics_negative(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        for what, value in (("damping", joint.damping), ("friction", joint.friction)):
            if value is not None and value < 0:
                yield Broken(f"{what} {shown(value)}", joint.dynamics_line or joint.line, "joint", joint.name, value)


@rule(
    "transmission-unused",
    "warning",
    condition="A transmission names a joint of the file; its <mechanicalReduction> is a number other than 0, and its <motorInertia>, kg m², one that is not negative.",
    cause="The joint was renamed or removed, or a number was left out, has a wrong sign or a unit. Readers leave rotor and gear of this joint out.",
    repair="Correct the name of the joint or the number.",
    formats=("urdf",),
)
def transmission_unused(robot: RobotFile) -> Iterator[Broken]:
    for each in () if robot.root is None else children(robot.root, "transmission"):
        name = each.get("name", "")
        joints = [joint for joint in children(each, "joint") if joint.get("name") is not None]
        loops = () if robot.model is None else robot.model.loop_names
        for joint in joints:
            if joint.get("name") in loops:
                yield Broken(
                    f'transmission "{name}" is of joint "{joint.get("name")}", which closes a loop, and so is no drive',
                    line_of(joint),
                    cause=CLOSES,
                    repair=CUT_ELSEWHERE,
                )
            elif joint.get("name") not in robot.joint_of:
                yield Broken(f'transmission "{name}" is of joint "{joint.get("name")}", which does not exist', line_of(joint))
        for given in each.iter("mechanicalReduction", "motorInertia"):
            text, is_ratio = (given.text or "").strip(), given.tag == "mechanicalReduction"
            number = to_float(text)
            if "${" not in text and (number is None or not np.isfinite(number) or (number == 0 if is_ratio else number < 0)):
                expected = "a number other than 0" if is_ratio else "kg m², 0 or more"
                yield Broken(f'<{given.tag}> of transmission "{name}" is "{text[:60]}", expected {expected}', line_of(given))
