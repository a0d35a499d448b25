"""MJCF as the rules see it: the model that MuJoCo's compiler makes, with the lines of the file."""

from __future__ import annotations

import warnings

import numpy as np

from ksl.base.errors import DescriptionWarning
from ksl.checks.description.robot import Inertial, FileJoint, FileLink, Mimic, RobotFile
from ksl.checks.description.xml_file import line_of
from ksl.robot_files.loading import load
from ksl.mechanism.mechanism import Joint, Link


def read_mjcf(robot: RobotFile) -> None:
    """Loads the file and fills in links and joints of the model."""
    robot.not_checked += [
        "meshes, geometry, elements and attributes of MJCF: MuJoCo's compiler refuses what it doesn't know",
        "lines of bodies and joints that are in included files, or have no name",
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DescriptionWarning)
        try:
            model = load(robot.path, masses="optional", loops=robot.beside, drives=robot.drives, **robot.reading)
        except ValueError as e:
            robot.refusal = str(e)
            return
    assert robot.root is not None
    robot.model = model
    lines = {(each.tag, each.get("name")): line_of(each) for each in robot.root.iter("body", "joint", "freejoint")}
    robot.links += [_link(link, lines.get(("body", link.name))) for link in model.links]
    robot.joints += [_joint(joint, lines.get(("joint", joint.name))) for joint in model.joints if joint.parent is not None]


def _link(link: Link, line: int | None) -> FileLink:
    inertial = None
    if link.mass > 0:
        c = np.array(link.first_moment) / link.mass
        xx, yy, zz, xy, yz, zx = link.inertia
        about_origin = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
        moments = about_origin - link.mass * (c @ c * np.eye(3) - np.outer(c, c))
        rounding = 1e-6 * abs(np.array([xx, yy, zz])).sum()  # the shift to the origin and back rounds, too
        inertial = Inertial(line, None, link.mass, c, np.eye(3), moments, rounding=rounding)
    return FileLink(link.name, line, None, inertial, has_inertial=inertial is not None)


def _joint(joint: Joint, line: int | None) -> FileJoint:
    mimic = Mimic(line, None, joint.leader, joint.multiplier, joint.offset) if joint.leader else None
    limits = (joint.lower, joint.upper, joint.effort, joint.velocity)
    assert joint.parent is not None
    return FileJoint(
        joint.name, line, None, joint.kind, joint.parent, joint.child, np.array(joint.axis), line, None, line, None, *limits, mimic=mimic
    )  # fmt: skip
