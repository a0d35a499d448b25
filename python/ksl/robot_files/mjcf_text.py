"""MJCF text of a model: a tree of bodies, equality constraints for its loops and mimic joints, a motor for each drive."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ksl.base.input_files import path_given
from ksl.base.rotations import quaternion_of
from ksl.mechanism.mechanism import Joint, Loop
from ksl.mechanism.states import Array
from ksl.model.model import Model
from ksl.robot_files.assembly import unused

KINDS = {"revolute": "hinge", "continuous": "hinge", "prismatic": "slide", "spherical": "ball", "floating": "free"}
LEAST = "1e-9"
"""kg and kg m² that MuJoCo gives to moving bodies without mass, which it refuses."""
FLAT = 1e-9
"""What the moments of points, rods and plates get besides, of the largest: MuJoCo refuses what rounding leaves of them."""
WORLD, BEYOND = "world", 1e10
"""The name that MuJoCo gives to the ground, and what its numbers can't exceed: where a joint has a limit on one side alone."""


def mjcf_text(m: Model) -> str:
    """The robot as MJCF: every inertia that a joint feels, `armature` and rotor through its gear, is its armature; effort limits are
    `actuatorfrcrange`; loops are `equality` constraints, soft ones, between sites; each drive is a motor, named as its joint.

    A model without named drives has a motor at each joint that has one coordinate and an effort limit.  Damping, dry friction and springs are written as the file
    has them, whatever physics= names.  Points, rods and plates, whose moments MuJoCo refuses where they are rounded, get a billionth of their largest moment about every axis.
    Raises ValueError for kinds of joints, moments and limits that MuJoCo doesn't have, and for force elements.

        Path("leg.xml").write_text(ksl.mjcf.text(m))
    """
    if m.force_elements:
        raise ValueError(f"force element {m.force_elements[0].name}: it is not written as MJCF; leave it out of the file")
    root = ET.Element("mujoco", model=m.name or "robot")
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(root, "option", gravity=_text(m.gravity))
    world = ET.SubElement(root, "worldbody")
    drawn = m.neutral()
    poses = {link.name: m.frame_pose(drawn, link.name) for link in m.links}
    bodies: dict[str, ET.Element] = {}
    for link in m.links:  # parents first
        above = m.joint_above(link.name)
        parent = above.parent
        if link.name == WORLD and parent is None and not above.nv and link.mass == 0:
            bodies[link.name] = world
            continue
        if above.kind == "floating" and parent is not None:
            _require_at_rest(m, above)
            parent = None
        X = poses[link.name] if parent is None else _inverse(poses[parent]) @ poses[link.name]
        name = link.name if link.name != WORLD else unused(WORLD, poses)
        body = ET.SubElement(world if parent is None else bodies[parent], "body", name=name, pos=_text(X[:3, 3]), quat=_quaternion(X[:3, :3]))
        bodies[link.name] = body
        moves = above.nv > 0 or above.leader is not None
        if moves:
            _add_joint(body, above, float(m.position_of(above, drawn)) if above.one_coordinate else 0.0)
        _add_inertia(m, body, link.name, moves)
    constraints = _constraints(m, bodies)
    if len(constraints):
        root.append(constraints)
    motors = [joint for joint in m.joints if (joint.name in m.drives if m.drives is not None else joint.nv == 1 and joint.effort)]
    if motors:
        actuators = ET.SubElement(root, "actuator")
        for joint in motors:
            limit = {"ctrlrange": _text((-joint.effort, joint.effort))} if joint.effort else {}
            ET.SubElement(actuators, "motor", {"name": joint.name, "joint": joint.name} | limit)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def write_mjcf(m: Model, path: str | os.PathLike[str]) -> str:
    """Writes :func:`ksl.mjcf.text` of a model into a file, and returns it."""
    from ksl.output import whole_file

    text = mjcf_text(m)
    with whole_file(Path(path_given(path, "a file to be written"))) as part:
        part.write_text(text, encoding="utf-8", newline="")
    return text


def _require_at_rest(m: Model, joint: Joint) -> None:
    """MuJoCo's free bodies are on the ground: what a floating joint is on must not move."""
    on: str | None = joint.parent
    while on is not None:
        above = m.joint_above(on)
        if above.nv or above.leader is not None:
            raise ValueError(f"joint {joint.name}: it floats on {joint.parent}, which moves, and MuJoCo's free joints are on the ground; give it one there")
        on = above.parent


