"""Rules of shapes: sizes that no shape has, and moments about another axis than that of a round shape."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ksl.checks.inertia_rules import placeholders, usable
from ksl.checks.description.repair import shown
from ksl.checks.description.robot import Array, Inertial, FileLink, RobotFile
from ksl.checks.rule import Broken, rule

ROUND = 0.02
"""Extents, or moments, that differ by less than this share of the larger one are those of something round."""
UNLIKE = 0.1
"""Share by which the moment about the axis must differ from the others."""


@rule(
    "shape-size",
    "warning",
    condition="Sizes of boxes, spheres, cylinders and meshes are there, and greater than zero.",
    cause="A number was left out, or has a wrong sign. Readers refuse the shape or the link, or take another size.",
    repair="Give the sizes in m, or remove the shape.",
    formats=("urdf", "sdf"),
)
def shape_size(robot: RobotFile) -> Iterator[Broken]:
    for note in robot.sizes:
        yield Broken(note.found, note.line, note.kind, note.name)


@rule(
    "inertia-axis",
    "warning",
    condition="A wheel, disc or bar has its largest or smallest moment about the axis that its shape is round about; a wheel, whatever its shape, about that of its joint.",
    cause="The moments are in the axes of the shape, which is turned in the link, and the inertial is not; or shape and moments are both of a wheel about another axis.",
    repair="Turn the inertial as the shape is turned, or exchange the moments.",
)
def inertia_axis(robot: RobotFile) -> Iterator[Broken]:
    told = {link.name for links in placeholders(robot) for link in links}
    for link in robot.links:
        inertial = None if link.name in told else usable(link)
        I = None if inertial is None else inertial.in_link_axes
        if inertial is None or I is None or not robot.matters(link) or not np.isfinite(I).all():
            continue
        own = _axis_of_moments(I)
        if own is None:
            continue
        about, most = own
        for found, does in ((_axis_of_shapes(link), "its shape is round"), (_axis_of_wheel(robot, link, inertial, I), "it turns")):
            if found is not None and found[1] == most and abs(found[0] @ about) < np.sqrt(0.5):
                words = f"moments {', '.join(shown(float(x)) for x in np.diag(I))} kg m²: round about {_said(about)}, where {does} about {_said(found[0])}"
                yield Broken(words, inertial.line, "link", link.name)
                break


def _said(axis: Array) -> str:
    """x, y or z, or the direction."""
    k = int(np.argmax(np.abs(axis)))
    return "xyz"[k] if abs(axis[k]) > 0.999 else " ".join(shown(float(x)) for x in axis)


def _axis_of_moments(I: Array) -> tuple[Array, bool] | None:
    """The axis (3) about which the moment is not that of the others, and whether it is the largest; None if all or no two are equal."""
    values, axes = np.linalg.eigh(I)
    low, middle, high = (float(x) for x in values)
    if not high > 0:
        return None
    if middle - low <= ROUND * high and high - middle > UNLIKE * high:
        return axes[:, 2], True
    if high - middle <= ROUND * high and middle - low > UNLIKE * high:
        return axes[:, 0], False
    return None


def _axis_of_shapes(link: FileLink) -> tuple[Array, bool] | None:
    """The axis (3) in the link's axes of all its cylinders, and whether they are discs: flatter than long.  None if it has other shapes, or several axes."""
    axes: list[tuple[Array, bool]] = []
    for shape in link.shapes:
        if shape.kind != "cylinder":
            return None
        radius, half = float(shape.half_size[0]), float(shape.half_size[2])
        # m r²/2 about the axis and m (3 r² + l²)/12 across it are equal at l = √3 r
        axes.append((shape.rotation[:, 2], half * 2 < np.sqrt(3) * radius))
    if not axes or any(disc != axes[0][1] or abs(a @ axes[0][0]) < 0.999 for a, disc in axes):
        return None
    return axes[0]


def _axis_of_wheel(robot: RobotFile, link: FileLink, inertial: Inertial, I: Array) -> tuple[Array, bool] | None:
    """The axis (3) that a wheel turns about, whatever its shapes: what a continuous joint turns about its centroid, and carries nothing that moves.  None of other links."""
    joint = robot.joint_above.get(link.name)
    if (
        joint is None
        or joint.kind != "continuous"
        or joint.axis is None
        or not joint.axis.any()
        or any(below.moves for below in robot.joints_below.get(link.name, ()))
    ):
        return None
    axis = joint.axis / np.linalg.norm(joint.axis)
    away = float(np.linalg.norm(np.cross(axis, inertial.centroid)))
    return (axis, True) if inertial.mass and inertial.mass * away**2 <= UNLIKE * np.trace(I) else None
