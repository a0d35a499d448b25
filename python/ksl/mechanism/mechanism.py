"""A mechanism: its joints and links, names and sizes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl import _core
from ksl.base.errors import name_among, other_kind, unknown_name
from ksl.base.files_read import InputFile
from ksl.base.notes import Note
from ksl.base.printable import sentence
from ksl.base.words import count
from ksl.mechanism.core_sentences import unused_of_core, warnings_of_core
from ksl.mechanism.joint_kinds import Kind
from ksl.mechanism.payload import Payload
from ksl.mechanism.states import Array, argument, in_order


@dataclass(frozen=True)
class Joint:
    """A joint as the file gives it.  Limits that the file doesn't give are None.  SI units."""

    name: str
    kind: Kind
    """fixed, revolute, continuous, prismatic, helical, cylindrical, universal, spherical, planar, translation or floating."""
    parent: str | None
    """Link on the parent side; None is the ground."""
    child: str
    nq: int
    """How many numbers it has in q; 0 for fixed joints and for mimic joints, which follow another."""
    nv: int
    q_index: int
    """Where they begin; −1 where there are none."""
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
    """Whether its position can have one pair of bounds: joints with one coordinate, but not continuous ones."""
    quaternion: int | None = None
    """Index, within its nq numbers, at which a unit quaternion [qx qy qz qw] begins: 0 for spherical joints, 3 for floating ones."""
    lower: float | None = None
    """Limits of its position; of the first number of a joint with several."""
    upper: float | None = None
    limits: tuple[tuple[float | None, float | None], ...] = ()
    """Limits (lower, upper) of each number in q that can have some: not of quaternions and continuous joints; rad or m."""
    effort: float | None = None
    velocity: float | None = None
    damping: float = 0.0
    """The damping of each coordinate, N m s/rad or N s/m.  Damping, and what follows, has no effect unless the physics of the model names it."""
    friction: float = 0.0
    """Dry friction of each coordinate, N m or N."""
    friction_width: float | None = None
    """The width of its smooth law of friction, rad/s or m/s; None is that of the model."""
    armature: float = 0.0
    """Inertia that each coordinate feels besides that of the links, kg m² or kg."""
    rotor_inertia: float = 0.0
    """The inertia of the motor's rotor about its own axis, kg m²."""
    gear_ratio: float = 1.0
    """Turns of the rotor for each of the joint; rad/m where the joint slides."""
    spring_stiffness: float = 0.0
    """N m/rad or N/m."""
    spring_rest: float = 0.0
    """Position where the spring is slack, rad or m."""
    is_rotor: bool = False
    """Whether it carries the rotor of its leader: with the physics "rotor bodies", JOINT_rotor."""
    leader: str | None = None
    """The joint that a mimic joint follows: its position is multiplier × that of the leader + offset.  None for other joints."""
    multiplier: float = 0.0
    offset: float = 0.0

    @property
    def one_coordinate(self) -> bool:
        """Whether it moves along or about its axis only: revolute, continuous, prismatic and helical joints."""
        return self.nv == 1 or self.leader is not None

    @property
    def unit(self) -> str:
        """The unit of the position of a joint with one coordinate: rad, or m where it only slides."""
        return "rad" if self.has_angle else "m"


@dataclass(frozen=True)
class Loop:
    """A joint that closes a loop.  It has no numbers in q and v; SI units."""

    name: str
    kind: Kind
    """Any kind of joint but floating."""
    predecessor: str
    """The link on the side that a file calls parent."""
    successor: str
    """The link on the side that a file calls child."""
    predecessor_pose: tuple[float, ...]
    """The pose of the joint's frame on the predecessor, in that link's frame: (4, 4), row by row."""
    successor_pose: tuple[float, ...]
    axis: tuple[float, float, float] | None
    """Unit vector, the same in both frames; None for kinds without an axis."""
    axis2: tuple[float, float, float] | None
    pitch: float
    equations: int
    """6 − nv of its kind."""
    turned: float = 0.0
    moved: float = 0.0
    """rad and m: its frames were off by so much, by the digits of a file, from where the mechanism can move, and have been made exact."""


