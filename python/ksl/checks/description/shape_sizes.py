"""Sizes of shapes as the readers of all formats note them: what is missing, zero or negative."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ksl.checks.description.repair import shown
from ksl.checks.description.robot import Array, Note, RobotFile
from ksl.checks.description.xml_file import line_of

if TYPE_CHECKING:
    from lxml.etree import _Element

NEEDED = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "cone": ("radius", "length"),
    "ellipsoid": ("radii",),
}
"""{shape: the sizes without which it has none}."""
SHAPES = (*NEEDED, "mesh", "plane", "heightmap", "polyline", "image")


def note_sizes(robot: RobotFile, link: str, role: str, shape: _Element, given: dict[str, Array | None], is_there: dict[str, bool]) -> None:
    """Notes sizes that no shape has.

    given: the numbers of each size, None where they are missing or can't be read.  is_there: whether the file gives the size at all.
    """
    for name in NEEDED.get(shape.tag, ()):
        if not is_there[name]:
            robot.sizes.append(Note(line_of(shape), f"<{shape.tag}> of a {role} has no {name}", "link", link))
    for name, values in given.items():
        if name == "scale" and values is not None and (values != 0).all():
            continue  # a negative scale mirrors a mesh
        if values is not None and not (values > 0).all():
            found = " ".join(shown(float(x)) for x in values)
            robot.sizes.append(Note(line_of(shape), f"{name} of <{shape.tag}> of a {role} is {found}", "link", link))


def note_number_of_shapes(robot: RobotFile, link: str, element: _Element, geometry: _Element | None, given: Sequence[_Element]) -> None:
    """Notes a geometry that is missing, that has no shape, or that has several."""
    shapes = [each for each in given if each.tag in SHAPES]
    if geometry is None:
        robot.sizes.append(Note(line_of(element), f"<{element.tag}> has no <geometry>", "link", link))
    elif not given:
        robot.sizes.append(Note(line_of(geometry), f"<geometry> of a {element.tag} has no shape", "link", link))
    elif len(shapes) > 1:
        listed = ", ".join(f"<{each.tag}>" for each in shapes[:6])
        robot.repeated.append(Note(line_of(shapes[1]), f"<geometry> of a {element.tag} has {len(shapes)} shapes: {listed}", "link", link))
