"""How large links are: boxes around their geometry, in the axes of the link."""

from __future__ import annotations

import numpy as np

from ksl.checks.description.robot import Array, FileLink, RobotFile, Shape
from ksl.robot_files.mesh_files import find_mesh, mesh_bounds


def shape_box(robot: RobotFile, shape: Shape) -> Array | None:
    """(2, 3): least and largest coordinates of a shape in the link's axes; None for a mesh whose extent is not
    known."""
    if shape.kind == "mesh":
        path = find_mesh(shape.uri, robot.path, robot.package_paths)
        bounds = mesh_bounds(path) if path else None
        if bounds is None:
            return None
        bounds = np.sort(bounds * shape.scale, axis=0)
    else:
        bounds = np.array([-shape.half_size, shape.half_size])
    if not np.isfinite(shape.translation).all():  # placed relative to a frame that only the loader knows
        return None
    middle = shape.rotation @ bounds.mean(axis=0) + shape.translation
    half = abs(shape.rotation) @ (bounds[1] - bounds[0]) / 2
    return np.array([middle - half, middle + half])


def link_box(robot: RobotFile, link: FileLink) -> Array | None:
    """(2, 3) around a link's geometry; None if too little of it is known.

    Meshes of collisions stand for the whole link.  Spheres and boxes don't: they may cover only its foot, while the
    mesh to look at,
    whose extent is not known, is larger.
    """
    known: dict[str, list[Array]] = {}
    for role in ("collision", "visual"):
        boxes = [shape_box(robot, shape) for shape in link.shapes if shape.role == role]
        if all(box is not None for box in boxes):
            known[role] = [box for box in boxes if box is not None]
    has_mesh = any(shape.kind == "mesh" for shape in link.shapes if shape.role == "collision")
    whole = [box for boxes in known.values() for box in boxes] if "visual" in known or has_mesh else []
    if not whole:
        return None
    return np.array([np.min([box[0] for box in whole], axis=0), np.max([box[1] for box in whole], axis=0)])
