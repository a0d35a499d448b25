"""A robot file as the rules see it: links and joints with their lines, whatever the format, however broken.

Nothing is refused here.  What can't be read is None, and is noted in `RobotFile.unreadable`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from heapq import heappop, heappush
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ksl.checks.description.repair import Names
from ksl.mechanism.joint_kinds import ANY_NAME, KINDS, names_with

if TYPE_CHECKING:
    from lxml.etree import _Element

    from ksl.checks.description.loop_positions import LoopPositions
    from ksl.model.model import Model

Array = NDArray[np.float64]
Format = Literal["urdf", "sdf", "mjcf", "unknown"]
Kind = Literal["link", "joint", ""]
"""The kind of what a finding is about; empty for the file."""

IN_SDF_ALONE = {"revolute2": "universal"}
"""Names of kinds of joints that SDF has besides."""
MOVING = names_with(lambda kind: kind.nv > 0) | IN_SDF_ALONE.keys()
ONE_COORDINATE = names_with(lambda kind: kind.nv == 1)
WITH_AXIS = names_with(lambda kind: kind.has_axis) | IN_SDF_ALONE.keys()
NEGLIGIBLE = 0.05
"""Share of a body's mass and moments below which one of the links that it is welded of doesn't matter."""
URDF_TYPES = frozenset(kind.name for kind in KINDS.values() if kind.in_urdf)
TYPES = sorted(ANY_NAME)


def at_origin() -> tuple[Array, Array]:
    """(rotation, translation) of what the file doesn't place."""
    return np.eye(3), np.zeros(3)


@dataclass
class Inertial:
    """Mass, centroid and moments of a link as the file gives them."""

    line: int | None
    element: _Element | None
    mass: float | None
    centroid: Array
    """(3,) in the link's axes, m."""
    rotation: Array
    """(3, 3): from the axes of the moments to those of the link."""
    moments: Array | None
    """(3, 3) about the centroid, kg m², in the axes that the file gives; None if a number is missing or can't be
    read."""
    rounding: float = 0.0
    """Half a unit of the last printed digit of the moments, summed over the diagonal: what rounding may have
    changed."""

    @property
    def in_link_axes(self) -> Array | None:
        return None if self.moments is None else self.rotation @ self.moments @ self.rotation.T


@dataclass
class Shape:
    """A <visual> or <collision>."""

    line: int | None
    element: _Element | None
    role: str
    kind: Literal["box", "sphere", "cylinder", "mesh"]
    half_size: Array
    """(3,) half the extent along its own axes, m; not used for meshes."""
    rotation: Array
    translation: Array
    uri: str = ""
    scale: Array = field(default_factory=lambda: np.ones(3))
    name: str = ""
    """The name that the file gives the shape, for what its words tell."""


@dataclass
class FileLink:
    name: str
    line: int | None
    element: _Element | None
    inertial: Inertial | None = None
    shapes: list[Shape] = field(default_factory=list)
    has_inertial: bool = False

    @property
    def mass(self) -> float:
        return self.inertial.mass or 0.0 if self.inertial else 0.0

    @property
    def mass_unreadable(self) -> bool:
        return self.inertial is not None and self.inertial.mass is None

    @property
    def largest_moment(self) -> float:
        """Largest element of the inertia matrix, kg m²; 0 where it is not known."""
        return 0.0 if self.inertial is None or self.inertial.moments is None else float(abs(self.inertial.moments).max())


@dataclass
class Mimic:
    line: int | None
    element: _Element | None
    leader: str
    multiplier: float
    offset: float


@dataclass
class FileJoint:
    name: str
    line: int | None
    element: _Element | None
    kind: str
    parent: str
    child: str
    axis: Array | None = None
    """(3,) as given; None if the file gives none, or no three numbers."""
    axis_line: int | None = None
    axis_element: _Element | None = None
    limit_line: int | None = None
    limit_element: _Element | None = None
    lower: float | None = None
    upper: float | None = None
    effort: float | None = None
    velocity: float | None = None
    damping: float | None = None
    friction: float | None = None
    dynamics_line: int | None = None
    mimic: Mimic | None = None
    translation: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def moves(self) -> bool:
        return self.kind in MOVING


