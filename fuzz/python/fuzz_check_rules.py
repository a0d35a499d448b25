"""`ksl check` of well-formed URDF and SDF texts: all rules, what they say, and their repairs.

Texts that are not well-formed, the loader and MJCF have targets of their own.  Files of meshes are stood in for: a text must not make the target read
what lies on this machine."""

from guided import guide

guide("ksl.checks")

from pathlib import Path

import numpy as np
from ksl.base.errors import DescriptionError
from ksl.base.printable import one_line
from ksl.checks import extent, mesh_rules, run as checks
from ksl.checks.description import read_sdf, read_urdf  # noqa: F401  are imported late
from lxml import etree
from mutate import of_xml
from target import BrokenPromise, check_characters, check_message, finite, run

MESH, BOUNDS = Path("mesh.stl"), np.array([[-0.1, -0.2, 0.0], [0.1, 0.2, 0.3]])
mesh_rules.find_mesh = extent.find_mesh = lambda uri, robot, packages: MESH if uri.endswith(".stl") else None
mesh_rules.mesh_fault = lambda path: None
mesh_rules.package_folders = lambda package, robot, packages: []
mesh_rules.same_but_for_capitals = lambda missing: None
extent.mesh_bounds = lambda path: BOUNDS

LONGEST = 601
"""Characters of what a finding quotes."""


PARSER = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False)


def read(data: bytes) -> None:
    try:
        etree.fromstring(data, PARSER)
    except (etree.XMLSyntaxError, ValueError):
        return
    findings = list(checks.findings_of_bytes(data, "robot.urdf"))
    check_characters(one_line(" ".join(map(str, findings))))
    if any(len(f.found) > LONGEST or len(f.name) > LONGEST or not f.found for f in findings):
        raise BrokenPromise("broken promise: a finding quotes nothing, or too much")
    finite([f.value for f in findings if f.value is not None], "values of findings")
    for repair in (f._fix for f in findings if f._fix is not None):  # what --fix and --accept ask for
        check_message(one_line(repair()))


if __name__ == "__main__":
    run(read, of_xml, DescriptionError)
