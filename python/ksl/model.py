"""A mechanism: names, sizes, and dynamics over arrays with any leading shape."""

from __future__ import annotations

import math
import operator
import os
import struct
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl import _core
from ksl.errors import DescriptionWarning

if TYPE_CHECKING:
    import pyarrow

Array = NDArray[np.floating]
External = Mapping[str, ArrayLike]
Side = Literal["child", "parent"]
Order = Literal["lin_ang", "ang_lin"]
Part = Literal["total", "constraint", "actuation"]
Point = str | Sequence[float]
"""'joint', 'world', a link's name, or three numbers: an offset from the joint's origin in the joint's axes, m."""

_Arguments = tuple[str, bool, bool, bool, list[float], list[tuple[str, float, list[float]]], bool]
"""Of `_core.load`: what a model is made from."""

QUATERNION_TOLERANCE = 1e-3
REQUESTS_KEPT = 64

_PLAIN_NUMBERS = frozenset((float, int))
_pack_three = struct.Struct("3d").pack


@dataclass(frozen=True)
class Joint:
    """A joint as the file gives it; limits that the file leaves out are None.  SI units."""

    name: str
    kind: Literal["fixed", "revolute", "continuous", "prismatic", "helical", "spherical", "floating"]
    parent: str | None
    """Link on the parent side; None is the ground."""
    child: str
    nq: int
    nv: int
    q_index: int
    v_index: int
    axis: tuple[float, float, float]
    """Unit vector in the joint's frame; zero for kinds without one axis."""
    pitch: float = 0.0
    """Advance along the axis, m/rad, positive for a right-handed screw; of helical joints."""
    lower: float | None = None
    upper: float | None = None
    effort: float | None = None
    velocity: float | None = None
    damping: float = 0.0
    friction: float = 0.0

    @property
    def has_axis(self) -> bool:
        """Whether it has one coordinate, along or about `axis`: revolute, continuous, prismatic and helical joints."""
        return self.nv == 1


@dataclass(frozen=True)
class Link:
    """A link's inertia about its origin, in its axes, payload included."""

    name: str
    mass: float
    first_moment: tuple[float, float, float]
    """Mass × centroid, kg m."""
    inertia: tuple[float, float, float, float, float, float]
    """Ixx Iyy Izz Ixy Iyz Izx about the link's origin, kg m², matrix elements (signs included)."""


