"""`ksl.check`: all rules over one robot file, and the repaired file."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ksl.base.errors import ArgumentError, DescriptionError, DescriptionWarning, near_names, of_argument
from ksl.base.input_files import path_given
from ksl.checks import drive_rules, file_rules, fit_rules, inertia_rules, joint_rules, limit_rules, loop_rules, mesh_rules, name_rules, portability_rules
from ksl.checks import shape_rules, symmetry_rules, tree_rules
from ksl.checks.description.findings import Finding, Findings, mend
from ksl.checks.description.robot import RobotFile
from ksl.checks.rule import Rule, rules_of
from ksl.checks.description.xml_file import parse, parse_bytes
from ksl.robot_files.xacro_files import EXPANDED, expanded, with_packages
from ksl.mechanism.requests import one_of

TOPICS: dict[str, list[Rule]] = {
    "The file": [*rules_of(file_rules), *rules_of(portability_rules)],
    "Names": rules_of(name_rules),
    "The tree": rules_of(tree_rules),
    "Masses and inertias": rules_of(inertia_rules),
    "Masses and inertias against the geometry": rules_of(fit_rules),
    "Joints": rules_of(joint_rules),
    "Loops": [*rules_of(loop_rules), *rules_of(drive_rules)],
    "Limits": rules_of(limit_rules),
    "Shapes": rules_of(shape_rules),
    "Meshes": rules_of(mesh_rules),
    "Left and right": rules_of(symmetry_rules),
}
"""The rules by topic: the only list of the files that declare them."""

RULES: dict[str, Rule] = {rule.name: rule for rules in TOPICS.values() for rule in rules}

SYMMETRY = 0.05
"""Share of its mass by which a limb may differ from that of the other side."""


def check(
    path: str | os.PathLike[str],
    *,
    ignore: Iterable[str] | str = (),
    package_paths: Iterable[str | os.PathLike[str]] | str = (),
    symmetry: float = SYMMETRY,
    loops: str | os.PathLike[str] | None = None,
    drives: Iterable[str] | str | None = None,
    floating_base: bool = False,
    mimic: Literal["coupled", "independent"] = "coupled",
    strict: bool = False,
    model: str | None = None,
    xacro: Mapping[str, object] | None = None,
    packages: Mapping[str, str | os.PathLike[str]] | None = None,
) -> Findings:
    """Looks for what is wrong in a robot file: URDF, SDF, or MJCF (with the extra `ksl[mjcf]`).

    path: also of a file that :func:`ksl.load` refuses; it is checked as far as it can be read.
    ignore: names of rules that are left out, `inertia-triangle` for example; docs/check.md has all of them.
    package_paths: folders in which package://NAME/… is looked for, besides those around the file, in ROS_PACKAGE_PATH
    and in AMENT_PREFIX_PATH.
    symmetry: share of its mass, 0 to 1, by which a limb may differ from that of the other side.
    loops, drives: as :func:`ksl.load` takes them: a TOML file with joints that close loops, and the joints that have motors.
    floating_base, mimic, strict, model: as :func:`ksl.load` takes them.  Of an SDF file with several models only that of this name is checked.
    xacro, packages: as :func:`ksl.load` takes them: arguments of a xacro file, which is run.  Lines are then those of the text that it makes.
    Returns the findings, errors first: a sequence of :class:`ksl.checks.description.findings.Finding`, with `table` as an Arrow
    table.
    Raises DescriptionError where there is no XML file to check, ValueError for an unknown rule.  Cost: O(links), and
    the first bytes of
    each mesh; of STL and OBJ meshes also a sample of the vertices; of loops the cube of their equations.  Needs lxml, of the extra `ksl[check]`.

        findings = ksl.check("robot.urdf")
        print(findings.summary, [f.rule for f in findings])
    """
    reading = {"floating_base": floating_base, "mimic": mimic, "strict": strict, "model": model}
    robot, left_out = _read(path, ignore, package_paths, symmetry, loops, drives, reading, with_packages(xacro, packages))
    return _findings(robot, left_out)


@dataclass(frozen=True)
class Fixed:
    """What :func:`fix` did."""

    path: str
    changes: list[tuple[Finding, str]]
    """What was changed, and the finding that asked for it."""
    left: Findings
    """The findings of the repaired file, with its lines: what needs a person's decision."""


