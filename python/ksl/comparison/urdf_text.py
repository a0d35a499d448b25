"""URDF as other libraries take it: without elements that they refuse, and with a floating joint below its root; SDF with one model."""

from __future__ import annotations

from xml.etree import ElementTree

from ksl.comparison.other_robot import NotLoaded
from ksl.model.model import Model


def _root(contents: bytes) -> ElementTree.Element:
    """Raises NotLoaded for a prefix without a namespace, say, which readers of robots take."""
    try:
        return ElementTree.fromstring(contents)
    except (ElementTree.ParseError, ValueError, LookupError) as e:
        raise NotLoaded(f"it takes the file with changes alone, and Python's reader of XML refuses it: {e}") from None


def without(contents: bytes, of: str, *tags: str) -> ElementTree.Element:
    """The document without some elements of its links or joints: without <visual> and <collision> of links no library looks for their meshes."""
    robot = _root(contents)
    for element in robot.iterfind(of):
        for child in [child for tag in tags for child in element.findall(tag)]:
            element.remove(child)
    return robot


def of_one_model(contents: bytes, name: str) -> ElementTree.Element:
    """A document of SDF without its other models."""
    root = _root(contents)
    for place in (root, *root.iterfind("world")):
        for other in [model for model in place.findall("model") if model.get("name") != name]:
            place.remove(other)
    return root


def on_floating_joint(robot: ElementTree.Element, model: Model) -> ElementTree.Element:
    """With a new root, on which the robot's floats: the joint is called as KSL calls it."""
    root, ground = model.root, "ground"
    while ground in model.link_names:
        ground += "_"
    robot.append(ElementTree.Element("link", name=ground))
    joint = ElementTree.SubElement(robot, "joint", name=model.joint_above(root).name, type="floating")
    ElementTree.SubElement(joint, "parent", link=ground)
    ElementTree.SubElement(joint, "child", link=root)
    return robot


def text(robot: ElementTree.Element) -> str:
    return ElementTree.tostring(robot, encoding="unicode")