class Model:
    """A mechanism, immutable.  Made by :func:`load`.

    A pickle holds the arguments of `load`, the path made absolute: where it is read (in a worker of `multiprocessing`,
    say) the file is read again, and ValueError raised where its joints or links are no longer the same.  A copy, deep
    or not, is the model itself.
    """

    def __init__(self, core: _core.Model, arguments: _Arguments) -> None:
        self._core, self._arguments = core, arguments
        self.name: str = core.name
        self.file: str = core.file
        self.nq: int = core.nq
        """Numbers in q."""
        self.nv: int = core.nv
        """Numbers in v, a and tau."""
        self.gravity: Array = np.array(core.gravity)
        """m/s², in world axes; read-only."""
        self.gravity.setflags(write=False)
        self.joints: tuple[Joint, ...] = tuple(Joint(**{**row, "axis": tuple(row["axis"])}) for row in core.joints)
        """All joints: the moving ones in the order of q, then the fixed ones, `base` last."""
        self.links: tuple[Link, ...] = tuple(
            Link(**{**row, "first_moment": tuple(row["first_moment"]), "inertia": tuple(row["inertia"])}) for row in core.links
        )
        """Parents first."""
        self.unused: tuple[str, ...] = tuple(core.unused)
        """What the file holds and nothing here uses, a line each."""
        self.warnings: tuple[str, ...] = tuple(core.warnings)
        """What is odd in the file, a line each: inertias that no rigid body can have, moving links without mass, names of link and condition."""
        self._moving = core.moving_joints
        self._joint_index = {joint.name: i for i, joint in enumerate(self.joints)}
        self._link_index = {link.name: i for i, link in enumerate(self.links)}
        children = {joint.name: self._link_index[joint.child] for joint in self.joints}
        self._frame_index = self._link_index | {name: link for name, link in children.items() if name not in self._link_index}
        self._requests: dict[tuple[object, ...], _core.Request] = {}
        self._link_lists: dict[tuple[str, ...] | str | None, _core.Links] = {}
        self._complete = True

    def __setattr__(self, name: str, value: object) -> None:
        if "_complete" in self.__dict__:
            raise AttributeError(f"{name} of a model can't be set: models are immutable; ksl.load makes one with other options")
        super().__setattr__(name, value)

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{name} of a model can't be deleted: models are immutable")

    def __copy__(self) -> Model:
        return self

    def __deepcopy__(self, _: object) -> Model:
        return self

    def __reduce__(self) -> tuple[Callable[..., Model], tuple[_Arguments, str]]:
        return _reloaded, (self._arguments, self._fingerprint())

    def _fingerprint(self) -> str:
        """Tells models apart that have other joints or links."""
        import hashlib

        return hashlib.sha256(repr((self.joints, self.links)).encode()).hexdigest()

    def __repr__(self) -> str:
        return f"<ksl.Model {self.name!r}: {self._moving} moving joints, {len(self.links)} links, nq={self.nq}, nv={self.nv}>"

    @property
    def joint_names(self) -> list[str]:
        """The moving joints in the order of q: depth first, children in file order."""
        return [joint.name for joint in self.joints[: self._moving]]

    @property
    def fixed_joint_names(self) -> list[str]:
        """The fixed joints in file order of the walk, then `base`: the ground on a fixed root."""
        return [joint.name for joint in self.joints[self._moving :]]

    @property
    def link_names(self) -> list[str]:
        """Links, parents first; the root is the first."""
        return [link.name for link in self.links]

    def joint(self, name: str) -> Joint:
        """The joint of that name."""
        return self.joints[self._index(self._joint_index, name, "joint")]

    def inverse_dynamics(
        self, q: ArrayLike, v: ArrayLike, a: ArrayLike, external: External | None = None, out: Array | None = None, threads: int | None = None
    ) -> Array:
        """Joint efforts that give accelerations `a` at positions `q` and velocities `v`.

        q (…, nq), v and a (…, nv) → (…, nv); rad, m, N m, N.  Leading shapes are broadcast.
        external: {link name: (…, 6)}, the wrench that the environment exerts on the link: force first, about the
        link's origin, in the link's axes.  Gravity is included.  Joint friction and damping are not.

        A floating base is the first joint: q = [x y z qx qy qz qw] in the world, v = [linear, angular] in the body's
        frame, a = dv/dt componentwise; its effort is the wrench on the body in the same frame.

        Arrays, sequences and whatever has the array, buffer or DLPack protocol; no copy where the numbers of a row are
        neighbours and rows lie at one distance, a negative one too.  float32 stays float32 where every argument is.
        out: a C-contiguous array for the result; it may be one of the arguments, but not overlap one otherwise.
        threads: at most so many for large batches; None or 0: all cores; results don't depend on it.  The interpreter's
        lock is released from 32 states on.

        Recursive Newton–Euler (Featherstone, RBDA 2008, table 5.1); O(bodies).
        Raises ValueError for shapes that don't fit and numbers that are complex or not finite.
        """
        if (tau := _room(out, v)) is not None and self._core.inverse_dynamics_direct(q, v, a, external, tau, _thread_count(threads)):
            return tau
        states = _States(self, external, q=q, v=v, a=a)
        tau, rows = states.result(out, self.nv), states.rows
        self._core.inverse_dynamics(rows["q"], rows["v"], rows["a"], *states.external, states.flat_result(tau, 2), [], [], _thread_count(threads))
        return tau

    def reactions(
        self,
        q: ArrayLike,
        v: ArrayLike,
        a: ArrayLike,
        external: External | None = None,
        on: Side = "child",
        at: Point = "joint",
        axes: str = "joint",
        order: Order = "lin_ang",
        part: Part = "total",
        joints: Iterable[str] | None = None,
        out: Array | None = None,
        threads: int | None = None,
    ) -> Array:
        """The wrench through each joint: what the parent side exerts on the child side.

        q, v, a, external: as in :meth:`inverse_dynamics`.  Returns (…, joints, 6); N and N m.
        joints: names in the order wanted, fixed ones and `base` too; by default the moving joints in the order of q.
        on: the side the wrench acts on; "parent" is the negative.
        at: the point that moments are about: "joint" (the joint's origin), "world" (its origin), a link's name (its
        origin), or three numbers, an offset from the joint's origin in the joint's axes, m.
        axes: "joint" (those of the joint's frame on the child side: the child link's), "world", or a link's name.
        order: "lin_ang" (fx fy fz tx ty tz) or "ang_lin".
        part: "constraint" is what the structure carries, H̄* f; "actuation" what lies along the joint's motion, h̄* f
        (revolute: the moment about the axis; prismatic: the force along it; fixed: nothing; floating: all); "total"
        their sum.  The split is made in the joint's frame and then moved by the coadjoint (Coscrews page, (7)–(9)).
        """
        request = self._request(on, at, axes, order, part, joints)
        wrenches = _room(out, v, (request.joints, 6))
        if wrenches is not None and self._core.reactions_direct(q, v, a, external, request, wrenches, _thread_count(threads)):
            return wrenches
        states = _States(self, external, q=q, v=v, a=a)
        wrenches, rows = states.result(out, request.joints, 6), states.rows
        outs = [states.flat_result(wrenches, 3)]
        self._core.inverse_dynamics(rows["q"], rows["v"], rows["a"], *states.external, None, [request], outs, _thread_count(threads))
        return wrenches

    def forward_dynamics(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, external: External | None = None, out: Array | None = None, threads: int | None = None
    ) -> Array:
        """Accelerations (…, nv) under joint efforts tau (…, nv) at q (…, nq) and v (…, nv).

        The inverse of :meth:`inverse_dynamics`, same conventions.  Articulated-body algorithm (Featherstone, RBDA 2008,
        table 7.1); O(bodies).
        """
        if (a := _room(out, v)) is not None and self._core.forward_dynamics_direct(q, v, tau, external, a, _thread_count(threads)):
            return a
        states = _States(self, external, q=q, v=v, tau=tau)
        a, rows = states.result(out, self.nv), states.rows
        self._core.forward_dynamics(rows["q"], rows["v"], rows["tau"], *states.external, states.flat_result(a, 2), _thread_count(threads))
        return a

    def mass_matrix(self, q: ArrayLike, out: Array | None = None, threads: int | None = None) -> Array:
        """Mass matrix (…, nv, nv), symmetric: inverse_dynamics = mass_matrix · a + bias.

        Composite-rigid-body algorithm (Featherstone, RBDA 2008, table 6.2); O(bodies × depth).
        """
        if (matrix := _room(out, q, (self.nv, self.nv))) is not None and self._core.mass_matrix_direct(q, matrix, _thread_count(threads)):
            return matrix
        states = _States(self, None, q=q)
        matrix = states.result(out, self.nv, self.nv)
        self._core.mass_matrix(states.rows["q"], states.flat_result(matrix, 3), _thread_count(threads))
        return matrix

    def bias(self, q: ArrayLike, v: ArrayLike, external: External | None = None, out: Array | None = None, threads: int | None = None) -> Array:
        """Efforts (…, nv) that hold velocities v without acceleration: Coriolis, centrifugal, gravity, less external wrenches.

        q, v, external, out, threads: as in :meth:`inverse_dynamics`, of which this is the case a = 0.
        """
        if (tau := _room(out, v)) is not None and self._core.inverse_dynamics_direct(q, v, None, external, tau, _thread_count(threads)):
            return tau
        states = _States(self, external, q=q, v=v)
        tau, rows = states.result(out, self.nv), states.rows
        self._core.inverse_dynamics(rows["q"], rows["v"], None, *states.external, states.flat_result(tau, 2), [], [], _thread_count(threads))
        return tau

    def gravity_torque(self, q: ArrayLike, external: External | None = None, out: Array | None = None, threads: int | None = None) -> Array:
        """Efforts (…, nv) that hold the mechanism at rest at q, against gravity and external wrenches.

        q, external, out, threads: as in :meth:`inverse_dynamics`, of which this is the case v = a = 0.
        """
        if (tau := _room(out, q, (self.nv,))) is not None and self._core.inverse_dynamics_direct(q, None, None, external, tau, _thread_count(threads)):
            return tau
        states = _States(self, external, q=q)
        tau = states.result(out, self.nv)
        self._core.inverse_dynamics(states.rows["q"], None, None, *states.external, states.flat_result(tau, 2), [], [], _thread_count(threads))
        return tau

    def frame_pose(self, q: ArrayLike, name: str, out: Array | None = None, threads: int | None = None) -> Array:
        """Pose (…, 4, 4) in the world of a link's frame, or of a joint's (the child link's), for q (…, nq).

        q, out, threads: as in :meth:`inverse_dynamics`.  :meth:`frame_poses` gives several from one walk over the bodies.
        """
        link = self._index(self._frame_index, name, "link or joint")
        if (pose := _room(out, q, (4, 4))) is not None and self._core.frame_pose_direct(q, link, pose, _thread_count(threads)):
            return pose
        states = _States(self, None, q=q)
        pose = states.result(out, 4, 4)
        self._core.frame_poses(states.rows["q"], _core.Links([link]), pose.reshape(states.count, 1, 4, 4), _thread_count(threads))
        return pose

    def frame_poses(self, q: ArrayLike, names: Iterable[str] | None = None, out: Array | None = None, threads: int | None = None) -> Array:
        """Poses (…, names, 4, 4) in the world of links' frames, or of joints' (the child links'), for q (…, nq); m.

        names: in the order wanted; by default all links in the order of `link_names`.
        q, out, threads: as in :meth:`inverse_dynamics`.  O(bodies + names).
        """
        links = self._links_of(names)
        if (poses := _room(out, q, (links.n, 4, 4))) is not None and self._core.frame_poses_direct(q, links, poses, _thread_count(threads)):
            return poses
        states = _States(self, None, q=q)
        poses = states.result(out, links.n, 4, 4)
        self._core.frame_poses(states.rows["q"], links, states.flat_result(poses, 4), _thread_count(threads))
        return poses

    def energy(self, q: ArrayLike, v: ArrayLike, out: tuple[Array, Array] | None = None, threads: int | None = None) -> tuple[Array, Array]:
        """Kinetic and potential energy, J, each (…), for q (…, nq), v (…, nv).

        Potential energy is that of gravity, zero with every centroid at the world's origin.
        out: two arrays, for the one and for the other.  q, v, threads: as in :meth:`inverse_dynamics`.
        """
        given = (None, None) if out is None else _two_arrays(out)
        kinetic, potential = _room(given[0], v, ()), _room(given[1], v, ())
        if kinetic is not None and potential is not None and self._core.energy_direct(q, v, kinetic, potential, _thread_count(threads)):
            return kinetic, potential
        states = _States(self, None, q=q, v=v)
        kinetic, potential = states.result(given[0]), states.result(given[1])
        if np.may_share_memory(kinetic, potential):  # exact: both are contiguous
            raise ValueError("out: kinetic and potential energies overlap; give each memory of its own")
        energies = states.flat_result(kinetic, 1), states.flat_result(potential, 1)
        self._core.energy(states.rows["q"], states.rows["v"], *energies, _thread_count(threads))
        return kinetic, potential

    def loads(self, time: ArrayLike, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None, **options: Any) -> pyarrow.Table:
        """Every wrench along a motion, as a table with a row for each sample and joint; see :func:`ksl.loads.wrench_table`.

        time (n), q (n, nq); v and a (n, nv) are differentiated from a quintic spline where they are missing.
        Needs the extra `ksl[loads]`.
        """
        from ksl.loads import wrench_table

        return wrench_table(self, time, q, v, a, **options)

    rnea = inverse_dynamics
    aba = forward_dynamics
    crba = mass_matrix

    def _evaluate(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, external: External | None, requests: list[_core.Request]) -> tuple[Array, list[Array]]:
        """Efforts and, for each request, reactions, in one pass over the states."""
        states = _States(self, external, np.float64, q=q, v=v, a=a)
        tau, wrenches = states.result(None, self.nv), [states.result(None, r.joints, 6) for r in requests]
        outs, rows = [states.flat_result(w, 3) for w in wrenches], states.rows
        self._core.inverse_dynamics(rows["q"], rows["v"], rows["a"], *states.external, states.flat_result(tau, 2), requests, outs, 0)
        return tau, wrenches

    def _external_power(self, q: ArrayLike, v: ArrayLike, external: External) -> Array:
        """Σ f · v of the links on which the environment exerts wrenches, W."""
        states = _States(self, external, np.float64, q=q, v=v)
        power = states.result(None)
        self._core.external_power(states.rows["q"], states.rows["v"], *states.external, states.flat_result(power, 1), 0)
        return power

    def _index(self, table: Mapping[str, int], name: str, what: str) -> int:
        if name not in table:
            raise ValueError(f"{self.name or self.file}: no {what} named {name!r}; known: {', '.join(table)}")
        return table[name]

    def _links_of(self, names: Iterable[str] | None) -> _core.Links:
        """What these names in `frame_poses` ask for; kept, since to look them up takes longer than the poses of a state."""
        key = names if names is None or isinstance(names, (str, tuple)) else tuple(names)
        links = self._link_lists.get(key)
        if links is None:
            wanted = self.link_names if key is None else [key] if isinstance(key, str) else key
            links = _core.Links([self._index(self._frame_index, name, "link or joint") for name in wanted])
            if len(self._link_lists) >= REQUESTS_KEPT:  # names that change from call to call
                self._link_lists.clear()
            self._link_lists[key] = links
        return links

    def _frame(self, name: str, what: str) -> tuple[_core.Frame, int]:
        if name in ("joint", "world"):
            return getattr(_core.Frame, name), -1
        if not isinstance(name, str) or name not in self._link_index:
            raise ValueError(f"{what}={name!r}: expected 'joint', 'world' or a link of {self.name or self.file}: {', '.join(self._link_index)}")
        return _core.Frame.link, self._link_index[name]

    def _request(self, on: str, at: Point, axes: str, order: str, part: str, joints: Iterable[str] | None) -> _core.Request:
        """What these keywords of `reactions` ask for; kept, since to work it out takes longer than the dynamics of a state."""
        if joints is not None and not isinstance(joints, (str, tuple)):
            joints = tuple(joints)
        point = at if isinstance(at, str) else _offset_key(at)
        key = (on, point, axes, order, part, joints)
        try:
            request = self._requests.get(key)
        except TypeError:  # a list, say, instead of a name: refused below
            request = point = None
        if request is None:
            request = self._new_request(on, at, axes, order, part, joints)
            if point is not None:
                if len(self._requests) >= REQUESTS_KEPT:  # a point that changes from call to call
                    self._requests.clear()
                self._requests[key] = request
        return request

    def _new_request(self, on: str, at: Point, axes: str, order: str, part: str, joints: tuple[str, ...] | str | None) -> _core.Request:
        offset: Sequence[float] = (0.0, 0.0, 0.0)
        if not isinstance(at, str):
            offset, at = _three_numbers(at, "at"), "joint"
        at_frame, at_link = self._frame(at, "at")
        axes_frame, axes_link = self._frame(axes, "axes")
        names = self.joint_names if joints is None else [joints] if isinstance(joints, str) else list(joints)
        return _core.Request(
            links=[self._link_index[self.joint(name).child] for name in names],
            part=getattr(_core.Part, _one_of(part, "part", "total", "constraint", "actuation")),
            on=getattr(_core.Side, _one_of(on, "on", "child", "parent")),
            at=at_frame,
            at_link=at_link,
            offset=list(offset),
            axes=axes_frame,
            axes_link=axes_link,
            angular_first=_one_of(order, "order", "lin_ang", "ang_lin") == "ang_lin",
        )


