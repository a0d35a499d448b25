"""Rules of mesh files."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ksl.checks.extent import shape_box
from ksl.checks.description.findings import Repair
from ksl.checks.description.repair import digits, set_attribute, shown
from ksl.checks.description.robot import FileLink, RobotFile, Shape
from ksl.checks.rule import Broken, rule
from ksl.robot_files.mesh_files import find_mesh, mesh_fault, package_folders, package_of, path_of_uri, same_but_for_capitals

LARGEST = 50.0
"""m: the largest robot arms and cranes are smaller; a part of 0.1 m drawn in mm has 100."""
SCALES = 30.0
"""Inches and metres differ by 39, millimetres by 1000; nobody draws the same part in two sizes that differ so much."""


def _meshes(robot: RobotFile) -> Iterator[tuple[FileLink, Shape]]:
    for link in robot.links:
        for shape in link.shapes:
            if shape.kind == "mesh":
                yield link, shape


@rule(
    "mesh-uri",
    "warning",
    condition="Meshes are named package://NAME/PATH, file:///PATH, or by a path with forward slashes.",
    cause="A slash too many, or the file was written on Windows. Some readers find the mesh nevertheless.",
    repair="Correct the name.",
    fix="removes the slash, and writes forward slashes",
    formats=("urdf", "sdf"),
)
def mesh_uri(robot: RobotFile) -> Iterator[Broken]:
    wrong = [(link, shape) for link, shape in _meshes(robot) if _corrected(shape.uri) != shape.uri]
    for link, shape in wrong[:1]:
        more = f", and {len(wrong) - 1} more" if len(wrong) > 1 else ""
        fix = _all_corrected([shape for _, shape in wrong]) if robot.format == "urdf" else None
        yield Broken(f"{shape.uri}{more}", shape.line, "link", link.name, float(len(wrong)), repair=f"Write {_corrected(shape.uri)}.", fix=fix)


def _corrected(uri: str) -> str:
    if uri.startswith(("package:///", "model:///")):
        scheme, _, rest = uri.partition("://")
        return f"{scheme}://{rest.lstrip('/')}"
    return uri.replace("\\", "/") if "\\" in uri and "/" not in uri else uri


def _all_corrected(shapes: list[Shape]) -> Repair:
    def change() -> str:
        for shape in shapes:
            if shape.element is not None:
                shape.element.set("filename", _corrected(shape.uri))
        return f"{len(shapes)} name{'s' if len(shapes) > 1 else ''} of meshes corrected: {shapes[0].uri} is now {_corrected(shapes[0].uri)}"

    return change


def _by_package(robot: RobotFile) -> dict[str, list[str]]:
    """The names of meshes by the packages that they are in."""
    meshes: dict[str, list[str]] = defaultdict(list)
    for _, shape in _meshes(robot):
        named = package_of(shape.uri)
        if named:
            meshes[named[0]].append(shape.uri)
    return meshes


def _package_is_found(robot: RobotFile, package: str, meshes: list[str]) -> bool:
    """Whether there is a folder for the package.  One that was only given for any package counts if a mesh is in it."""
    folders = package_folders(package, robot.path, robot.package_paths)
    given = [Path(path) for path in robot.package_paths]
    if any(folder not in given or folder.name == package for folder in folders):
        return True
    return bool(folders) and any(find_mesh(uri, robot.path, robot.package_paths) for uri in meshes)


@rule(
    "package-missing",
    "warning",
    condition="The packages that meshes are in are found.",
    cause="The package is not installed here, or its workspace was not sourced.",
    repair="Give the folder that holds the package with --package-path, or set ROS_PACKAGE_PATH.",
)
def package_missing(robot: RobotFile) -> Iterator[Broken]:
    first: dict[str, tuple[FileLink, Shape]] = {}
    meshes = _by_package(robot)
    for link, shape in _meshes(robot):
        named = package_of(shape.uri)
        if named:
            first.setdefault(named[0], (link, shape))
    for package, (link, shape) in first.items():
        if not _package_is_found(robot, package, meshes[package]):
            n = len(meshes[package])
            found = f"package {package} not found, with {n} mesh{'es' if n > 1 else ''}, the first of which is {shape.uri}"
            yield Broken(found, shape.line, "link", link.name)


@rule(
    "mesh-missing",
    "error",
    condition="Mesh files exist.",
    cause="The mesh was not copied with the robot file, was renamed, or its path is that of another computer.",
    repair="Correct the path, or put the mesh there.",
    fix="corrects the path where only capitals differ",
    formats=("urdf", "sdf"),
)
def mesh_missing(robot: RobotFile) -> Iterator[Broken]:
    told: set[str] = set()
    is_found: dict[str, bool] = {}
    meshes = _by_package(robot)
    for link, shape in _meshes(robot):
        named = package_of(shape.uri)
        if shape.uri in told or "${" in shape.uri or find_mesh(shape.uri, robot.path, robot.package_paths):
            continue
        told.add(shape.uri)
        if not shape.uri:
            yield Broken("a mesh without a file name", shape.line, "link", link.name)
            continue
        folders = package_folders(named[0], robot.path, robot.package_paths) if named else []
        if named and named[0] not in is_found:
            is_found[named[0]] = _package_is_found(robot, named[0], meshes[named[0]])
        if named and not is_found[named[0]]:
            continue  # package-missing
        expected = folders[0] / named[1] if named else robot.path.parent / path_of_uri(shape.uri)
        other = same_but_for_capitals(expected.absolute())
        repair, fix = None, None
        if other is not None:
            right = shape.uri[: len(shape.uri) - len(_tail(expected, other))] + _tail(expected, other)
            repair = f"Did you mean {right}? Names of files with other capitals are other files on most systems."
            fix = set_attribute(shape.element, "filename", right) if robot.format == "urdf" else None
        yield Broken(f"{shape.uri} not found ({expected})", shape.line, "link", link.name, repair=repair, fix=fix)


def _tail(expected: Path, other: Path) -> str:
    """The parts of the right path from the first on that differs, as the end of a name."""
    parts = list(zip(expected.absolute().parts, other.parts))
    first = next(i for i, (a, b) in enumerate(parts) if a != b)
    return "/".join(other.parts[first:])


@rule(
    "mesh-unreadable",
    "error",
    condition="Mesh files are what their suffix says, and complete.",
    cause="A download that was cut short, a placeholder of Git LFS, or a wrong suffix.",
    repair="Get the file again, or export it again.",
    formats=("urdf", "sdf"),
)
def mesh_unreadable(robot: RobotFile) -> Iterator[Broken]:
    told: set[Path] = set()
    for link, shape in _meshes(robot):
        path = find_mesh(shape.uri, robot.path, robot.package_paths)
        if path is None or path in told:
            continue
        told.add(path)
        fault = mesh_fault(path)
        if fault:
            yield Broken(f"{shape.uri} {fault}", shape.line, "link", link.name)


@rule(
    "mesh-units",
    "warning",
    condition=f"Links are smaller than {LARGEST:g} m.",
    cause='The mesh is in millimetres, and scale="0.001 0.001 0.001" is missing.',
    repair='Add scale="0.001 0.001 0.001" to <mesh>, if it is in millimetres.',
    accept="multiplies the scale of the mesh by 0.001",
    formats=("urdf", "sdf"),
)
def mesh_units(robot: RobotFile) -> Iterator[Broken]:
    told: set[tuple[str, float]] = set()
    for link, shape in _meshes(robot):
        box = shape_box(robot, shape)
        largest = 0.0 if box is None else float((box[1] - box[0]).max())
        if largest > LARGEST and (shape.uri, largest) not in told:
            told.add((shape.uri, largest))
            scale = " ".join(digits(float(x) / 1000) for x in shape.scale)
            guess = set_attribute(shape.element, "scale", scale) if robot.format == "urdf" else None
            yield Broken(f"{shape.uri} is {shown(largest)} m long", shape.line, "link", link.name, largest, guess=guess)


@rule(
    "mesh-scales",
    "warning",
    condition=f"A mesh is used at scales that differ by less than {SCALES:g} times.",
    cause="One of the uses is in millimetres and the other in metres.",
    repair="Correct one of the scales, and check whether masses and lengths of the link are in kg and m.",
    formats=("urdf", "sdf"),
)
def mesh_scales(robot: RobotFile) -> Iterator[Broken]:
    uses: dict[str, list[tuple[float, FileLink, Shape]]] = defaultdict(list)
    for link, shape in _meshes(robot):
        scale = float(np.abs(shape.scale).max())
        if scale > 0:
            uses[shape.uri].append((scale, link, shape))
    for uri, each in uses.items():
        least, most = min(each, key=lambda use: use[0]), max(each, key=lambda use: use[0])
        if most[0] / least[0] >= SCALES:
            yield Broken(
                f"{uri} at scale {shown(least[0])} and, in line {most[2].line}, at scale {shown(most[0])}",
                least[2].line,
                "link",
                least[1].name,
                most[0] / least[0],
            )
