"""Rules of masses and inertias that need no geometry: what a rigid body can have."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from ksl.base.words import listed
from ksl.checks.description.findings import Repair, Severity
from ksl.checks.description.repair import digits, shown
from ksl.checks.description.robot import Array, Inertial, FileLink, RobotFile
from ksl.checks.rule import Broken, rule

TOLERANCE = 1e-6
"""Relative to the largest moment, as the loader has it."""
MENDABLE = 0.1
"""Share of the largest moment by which an inertia may miss what a body can have and still be repaired without a
person."""
SMALL = 1e-12
"""m².  Moments below this times the mass are zero: a body of a micrometre, or the rounding of a CAD program."""
COPIES = 3
"""Links with the same mass and moments, on different shapes, from which on they are placeholders."""
DIFFERENT = 1.5
"""Ratio of masses beyond which parts with the same moments aren't copies of each other."""


def usable(link: FileLink) -> Inertial | None:
    """The inertial of a link if it has a positive mass and readable moments."""
    inertial = link.inertial
    if inertial is None or inertial.moments is None or inertial.mass is None or not inertial.mass > 0:
        return None
    return inertial


def beside(robot: RobotFile, link: FileLink) -> Severity | None:
    """The severity of an impossible inertia that is negligible beside what the link is welded to."""
    return None if robot.matters(link) else "warning"


def principal_moments(moments: Array) -> Array:
    """(3,) ascending."""
    return np.asarray(np.linalg.eigvalsh(moments))


@rule(
    "mass-negative",
    "error",
    condition="A mass is zero or more.",
    cause="A wrong sign, or an inertial that was meant to subtract a part.",
    repair="Give the mass of the link, kg.",
    formats=("urdf", "sdf"),
)
def mass_negative(robot: RobotFile) -> Iterator[Broken]:
    for link in robot.links:
        if link.inertial and link.inertial.mass is not None and link.inertial.mass < 0:
            yield Broken(f"mass {shown(link.inertial.mass)} kg", link.inertial.line, "link", link.name, link.inertial.mass)


@rule(
    "inertia-without-mass",
    "error",
    condition="A link with moments of inertia has a mass.",
    cause="The mass was left at 0.",
    repair="Give the mass, kg, or remove <inertial>.",
    formats=("urdf", "sdf"),
)
def inertia_without_mass(robot: RobotFile) -> Iterator[Broken]:
    for link in robot.links:
        inertial = link.inertial
        if inertial and inertial.mass == 0 and inertial.moments is not None and inertial.moments.any():
            yield Broken(
                f"mass 0, largest moment {shown(float(abs(inertial.moments).max()))} kg m²", inertial.line, "link", link.name, 0.0, severity=beside(robot, link)
            )


@rule(
    "inertia-not-positive",
    "error",
    condition="The inertia matrix about the centroid has no negative principal moment.",
    cause=("Off-diagonal elements too large or with a wrong sign, elements in a wrong order (ixx ixy ixz iyy iyz izz), or a matrix about another point."),
    repair="Take the matrix about the centroid from the CAD program again.",
    fix=(f"takes the nearest matrix that a body can have, where the moment is negative by less than {MENDABLE:.0%} of the largest"),
)
def inertia_not_positive(robot: RobotFile) -> Iterator[Broken]:
    for link in robot.links:
        inertial = usable(link)
        if inertial is None or inertial.moments is None:
            continue
        low, middle, high = principal_moments(inertial.moments)
        if low < -TOLERANCE * max(abs(high), abs(low)) - SMALL * link.mass:
            fix = _nearest(inertial) if -low < MENDABLE * high and robot.format == "urdf" else None
            found = f"principal moments {shown(high)}, {shown(middle)}, {shown(low)} kg m²"
            yield Broken(found, inertial.line, "link", link.name, float(low), severity=beside(robot, link), fix=fix)


@rule(
    "inertia-triangle",
    "error",
    condition="No principal moment about the centroid exceeds the sum of the other two.",
    cause="Moments estimated or typed one by one, or given about another point than the centroid.",
    repair="Take the matrix about the centroid from the CAD program again.",
    fix=(f"takes the nearest matrix that a body can have, where the excess is below {MENDABLE:.0%} of the largest moment"),
)
def inertia_triangle(robot: RobotFile) -> Iterator[Broken]:
    for link in robot.links:
        inertial = usable(link)
        if inertial is None or inertial.moments is None:
            continue
        low, middle, high = (float(x) for x in principal_moments(inertial.moments))
        excess = high - middle - low
        if low < -TOLERANCE * high - SMALL * link.mass or excess <= TOLERANCE * high + SMALL * link.mass:
            continue
        found = f"principal moments {shown(high)}, {shown(middle)}, {shown(low)} kg m²: the largest exceeds the sum of the others by {shown(excess)}"
        fix = _nearest(inertial) if excess < MENDABLE * high and robot.format == "urdf" else None
        # a thin plate has exactly the sum: the last digit of the file decides on which side it is
        rounded = excess <= min(1.5 * inertial.rounding, 0.01 * high)
        cause = "Rounding: the printed digits of a flat part." if rounded else None
        yield Broken(found, inertial.line, "link", link.name, excess, cause=cause, severity="warning" if rounded else beside(robot, link), fix=fix)