def _add_joint(body: ET.Element, joint: Joint, drawn: float) -> None:
    """drawn: its position where the bodies are as the file has them, which of a follower is its offset."""
    if joint.kind not in KINDS:
        raise ValueError(f"joint {joint.name}: MJCF has no {joint.kind} joint; describe it by hinges and slides")
    given = {"name": joint.name, "type": KINDS[joint.kind]}
    if joint.has_axis:
        given["axis"] = _text(joint.axis)
    if drawn:
        given["ref"] = repr(drawn)
    if joint.one_coordinate and (joint.lower, joint.upper) != (None, None):
        lower, upper = (beyond if x is None else x for x, beyond in ((joint.lower, -BEYOND), (joint.upper, BEYOND)))
        if lower >= upper:  # which MuJoCo takes for no limits
            raise ValueError(
                f"joint {joint.name}: its limits leave it no way, from {lower:g} to {upper:g}, which MJCF doesn't have; freeze it: m.with_frozen_joints"
            )
        given["range"] = _text((lower, upper))
    if joint.effort and joint.one_coordinate:
        given["actuatorfrcrange"] = _text((-joint.effort, joint.effort))
    armature = joint.armature + joint.rotor_inertia * joint.gear_ratio**2
    numbers = {"damping": joint.damping, "frictionloss": joint.friction, "armature": armature, "stiffness": joint.spring_stiffness}
    given |= {key: repr(x) for key, x in numbers.items() if x}
    if joint.spring_stiffness:
        given["springref"] = repr(joint.spring_rest)
    ET.SubElement(body, "joint", given)


def _add_inertia(m: Model, body: ET.Element, name: str, moves: bool) -> None:
    link = m.link(name)
    if link.mass == 0 and not any(link.inertia):
        if moves:
            ET.SubElement(body, "inertial", pos="0 0 0", mass=LEAST, diaginertia=f"{LEAST} {LEAST} {LEAST}")
        return
    mass = link.mass or float(LEAST)
    c = np.array(link.first_moment) / mass
    xx, yy, zz, xy, yz, zx = link.inertia
    I = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]) - mass * (c @ c * np.eye(3) - np.outer(c, c))
    moments, axes = np.linalg.eigh(I)  # which MuJoCo finds to 1e-12 kg m² only
    small, middle, large = moments.tolist()
    rounding = 1e-13 * max(map(abs, link.inertia))
    if small + middle < (1 - FLAT) * large - rounding:
        raise ValueError(f"link {name}: its moments {small:.6g}, {middle:.6g}, {large:.6g} are those of no body, and MuJoCo refuses them; correct its inertia")
    if small + middle <= (1 + 1e-12) * large + rounding:
        moments += max(FLAT * large, rounding, 1e-14) - min(small, 0.0)
    axes[:, 0] *= np.linalg.det(axes)
    ET.SubElement(body, "inertial", pos=_text(c), quat=_quaternion(axes), mass=repr(mass), diaginertia=_text(moments))


def _constraints(m: Model, bodies: dict[str, ET.Element]) -> ET.Element:
    found = ET.Element("equality")
    for joint in m.joints:
        if joint.leader is not None:
            ET.SubElement(found, "joint", joint1=joint.name, joint2=joint.leader, polycoef=_text((0.0, joint.multiplier, 0.0, 0.0, 0.0)))  # of what they move
    for loop in m.loops:
        for tag, offset in _ties(m, loop):
            sites = []
            for side, link, pose in ((1, loop.predecessor, loop.predecessor_pose), (2, loop.successor, loop.successor_pose)):
                X = np.reshape(pose, (4, 4))
                name = f"{loop.name}_{len(found)}_{side}"
                ET.SubElement(bodies[link], "site", name=name, pos=_text(X[:3, 3] + X[:3, :3] @ offset), quat=_quaternion(X[:3, :3]))
                sites.append(name)
            ET.SubElement(found, tag, name=loop.name if not offset.any() else f"{loop.name}_axis", site1=sites[0], site2=sites[1])
    return found


def _ties(m: Model, loop: Loop) -> list[tuple[str, Array]]:
    """Constraints, and how far off the loop's frame: a hinge is two points of its axis, a tenth of the mechanism's length apart."""
    if loop.kind == "spherical":
        return [("connect", np.zeros(3))]
    if loop.kind == "fixed":
        return [("weld", np.zeros(3))]
    if loop.kind in ("revolute", "continuous") and loop.axis is not None:
        return [("connect", np.zeros(3)), ("connect", 0.1 * (m.mobility(m.neutral()).length or 1.0) * np.array(loop.axis))]
    raise ValueError(f"loop joint {loop.name}: MJCF has no constraint that is a {loop.kind} joint; close the loop by a spherical, revolute or fixed one")


def _inverse(X: Array) -> Array:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = X[:3, :3].T, -X[:3, :3].T @ X[:3, 3]
    return out


def _quaternion(R: Array) -> str:
    x, y, z, w = quaternion_of(R)
    return _text((w, x, y, z))


def _text(numbers: Sequence[float] | Array) -> str:
    return " ".join(repr(float(x) + 0.0) for x in numbers)