def fix(
    path: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    ignore: Iterable[str] | str = (),
    package_paths: Iterable[str | os.PathLike[str]] | str = (),
    symmetry: float = SYMMETRY,
    accept: Iterable[str] | str = (),
    force: bool = False,
    loops: str | os.PathLike[str] | None = None,
    drives: Iterable[str] | str | None = None,
    floating_base: bool = False,
    mimic: Literal["coupled", "independent"] = "coupled",
    strict: bool = False,
    model: str | None = None,
) -> Fixed:
    """Writes a repaired URDF file.  Comments and layout stay; only what :attr:`Fixed.changes` lists is changed.

    out: a new file; the original is never overwritten, and another existing file only with `force`.
    ignore, package_paths, symmetry, loops, drives, floating_base, mimic, strict, model: as :func:`check` takes them.
    accept: names of rules whose likely cause is right: moments in kg mm², limits in degrees … These are repaired, too.
    Raises DescriptionError where the file is no URDF or is not well-formed, and OutputError where `out` can't be
    written.
    """
    from ksl.checks.description.write import write_tree

    ignored = [ignore] if isinstance(ignore, str) else list(ignore)
    packages = [package_paths] if isinstance(package_paths, str) else list(package_paths)
    reading: dict[str, Any] = {"floating_base": floating_base, "mimic": mimic, "strict": strict, "model": model}
    robot, left_out = _read(path, ignored, packages, symmetry, loops, drives, reading)
    if robot.format != "urdf":
        raise DescriptionError(f"{path}: only URDF files can be repaired; correct the findings by hand")
    accepted = _rule_names(accept, "accept")
    if robot.syntax and not (robot.mended and "xml-syntax" in accepted):
        first = robot.syntax[0]
        way_out = ", or accept xml-syntax (--accept xml-syntax)" if robot.mended else ", since what it hides would be lost"
        raise DescriptionError(f"{path}:{first.line}: the XML is broken ({first.found}); correct that first{way_out}")
    changes = [(finding, change) for finding in _findings(robot, left_out) if (change := mend(finding, accepted)) is not None]
    write_tree(robot, Path(out), force)
    return Fixed(
        str(out), changes, check(out, ignore=ignored, package_paths=[*packages, robot.path.parent], symmetry=symmetry, loops=loops, drives=drives, **reading)
    )


def _read(
    path: str | os.PathLike[str],
    ignore: Iterable[str] | str,
    package_paths: Iterable[str | os.PathLike[str]] | str,
    symmetry: float,
    loops: str | os.PathLike[str] | None = None,
    drives: Iterable[str] | str | None = None,
    reading: Mapping[str, Any] | None = None,
    xacro: Mapping[str, object] | None = None,
) -> tuple[RobotFile, list[str]]:
    """The file as the rules see it, and the rules that are left out."""
    left_out = _rule_names(ignore, "ignore")
    given_reading = dict(reading or {})
    one_of(given_reading.get("mimic", "coupled"), "mimic", "coupled", "independent")
    path_given(path, "a robot file")
    if not (0 <= symmetry <= 1):
        raise of_argument(ArgumentError, "symmetry", ": expected a share between 0 and 1, 0.05 for 5 %", symmetry)
    folders = [Path(p) for p in ([package_paths] if isinstance(package_paths, str) else package_paths)]
    for folder in folders:
        if not folder.is_dir():
            raise of_argument(ArgumentError, "package_path", ": no such folder; name the folder that holds the packages", str(folder))
    motors = None if drives is None else (drives,) if isinstance(drives, str) else tuple(drives)
    robot = RobotFile(Path(path), package_paths=folders, symmetry=symmetry, beside=loops, drives=motors, xacro=xacro, reading=given_reading)
    try:
        if xacro is None:
            parse(robot)
        else:
            made = expanded(str(path), xacro)
            parse_bytes(robot, made.contents)
    except ModuleNotFoundError as e:
        raise DescriptionError(f"checking a file needs {e.name}; install it with: pip install 'ksl[check]'") from None
    _fill(robot)
    return robot, left_out