class _States:
    """Arguments of one call: checked, broadcast and flattened to rows of one precision; and arrays for its results.

    float32 where every argument is; no copy of what is contiguous and of the full leading shape.
    """

    def __init__(self, model: Model, external: External | None, dtype: type | None = None, **arrays: ArrayLike) -> None:
        given = {name: _array(value) for name, value in arrays.items()}
        wrenches = {name: _array(value) for name, value in (external or {}).items()}
        for name, x in given.items():
            _refuse_complex(name, x)
        for name, w in wrenches.items():
            _refuse_complex(f"external[{name!r}]", w)
        single = dtype is None and all(x.dtype.newbyteorder("=") == np.float32 for x in (*given.values(), *wrenches.values()))
        self.dtype: np.dtype[np.floating] = np.dtype(np.float32 if single else np.float64)
        for name, x in given.items():
            width = model.nq if name == "q" else model.nv
            if x.ndim == 0 or x.shape[-1] != width:
                raise ValueError(f"{name} has shape {x.shape}; expected (…, {width}): {'nq' if name == 'q' else 'nv'} numbers for each state")
        for name, w in wrenches.items():
            if w.ndim == 0 or w.shape[-1] != 6:
                raise ValueError(f"external[{name!r}] has shape {w.shape}; expected (…, 6): force, then moment")
        self.leading = _common_shape(given | wrenches)
        self.count = prod(self.leading)
        self.rows = {name: self._flat(name, x) for name, x in given.items()}
        _check_quaternions(model, self.rows["q"])
        stacked = np.empty((self.count, len(wrenches), 6), self.dtype)
        for k, (name, w) in enumerate(wrenches.items()):
            stacked[:, k] = self._flat(f"external[{name!r}]", w)
        self.external = [model._index(model._link_index, name, "link") for name in wrenches], stacked

    def _flat(self, name: str, x: Array) -> Array:
        if x.shape[:-1] != self.leading:
            x = np.broadcast_to(x, (*self.leading, x.shape[-1]))
        rows = np.ascontiguousarray(x, self.dtype).reshape(self.count, x.shape[-1])
        if not rows.flags.aligned:
            rows = rows.copy()
        if not np.isfinite(rows).all():
            where = np.argwhere(~np.isfinite(x))[0].tolist()
            raise ValueError(f"{name}{where} is {x[tuple(where)]}; every number must be finite")
        return rows

    def result(self, out: Array | None, *shape: int) -> Array:
        """An array for the result: (…, *shape), the caller's `out` if there is one."""
        wanted = (*self.leading, *shape)
        if out is None:
            return np.empty(wanted, self.dtype)
        if not isinstance(out, np.ndarray) or out.shape != wanted or out.dtype != self.dtype or not (out.flags.carray and out.dtype.isnative):
            found = f"{out.dtype} {out.shape}" if isinstance(out, np.ndarray) else type(out).__name__
            raise ValueError(f"out is {found}; expected a C-contiguous, aligned, writeable {self.dtype.name} array of shape {wanted}")
        for name, rows in self.rows.items():
            # a state is read before its result is written: out may be an argument, but then row on row
            same = rows.ctypes.data == out.ctypes.data and rows.nbytes == out.nbytes
            if np.may_share_memory(out, rows) and not same:  # exact: both are contiguous
                raise ValueError(f"out overlaps {name}, which would be overwritten before it is read; give out={name} itself or memory apart from it")
        return out

    def flat_result(self, result: Array, ndim: int) -> Array:
        """A view of a result with one leading axis, ndim axes in all."""
        return result.reshape(self.count, *result.shape[len(self.leading) :][: ndim - 1])


