"""URDF as the rules see it.  Unlike the loader, this reads on after an error."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ksl.checks.description.robot import Array, Inertial, FileJoint, Kind, FileLink, Mimic, Note, RobotFile, Shape
from ksl.checks.description.shape_sizes import note_number_of_shapes, note_sizes
from ksl.checks.description.xml_file import Numbers, children, half_unit, line_of, rotation_of, rotation_of_quaternion
from ksl.mechanism.joint_kinds import ANY_NAME

if TYPE_CHECKING:
    from lxml.etree import _Element

MOMENTS = ("ixx", "iyy", "izz", "ixy", "iyz", "ixz")
ONCE = {
    "link": ("inertial",),
    "inertial": ("origin", "mass", "inertia"),
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
    "visual": ("origin", "geometry"),
    "collision": ("origin", "geometry"),
}


def read_urdf(robot: RobotFile) -> None:
    """Fills in links and joints from `robot.root`."""
    root = robot.root
    assert root is not None
    robot.name = root.get("name", "")
    for element in children(root, "link"):
        robot.links.append(_link(robot, element))
    for element in children(root):
        if element.tag in ("joint", "drake:joint") or element.tag.endswith("}joint"):
            robot.joints.append(_joint(robot, element))


def _once(robot: RobotFile, parent: _Element, kind: Kind, name: str, tags: tuple[str, ...]) -> None:
    for tag in tags:
        found = children(parent, tag)
        if len(found) > 1:
            robot.repeated.append(Note(line_of(found[1]), f"<{tag}> stands {len(found)} times in <{parent.tag}>", kind, name))


def _origin(numbers: Numbers, parent: _Element) -> tuple[Array, Array]:
    """(rotation, translation) of an <origin>."""
    origin = parent.find("origin")
    t, rpy = numbers.vector(origin, "xyz"), numbers.vector(origin, "rpy")
    rotation = np.eye(3) if rpy is None or not rpy.any() else rotation_of(rpy)
    quaternion = None if origin is None or origin.get("quat_xyzw") is None else numbers.several(origin.get("quat_xyzw"), 4, line_of(origin), "quat_xyzw")
    if quaternion is not None:
        rotation = rotation_of_quaternion(quaternion)
    return rotation, np.zeros(3) if t is None else t


def _link(robot: RobotFile, element: _Element) -> FileLink:
    name = element.get("name", "")
    numbers = Numbers(robot, "link", name)
    link = FileLink(name, line_of(element), element)
    _once(robot, element, "link", name, ONCE["link"])
    inertial = element.find("inertial")
    if inertial is not None:
        _once(robot, inertial, "link", name, ONCE["inertial"])
        link.has_inertial = True
        link.inertial = _inertial(numbers, inertial)
    for role in ("visual", "collision"):
        for each in children(element, role):
            shape = _shape(robot, numbers, each, role)
            if shape:
                link.shapes.append(shape)
    return link


def _inertial(numbers: Numbers, element: _Element) -> Inertial:
    mass, inertia = element.find("mass"), element.find("inertia")
    rotation, centroid = _origin(numbers, element)
    for child, tag, mend in ((mass, "mass", '<mass value="1.5"/> for example'), (inertia, "inertia", '<inertia ixx="..." .../>')):
        if child is None:
            numbers.note(line_of(element), f"<inertial> has no <{tag}>, expected {mend}")
    if mass is not None and mass.get("value") is None:
        numbers.note(line_of(mass), '<mass> has no value, expected <mass value="1.5"/> for example')
    moments, rounding = None, 0.0
    if inertia is not None:
        absent = [name for name in MOMENTS if inertia.get(name) is None]
        if absent:
            numbers.note(line_of(inertia), f"<inertia> has no {', '.join(absent)}, expected all of ixx, ixy, ixz, iyy, iyz, izz")
        values = [numbers.attribute(inertia, name) for name in MOMENTS]
        if not absent and None not in values:
            xx, yy, zz, xy, yz, xz = values
            moments = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], dtype=float)
            rounding = sum(half_unit(inertia.get(name)) for name in MOMENTS[:3])
    return Inertial(line_of(element), element, numbers.attribute(mass, "value"), centroid, rotation, moments, rounding)


def _shape(robot: RobotFile, numbers: Numbers, element: _Element, role: str) -> Shape | None:
    geometry = element.find("geometry")
    given = [] if geometry is None else children(geometry)
    _once(robot, element, "link", numbers.name, ONCE[role])
    note_number_of_shapes(robot, numbers.name, element, geometry, given)
    if not given:
        return None
    found = _shape_of(robot, numbers, given[0], role, *_origin(numbers, element))
    if found is not None:
        found.name = element.get("name", "")
    return found


def _shape_of(robot: RobotFile, numbers: Numbers, shape: _Element, role: str, rotation: Array, translation: Array) -> Shape | None:
    line = line_of(shape)

    def note(**given: Array | float | None) -> None:
        sizes = {name: None if x is None else np.atleast_1d(x) for name, x in given.items()}
        note_sizes(robot, numbers.name, role, shape, sizes, {name: shape.get(name) is not None for name in given})

    if shape.tag == "mesh":
        scale = numbers.vector(shape, "scale")
        note(scale=scale)
        return Shape(line, shape, role, "mesh", np.zeros(3), rotation, translation, shape.get("filename", ""), np.ones(3) if scale is None else scale)
    if shape.tag == "box":
        size = numbers.vector(shape, "size")
        note(size=size)
        return None if size is None else Shape(line, shape, role, "box", abs(size) / 2, rotation, translation)
    if shape.tag not in ("sphere", "cylinder", "capsule"):  # shapes of other formats, which URDF doesn't have
        return None
    radius, length = numbers.attribute(shape, "radius"), numbers.attribute(shape, "length")
    note(**({"radius": radius} if shape.tag == "sphere" else {"radius": radius, "length": length}))
    if shape.tag == "sphere" and radius is not None:
        return Shape(line, shape, role, "sphere", np.full(3, abs(radius)), rotation, translation)
    if shape.tag in ("cylinder", "capsule") and radius is not None and length is not None:
        end = abs(length) / 2 + (abs(radius) if shape.tag == "capsule" else 0)
        return Shape(line, shape, role, "cylinder", np.array([abs(radius), abs(radius), end]), rotation, translation)
    return None


def _joint(robot: RobotFile, element: _Element) -> FileJoint:
    name = element.get("name", "")
    numbers = Numbers(robot, "joint", name)
    _once(robot, element, "joint", name, ONCE["joint"])
    parent, child = element.find("parent"), element.find("child")
    given = element.get("type", "")
    kind = ANY_NAME[given].name if given in ANY_NAME else given
    ends = ["" if end is None else end.get("link", "") for end in (parent, child)]
    joint = FileJoint(name, line_of(element), element, kind, ends[0], ends[1])
    axis, limit, dynamics = element.find("axis"), element.find("limit"), element.find("dynamics")
    if axis is not None:
        joint.axis, joint.axis_line, joint.axis_element = numbers.vector(axis, "xyz"), line_of(axis), axis
    if limit is not None:
        joint.limit_line, joint.limit_element = line_of(limit), limit
        joint.lower, joint.upper, joint.effort, joint.velocity = (numbers.attribute(limit, k) for k in ("lower", "upper", "effort", "velocity"))
    if dynamics is not None:
        joint.dynamics_line = line_of(dynamics)
        joint.damping, joint.friction = (numbers.attribute(dynamics, k) for k in ("damping", "friction"))
    joint.translation = _origin(numbers, element)[1]
    mimic = element.find("mimic")
    if mimic is not None:
        factor, offset = (numbers.attribute(mimic, k) for k in ("multiplier", "offset"))
        joint.mimic = Mimic(line_of(mimic), mimic, mimic.get("joint", ""), 1.0 if factor is None else factor, offset or 0.0)
    return joint
