#!/usr/bin/env python3
"""Fills a folder with real robots, cut down to what a fuzzer changes quickly.

    real_robots.py urdf|sdf FOLDER [--most BYTES]

The robots are those of the package example-robot-data.  Each becomes one file or several, of neighbouring links and their
joints, without geometry, with all that the readers use.  SDF files are made from the same links and joints."""

import argparse
import importlib.metadata
from pathlib import Path
from xml.etree import ElementTree as ET


def real_robots():
    """The URDF files of example-robot-data; none without the package."""
    try:
        files = importlib.metadata.files("example-robot-data") or []
    except importlib.metadata.PackageNotFoundError:
        return []
    return sorted({Path(file.locate()).resolve() for file in files if file.suffix == ".urdf"})


def pieces(root, most):
    """Robots of neighbouring links of a robot, each of about `most` bytes."""
    links = {link.get("name"): link for link in root.findall("link")}
    piece, size = None, 0
    for joint in root.findall("joint"):
        ends = [joint.find(end).get("link") for end in ("parent", "child")]
        if any(end not in links for end in ends):
            continue
        new = [link for link in (links[end] for end in ends) if piece is None or link not in piece]
        length = sum(len(ET.tostring(element)) for element in [joint, *new])
        if piece is None or size + length > most:
            if piece is not None:
                yield piece
            piece, size, new = ET.Element("robot", name=root.get("name", "r")), 0, [links[end] for end in ends]
        piece.extend([*new, joint])
        size += length
    if piece is not None:
        yield piece


def without_geometry(root):
    for element in [*root.iter("link")]:
        for child in [*element]:
            if child.tag in ("visual", "collision"):
                element.remove(child)
    for element in root.iter():
        element.text = element.tail = None
    return root


def text(tag, words):
    element = ET.Element(tag)
    element.text = words
    return element


def pose(origin, relative_to=None):
    words = " ".join((origin.get("xyz", "0 0 0"), origin.get("rpy", "0 0 0"))) if origin is not None else "0 0 0 0 0 0"
    element = text("pose", words)
    if relative_to:
        element.set("relative_to", relative_to)
    return element


def as_sdf(robot):
    """The same links and joints, as SDF has them."""
    sdf = ET.Element("sdf", version="1.10")
    model = ET.SubElement(sdf, "model", name=robot.get("name"))
    carried = {joint.find("child").get("link"): joint for joint in robot.findall("joint")}
    for link in robot.findall("link"):
        out = ET.SubElement(model, "link", name=link.get("name"))
        if (joint := carried.get(link.get("name"))) is not None:
            out.append(pose(joint.find("origin"), joint.find("parent").get("link")))
        if (inertial := link.find("inertial")) is not None:
            of = ET.SubElement(out, "inertial")
            of.append(pose(inertial.find("origin")))
            of.append(text("mass", inertial.find("mass").get("value")))
            of.append(ET.Element("inertia"))
            of[-1].extend(text(*moment) for moment in inertial.find("inertia").items())
    for joint in robot.findall("joint"):
        kind = joint.get("type")
        out = ET.SubElement(model, "joint", name=joint.get("name"), type=kind if kind in ("revolute", "continuous", "prismatic", "fixed") else "ball")
        out.extend([text("parent", joint.find("parent").get("link")), text("child", joint.find("child").get("link"))])
        if out.get("type") not in ("fixed", "ball"):
            axis = ET.SubElement(out, "axis")
            given = joint.find("axis")
            axis.append(text("xyz", given.get("xyz") if given is not None else "1 0 0"))
            if (limit := joint.find("limit")) is not None:
                ET.SubElement(axis, "limit").extend(text(*each) for each in limit.items())
    return sdf


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("format", choices=("urdf", "sdf"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--most", type=int, default=3000, help="bytes of each file, about")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    count = 0
    for file in real_robots():
        try:
            root = without_geometry(ET.parse(file).getroot())
        except ET.ParseError:
            continue
        if root.tag != "robot":
            continue
        for number, piece in enumerate(pieces(root, asked.most)):
            made = piece if asked.format == "urdf" else as_sdf(piece)
            (asked.folder / f"{file.stem}_{number}.{asked.format}").write_bytes(ET.tostring(made))
            count += 1
    print(f"{count} pieces of real robots in {asked.folder}")


if __name__ == "__main__":
    main()
