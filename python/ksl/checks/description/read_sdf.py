"""SDF as the rules see it.  Names of links and joints in nested models are those of the format: `hand::palm`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ksl.checks.description.robot import IN_SDF_ALONE, Array, Inertial, FileJoint, FileLink, Mimic, RobotFile, Shape, at_origin
from ksl.checks.description.shape_sizes import NEEDED, note_number_of_shapes, note_sizes
from ksl.checks.description.xml_file import Numbers, children, half_unit, line_of, rotation_of, rotation_of_quaternion
from ksl.mechanism.joint_kinds import ANY_NAME

if TYPE_CHECKING:
    from lxml.etree import _Element

KINDS = IN_SDF_ALONE | {other: kind.name for other, kind in ANY_NAME.items() if not kind.is_free}
"""Kinds by the names that SDF has for them."""
MOMENTS = ("ixx", "iyy", "izz", "ixy", "iyz", "ixz")


def read_sdf(robot: RobotFile) -> None:
    """Fills in links and joints of the model that is asked for, or of all models of the file, from `robot.root`."""
    root = robot.root
    assert root is not None
    models = [*children(root, "model"), *(model for world in children(root, "world") for model in children(world, "model"))]
    wanted = robot.reading.get("model")
    models = [model for model in models if model.get("name") == wanted] or models  # a name that isn't there is refused by the loader
    for model in models:
        _model(robot, model, f"{model.get('name', '')}::" if len(models) > 1 else "")
    robot.name = models[0].get("name", "") if models else ""
    robot.not_checked += [
        "elements and attributes of SDF that no reader knows",
        "the size of links whose shapes are placed by relative_to, or whose meshes are Collada",
    ]


def _model(robot: RobotFile, model: _Element, scope: str) -> None:
    for element in children(model, "link"):
        robot.links.append(_link(robot, element, scope))
    for element in children(model, "joint"):
        robot.joints.append(_joint(robot, element, scope))
    for nested in children(model, "model"):
        _model(robot, nested, f"{scope}{nested.get('name', '')}::")


def _pose(numbers: Numbers, parent: _Element) -> tuple[Array, Array] | None:
    """(rotation, translation); None where it is relative to another frame, which only the loader resolves."""
    pose = parent.find("pose")
    if pose is None:
        return at_origin()
    if pose.get("relative_to") or pose.get("frame"):
        return None
    quaternion = pose.get("rotation_format") == "quat_xyzw"
    values = numbers.several(pose.text, 7 if quaternion else 6, line_of(pose), "<pose>")
    if values is None:
        return at_origin()
    if quaternion:
        return rotation_of_quaternion(values[3:]), values[:3]
    return rotation_of(np.radians(values[3:]) if pose.get("degrees") == "true" else values[3:]), values[:3]


def _link(robot: RobotFile, element: _Element, scope: str) -> FileLink:
    name = element.get("name", "")
    link = FileLink(scope + name if name else "", line_of(element), element)
    numbers = Numbers(robot, "link", link.name)
    inertial = element.find("inertial")
    if inertial is not None:
        link.has_inertial = True
        link.inertial = _inertial(numbers, inertial)
    else:
        rotation, centroid = at_origin()
        link.inertial = Inertial(link.line, None, 1.0, centroid, rotation, None)  # what the format takes; a rule says it
    for role in ("visual", "collision"):
        for each in children(element, role):
            shape = _shape(robot, numbers, each, role)
            if shape:
                link.shapes.append(shape)
    return link


def _inertial(numbers: Numbers, element: _Element) -> Inertial:
    rotation, centroid = _pose(numbers, element) or at_origin()
    if element.get("auto", "").strip() in ("true", "1"):  # computed from shapes: what else is given there has no effect
        return Inertial(line_of(element), element, None, centroid, rotation, None)
    mass = numbers.text(element, "mass")
    inertia = element.find("inertia")
    moments = np.eye(3)  # what the format takes where nothing is given
    rounding = 0.0
    if inertia is not None:
        given = {name: numbers.text(inertia, name) for name in MOMENTS}
        xx, yy, zz = (_one(given[name], 1.0) for name in MOMENTS[:3])
        xy, yz, xz = (_one(given[name], 0.0) for name in MOMENTS[3:])
        moments = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        rounding = sum(half_unit(inertia.findtext(name, "")) for name in MOMENTS[:3])
    return Inertial(line_of(element), element, 1.0 if mass is None else float(mass[0]), centroid, rotation, moments, rounding)


def _one(value: Array | None, otherwise: float) -> float:
    return otherwise if value is None else float(value[0])


def _shape(robot: RobotFile, numbers: Numbers, element: _Element, role: str) -> Shape | None:
    geometry, pose = element.find("geometry"), _pose(numbers, element)
    given = [] if geometry is None else children(geometry)
    note_number_of_shapes(robot, numbers.name, element, geometry, given)
    if not given:
        return None
    found = _shape_of(robot, numbers, given[0], role, *(pose if pose else (np.eye(3), np.full(3, np.nan))))
    if found is not None:
        found.name = element.get("name", "")
    return found


def _shape_of(robot: RobotFile, numbers: Numbers, shape: _Element, role: str, rotation: Array, translation: Array) -> Shape | None:
    line = line_of(shape)
    if shape.tag in NEEDED or shape.tag == "mesh":
        names = NEEDED.get(shape.tag, ("scale",))
        sizes = {name: Numbers(RobotFile(robot.path), "link", "").text(shape, name, 1 if name in ("radius", "length") else 3) for name in names}
        note_sizes(robot, numbers.name, role, shape, sizes, {name: shape.find(name) is not None for name in names})
    if shape.tag == "mesh":
        scale = numbers.text(shape, "scale", 3)
        return Shape(line, shape, role, "mesh", np.zeros(3), rotation, translation, shape.findtext("uri", "").strip(), np.ones(3) if scale is None else scale)
    radius, length = numbers.text(shape, "radius"), numbers.text(shape, "length")
    size = numbers.text(shape, "size", 3) if shape.tag == "box" else None
    if size is not None:
        return Shape(line, shape, role, "box", abs(size) / 2, rotation, translation)
    if shape.tag == "sphere" and radius is not None:
        return Shape(line, shape, role, "sphere", np.full(3, abs(radius[0])), rotation, translation)
    if shape.tag in ("cylinder", "capsule") and radius is not None and length is not None:
        end = abs(length[0]) / 2 + (abs(radius[0]) if shape.tag == "capsule" else 0)
        return Shape(line, shape, role, "cylinder", np.array([abs(radius[0]), abs(radius[0]), end]), rotation, translation)
    return None


def _joint(robot: RobotFile, element: _Element, scope: str) -> FileJoint:
    name = element.get("name", "")
    kind = KINDS.get(element.get("type", ""), element.get("type", ""))

    def end(tag: str) -> str:
        link: str = element.findtext(tag, "").strip()
        return link if link in ("", "world") else scope + link

    joint = FileJoint(scope + name if name else "", line_of(element), element, kind, end("parent"), end("child"))
    numbers = Numbers(robot, "joint", joint.name)
    axis = element.find("axis")
    if axis is None:
        return joint
    joint.axis, joint.axis_line, joint.axis_element = numbers.text(axis, "xyz", 3), line_of(axis), axis
    limit, dynamics, mimic = axis.find("limit"), axis.find("dynamics"), axis.find("mimic")

    def number(parent: _Element | None, tag: str) -> float | None:
        value = numbers.text(parent, tag)
        return None if value is None else float(value[0])

    joint.limit_line, joint.limit_element = line_of(limit), limit
    joint.lower, joint.upper, joint.effort, joint.velocity = (number(limit, tag) for tag in ("lower", "upper", "effort", "velocity"))
    joint.damping, joint.friction, joint.dynamics_line = (number(dynamics, "damping"), number(dynamics, "friction"), line_of(dynamics))
    if mimic is not None:
        multiplier, offset = number(mimic, "multiplier"), number(mimic, "offset")
        joint.mimic = Mimic(line_of(mimic), mimic, scope + mimic.get("joint", ""), 1.0 if multiplier is None else multiplier, offset or 0.0)
    return joint
