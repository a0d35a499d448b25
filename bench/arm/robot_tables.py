"""Robots as tables for bench/arm/load.cpp: robot_tables.py ROBOTS OUTPUT_DIR NAME...

ROBOTS is the robots.txt of bench/robots.py.  A line for each joint and the body that it carries: kind, parent joint, rotation (9, row by
row), position (3), axis (3), mass, centroid (3), inertia about the centroid (xx yy zz xy yz zx).  robots.txt in OUTPUT_DIR has the
arguments of bench/arm/count.cpp.  Run it with the Python that has Pinocchio, which reads the files and lumps welded links.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin


def axis_of(joint: pin.JointModel) -> np.ndarray:
    """The axis of a joint that turns or slides."""
    name = joint.shortname()
    if "Unaligned" in name:
        return joint.extract().axis
    return np.eye(3)["XYZ".index(name[-1])]


def lines(model: pin.Model) -> Iterator[str]:
    for i in range(1, model.njoints):
        joint, placement, body = model.joints[i], model.jointPlacements[i], model.inertias[i]
        name = joint.shortname()
        kind = "floating" if "FreeFlyer" in name else "prismatic" if "Prismatic" in name or name[-2] == "P" else "revolute"
        axis = np.zeros(3) if kind == "floating" else axis_of(joint)
        I = body.inertia
        moments = [I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[1, 2], I[2, 0]]
        numbers = [*placement.rotation.ravel(), *placement.translation, *axis, body.mass, *body.lever, *moments]
        yield f"{kind} {model.parents[i] - 1} " + " ".join(repr(float(x)) for x in numbers)


def main(robots: str, output: str, *names: str) -> None:
    rows = {name: (base, path) for name, base, path in (line.split(maxsplit=2) for line in Path(robots).read_text().splitlines())}
    arguments = []
    for name in names:
        base, path = rows[name]
        floating = base == "floating"
        model = pin.buildModelFromUrdf(path, pin.JointModelFreeFlyer()) if floating else pin.buildModelFromUrdf(path)
        table = Path(output) / f"{name}.table"
        table.write_text("\n".join(lines(model)) + "\n")
        arguments.append(f"{name}={table}{':floating' if floating else ''}")
    (Path(output) / "robots.txt").write_text(" ".join(arguments) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
