"""A free body: a link with everything that acts on it at one instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl.mechanism import given
from ksl.mechanism.states import Array

COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")


@dataclass(frozen=True)
class PartWrench:
    """What acts on a body at a point, in the body's axes."""

    name: str
    kind: str
    """joint, loop (a joint that closes one), payload, external or force element."""
    point: Array
    """(3), from the body's origin, m; moments are about it."""
    wrench: Array
    """(6): force, then moment; N, N m."""
    undetermined: NDArray[np.bool_]
    """(6): components that rigid bodies leave open; their values are a convention."""

    def about_origin(self) -> Array:
        """(6): with moments about the body's origin."""
        return np.concatenate([self.wrench[:3], self.wrench[3:] + np.cross(self.point, self.wrench[:3])])


@dataclass(frozen=True)
class FreeBody:
    """A link, or links that are welded together, with everything that acts on it; all in the axes of the topmost link, from its origin."""

    link: str
    """The topmost of `links`."""
    links: tuple[str, ...]
    wrenches: tuple[PartWrench, ...]
    gravity: Array
    """(6): weight, about the origin, without payloads; N, N m."""
    inertia: Array
    """(6): minus the rate of momentum, about the origin, without payloads; N, N m."""
    acceleration: Array
    """(3): of the origin, without gravity, m/s²."""
    angular_velocity: Array
    """(3), rad/s."""
    angular_acceleration: Array
    """(3), rad/s²."""
    gravity_field: Array
    """(3): the acceleration of free fall, m/s²."""
    mass: float
    """Without payloads, kg."""
    center_of_mass: Array
    """(3), m; zero for a body without mass."""
    frame: str = "link"
    """In whose axes all is: those of the link, or of the part (:meth:`in_frame`)."""

    @property
    def complete(self) -> bool:
        """Whether rigid bodies determine every component."""
        return not any(w.undetermined.any() for w in self.wrenches)

    @property
    def residual(self) -> Array:
        """(6): the sum of all, about the origin; round-off."""
        return np.asarray(self.gravity + self.inertia + sum(w.about_origin() for w in self.wrenches))

    @property
    def largest(self) -> tuple[float, float]:
        """The largest force and the largest moment of a wrench, weight and inertia included: N, N m."""
        rows = np.array([self.gravity, self.inertia, *(w.wrench for w in self.wrenches)])
        return float(np.linalg.norm(rows[:, :3], axis=1).max()), float(np.linalg.norm(rows[:, 3:], axis=1).max())

    def in_frame(self, pose: given.PoseLike, name: str = "part") -> FreeBody:
        """This body in the axes, and from the origin, of a CAD part: pose (4, 4) of the part's frame in the link's."""
        T = np.reshape(given.pose(pose, f"frame of {self.link}", self.link), (4, 4))
        R, p = T[:3, :3].T, T[:3, 3]
        spin, turn = self.angular_velocity, self.angular_acceleration
        moved = self.acceleration + np.cross(turn, p) + np.cross(spin, np.cross(spin, p))
        at_part = [np.concatenate([x[:3], x[3:] - np.cross(p, x[:3])]) for x in (self.gravity, self.inertia)]
        gravity, inertia = (_turned(R, x) for x in at_part)
        wrenches = tuple(replace(w, point=R @ (w.point - p), wrench=_turned(R, w.wrench), undetermined=_open(R, w.undetermined)) for w in self.wrenches)
        return replace(
            self, wrenches=wrenches, gravity=gravity, inertia=inertia, acceleration=R @ moved, angular_velocity=R @ spin, angular_acceleration=R @ turn,
            gravity_field=R @ self.gravity_field, center_of_mass=R @ (self.center_of_mass - p), frame=name,
        )  # fmt: skip

    def as_dict(self) -> dict[str, Any]:
        """Values that JSON can hold."""
        vectors = ("gravity", "inertia", "acceleration", "angular_velocity", "angular_acceleration", "gravity_field", "center_of_mass", "residual")
        wrenches = [
            {"name": w.name, "kind": w.kind, "point": w.point.tolist(), "wrench": w.wrench.tolist(), "undetermined": open_components(w.undetermined)}
            for w in self.wrenches
        ]
        numbers = {name: getattr(self, name).tolist() for name in vectors}
        return {
            "link": self.link,
            "links": list(self.links),
            "frame": self.frame,
            "complete": self.complete,
            "mass": self.mass,
            "wrenches": wrenches,
            **numbers,
        }


def open_components(undetermined: Sequence[bool] | NDArray[np.bool_]) -> list[str]:
    """Names of those that are open."""
    return [name for name, is_open in zip(COMPONENTS, undetermined, strict=True) if is_open]


def _turned(R: Array, wrench: ArrayLike) -> Array:
    x = np.asarray(wrench)
    return np.concatenate([R @ x[:3], R @ x[3:]])


def _open(R: Array, undetermined: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Components of turned axes that an open one reaches."""
    reaches = np.abs(R) > 1e-9
    return np.concatenate([(reaches & undetermined[k : k + 3]).any(axis=1) for k in (0, 3)])
