"""MJCF as the rules see it: the model that MuJoCo's compiler makes, with the lines of the file."""

from __future__ import annotations

import warnings

import numpy as np

from ksl.base.errors import DescriptionWarning
from ksl.checks.robot import Inertial, Joint, Link, Mimic, RobotFile
from ksl.checks.xml_file import line_of


def read_mjcf(robot: RobotFile) -> None:
    """Loads the file and fills in links and joints of the model."""
    from ksl.model.loading import load

    robot.not_checked += [
        "meshes, geometry, elements and attributes of MJCF: MuJoCo's compiler refuses what it doesn't know",
        "lines of bodies and joints that are in included files, or have no name",
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DescriptionWarning)
        try:
            model = load(robot.path, masses="optional")
        except ValueError as e:
            robot.refusal = str(e)
            return
    assert robot.root is not None
    lines = {(each.tag, each.get("name")): line_of(each) for each in robot.root.iter("body", "joint", "freejoint")}
    for link in model.links:
        line = lines.get(("body", link.name))
        inertial = None
        if link.mass > 0:
            c = np.array(link.first_moment) / link.mass
            xx, yy, zz, xy, yz, zx = link.inertia
            moments = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]) - link.mass * (
                c @ c * np.eye(3) - np.outer(c, c)
            )
            size = abs(np.array([xx, yy, zz])).sum()
            inertial = Inertial(
                line, None, link.mass, c, np.eye(3), moments, rounding=1e-6 * size
            )  # the shift to the origin and back rounds, too
        robot.links.append(Link(link.name, line, None, inertial, has_inertial=inertial is not None))
    for each in model.joints:
        if each.parent is None:
            continue
        line = lines.get(("joint", each.name))
        mimic = Mimic(line, None, each.leader, each.multiplier, each.offset) if each.leader else None
        limits = (each.lower, each.upper, each.effort, each.velocity)
        robot.joints.append(
            Joint(
                each.name,
                line,
                None,
                each.kind,
                each.parent,
                each.child,
                np.array(each.axis),
                line,
                None,
                line,
                None,
                *limits,
                mimic=mimic,
            )
        )