def load(
    path: str | bytes | os.PathLike[str] | os.PathLike[bytes],
    floating_base: bool = False,
    mimic: Literal["independent"] | None = None,
    strict: bool = False,
    gravity: Sequence[float] = (0.0, 0.0, -9.81),
    payloads: Mapping[str, tuple[float, Sequence[float]]] | None = None,
    masses: Literal["optional"] | None = None,
) -> Model:
    """Reads a URDF file.

    floating_base: the root link floats; the first joint is then `floating_base` (`floating_root`, with a warning, where the
    file has a joint of that name).
    mimic: None refuses a moving joint that mimics another; "independent" gives it a coordinate of its own.
    strict: an inertia that no rigid body can have, or a moving link with geometry and no mass, is an error instead of a
    :class:`DescriptionWarning`.
    gravity: in world axes, m/s².
    payloads: {link name: (mass in kg, point in the link's frame in m)}: point masses fixed to links.
    masses: None refuses a robot whose links move and have no mass, none of them; "optional" reads it, for kinematics.
    Raises :class:`DescriptionError` with file, line, link or joint, fault and mend.
    """
    if mimic is not None:
        _one_of(mimic, "mimic", "independent")
    if masses is not None:
        _one_of(masses, "masses", "optional")
    file, loads = os.fsdecode(path), [_payload(link, load) for link, load in (payloads or {}).items()]
    options = (floating_base, mimic is not None, strict, list(_three_numbers(gravity, "gravity")), loads, masses is not None)
    model = Model(_core.load(file, *options), (os.path.abspath(file), *options))
    for line in model.warnings:
        warnings.warn(line, DescriptionWarning, stacklevel=2)
    return model