def _nearest(inertial: Inertial) -> Repair:
    """Writes the nearest moments that a body of positive density has; mass and centroid stay."""

    def change() -> str:
        from ksl.identify.consistency import nearest_consistent

        I, element = inertial.moments, inertial.element
        assert I is not None and element is not None
        J = nearest_consistent([inertial.mass or 0.0, 0, 0, 0, I[0, 0], I[0, 1], I[1, 1], I[0, 2], I[1, 2], I[2, 2]])
        values = dict(zip(("ixx", "ixy", "iyy", "ixz", "iyz", "izz"), J[4:]))
        inertia = element.find("inertia")
        old = ", ".join(f"{name} {inertia.get(name)}" for name in values)
        for name, value in values.items():
            if not math.isclose(value, float(inertia.get(name)), rel_tol=1e-9, abs_tol=1e-12 * abs(I).max()):
                inertia.set(name, digits(value))
        return f"<inertia> had {old}; now {', '.join(f'{name} {inertia.get(name)}' for name in values)}"

    return change


@rule(
    "inertia-zero",
    "warning",
    condition="A body with a mass that moves has moments of inertia.",
    cause="Left at 0: the body is a point mass, and turning it about its centroid costs nothing.",
    repair="Give the moments about the centroid, kg m².",
)
def inertia_zero(robot: RobotFile) -> Iterator[Broken]:
    for body in robot.bodies.values():
        heavy = [(link, inertial) for link in body if (inertial := usable(link))]
        if not heavy or not _is_moved(robot, body[0].name) or any(link.largest_moment > SMALL * link.mass for link, _ in heavy):
            continue
        link, inertial = max(heavy, key=lambda each: each[0].mass)
        yield Broken(f"mass {shown(link.mass)} kg, all moments 0", inertial.line, "link", link.name, 0.0)


def _is_moved(robot: RobotFile, name: str) -> bool:
    joint = robot.joint_above.get(robot.welded.get(name, name))
    return joint is not None and joint.moves


@rule(
    "inertia-placeholder",
    "warning",
    condition="Mass and moments are those of the part, not of a template.",
    cause="A template or a program wrote them so that the file loads.",
    repair="Give mass and moments of the part, from the CAD program or of a solid of its size.",
)
def inertia_placeholder(robot: RobotFile) -> Iterator[Broken]:
    for links in placeholders(robot):
        link = links[0]
        assert link.inertial and link.inertial.moments is not None
        moments = np.diag(link.inertial.moments)
        said = f"ixx = iyy = izz = {shown(float(moments[0]))}" if not np.ptp(moments) else f"moments {', '.join(shown(float(x)) for x in moments)}"
        masses = sorted({each.mass for each in links})
        if len(masses) == 1:
            n = len(links) - 1
            others = f", and so {'have' if n > 1 else 'has'} {n} other link{'s' if n > 1 else ''}" if n else ""
            found = f"mass {shown(link.mass)} kg, {said} kg m²{others}"
        else:
            found = f"{said} kg m² in {len(links)} links of {shown(masses[0])} to {shown(masses[-1])} kg: {listed(each.name for each in links)}"
        yield Broken(found, link.inertial.line, "link", link.name, float(moments.max()))


def placeholders(robot: RobotFile) -> list[list[FileLink]]:
    """Links that share what is not theirs: the same moments with masses that differ, or with one mass, all equal and a power of ten."""
    constant = _constant_moments(robot)
    told = {link.name for links in constant for link in links}
    same: dict[tuple[float, float], list[FileLink]] = defaultdict(list)
    for link in robot.links:
        inertial = usable(link)
        if inertial is None or inertial.moments is None or not robot.matters(link) or _has_equal_moments(link) or link.name in told:
            continue
        I = inertial.moments
        if I[0, 0] == I[1, 1] == I[2, 2] > 0 and not (I - np.diag(np.diag(I))).any() and _is_power_of_ten(float(I[0, 0])):
            same[link.mass, float(I[0, 0])].append(link)
    return constant + [links for (mass, moment), links in same.items() if len(links) >= COPIES or mass == 1 or moment >= 0.1]


