"""Where and how wrenches are expressed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ksl.mechanism.requests import WORLD
from ksl.mechanism.states import JOINT_AND, Order, Point, Side


@dataclass(frozen=True)
class Placement:
    """Side, point, axes and order of the wrenches; see `Model.reactions`."""

    on: Side = "child"
    at: Point = "joint"
    axes: str = "joint"
    order: Order = "lin_ang"
    points: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """Points of joints that have one of their own: from the joint's origin, in its axes, m."""
    joints: Sequence[str] = ()
    """The joints whose wrenches are wanted; all if empty."""

    def of(self, joint: str) -> str:
        """The point of a joint in one word or three numbers."""
        return Placement(at=self.points[joint]).point if joint in self.points else self.point

    def wanted(self, joint: str) -> bool:
        return not self.joints or joint in self.joints

    @property
    def point(self) -> str:
        """The point in one word or three numbers."""
        return self.at if isinstance(self.at, str) else JOINT_AND + " ".join(f"{x:g}" for x in self.at)

    @property
    def about(self) -> str:
        """The point as people read it."""
        own = ", ".join(f"({', '.join(f'{x:g}' for x in p)}) m for {joint}" for joint, p in self.points.items())
        return self._common + (f", but {own}, from its origin in its axes" if own else "")

    @property
    def _common(self) -> str:
        if not isinstance(self.at, str):
            return f"the point ({', '.join(f'{x:g}' for x in self.at)}) m from the joint's origin, in its axes"
        return {"joint": "the joint's origin", "world": "the world's origin", WORLD: "the world's origin"}.get(
            self.at, f"the origin of {self.at.removeprefix('link:')}"
        )