def _reloaded(arguments: _Arguments, fingerprint: str) -> Model:
    """The model of a pickle; its warnings were given when it was loaded first."""
    model = Model(_core.load(*arguments), arguments)
    if model._fingerprint() != fingerprint:
        raise ValueError(f"{model.file}: joints or links have changed since the model was pickled; load the file again")
    return model


def _payload(link: str, load: tuple[float, Sequence[float]]) -> tuple[str, float, list[float]]:
    try:
        mass, point = load
        mass = float(mass)
    except (TypeError, ValueError):
        raise ValueError(f"payload on {link}: found {load!r}; expected (mass in kg, (x, y, z) in the link's frame in m)") from None
    if not (math.isfinite(mass) and mass >= 0):
        raise ValueError(f"payload on {link}: mass {mass} kg; expected a number that is not negative")
    return link, mass, list(_three_numbers(point, f"payload on {link}: payload point"))


def _array(x: Any) -> NDArray[Any]:
    """Of NumPy, which doesn't look for objects that offer DLPack and nothing else."""
    return np.from_dlpack(x) if hasattr(x, "__dlpack__") and not hasattr(x, "__array__") else np.asarray(x)


def _room(out: Array | None, like: ArrayLike, shape: tuple[int, ...] | None = None) -> Array | None:
    """`out`, or an array in the precision of `like`: of its shape, or with its last axis replaced by `shape`.

    None where only the long way can tell what fits.
    """
    if out is not None:
        return out if type(out) is np.ndarray else None
    if type(like) is not np.ndarray:
        return None
    return np.empty(like.shape if shape is None else like.shape[:-1] + shape, like.dtype)


