"""Rules of names."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

from ksl.checks.description.findings import Repair
from ksl.checks.description.robot import FileJoint, FileLink, RobotFile
from ksl.checks.rule import Broken, rule

Kind = Literal["link", "joint"]


def _named(robot: RobotFile) -> list[tuple[Kind, Sequence[FileLink | FileJoint]]]:
    return [("link", robot.links), ("joint", robot.joints)]


@rule(
    "name-missing",
    "error",
    condition="Every link and every joint has a name.",
    cause="The attribute was left out.",
    repair='Add name="...".',
    formats=("urdf", "sdf"),
)
def name_missing(robot: RobotFile) -> Iterator[Broken]:
    for kind, all_of_them in _named(robot):
        for each in all_of_them:
            if not each.name.strip():
                yield Broken(f"<{kind}> without a name", each.line)


@rule(
    "name-duplicate",
    "error",
    condition="No two links, and no two joints, have the same name.",
    cause="A part was copied and its name was not changed, or a macro was used twice without a prefix.",
    repair="Rename one of them, and what refers to it.",
    formats=("urdf", "sdf"),
)
def name_duplicate(robot: RobotFile) -> Iterator[Broken]:
    for kind, all_of_them in _named(robot):
        first: dict[str, int | None] = {}
        for each in all_of_them:
            if each.name in first and each.name.strip():
                yield Broken(f"a second {kind} of this name, the first is in line {first[each.name]}", each.line, kind, each.name)
            first.setdefault(each.name, each.line)


@rule(
    "name-case",
    "warning",
    condition="Names differ by more than capitals.",
    cause="The same part under two spellings; on some file systems and in some tools they are the same name.",
    repair="Rename one of them so that nobody mistakes it for the other.",
)
def name_case(robot: RobotFile) -> Iterator[Broken]:
    for kind, all_of_them in _named(robot):
        spellings: dict[str, str] = {}
        for each in all_of_them:
            other = spellings.setdefault(each.name.lower(), each.name)
            if other != each.name:
                yield Broken(f"differs from {kind} {other} by capitals only", each.line, kind, each.name)


@rule(
    "name-space",
    "warning",
    condition="Names neither begin nor end with a space.",
    cause="Copied with the space beside it. Others that refer to the name without the space don't find it.",
    repair="Remove the space.",
    fix="removes the space, from the name and from all that refers to it",
    formats=("urdf",),
)
def name_space(robot: RobotFile) -> Iterator[Broken]:
    for kind, all_of_them in _named(robot):
        taken = {each.name for each in all_of_them}
        for each in all_of_them:
            bare = each.name.strip()
            if bare and bare != each.name:
                fix = None if bare in taken else _renamed(robot, kind, each.name, bare)
                yield Broken(f'name "{each.name}"', each.line, kind, each.name, fix=fix)


def _renamed(robot: RobotFile, kind: Kind, old: str, new: str) -> Repair:
    """Renames a link or joint in its own element and in those that name it."""
    attribute, tags = ("link", ("parent", "child")) if kind == "link" else ("joint", ("mimic",))

    def change() -> str:
        assert robot.root is not None
        for element in robot.root.iter(kind, *tags):
            name = "name" if element.tag == kind else attribute
            if element.get(name) == old:
                element.set(name, new)
        return f'{kind} "{old}" is now "{new}"'

    return change