@dataclass(frozen=True)
class ForceElement:
    """A spring, damper or cylinder between a point of one link and a point of another; SI units.

    At the length l it pulls the points together, or with a negative force apart, with preload + stiffness (l − free_length) + damping dl/dt,
    and beyond its limits with stop_stiffness (l − limit) more.
    """

    name: str
    link1: str
    link2: str
    point1: tuple[float, float, float]
    """In the frame of link1, m."""
    point2: tuple[float, float, float]
    stiffness: float = 0.0
    """N/m."""
    free_length: float = 0.0
    """m."""
    damping: float = 0.0
    """N s/m."""
    preload: float = 0.0
    """N, positive where it pulls."""
    lower: float | None = None
    """Limits of the length, m; None where there are none."""
    upper: float | None = None
    stop_stiffness: float = 0.0
    """N/m of stops at the limits; with 0 a length beyond them is refused."""


@dataclass(frozen=True)
class Link:
    """A link's inertia about its origin, in its axes, payload included."""

    name: str
    mass: float
    first_moment: tuple[float, float, float]
    """Mass × centroid, kg m."""
    inertia: tuple[float, float, float, float, float, float]
    """Ixx Iyy Izz Ixy Iyz Izx about the link's origin, kg m², matrix elements (signs included)."""

    @property
    def parameters(self) -> tuple[float, ...]:
        """The ten numbers that regressors multiply: m, m cx, m cy, m cz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz."""
        xx, yy, zz, xy, yz, zx = self.inertia
        return (self.mass, *self.first_moment, xx, xy, yy, zx, yz, zz)


_Row = TypeVar("_Row", Joint, Link, Loop, ForceElement)


def _of_row(kind: type[_Row], row: Mapping[str, Any]) -> _Row:
    """A row of the core as one of these.  Not by the call of its class, which sets each field of a frozen one by a call of its own: models have thousands of rows.

    Fields that the row leaves out are those of the class, their defaults."""
    made = object.__new__(kind)
    made.__dict__.update({name: tuple(x) if type(x) is list else x for name, x in row.items()})
    return made


def _read_only(x: Array) -> Array:
    x.setflags(write=False)
    return x


