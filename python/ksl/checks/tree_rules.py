"""Rules of the tree: which links and joints there are, and how they hang together."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import dropwhile
from typing import TYPE_CHECKING

from ksl.checks.description.repair import Strangers, set_attribute
from ksl.checks.description.robot import TYPES, URDF_TYPES, FileJoint, RobotFile
from ksl.checks.rule import Broken, rule

if TYPE_CHECKING:
    from lxml.etree import _Element

_PLACES = ("origin", "pose", "axis", "axis2", "xyz")


@rule(
    "no-link",
    "error",
    condition="A robot has at least one link.",
    cause="Another file was meant, or the file only includes others.",
    repair="Name the file that has the links. If it is made by xacro, run xacro first: xacro FILE > robot.urdf; or let KSL run it: --xacro 'NAME:=VALUE'.",
    formats=("urdf", "sdf"),
    whole=True,
)
def no_link(robot: RobotFile) -> Iterator[Broken]:
    if not robot.links and robot.root is not None:
        yield Broken("no link in the file", robot.root.sourceline, value=0.0)


@rule(
    "joint-incomplete",
    "error",
    condition="A joint has a type, a parent link and a child link, which differ.",
    cause="An element was left out or misspelt.",
    repair="Add what is missing.",
    whole=True,
)
def joint_incomplete(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        absent = [what for what, given in (("type", joint.kind), ("parent", joint.parent), ("child", joint.child)) if not given]
        if absent:
            yield Broken(f"no {', no '.join(absent)}", joint.line, "joint", joint.name)
        elif joint.parent == joint.child:
            yield Broken(f"link {joint.child} is both its parent and its child", joint.line, "joint", joint.name, repair="Name two links.")


@rule(
    "joint-type",
    "error",
    condition="The type of a joint is one that the format has.",
    cause="A spelling mistake, or a type of another format.",
    repair="Write one of these types.",
    fix="writes the type in small letters where only that differs",
    formats=("urdf",),
)
def joint_type(robot: RobotFile) -> Iterator[Broken]:
    strangers, types = Strangers(), tuple(TYPES)
    for joint in robot.joints:
        if joint.kind and joint.kind not in TYPES:
            small = joint.kind.lower().strip()
            near = strangers.meant(joint.kind, types)
            fix = set_attribute(joint.element, "type", small) if small in TYPES else None
            repair = f"Did you mean {near}?" if near else f"Write one of {', '.join(TYPES)}."
            yield Broken(f'type "{joint.kind}"', joint.line, "joint", joint.name, repair=repair, fix=fix)


@rule(
    "joint-type-extension",
    "warning",
    condition="The type of a joint is fixed, revolute, continuous, prismatic, floating or planar.",
    cause="A type that KSL reads and URDF doesn't have.",
    repair="Keep it if only KSL reads the file. Otherwise describe the joint by several joints with massless links between them.",
    formats=("urdf",),
)
def joint_type_extension(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        if joint.kind in TYPES and joint.kind not in URDF_TYPES:
            yield Broken(f'type "{joint.kind}"', joint.line, "joint", joint.name)


@rule(
    "link-undefined",
    "error",
    condition="The parent and the child of a joint are links of the file.",
    cause="The link was renamed or removed, or its name is misspelt.",
    repair="Correct the name, or add the link.",
    fix="corrects the name where only capitals or spaces at its ends differ",
    formats=("urdf", "sdf"),
    whole=True,
)
def link_undefined(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        for end, name in (("parent", joint.parent), ("child", joint.child)):
            if not name or name in robot.link_of or (robot.format == "sdf" and (name in ("world", "__model__") or "::" in name)):
                continue
            same = robot.link_names.same(name)
            element = None if joint.element is None else joint.element.find(end)
            fix = set_attribute(element, "link", same[0]) if len(same) == 1 and robot.format == "urdf" else None
            line = joint.line if element is None else element.sourceline
            yield Broken(f'{end} link "{name}" does not exist', line, "joint", joint.name, repair=robot.link_names.suggest(name), fix=fix)


@rule(
    "joint-copied",
    "error",
    condition="Of several joints that carry a link, each differs in its parent, its place or its axis: all but one of them close loops.",
    cause="A joint was copied and not changed.",
    repair="Remove one of these joints, or correct its links.",
)
def joint_copied(robot: RobotFile) -> Iterator[Broken]:
    first: dict[tuple[str, ...], FileJoint] = {}
    for joint in robot.joints:
        if not joint.child or joint.element is None:
            continue
        same = first.setdefault((joint.parent, joint.child, joint.kind, *_motion(joint.element)), joint)
        if same is not joint and same.name != joint.name:
            yield Broken(f"joint {same.name} connects the same links in the same way", joint.line, "joint", joint.name)


def _motion(joint: _Element) -> list[str]:
    """What places a joint and its axes, as text."""
    return ["|".join((child.tag, (child.text or "").strip(), *(f"{k}={v}" for k, v in sorted(child.items())))) for tag in _PLACES for child in joint.iter(tag)]


@rule(
    "joint-cycle",
    "error",
    condition="A joint leads to each link from another one, and from a root to all: no link is carried by itself alone.",
    cause="Parent and child of a joint are exchanged.",
    repair="Exchange parent and child of one of these joints, or remove one.",
)
def joint_cycle(robot: RobotFile) -> Iterator[Broken]:
    done: set[str] = set()
    for start in robot.joint_above:
        path: dict[str, None] = {}
        link = start
        while link in robot.joint_above and link not in done and link not in path:
            path[link] = None
            link = robot.joint_above[link].parent
        if link in path:
            around = [robot.joint_above[name] for name in dropwhile(link.__ne__, path)]
            if len(around) > 1:  # a joint from a link to itself is another rule's
                yield Broken(f"joints {', '.join(j.name for j in reversed(around))} form a cycle", around[0].line, "joint", around[0].name)
        done.update(path)


@rule(
    "link-unreachable",
    "error",
    condition="Joints lead from one root link to every other link.",
    cause="The joint that carries the link is missing, was commented out, or names another child.",
    repair="Add a joint that carries the link, or remove it and what hangs on it.",
    formats=("urdf",),
    whole=True,
)
def link_unreachable(robot: RobotFile) -> Iterator[Broken]:
    misspelt = {joint.child.strip().lower() for joint in robot.joints if joint.child not in robot.link_of}
    for link in robot.roots[1:]:
        if link.name.strip().lower() in misspelt:
            continue  # link-undefined says it
        below = sum(1 for _ in robot.subtree(link.name)) - 1
        carried = f", and {below} link{'s' if below > 1 else ''} that hang{'' if below > 1 else 's'} on it" if below else ""
        yield Broken(f"no joint carries it{carried}; the root is {robot.roots[0].name}", link.line, "link", link.name)
