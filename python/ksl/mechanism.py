"""A mechanism: its joints and links, names and sizes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import numpy as np

from ksl import _core
from ksl.states import Array


@dataclass(frozen=True)
class Joint:
    """A joint as the file gives it.  Limits that the file doesn't give are None.  SI units."""

    name: str
    kind: str
    """fixed, revolute, continuous, prismatic, helical, cylindrical, universal, spherical, planar, translation or floating."""
    parent: str | None
    """Link on the parent side; None is the ground."""
    child: str
    nq: int
    nv: int
    q_index: int
    v_index: int
    axis: tuple[float, float, float]
    """Unit vector in the joint's frame, about or along which it moves; the first of universal joints, the normal of planar ones; zero for kinds without one."""
    pitch: float = 0.0
    """Advance along the axis, m/rad, positive for a right-handed screw; of helical joints."""
    axis2: tuple[float, float, float] | None = None
    """Second axis of universal joints, fixed in the child: a unit vector in the joint's frame, whose axes are the child's."""
    has_axis: bool = False
    """Whether it has an axis: all but spherical, translation, floating and fixed joints."""
    has_angle: bool = False
    """Whether its position has an angle about the axis: all of these but prismatic joints."""
    has_limits: bool = False
    """Whether its position can have bounds: joints with one coordinate, but not continuous ones."""
    quaternion: int | None = None
    """Index, within its nq numbers, at which a unit quaternion [qx qy qz qw] begins: 0 for spherical joints, 3 for floating ones."""
    lower: float | None = None
    upper: float | None = None
    effort: float | None = None
    velocity: float | None = None
    damping: float = 0.0
    friction: float = 0.0

    @property
    def one_coordinate(self) -> bool:
        """Whether it moves along or about its axis only: revolute, continuous, prismatic and helical joints."""
        return self.nv == 1

    @property
    def unit(self) -> str:
        """Of the position of a joint with one coordinate: rad, or m where it only slides."""
        return "rad" if self.has_angle else "m"


@dataclass(frozen=True)
class Link:
    """A link's inertia about its origin, in its axes, payload included."""

    name: str
    mass: float
    first_moment: tuple[float, float, float]
    """Mass × centroid, kg m."""
    inertia: tuple[float, float, float, float, float, float]
    """Ixx Iyy Izz Ixy Iyz Izx about the link's origin, kg m², matrix elements (signs included)."""


class Mechanism:
    """Joints and links of a model, by name and in order; immutable."""

    def __init__(self, core: _core.Model) -> None:
        self._core = core
        self.name: str = core.name
        self.file: str = core.file
        self.nq: int = core.nq
        """Length of q."""
        self.nv: int = core.nv
        """Length of v, a and tau."""
        self.gravity: Array = np.array(core.gravity)
        """m/s², in world axes; read-only."""
        self.gravity.setflags(write=False)
        self.joints: tuple[Joint, ...] = tuple(Joint(**{k: tuple(x) if k in ("axis", "axis2") else x for k, x in row.items()}) for row in core.joints)
        """All joints: the moving ones in the order of q, then the fixed ones, `base` last."""
        self.links: tuple[Link, ...] = tuple(
            Link(**{**row, "first_moment": tuple(row["first_moment"]), "inertia": tuple(row["inertia"])}) for row in core.links
        )
        """Parents first."""
        self.unused: tuple[str, ...] = tuple(core.unused)
        """Contents of the file that KSL doesn't use, a line for each kind."""
        self.warnings: tuple[str, ...] = tuple(core.warnings)
        """Suspicious contents of the file, a line each: inertias that no rigid body can have, moving links without mass.  Names link and condition."""
        self._moving = core.moving_joints
        self._joint_index = {joint.name: i for i, joint in enumerate(self.joints)}
        self._link_index = {link.name: i for i, link in enumerate(self.links)}
        children = {joint.name: self._link_index[joint.child] for joint in self.joints}
        self._frame_index = self._link_index | {name: link for name, link in children.items() if name not in self._link_index}
        self._complete = True

    def __setattr__(self, name: str, value: object) -> None:
        if "_complete" in self.__dict__:
            raise AttributeError(f"{name} of a model can't be set: models are immutable; ksl.load makes one with other options")
        super().__setattr__(name, value)

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{name} of a model can't be deleted: models are immutable")

    def __repr__(self) -> str:
        return f"<ksl.Model {self.name!r}: {self._moving} moving joints, {len(self.links)} links, nq={self.nq}, nv={self.nv}>"

    @property
    def joint_names(self) -> list[str]:
        """The moving joints in the order of q: depth first, children in file order."""
        return [joint.name for joint in self.joints[: self._moving]]

    @property
    def fixed_joint_names(self) -> list[str]:
        """The fixed joints, depth first and in file order, then `base`, which connects a fixed root with the ground."""
        return [joint.name for joint in self.joints[self._moving :]]

    @property
    def link_names(self) -> list[str]:
        """Links, parents first; the root is the first."""
        return [link.name for link in self.links]

    def joint(self, name: str) -> Joint:
        """The joint of that name."""
        return self.joints[self._index(self._joint_index, name, "joint")]

    def _index(self, table: Mapping[str, int], name: str, what: str) -> int:
        if not isinstance(name, str) or name not in table:
            raise ValueError(f"{self.name or self.file}: no {what} named {name!r}; known: {', '.join(table)}")
        return table[name]