@dataclass(frozen=True)
class Note:
    """Something that reading the file brought to light, for a rule to report."""

    line: int | None
    found: str
    kind: Kind = ""
    name: str = ""
    removed: bool = False
    """A tag that the tree that is written leaves out."""


@dataclass
class RobotFile:
    """Everything that the rules look at."""

    path: Path
    format: Format = "unknown"
    root: _Element | None = None
    name: str = ""
    links: list[FileLink] = field(default_factory=list)
    joints: list[FileJoint] = field(default_factory=list)
    syntax: list[Note] = field(default_factory=list)
    """Errors of the XML parser."""
    mended: bool = False
    """Whether closing the tags that were not closed, and removing those that close nothing, makes it well-formed."""
    cut_short: bool = False
    """Whether the file ends before its root element does."""
    encoding: list[Note] = field(default_factory=list)
    unreadable: list[Note] = field(default_factory=list)
    """Attributes and elements that are no numbers."""
    text: str = ""
    """A character for each byte, of files that aren't too large for rules that look at how it is written."""
    sizes: list[Note] = field(default_factory=list)
    """Shapes whose sizes are missing, zero or negative, or that aren't there."""
    repeated: list[Note] = field(default_factory=list)
    """Elements that may stand once and stand there several times."""
    refusal: str | None = None
    """What the loader said when it refused the file."""
    model: Model | None = None
    """The model that the loader made; None where it refused the file, or was not called."""
    package_paths: Sequence[Path] = ()
    symmetry: float = 0.05
    beside: str | PathLike[str] | None = None
    """The file with loops that is given besides."""
    xacro: Mapping[str, object] | None = None
    """Arguments of a xacro file, which was run; None of other files."""
    drives: tuple[str, ...] | None = None
    reading: Mapping[str, Any] = field(default_factory=dict)
    """Further arguments of the loader: floating_base, mimic, strict, model."""
    not_checked: list[str] = field(default_factory=list)

    @cached_property
    def link_of(self) -> dict[str, FileLink]:
        return {link.name: link for link in reversed(self.links) if link.name}  # the first of a name

    @cached_property
    def joint_of(self) -> dict[str, FileJoint]:
        return {joint.name: joint for joint in reversed(self.joints) if joint.name}

    @cached_property
    def link_names(self) -> Names:
        return Names(self.link_of)

    @cached_property
    def joint_names(self) -> Names:
        return Names(self.joint_of)

    @cached_property
    def joint_above(self) -> dict[str, FileJoint]:
        """{link: the joint that carries it}: where there are several the first, unless it would cut the link off from the roots."""
        above: dict[str, FileJoint] = {}
        leaving: dict[str, list[int]] = {}
        for i, joint in enumerate(self.joints):
            above.setdefault(joint.child, joint)
            leaving.setdefault(joint.parent, []).append(i)
        reached: set[str] = set()
        others: list[int] = []
        waiting = [name for name in dict.fromkeys((*self.link_of, *leaving)) if name not in above]
        while waiting or others:
            if not waiting:  # what no first joint reaches may be reached by others
                joint = self.joints[heappop(others)]
                if joint.child in reached:
                    continue
                above[joint.child] = joint
                waiting.append(joint.child)
            link = waiting.pop()
            if link in reached:
                continue
            reached.add(link)
            for i in leaving.get(link, ()):
                joint = self.joints[i]
                if above[joint.child] is joint:
                    waiting.append(joint.child)
                else:
                    heappush(others, i)
        return above

    @cached_property
    def joints_below(self) -> dict[str, list[FileJoint]]:
        below: dict[str, list[FileJoint]] = {}
        for joint in self.joints:
            if self.joint_above.get(joint.child) is joint:
                below.setdefault(joint.parent, []).append(joint)
        return below

    @cached_property
    def roots(self) -> list[FileLink]:
        """Links that no joint carries, the one with the most links below it first."""
        first = {link.name: link for link in reversed(self.links)}  # of several with a name one, so that each subtree is walked once
        free = [link for link in self.links if link.name and first[link.name] is link and link.name not in self.joint_above]
        return sorted(free, key=lambda link: -sum(1 for _ in self.subtree(link.name)))

    def subtree(self, name: str) -> Iterator[str]:
        """Names of a link and all below it, each once even where joints form a cycle."""
        seen, waiting = {name}, [name]
        while waiting:
            link = waiting.pop()
            yield link
            for joint in self.joints_below.get(link, ()):
                if joint.child not in seen:
                    seen.add(joint.child)
                    waiting.append(joint.child)

    @cached_property
    def _turns(self) -> dict[str, tuple[int, int]]:
        """{link: when a walk through the tree comes to it, and when it leaves it}."""
        turns: dict[str, tuple[int, int]] = {}
        step = 0
        waiting = [(link.name, False) for link in self.roots]
        while waiting:
            name, leaves = waiting.pop()
            step += 1
            if leaves:
                turns[name] = (turns[name][0], step)
            elif name not in turns:
                turns[name] = (step, step)
                waiting.append((name, True))
                waiting += [(joint.child, False) for joint in self.joints_below.get(name, ())]
        return turns

    def carries(self, one: str, other: str) -> bool:
        """Whether a link is between another one and the root.  O(1) after the first call."""
        first, second = self._turns.get(one), self._turns.get(other)
        return first is not None and second is not None and first[0] < second[0] and second[1] <= first[1]

    @cached_property
    def loops(self) -> LoopPositions | None:
        """Where the loops of the model close; None without loops, and for mechanisms that are too large for it."""
        from ksl.checks.description.loop_positions import MOST, LoopPositions

        if self.model is None or not self.model.loops:
            return None
        size = max(self.model.nv, sum(loop.equations for loop in self.model.loops))
        if size > MOST or not self.model.nv:
            self.not_checked.append(
                f"whether loops close, and what is redundant: {size} equations or coordinates are more than {MOST}" if size > MOST else "loops of welded links"
            )
            return None
        return LoopPositions(self.model)

    @cached_property
    def lines_of_joints(self) -> dict[str, int | None]:
        """{name: line} of joints and of elements that close loops, whatever the format."""
        tags = ("joint", "constraint", "loop_joint", "loop", "connect", "weld")
        found: dict[str, int | None] = {}
        for element in () if self.root is None else self.root.iter(*tags):
            found.setdefault(element.get("name", ""), element.sourceline)
        return found

    @cached_property
    def welded(self) -> dict[str, str]:
        """{link: the link that stands for all that are welded to it}: the one nearest to the root."""
        head: dict[str, str] = {}
        for link in self.links:
            path: dict[str, None] = {}
            name = link.name
            while name not in head and name not in path:
                path[name] = None
                above = self.joint_above.get(name)
                if above is None or above.kind != "fixed":
                    break
                name = above.parent
            end = head.get(name, name)
            for visited in path:
                head[visited] = end
        return head

    @cached_property
    def moves_mass(self) -> dict[str, bool]:
        """{link: whether it, or what it carries, has a mass}, of links that are reached from a root.  A mass that
        can't be read is one."""
        order = [name for root in self.roots for name in self.subtree(root.name)]
        heavy = {name: self.link_of[name].mass != 0 or self.link_of[name].mass_unreadable for name in order if name in self.link_of}
        for name in reversed(order):  # every link comes after the one that carries it
            above = self.joint_above.get(name)
            if above is not None and above.parent in heavy:
                heavy[above.parent] |= heavy.get(name, False)
        return heavy

    @cached_property
    def bodies(self) -> dict[str, list[FileLink]]:
        """{link nearest to the root: all links welded together with it}."""
        found: dict[str, list[FileLink]] = {}
        for link in self.links:
            found.setdefault(self.welded.get(link.name, link.name), []).append(link)
        return found

    def matters(self, link: FileLink) -> bool:
        """Whether a link has a share of the mass or of the moments of the body that it is welded into.

        Frames, sensors and markers are often given token masses so that simulators accept them.  Beside the part that
        they sit on
        these change no result.
        """
        heaviest, largest = self._largest_of_bodies[self.welded.get(link.name, link.name)]
        return (link.mass >= NEGLIGIBLE * heaviest and heaviest > 0) or link.largest_moment > NEGLIGIBLE * largest

    @cached_property
    def _largest_of_bodies(self) -> dict[str, tuple[float, float]]:
        return {name: (max(link.mass for link in body), max(link.largest_moment for link in body)) for name, body in self.bodies.items()}
