"""Rules of the file: syntax, xacro, numbers, elements and attributes that nobody reads, and what the loader says."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Literal

from ksl.base import limits
from ksl.checks.description.findings import Repair
from ksl.checks.description.repair import Strangers
from ksl.checks.description.robot import Note, RobotFile
from ksl.checks.rule import Broken, rule
from ksl.checks.description.vocabulary import ATTRIBUTES, ELEMENTS, MANY, OPAQUE, SHARED
from ksl.checks.description.xml_file import children
from ksl.mechanism.core_sentences import place_and_rest

if TYPE_CHECKING:
    from lxml.etree import _Element


Place = tuple[Literal["link", "joint", ""], str, "int | None"]
"""Kind and name of what an element is in, and its line."""


def _noted(notes: list[Note]) -> Iterator[Broken]:
    for note in notes:
        yield Broken(note.found, note.line, note.kind, note.name)


@rule(
    "xml-syntax",
    "error",
    condition="The file is well-formed XML.",
    cause="A tag that is not closed, a quote or bracket that is missing, or a file that was cut short.",
    repair="Correct the line, or the one before it. What follows it may be missing from the other findings.",
    accept="closes elements where their parents end, and removes tags that close nothing",
    formats=("urdf", "sdf", "mjcf", "unknown"),
)
def xml_syntax(robot: RobotFile) -> Iterator[Broken]:
    for note in robot.syntax[:20]:
        guess = partial(_mended, note) if robot.mended else None
        yield Broken(note.found, note.line, guess=guess)


def _mended(note: Note) -> str:
    """The tree that is written has it already."""
    return "removed" if note.removed else f"closed there: {note.found}"


@rule(
    "xml-encoding",
    "warning",
    condition="The file is encoded as it says, UTF-8 if it says nothing.",
    cause="Saved by an editor with another encoding.",
    repair="Save the file as UTF-8.",
    fix="writes UTF-8",
    formats=("urdf", "sdf", "mjcf", "unknown"),
)
def xml_encoding(robot: RobotFile) -> Iterator[Broken]:
    for note in robot.encoding:
        yield Broken(note.found, note.line, fix=lambda: "the file is now UTF-8")


@rule(
    "xacro-unexpanded",
    "error",
    condition="The file holds neither elements nor expressions of xacro.",
    cause="The source for xacro was given, and not what xacro makes of it.",
    repair="Run xacro first: xacro FILE > robot.urdf; or let KSL run it: --xacro 'NAME:=VALUE'.",
    formats=("urdf", "unknown"),
)
def xacro_unexpanded(robot: RobotFile) -> Iterator[Broken]:
    if robot.root is None:
        return
    elements, expressions = [], []
    for element in robot.root.iter():
        if not isinstance(element.tag, str):
            continue
        if re.match(r"xacro:|\{[^}]*xacro[^}]*\}", element.tag):
            elements.append(element)
        elif _is_loadable(element) and any(re.search(r"\$[{(]", value) for value in element.attrib.values()):
            expressions.append(element)
    for found, what in ((elements, "element"), (expressions, "expression")):
        if found:
            first = re.sub(r"\{.*\}", "xacro:", found[0].tag)
            if what == "expression":
                first += " " + next(f'{k}="{v}"' for k, v in found[0].attrib.items() if re.search(r"\$[{(]", v))[:60]
            more = f", and {len(found) - 1} more" if len(found) > 1 else ""
            yield Broken(f"{what} of xacro: <{first}>{more}", found[0].sourceline, value=float(len(found)))


def _is_loadable(element: _Element) -> bool:
    """Whether the loader takes that many attributes.  The time to read the values of all is quadratic in their number."""
    return len(element.attrib) <= limits.ATTRIBUTES


@rule(
    "number-unreadable",
    "error",
    condition="Numbers are finite, complete, and written with a decimal point.",
    cause="A decimal comma, a unit behind the number, NaN from a program, or an attribute that was left out.",
    repair="Write the number.",
    formats=("urdf", "sdf"),
)
def number_unreadable(robot: RobotFile) -> Iterator[Broken]:
    return _noted(robot.unreadable)


@rule(
    "element-repeated",
    "error",
    condition="Elements that have one value stand once.",
    cause="Copied, or two versions merged. Readers take the first or the last one.",
    repair="Remove all but one.",
    formats=("urdf", "sdf"),
)
def element_repeated(robot: RobotFile) -> Iterator[Broken]:
    return _noted(robot.repeated)


@rule(
    "unknown-tag",
    "warning",
    condition="Every element is one that readers of URDF know.",
    cause=("A spelling mistake, an element in the wrong place, or one of another format. Readers skip it without notice."),
    repair="Correct the name or the place, or remove it.",
    fix="corrects the name where exactly one known element is near and is missing there",
    formats=("urdf",),
)
def unknown_tag(robot: RobotFile) -> Iterator[Broken]:
    places: dict[tuple[str, str], list[Place]] = {}
    strangers = Strangers()
    for element, kind, name in _known_elements(robot):
        known = ELEMENTS[element.tag]
        skipped = {*known, *SHARED, *OPAQUE.get(element.tag, ())}
        tags = [(child, child.tag) for child in children(element)]
        present = {tag for _, tag in tags}
        missing = tuple(tag for tag in known if tag in MANY or tag not in present)
        for child, tag in tags:
            if tag in skipped or ":" in tag or "}" in tag:
                continue
            right = strangers.meant(tag, missing)
            if right:
                yield Broken(f"<{tag}> in <{element.tag}>", child.sourceline, kind, name, repair=f"Did you mean <{right}>?", fix=_renamed(child, right))
            else:
                places.setdefault((tag, element.tag), []).append((kind, name, child.sourceline))
    for (tag, parent), where in places.items():
        kind, name, line = where[0]
        right_place = next((f"It belongs into <{p}>." for p, others in ELEMENTS.items() if tag in others), None)
        yield Broken(f"<{tag}> in <{parent}>{_and_more(where)}", line, kind, name, float(len(where)), repair=right_place)


def _and_more(places: list[Place]) -> str:
    return f", and {len(places) - 1} more" if len(places) > 1 else ""


def _renamed(element: _Element, tag: str) -> Repair:
    def change() -> str:
        old = element.tag
        element.tag = tag
        return f"<{old}> is now <{tag}>"

    return change


def _known_elements(robot: RobotFile) -> Iterator[tuple[_Element, Literal["link", "joint", ""], str]]:
    """(element, kind, name) of <robot> and all in its links and joints that readers know."""
    if robot.root is None:
        return
    yield robot.root, "", ""
    for element in robot.root:
        if element.tag not in ("link", "joint"):
            continue
        waiting = [element]
        while waiting:
            each = waiting.pop()
            yield each, "link" if element.tag == "link" else "joint", element.get("name", "")
            waiting += [child for child in children(each, *ELEMENTS[each.tag]) if child.tag in ELEMENTS]


@rule(
    "unknown-attribute",
    "warning",
    condition="Every attribute is one that readers of URDF know.",
    cause="A spelling mistake, or an attribute of another element or program. Readers skip it without notice.",
    repair="Correct the name, or remove it.",
    fix="corrects the name where exactly one known attribute is near and is missing there",
    formats=("urdf",),
)
def unknown_attribute(robot: RobotFile) -> Iterator[Broken]:
    places: dict[tuple[str, tuple[str, ...]], list[Place]] = {}
    strangers = Strangers()
    for element, kind, name in _known_elements(robot):
        known = ATTRIBUTES.get(element.tag)
        if known is None:
            continue
        strange = [each for each in element.attrib if each not in known and "}" not in each and ":" not in each]
        if not strange:
            continue
        missing = tuple(k for k in known if element.get(k) is None)
        meant = {each: strangers.meant(each, missing) for each in strange} if _is_loadable(element) else {}
        near = {each: right for each, right in meant.items() if right}
        for each, right in near.items():
            fix = _renamed_attribute(element, each, right)
            yield Broken(f"{each} of <{element.tag}>", element.sourceline, kind, name, repair=f"Did you mean {right}?", fix=fix)
        others = tuple(sorted(each for each in strange if each not in near))
        if others:
            places.setdefault((element.tag, others), []).append((kind, name, element.sourceline))
    for (tag, attributes), where in places.items():
        kind, name, line = where[0]
        yield Broken(f"{', '.join(attributes)} of <{tag}>{_and_more(where)}", line, kind, name, float(len(where)))


def _renamed_attribute(element: _Element, old: str, new: str) -> Repair:
    def change() -> str:
        items = [(new if k == old else k, v) for k, v in element.attrib.items()]
        element.attrib.clear()
        element.attrib.update(items)
        return f"{old} of <{element.tag}> is now {new}"

    return change


@rule(
    "not-loaded",
    "error",
    condition="ksl.load reads the file.",
    cause="Something that no other rule looks at.",
    repair="Do what the sentence says.",
    formats=("urdf", "sdf", "mjcf", "unknown"),
)
def not_loaded(robot: RobotFile) -> Iterator[Broken]:
    if robot.refusal:
        line, said = place_and_rest(robot.refusal, str(robot.path))
        yield Broken(said, line)