def _two_arrays(out: tuple[Array, Array]) -> tuple[Array, Array]:
    if not isinstance(out, (tuple, list)) or len(out) != 2:
        raise ValueError(f"out is {type(out).__name__}; expected two arrays, (kinetic, potential)")
    return out[0], out[1]


def _thread_count(threads: int | None) -> int:
    """0 is all cores."""
    if not threads:
        return 0
    if operator.index(threads) < 0:
        raise ValueError(f"threads={threads}; expected how many threads to use at most, or None or 0 for all cores")
    return operator.index(threads)


def _refuse_complex(name: str, x: Array) -> None:
    if x.dtype.kind == "c":
        raise ValueError(f"{name} is complex ({x.dtype}); expected real numbers: .real takes the real parts")


def _one_of(value: str, what: str, *known: str) -> str:
    if value not in known:
        raise ValueError(f"{what}={value!r}; expected one of {', '.join(repr(k) for k in known)}")
    return value


def _three_numbers(x: ArrayLike, what: str) -> tuple[float, float, float]:
    try:
        v = np.asarray(x)
        v = v.astype(float) if v.dtype.kind != "c" else np.empty(0)
    except (TypeError, ValueError):
        v = np.empty(0)
    if v.shape != (3,) or not np.isfinite(v).all():
        raise ValueError(f"{what} needs three finite numbers, found {x!r}")
    return float(v[0]), float(v[1]), float(v[2])


