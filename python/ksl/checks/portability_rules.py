"""What common readers of URDF take in different ways, though KSL and some of them read it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Literal

from ksl.checks.description.findings import Repair
from ksl.checks.description.robot import RobotFile
from ksl.checks.rule import Broken, rule
from ksl.checks.description.tags import elements
from ksl.checks.description.xml_file import children

if TYPE_CHECKING:
    from lxml.etree import _Element

ONE_NUMBER = {
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "limit": ("lower", "upper", "effort", "velocity"),
    "dynamics": ("damping", "friction"),
    "mimic": ("multiplier", "offset"),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "safety_controller": ("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"),
    "calibration": ("rising", "falling"),
}
"""{element: attributes of one number}."""
SEVERAL = {"origin": ("xyz", "rpy", "quat_xyzw"), "axis": ("xyz",), "box": ("size",), "mesh": ("scale",), "color": ("rgba",)}
"""{element: attributes of several numbers, with blanks between them}."""
DROPPED = {
    "mass": "the whole <inertial>",
    "inertia": "the whole <inertial>",
    "limit": "the joint, and with it the file",
    "dynamics": "the joint, and with it the file",
    "mimic": "the joint, and with it the file",
}
"""{element: what urdfdom, which reads URDF in ROS and in most other programs, drops where a number of it is not one to it}."""
_SEVERAL_IN_TEXT = re.compile(r"(?<![\w:.\-])([\w:.\-]+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)')")
_SUSPECT = re.compile(r"(?:xyz|rpy|size|scale|rgba)\s*=\s*(?:\"[^\"<]*[\t\n\r]|'[^'<]*[\t\n\r])")
"""Without it no element has to be looked at."""

BLANKS = " \t\r\n"
"""White space in XML."""
Place = Literal["link", "joint", ""]


@rule(
    "portability",
    "warning",
    condition="Numbers are written so that all common readers take them: without blanks around one, and with nothing but blanks between several.",
    cause="A blank behind a number, or a tab or line end between numbers. KSL reads them; urdfdom, and all that use it, take them for no numbers.",
    repair="Remove the blanks, and write one blank between numbers.",
    fix="removes the blanks, and writes one blank between numbers",
    formats=("urdf",),
)
def portability(robot: RobotFile) -> Iterator[Broken]:
    if robot.root is None:
        return
    for top in children(robot.root, "link", "joint"):
        kind: Place = "link" if top.tag == "link" else "joint"
        for element in top.iter(*ONE_NUMBER):
            bad = [name for name in ONE_NUMBER[element.tag] if _has_blanks(element.get(name))]
            if bad:
                value = element.get(bad[0])
                rest = f", and {len(bad) - 1} more numbers of it" if len(bad) > 1 else ""
                drops = DROPPED.get(element.tag)
                found = f'{bad[0]} of <{element.tag}> is "{value}"{rest}: a blank beside a number' + (f"; urdfdom drops {drops}" if drops else "")
                yield Broken(found, element.sourceline, kind, top.get("name", ""), fix=_stripped(element, bad))
    yield from _separated_by_other_than_blanks(robot)


def _has_blanks(value: str | None) -> bool:
    """Whether there is white space behind a number, or white space other than blanks before it."""
    return value is not None and bool(value.strip(BLANKS)) and (value != value.rstrip(BLANKS) or value.lstrip(" ") != value.lstrip(BLANKS))


def _stripped(element: _Element, names: list[str]) -> Repair:
    def change() -> str:
        for name in names:
            element.set(name, element.get(name).strip(BLANKS))
        return f"blanks beside {', '.join(names)} of <{element.tag}> are removed"

    return change


def _separated_by_other_than_blanks(robot: RobotFile) -> Iterator[Broken]:
    """Tabs and line ends in attributes.  Parsers of XML make blanks of them; that of urdfdom doesn't, so the text tells."""
    found = []
    for tag, attributes, line in elements(robot.text) if _SUSPECT.search(robot.text) else ():
        for name, double, single in _SEVERAL_IN_TEXT.findall(attributes) if tag in SEVERAL else ():
            if name in SEVERAL[tag] and any(sign in (double or single).strip() for sign in "\t\n\r"):
                found.append((tag, name, line))
    if found:
        tag, name, line = found[0]
        more = f", and {len(found) - 1} more" if len(found) > 1 else ""
        yield Broken(
            f"a tab or line end between the numbers in {name} of <{tag}>{more}",
            line,
            value=float(len(found)),
            fix=partial(str, "blanks are between all numbers"),
        )
