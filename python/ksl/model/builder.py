"""Models that a program describes, link by link and joint by joint, or by Denavit–Hartenberg parameters."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl import _core
from ksl.base.errors import DescriptionWarning
from ksl.mechanism import given
from ksl.mechanism.joint_kinds import AnyKind, names_with
from ksl.model.model import Model
from ksl.mechanism.payload import point_masses
from ksl.mechanism.requests import one_of, three_numbers

DHRow = Mapping[str, Any] | Sequence[Any]
"""{"a": m, "alpha": rad, "d": m, "theta": rad, …}, or a sequence a, alpha, d, theta[, kind]."""
Convention = Literal["standard", "modified"]

_JointNumbers = tuple[
    list[float] | None,
    list[float] | None,
    float | None,
    float | None,
    float | None,
    float | None,
    float | None,
    float,
    float,
    tuple[str, float, float] | None,
    float | None,
    list[float],
    list[float | None],
]
_ORIGIN, _NO_TENSOR = np.zeros(3), np.zeros((3, 3))
_SEVERAL_LIMITS = names_with(lambda kind: kind.numbers_with_limits > 1)
_OF_A_ROW = ("a", "alpha", "d", "theta", "kind", "mass", "center_of_mass", "inertia", "limits", "effort", "velocity", "damping", "friction")


class Builder:
    """Collects links and joints; :meth:`build` makes the model.

        b = ksl.Builder("pendulum")
        b.add_link("ceiling")
        b.add_link("rod", mass=2.0, center_of_mass=(0, 0, -0.5))
        b.add_joint("hinge", "revolute", "ceiling", "rod", axis=(0, 1, 0))
        m = b.build()

    Every call raises :class:`ksl.DescriptionError`, or ValueError for a wrong type or shape; messages name the link or joint, what
    was found and how to mend it.  `gravity`: in world axes, m/s².
    """

    def __init__(self, name: str, gravity: Sequence[float] = (0.0, 0.0, -9.81)) -> None:
        self._core = _core.Builder(given.name(name, "name"), list(three_numbers(gravity, "gravity")))

    def add_link(self, name: str, mass: float = 0.0, center_of_mass: ArrayLike = (0.0, 0.0, 0.0), inertia: ArrayLike | None = None) -> Builder:
        """A link; the one that no joint carries is the root.  Returns the builder.

        mass: kg.  center_of_mass (3): in the link's axes, m.  inertia (3, 3): about the centre of mass, in the link's axes, kg m²,
        with off-diagonal elements −∫xy dm; None for a point mass.  A matrix that isn't symmetric and positive semidefinite is an error;
        principal moments that violate the triangle inequality are a warning of :meth:`build`.
        """
        self._core.add_link(given.name(name, "the name of the link"), given.mass(f"link {name}", mass, center_of_mass, inertia))
        return self

    def add_joint(
        self,
        name: str,
        kind: AnyKind,
        parent: str,
        child: str,
        pose: given.PoseLike | None = None,
        axis: ArrayLike | None = None,
        axis2: ArrayLike | None = None,
        pitch: float | None = None,
        limits: Sequence[float | None] | Sequence[Sequence[float | None] | None] | None = None,
        effort: float | None = None,
        velocity: float | None = None,
        damping: float = 0.0,
        friction: float = 0.0,
        mimic: tuple[str, float, float] | None = None,
        friction_width: float | None = None,
        armature: float = 0.0,
        rotor_inertia: float = 0.0,
        gear_ratio: float = 1.0,
        spring_stiffness: float = 0.0,
        spring_rest: float = 0.0,
        *,
        xyz: ArrayLike | None = None,
        rpy: ArrayLike | None = None,
        quaternion: ArrayLike | None = None,
    ) -> Builder:
        """A joint between two links that have been added.  Returns the builder.

        kind: fixed, revolute, continuous, prismatic, helical (or screw), cylindrical, universal, spherical (or ball), planar, translation,
        floating (or free); docs/conventions.md has the table.
        pose: of the joint's frame in the parent link, (4, 4) or a :class:`ksl.Pose`; the child link's frame is the joint's at q = 0.  Or, in its place,
        xyz (3), m, with rpy (3), rad, about the fixed axes x, y, z in this order, as URDF has them, or with quaternion (4), x, y, z, w.
        axis (3): of any length, in the joint's frame; kinds that have one need it, others must not have it.  That of a planar joint is the
        normal, z if it is left out.  axis2 (3): the second axis of a universal joint, fixed in the child.
        pitch: of helical joints, m/rad, positive for a right-handed screw.
        limits: (lower, upper), rad or m, each may be None; of cylindrical, universal, planar and translation joints a pair, or None, for each
        number in q.  effort, velocity: limits, N m or N, rad/s or m/s.  They are kept and not enforced.
        damping, friction: of each coordinate, N m s/rad or N s/m, and N m or N.  friction_width: of friction's smooth law, rad/s or m/s.
        armature: inertia that each coordinate feels besides that of the links, kg m² or kg.  rotor_inertia, gear_ratio: of the motor's rotor, kg m²,
        and its turns for each of the joint.  spring_stiffness, spring_rest: of a joint with one coordinate, N m/rad or N/m, and rad or m.
        They have no effect unless `physics=` names them.
        mimic: (joint, multiplier, offset): it follows that joint, which may be added later, at multiplier × its position + offset.
        """
        given.name(name, "the name of the joint")
        for word, what in ((kind, "kind"), (parent, "parent"), (child, "child")):
            given.name(word, f"joint {name}: its {what}")
        if kind in _SEVERAL_LIMITS and limits is not None and not any(hasattr(x, "__len__") for x in limits):
            raise ValueError(f"joint {name}: its limits are {limits!r}; a {kind} joint has several numbers in q, each of which needs (lower, upper) or None")
        placed = given.pose_of(f"joint {name}: its pose", pose, xyz, rpy, quaternion)
        options = _options(f"joint {name}", axis, axis2, pitch, limits, effort, velocity, damping, friction, mimic)
        physics = {"armature": armature, "rotor inertia": rotor_inertia, "gear ratio": gear_ratio, "stiffness": spring_stiffness, "rest position": spring_rest}
        numbers = [given.number(x, f"joint {name}: its {what}") for what, x in physics.items()]
        options = (*options[:10], None if friction_width is None else given.number(friction_width, f"joint {name}: its friction width"), numbers, options[12])
        self._core.add_joint(name, kind, parent, child, given.pose(placed, f"joint {name}: its pose", parent), options)
        return self

    def add_loop(
        self,
        name: str,
        kind: AnyKind,
        predecessor: str,
        successor: str,
        predecessor_pose: given.PoseLike | None = None,
        successor_pose: given.PoseLike | None = None,
        axis: ArrayLike | None = None,
        axis2: ArrayLike | None = None,
        pitch: float | None = None,
    ) -> Builder:
        """A joint that closes a loop, between two links that have been added and that joints connect already.  Returns the builder.

        kind: any of :meth:`add_joint` but floating.  predecessor, successor: the sides that a file calls parent and child.
        predecessor_pose, successor_pose: of the joint's frame on each side, in that link's frame, (4, 4) or a :class:`ksl.Pose`; the frames
        coincide where the joint's position is zero.  axis, axis2 (3), pitch: as of :meth:`add_joint`; an axis has the same
        components in both frames.

            b.add_loop("C", "revolute", "coupler", "rocker", at_end_of_coupler, at_end_of_rocker, axis=(0, 1, 0))
        """
        self._core.add_loop(given.loop(name, kind, predecessor, successor, predecessor_pose, successor_pose, axis, axis2, pitch))
        return self

    def add_force_element(
        self,
        name: str,
        link1: str,
        point1: ArrayLike,
        link2: str,
        point2: ArrayLike,
        stiffness: float = 0.0,
        free_length: float = 0.0,
        damping: float = 0.0,
        preload: float = 0.0,
        limits: Sequence[float | None] | None = None,
        stop_stiffness: float = 0.0,
    ) -> Builder:
        """A spring, damper or cylinder between two points, of links that have been added.  Returns the builder.

        point1, point2 (3): each in the frame of its link, m.  At the distance l of the points the element pulls them together, or with a
        negative force apart, with preload + stiffness (l − free_length) + damping dl/dt; N, N/m, m, N s/m.
        limits: (lower, upper) of l, m, each may be None.  Beyond them, stops pull or push with stop_stiffness (l − limit) more, N/m; with 0
        such a length is refused.  It has no effect unless `physics=` names "force elements".

            b.add_force_element("gas spring", "body", (0, 0, 0.1), "lid", (0.3, 0, 0), preload=-250.0, damping=80.0)
        """
        self._core.add_force_element(given.force_element(name, link1, point1, link2, point2, stiffness, free_length, damping, preload, limits, stop_stiffness))
        return self

    def add_dh_chain(self, parent: str, rows: Iterable[DHRow], convention: Convention = "standard", prefix: str = "") -> Builder:
        """Adds joint1, link1, joint2, link2, … to a link, their names after `prefix`.  Returns the builder.

        rows: mappings with a, alpha, d, theta (0 where missing; m and rad) and, if wanted, kind ("revolute", "continuous" or
        "prismatic"), mass, center_of_mass and inertia as in :meth:`add_link`, limits, effort, velocity, damping and friction as in
        :meth:`add_joint`; or sequences a, alpha, d, theta[, kind].  theta is added to q of a joint that turns, d to q of one that slides.
        convention: "standard", Rz(theta) Tz(d) Tx(a) Rx(alpha), puts frame i at the end of link i (Denavit and Hartenberg, 1955);
        "modified", Rx(alpha) Tx(a) Rz(theta) Tz(d), at its start (Craig, Introduction to Robotics, 3.4).  Here a and alpha are those
        of the row as Craig writes it, a(i−1) and alpha(i−1).
        The frame of link i is frame i, in which its centre of mass and inertia are given.  With "standard" a massless link
        `link1_start`, at the joint, carries each link.
        """
        modified = one_of(convention, "convention", "standard", "modified") == "modified"
        if not isinstance(rows, Iterable):
            raise ValueError(f"rows is {rows!r}; expected the rows of a table")
        table = [_dh_row(i + 1, row) for i, row in enumerate(rows)]
        self._core.add_dh_chain(given.name(parent, "parent"), table, modified, given.name(prefix, "prefix"))
        return self

    @classmethod
    def from_dh(
        cls, rows: Iterable[DHRow], convention: Convention = "standard", name: str = "robot", base: str = "base", gravity: Sequence[float] = (0.0, 0.0, -9.81)
    ) -> Builder:
        """A builder with a massless root link `base` and the chain of :meth:`add_dh_chain` on it."""
        return cls(name, gravity).add_link(base).add_dh_chain(base, rows, convention)

    def build(
        self,
        floating_base: bool = False,
        strict: bool = False,
        gravity: Sequence[float] | None = None,
        payloads: Mapping[str, tuple[float, Sequence[float]]] | None = None,
        masses: Literal["optional"] | None = None,
        physics: str | Iterable[str] | None = None,
        friction_width: float = 0.01,
        drives: given.Drives | None = None,
    ) -> Model:
        """The model of what has been added, with the options of :func:`ksl.load`; `gravity` None is the builder's own.

        drives: the joints that have a motor.  Inverse dynamics of mechanisms with loops need to know them.

        More can be added, and another model built, afterwards.
        """
        if masses is not None:
            one_of(masses, "masses", "optional")
        own = None if gravity is None else list(three_numbers(gravity, "gravity"))
        floating_base, strict = given.flag(floating_base, "floating_base"), given.flag(strict, "strict")
        if drives is not None:
            self._core.set_drives(*given.drives(drives))
        points = given.payload_points(payloads)
        core = self._core.build(floating_base, strict, own, points, masses is not None, given.physics(physics, friction_width))
        for line in core.warnings:
            warnings.warn(line, DescriptionWarning, stacklevel=2)
        return Model(core, payloads=point_masses(points))


def _options(
    who: str, axis: Any, axis2: Any, pitch: Any, limits: Any, effort: Any, velocity: Any, damping: Any, friction: Any, mimic: Any = None
) -> _JointNumbers:
    def optional(x: Any, what: str) -> float | None:
        return None if x is None else given.number(x, f"{who}: its {what}")

    try:
        one = limits is None or not any(hasattr(x, "__len__") for x in limits)
        pairs = [(None, None) if x is None else tuple(x) for x in ([limits] if one else limits)]
        if not 1 <= len(pairs) <= 3 or any(len(pair) != 2 for pair in pairs):
            raise ValueError
    except (TypeError, ValueError):
        raise ValueError(f"{who}: its limits are {limits!r}; expected (lower, upper), or such a pair for each number in q") from None
    lower, upper = pairs[0]
    others = (*pairs[1:], (None, None), (None, None))[:2]
    further = [optional(x, f"{side} limit {c}") for c, pair in enumerate(others, 2) for side, x in zip(("lower", "upper"), pair)]
    try:
        follows = None if mimic is None else (given.name(mimic[0], "the leader"), float(mimic[1]), float(mimic[2]))
    except (TypeError, ValueError, IndexError):
        raise ValueError(f"{who}: its mimic is {mimic!r}; expected (joint, multiplier, offset)") from None
    return (
        given.direction(axis, f"{who}: its axis"),
        given.direction(axis2, f"{who}: its axis2"),
        optional(pitch, "pitch"),
        optional(lower, "lower limit"),
        optional(upper, "upper limit"),
        optional(effort, "effort limit"),
        optional(velocity, "velocity limit"),
        given.number(damping, f"{who}: its damping"),
        given.number(friction, f"{who}: its friction"),
        follows,
        None,
        [0.0, 0.0, 1.0, 0.0, 0.0],
        further,
    )


def _dh_row(number: int, row: DHRow) -> tuple[list[float], str, given.Mass, _JointNumbers]:
    who = f"row {number} of the table"
    if not isinstance(row, Mapping):
        if isinstance(row, str) or not hasattr(row, "__len__") or not 4 <= len(row) <= 5:
            raise ValueError(f"{who} is {row!r}; expected a mapping, or a, alpha, d, theta and perhaps a kind")
        row = dict(zip(_OF_A_ROW, row))
    for key in row:
        one_of(key, f"{who} has key", *_OF_A_ROW)
    numbers = [given.number(row.get(key, 0.0), f"{who}: {key}") for key in ("a", "alpha", "d", "theta")]
    mass = given.mass(who, row.get("mass", 0.0), row.get("center_of_mass", (0.0, 0.0, 0.0)), row.get("inertia"))
    limits, effort, velocity = row.get("limits"), row.get("effort"), row.get("velocity")
    options = _options(who, None, None, None, limits, effort, velocity, row.get("damping", 0.0), row.get("friction", 0.0))
    return numbers, given.name(row.get("kind", "revolute"), f"{who}: kind"), mass, options


class PlainBuilder:
    """What readers of files give a builder: arrays of doubles and plain numbers, which need no conversion, and a hundred thousand of them no time."""

    def __init__(self, builder: Builder) -> None:
        self._core = builder._core

    def add_link(self, name: str, mass: float = 0.0, center_of_mass: NDArray[np.float64] = _ORIGIN, inertia: NDArray[np.float64] = _NO_TENSOR) -> None:
        self._core.add_link(name, (mass, center_of_mass.tolist(), inertia.ravel().tolist()))

    def add_joint(
        self,
        name: str,
        kind: str,
        parent: str,
        child: str,
        pose: NDArray[np.float64],
        axis: NDArray[np.float64] | None = None,
        *,
        limits: tuple[float | None, float | None] = (None, None),
        effort: float | None = None,
        velocity: float | None = None,
        armature: float = 0.0,
        mimic: tuple[str, float, float] | None = None,
    ) -> None:
        """Joints whose position has one pair of limits at most."""
        numbers = [armature, 0.0, 1.0, 0.0, 0.0]
        of_axis = None if axis is None else axis.tolist()
        options = (of_axis, None, None, *limits, effort, velocity, 0.0, 0.0, mimic, None, numbers, [None] * 4)
        self._core.add_joint(name, kind, parent, child, pose.ravel().tolist(), options)


def core_of_builder(builder: Builder) -> _core.Builder:
    """The compiled builder, for readers of files, which give it what no program says: where the robot was read, and what was left out."""
    return builder._core