def _constant_moments(robot: RobotFile) -> list[list[FileLink]]:
    """Links with the same moments, to the last digit, whose masses differ by more than a part and its copy may."""
    same: dict[tuple[float, ...], list[FileLink]] = defaultdict(list)
    for link in robot.links:
        inertial = usable(link)
        if inertial is not None and inertial.moments is not None and inertial.moments.any() and robot.matters(link):
            same[tuple(inertial.moments.ravel().tolist())].append(link)
    masses = {key: [link.mass for link in links] for key, links in same.items()}
    return [links for key, links in same.items() if len(links) >= COPIES and max(masses[key]) > DIFFERENT * min(masses[key])]


def _is_power_of_ten(x: float) -> bool:
    return math.isclose(10 ** round(math.log10(x)), x, rel_tol=1e-9)


def _has_equal_moments(link: FileLink) -> bool:
    """Whether one of the link's shapes is a ball or a cube, whose moments are equal."""
    return any(shape.kind in ("sphere", "box") and np.ptp(shape.half_size) == 0 for shape in link.shapes)


@rule(
    "massless-end",
    "error",
    condition="What a joint moves has a mass, on the link itself or beyond it.",
    cause="The last link of a chain is a frame or a part without <inertial>.",
    repair="Give the link its mass and moments, or make the joint fixed.",
    whole=True,
)
def massless_end(robot: RobotFile) -> Iterator[Broken]:
    if not any(link.mass or link.mass_unreadable for link in robot.links):
        moving = [joint for joint in robot.joints if joint.moves]
        if moving:
            yield Broken("no link of the file has a mass", None, value=0.0, repair="Give the links masses. For kinematics alone the file can be used as it is.")
        return
    for joint in robot.joints:
        # a joint above it that moves nothing heavy either has the same finding
        if joint.moves and not joint.mimic and robot.moves_mass.get(joint.child) is False and robot.moves_mass.get(joint.parent, True):
            yield Broken(f"joint {joint.name} moves no mass: forward dynamics can't be computed", robot.link_of[joint.child].line, "link", joint.child, 0.0)


@rule(
    "mass-missing",
    "warning",
    condition="A moving link with geometry has a mass, or is welded to one that has.",
    cause="<inertial> was left out: the weight of the part is missing from every result.",
    repair="Add <inertial> with mass and moments.",
    formats=("urdf", "mjcf"),
    whole=True,
)
def mass_missing(robot: RobotFile) -> Iterator[Broken]:
    for body in robot.bodies.values():
        if not any(link.mass or link.mass_unreadable for link in body):
            for link in body:
                if link.shapes and link.name and _is_moved(robot, link.name):
                    yield Broken(f"{link.shapes[0].role} and no mass", link.line, "link", link.name, 0.0)


@rule(
    "inertial-default",
    "warning",
    condition="A link of an SDF file has <inertial>.",
    cause="Left out: the format then takes 1 kg and 1 kg m².",
    repair="Add <inertial> with mass and moments.",
    formats=("sdf",),
)
def inertial_default(robot: RobotFile) -> Iterator[Broken]:
    for link in robot.links:
        if not link.has_inertial:
            yield Broken("no <inertial>, so 1 kg and 1 kg m² are taken", link.line, "link", link.name)


@rule(
    "root-inertial",
    "warning",
    condition="The root link of a URDF file has no mass.",
    cause=("The robot has no link for the place that it stands on. KDL, and ROS tools that use it, ignore the inertia of the root."),
    repair="Add a root link without <inertial>, and join this one to it by a fixed joint.",
    accept="adds the link ROOT_mount and the fixed joint ROOT_mount_joint",
    formats=("urdf",),
    whole=True,
)
def root_inertial(robot: RobotFile) -> Iterator[Broken]:
    for root in robot.roots[:1]:
        if root.mass > 0 and robot.joints:
            assert root.inertial
            yield Broken(f"the root link has a mass of {shown(root.mass)} kg", root.inertial.line, "link", root.name, root.mass, guess=_mounted(robot, root))


def _mounted(robot: RobotFile, root: FileLink) -> Repair:
    def change() -> str:
        from lxml import etree

        element = root.element
        assert element is not None
        link, joint = f"{root.name}_mount", f"{root.name}_mount_joint"
        mount = etree.Element("link", name=link)
        fixed = etree.Element("joint", name=joint, type="fixed")
        etree.SubElement(fixed, "parent", link=link)
        etree.SubElement(fixed, "child", link=root.name)
        before = element.getprevious()
        space = element.getparent().text if before is None else before.tail  # each on a line of its own
        for new in (mount, fixed):
            element.addprevious(new)
            new.tail = space
        return f"added the link {link}, and {joint}, which fixes {root.name} to it"

    return change