class Mechanism:
    """Joints and links of a model, by name and in order; immutable."""

    def __init__(self, core: _core.Model, inputs: tuple[InputFile, ...] = (), payloads: tuple[Payload, ...] = ()) -> None:
        self._core = core
        self.inputs: tuple[InputFile, ...] = inputs
        """The files that it was read from, with the hashes of what was read: the robot's, those that it includes, meshes that give inertia."""
        self.name: str = core.name
        self.file: str = core.file
        self.nq: int = core.nq
        """Length of q."""
        self.nv: int = core.nv
        """Length of v, a and tau."""
        self.gravity: Array = _read_only(np.array(core.gravity))
        """m/s², in world axes; read-only."""
        self.physics: tuple[str, ...] = tuple(core.physics[0])
        """Which physics of joints the model has, besides that of rigid bodies: names as `physics=` of :func:`ksl.load` takes them."""
        self.friction_width: float = core.physics[1]
        """The width of the smooth law of friction, for joints that have none of their own; rad/s or m/s."""
        self.joints: tuple[Joint, ...] = tuple(_of_row(Joint, row) for row in core.joints)
        """All joints: the moving ones in the order of q, then the mimic joints that follow them, then the fixed ones, `base` last."""
        self.loops: tuple[Loop, ...] = tuple(_of_row(Loop, row) for row in core.loops)
        """The joints that close loops; a model without them is a tree."""
        self.force_elements: tuple[ForceElement, ...] = tuple(_of_row(ForceElement, row) for row in core.force_elements)
        """Springs, dampers and cylinders between points of two links.  They act if `physics` names "force elements"."""
        self.drives: tuple[str, ...] | None = None if core.drives is None else tuple(core.drives)
        self.drive_weights: tuple[float, ...] = tuple(core.drive_weights)
        """The joints that have motors; None where the file names none.  Without loops every joint is taken to have one."""
        self.unused: tuple[Note, ...] = unused_of_core(core.unused)
        """Contents of the file that KSL doesn't use, a line for each kind."""
        self.warnings: tuple[str, ...] = warnings_of_core(core.warnings)
        """Suspicious contents of the file, a line each: inertias that no rigid body can have, moving links without mass.  Names link and condition."""
        self._moving, self._followers = core.moving_joints, core.followers
        lower, upper = np.array(core.position_ranges).reshape(-1, 2).T
        self._ranges = _read_only(lower), _read_only(upper)
        starts = [j.q_index + j.quaternion for j in self.joints if j.quaternion is not None]
        self._quaternions = tuple(slice(start, start + 4) for start in starts)
        self._joint_index = {joint.name: i for i, joint in enumerate(self.joints)}
        self._loop_index = {loop.name: i for i, loop in enumerate(self.loops)}
        self._any_joint_index = self._joint_index | self._loop_index
        self._own_coordinates = {joint.name: tuple(range(joint.v_index, joint.v_index + joint.nv)) for joint in self.joints if joint.nv}
        self._link_index = {link.name: i for i, link in enumerate(self.links)}
        children = {joint.name: self._link_index[joint.child] for joint in self.joints}
        self._children = children
        self._frame_index = {name: link for name, link in (self._link_index | children).items() if self._is_one_frame(name, link)}
        self._carrying = {joint.child: joint for joint in self.joints}
        named = [replace(payload, link=name_among(self._link_index, payload.link, "link")) for payload in payloads]
        self.payloads: tuple[Payload, ...] = tuple(payload for payload in named if payload.link in self._link_index)
        """Bodies on links that are no part of them: what `payloads=` and :meth:`with_payload` added.  The inertias of `links` include them."""
        self._complete = True

    @cached_property
    def tree_rows(self) -> list[int]:
        """Where the rows of :meth:`mass_matrix_tree` begin, and where they end: nv + 1 numbers."""
        return list(self._core.tree_rows)

    @cached_property
    def tree_columns(self) -> list[int]:
        """In which columns its elements are."""
        return list(self._core.tree_columns)

    @cached_property
    def links(self) -> tuple[Link, ...]:
        """Parents first.  Made when asked for: models that differ in inertias alone are made by the thousand."""
        return tuple(_of_row(Link, row) for row in self._core.links)

    @cached_property
    def lower(self) -> Array:
        """Lower limits (nq) of the numbers in q, rad or m; −∞ where there are none, as for quaternions and continuous joints; read-only.

        Those of mimic joints are included: a position within the limits of `lower` and `upper` keeps every joint within its own.
        """
        return self._position_limits[0]

    @cached_property
    def upper(self) -> Array:
        """Upper limits (nq), as :attr:`lower`; ∞ where there are none."""
        return self._position_limits[1]

    @cached_property
    def velocity_limit(self) -> Array:
        """Limits (nv) of the magnitudes of the numbers in v, rad/s or m/s; read-only.

        ∞ where the file gives none or 0, which no robot means, and for joints with several coordinates.  Those of mimic joints are included.
        """
        limit = np.full(self.nv, np.inf)
        for joint in self.joints[: self._moving + self._followers]:
            if joint.one_coordinate and joint.velocity:
                leader, factor = (joint, 1.0) if joint.leader is None else (self.joint(joint.leader), abs(joint.multiplier))
                if factor > 0:
                    limit[leader.v_index] = min(limit[leader.v_index], joint.velocity / factor)
        return _read_only(limit)

    @cached_property
    def effort_limit(self) -> Array:
        """Limits (nv) of the magnitudes of efforts, N m or N; ∞ where the file gives none or 0, and for joints with several coordinates; read-only."""
        limit = np.full(self.nv, np.inf)
        for joint in self.joints[: self._moving]:
            if joint.nv == 1 and joint.effort:
                limit[joint.v_index] = joint.effort
        return _read_only(limit)

    @cached_property
    def _position_limits(self) -> tuple[Array, Array]:
        lower, upper = np.full(self.nq, -np.inf), np.full(self.nq, np.inf)
        for joint in self.joints[: self._moving]:
            for c, (least, most) in enumerate(joint.limits):  # quaternions are the last numbers of a joint
                lower[joint.q_index + c], upper[joint.q_index + c] = -np.inf if least is None else least, np.inf if most is None else most
        for joint in self.joints[self._moving : self._moving + self._followers]:
            if joint.limits and joint.leader is not None and joint.multiplier:
                bounds = [None if x is None else (x - joint.offset) / joint.multiplier for x in joint.limits[0]]
                least, most = bounds if joint.multiplier > 0 else bounds[::-1]
                k = self.joint(joint.leader).q_index
                narrowed = lower[k] if least is None else max(lower[k], least), upper[k] if most is None else min(upper[k], most)
                if narrowed[0] <= narrowed[1]:  # otherwise there is a warning of the model
                    lower[k], upper[k] = narrowed
        return _read_only(lower), _read_only(upper)

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
        """The moving joints in the order of q: depth first, children in file order.  Mimic joints, which follow them, are in `follower_names`."""
        return [joint.name for joint in self.joints[: self._moving]]

    @property
    def follower_names(self) -> list[str]:
        """The mimic joints, depth first.  They have no numbers in q and v, but links, frames and reactions as all joints."""
        return [joint.name for joint in self.joints[self._moving : self._moving + self._followers]]

    @property
    def fixed_joint_names(self) -> list[str]:
        """The fixed joints, depth first and in file order, then `base`, which connects a fixed root with the ground."""
        return [joint.name for joint in self.joints[self._moving + self._followers :]]

    @property
    def loop_names(self) -> list[str]:
        """The joints that close loops, in the order of the file.  Reactions are theirs, too; q and v have no numbers of them."""
        return [loop.name for loop in self.loops]

    @property
    def link_names(self) -> list[str]:
        """Links, parents first; the root is the first."""
        return [link.name for link in self.links]

    @property
    def parameters(self) -> Array:
        """Inertial parameters (links, 10), as :attr:`Link.parameters`, in the order of `link_names`."""
        return np.array([link.parameters for link in self.links])

    def neutral(self) -> Array:
        """The neutral position (nq): zeros, and quaternions of no rotation.  Limits of joints may exclude it."""
        q = np.zeros(self.nq)
        for part in self._quaternions:
            q[part.stop - 1] = 1.0
        return q

    def random(self, rng: np.random.Generator | int | None = None, size: int | tuple[int, ...] | None = None) -> Array:
        """Random positions, (nq) or, with a size, (*size, nq).

        Uniform between the limits of joints, those of mimic joints included; where the file gives none, in (−π, π] for angles
        and between −1 m and 1 m for lengths.  Quaternions are uniform on the sphere of orientations.
        rng: a generator, a seed for one, or None for a fresh one.

            q = m.random(1, size=1000)                                      # (1000, 6)
        """
        try:
            generator = np.random.default_rng(rng)
        except (TypeError, ValueError):
            raise ValueError(f"rng={rng!r}; expected a generator of numpy.random, a seed that is not negative, or None") from None
        leading = () if size is None else (size,) if isinstance(size, (int, np.integer)) else size
        if not isinstance(leading, (tuple, list)) or not all(isinstance(n, (int, np.integer)) and type(n) is not bool and n >= 0 for n in leading):
            raise ValueError(f"size={size!r}; expected a number of positions, or several, which are leading axes")
        lower, upper = self._ranges
        numbers = generator.random((*leading, self.nq))
        with np.errstate(over="ignore", invalid="ignore"):
            width = upper - lower
            q: Array = upper - width * numbers  # the upper end can be reached, the lower can't
        if not np.isfinite(width).all():
            q = np.where(np.isfinite(width), q, 2 * (upper / 2 - (upper / 2 - lower / 2) * numbers))
        for part in self._quaternions:
            direction = generator.normal(size=(*leading, 4))
            q[..., part] = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
        return q

    @property
    def position_ranges(self) -> tuple[Array, Array]:
        """Where :meth:`random` has its positions: the least and the largest numbers, each (nq), rad or m; read-only.

        They are `lower` and `upper` where these are finite, and otherwise −π and π for angles, and ±1 m for lengths.
        """
        return self._ranges

    def as_array(self, x: Any, what: str) -> NDArray[Any]:
        """What calls make of an argument: a table by the names of its columns, one number as one for each coordinate, others as arrays.

        what: "q", "v", "a" or "tau".  Raises ValueError for what holds no real numbers, and for columns that don't fit.
        """
        return argument(x, what, self.nq if what == "q" else self.nv, self._core)

    def in_order(self, x: Any, what: str) -> Any:
        """A table by the names of its columns as an array, in the order of q, v, a or tau, as `what` says; what is none as it is."""
        return in_order(x, what, self._core)

    def position_of(self, joint: Joint | str, q: ArrayLike) -> Array:
        """Positions (…) of a joint with one coordinate, or of that name, from q (…, nq); of a mimic joint as its leader has it; rad or m.

        Raises ValueError for joints with none or several coordinates.
        """
        of, x = self._of_one_coordinate(joint), self._rows(q, "q", self.nq)
        position: Array = x[..., of.q_index] if of.leader is None else of.multiplier * x[..., self.joint(of.leader).q_index] + of.offset
        return position

    def velocity_of(self, joint: Joint | str, v: ArrayLike) -> Array:
        """Velocities (…) of a joint with one coordinate, or of that name, from v (…, nv), and accelerations from a; of a mimic joint as its leader has it.

        Raises ValueError for joints with none or several coordinates.
        """
        of, x = self._of_one_coordinate(joint), self._rows(v, "v", self.nv)
        velocity: Array = x[..., of.v_index] if of.leader is None else of.multiplier * x[..., self.joint(of.leader).v_index]
        return velocity

    def _rows(self, x: ArrayLike, name: str, columns: int) -> Array:
        """Numbers of any type, NaN among them."""
        array = self.as_array(x, name)
        if array.ndim == 0 or array.shape[-1] != columns:
            raise ValueError(f"{name} has shape {array.shape}; expected (…, {columns})")
        return array

    def _of_one_coordinate(self, joint: Joint | str) -> Joint:
        of = self.joint(joint) if isinstance(joint, str) else joint
        if not of.one_coordinate:
            raise ValueError(
                f"joint {of.name} has {count(of.nv, 'coordinate') if of.nv else 'no coordinates'}; expected one with one, whose position is a number"
            )
        return of

    def joint(self, name: str) -> Joint:
        """The joint of that name."""
        return self.joints[self.joint_index(name)]

    def joint_index(self, name: str) -> int:
        """Where the joint of that name is in `joints`."""
        return self._index(self._joint_index, name, "joint")

    def link(self, name: str) -> Link:
        """The link of that name."""
        return self.links[self._index(self._link_index, name, "link")]

    @property
    def root(self) -> str:
        """The link that no joint of the robot carries."""
        return self.links[0].name

    @property
    def frames(self) -> list[str]:
        """Every name that calls take for a frame: links, and joints, which stand for the links that they carry.

        `link:NAME` and `joint:NAME` say which is meant.  They are needed, and listed here, for names of a link and of a joint that carries
        another link; a name that is both is otherwise listed once.
        """
        links = [name if name in self._frame_index else f"link:{name}" for name in self._link_index]
        joints = [name if name in self._frame_index else f"joint:{name}" for name in self._children]
        return list(dict.fromkeys((*links, *joints)))

    @property
    def mass(self) -> float:
        """The mass of all links, payloads included; kg."""
        return math.fsum(link.mass for link in self.links)

    def joint_above(self, link: str) -> Joint:
        """The joint that carries a link."""
        return self._carrying[self.link(link).name]

    def parent(self, link: str) -> str | None:
        """The link on the other side of the joint that carries this one; None for the root."""
        return self.joint_above(link).parent

    def children(self, link: str) -> list[str]:
        """The links that joints connect to this one, in the order of `links`."""
        name = self.link(link).name
        return [other.name for other in self.links if self._carrying[other.name].parent == name]

    def support(self, link: str) -> list[str]:
        """The joints between the root and a link, the root's first, fixed ones too; a floating base is the first."""
        joints = []
        above: Joint | None = self.joint_above(link)
        while above is not None:
            if above.parent is not None or above.nv:  # what welds the root to the ground is no joint of the robot
                joints.append(above.name)
            above = None if above.parent is None else self._carrying[above.parent]
        return joints[::-1]

    def subtree_links(self, joint: str) -> list[str]:
        """The links that a joint carries, directly or not, parents first.  The name of a link stands for the joint above it.

        Raises ValueError for a name of both a joint and a link that another joint carries; `joint:NAME` and `link:NAME` say which.
        """
        names = {self.links[self.frame_link(joint)].name}
        for link in self.links:
            if self._carrying[link.name].parent in names:
                names.add(link.name)
        return [link.name for link in self.links if link.name in names]

    def subtree_mass(self, joint: str) -> float:
        """The mass of those links, kg."""
        return math.fsum(self.link(name).mass for name in self.subtree_links(joint))

    def frame_link(self, name: str) -> int:
        """Where the link of a frame is in `links`: of a link itself, and of a joint that which it carries; `link:NAME` or `joint:NAME` says which is meant.

        Raises ValueError for unknown names, and for a name of both a link and a joint that carries another link.
        """
        index = self._frame_index.get(name) if isinstance(name, str) else None
        return self._qualified_frame(name) if index is None else index

    def _qualified_frame(self, name: str) -> int:
        if isinstance(name, str):
            kind, _, rest = name.partition(":")
            table = {"link": self._link_index, "joint": self._children}.get(kind, {})
            if rest in table:
                return table[rest]
            if name in self._link_index:  # and of a joint that carries another one
                other = self.links[self._children[name]].name
                said = f"{name!r} names a link and also a joint, which carries another link, {other!r}; say 'link:{name}' or 'joint:{name}'"
                raise ValueError(sentence(f"{self.name or self.file}: {said}"))
        raise ValueError(unknown_name(self.name or self.file, "link or joint", name, self.frames))

    def _is_one_frame(self, name: str, link: int) -> bool:
        """Does a name mean this link alone?  Not if joint and link of the name differ, and not if it says what `link:` and `joint:` say of another."""
        kind, separated, rest = name.partition(":")
        is_said = separated and rest in {"link": self._link_index, "joint": self._children}.get(kind, {})
        return not is_said and self._link_index.get(name, link) == link == self._children.get(name, link)

    def _index(self, table: Mapping[str, int], name: str, what: str) -> int:
        """Where a joint or link is in its table.  `joint:NAME` and `link:NAME` are taken, too, since other calls need them."""
        plain = name_among(table, name, what)
        if isinstance(plain, str) and plain in table:
            return table[plain]
        raise ValueError(self._other_kind(name, what) or unknown_name(self.name or self.file, what, name, table))

    def _plain(self, name: str, what: str) -> str:
        """A name as the compiled calls know it, without `joint:` or `link:`.  Raises ValueError for a link where a joint is meant, or the other way round.

        Joints are those that close loops, too.  Of names that there are not the compiled calls say what there is.
        """
        known = self._link_index if what == "link" else self._any_joint_index
        plain: str = name_among(known, name, what)
        if plain in known:
            return plain
        if said := self._other_kind(name, what):
            raise ValueError(said)
        return name

    def _other_kind(self, name: object, what: str) -> str:
        """A sentence about a link where a joint is meant, or the other way round; empty for other names."""
        if not isinstance(name, str):
            return ""
        where = self.name or self.file
        if what == "joint" and name.removeprefix("joint:") in self._loop_index:
            return sentence(f"{where}: no joint named {name!r} has coordinates; it closes a loop")
        if what == "joint" and name in self._link_index:
            return other_kind(where, what, name, "link", self._carrying[name].name)
        if what == "link" and name in self._children:
            return other_kind(where, what, name, "joint", self.links[self._children[name]].name)
        return ""