def _offset_key(at: Any) -> bytes | None:
    """Tells offsets apart, zeros of either sign too; None where only `_three_numbers` can tell what they are."""
    numbers = at.tolist() if type(at) is np.ndarray else at
    if type(numbers) not in (list, tuple) or len(numbers) != 3:
        return None
    x, y, z = numbers
    if type(x) not in _PLAIN_NUMBERS or type(y) not in _PLAIN_NUMBERS or type(z) not in _PLAIN_NUMBERS:
        return None
    try:
        return _pack_three(x, y, z)
    except struct.error:  # an integer beyond all doubles
        return None


def _common_shape(arrays: Mapping[str, Array]) -> tuple[int, ...]:
    """Leading shape that all arrays broadcast to."""
    shapes = {x.shape[:-1] for x in arrays.values()}
    if len(shapes) == 1:
        return shapes.pop()
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        found = ", ".join(f"{name} {x.shape}" for name, x in arrays.items())
        raise ValueError(f"leading shapes don't broadcast: {found}") from None


def _check_quaternions(model: Model, q: Array) -> None:
    for joint in model.joints[: model._moving]:
        if joint.kind in ("floating", "spherical") and len(q):
            length = np.linalg.norm(q[:, joint.q_index + joint.nq - 4 : joint.q_index + joint.nq], axis=1)
            worst = int(np.argmax(np.abs(length - 1)))
            if abs(length[worst] - 1) > QUATERNION_TOLERANCE:
                raise ValueError(f"{joint.name}: quaternion of state {worst} has length {length[worst]:.6g}; expected a unit quaternion [qx qy qz qw]")