def _rule_names(names: Iterable[str] | str, argument: str) -> list[str]:
    given = [names] if isinstance(names, str) else list(names)
    for name in given:
        if name not in RULES:
            raise of_argument(ArgumentError, argument, f": no such rule; {near_names(name, RULES)}docs/check.md lists all {len(RULES)}", name)
    return given


def findings_of_bytes(data: bytes, path: str = "robot.urdf") -> Findings:
    """The findings of all rules but `not-loaded`, in the contents of a file.  path: its name in messages.  The loader is not called."""
    return _findings(robot_of_bytes(data, path), [])


def robot_of_bytes(data: bytes, path: str = "robot.urdf") -> RobotFile:
    """The contents of a file as the rules see them, without what the loader says.  Raises DescriptionError."""
    from ksl.checks.description.xml_file import check_xml, parse_bytes

    robot = RobotFile(Path(path))
    check_xml(data, robot.path)
    parse_bytes(robot, data)
    _fill(robot, load=False)
    return robot


def _fill(robot: RobotFile, load: bool = True) -> None:
    """Links and joints by the reader of the format, and what the loader says of the file."""
    tag = None if robot.root is None else robot.root.tag
    if not load and tag == "mujoco":
        return  # MuJoCo's compiler reads it
    if tag == "robot":
        from ksl.checks.description.read_urdf import read_urdf

        robot.format = "urdf"
        read_urdf(robot)
    elif tag == "sdf":
        from ksl.checks.description.read_sdf import read_sdf

        robot.format = "sdf"
        read_sdf(robot)
    elif tag == "mujoco":
        from ksl.checks.description.read_mjcf import read_mjcf

        robot.format = "mjcf"
        read_mjcf(robot)
        return
    if load:
        _load(robot)


def _load(robot: RobotFile) -> None:
    from ksl.robot_files.loading import load

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DescriptionWarning)
        try:
            robot.model = load(robot.path, masses="optional", loops=robot.beside, drives=robot.drives, xacro=robot.xacro, **robot.reading)
        except ValueError as e:
            robot.refusal = str(e)


def _findings(robot: RobotFile, left_out: Sequence[str]) -> Findings:
    asked = [rule for rule in RULES.values() if rule.name not in left_out and rule.name != "not-loaded" and robot.format in rule.formats]
    if robot.cut_short:
        robot.not_checked.append(f"what may stand behind the end of the file: {', '.join(rule.name for rule in asked if rule.whole)}")
        asked = [rule for rule in asked if not rule.whole]
    with np.errstate(all="ignore"):  # numbers at the ends of their range; what comes of them is compared, not computed with
        found = [finding for rule in asked for finding in rule.findings(robot)]
    if "not-loaded" not in left_out and not robot.syntax:
        found += [f for f in RULES["not-loaded"].findings(robot) if not any(_explains(other, f) for other in found)]
    return Findings(f"{robot.path}{'' if robot.xacro is None else EXPANDED}", found, robot.not_checked, left_out)


def _explains(finding: Finding, refusal: Finding) -> bool:
    """Whether a finding says what the loader stopped at: it is about the same line, or about a link or joint that the
    loader names."""
    if finding.severity != "error":
        return False
    names = re.findall(r"[^\s,;:\"]+", refusal.found)
    return (finding.line is not None and finding.line == refusal.line) or finding.name in names or refusal.line is None
