"""Spatial values with checked frames and kinds: poses, twists, accelerations, wrenches, momenta and inertias over NumPy arrays.

    X = ksl.Pose(M, to="world", of="tool")                  # (…, 4, 4); carries coordinates of the tool to the world
    f = ksl.Wrench(x, frame="tool")                         # (…, 6), linear first
    power = (X @ f) @ ksl.Twist(v, frame="world")           # (…)

Only what physics has is computed.  Mixing kinds raises TypeError, mixing frames :class:`ksl.FrameError`, mixing orders
ValueError; each message names both sides.  A value without a frame's name goes with values without one, never with
named ones.  Leading shapes broadcast; float32 and float64 stay what they are, mixed they give float64, other numbers
become float64.  Values are immutable and share memory with float arrays that they are made of; NaN in six-vectors is
passed on, in poses and inertias it is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, ClassVar, Literal, NoReturn, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from ksl import ufuncs
from ksl.base.errors import FrameError, near_names
from ksl.base.rotations import rotation_of_quaternion, rotation_of_rpy

Floats = NDArray[np.floating[Any]]
Order = Literal["lin_ang", "ang_lin"]

ROTATION_TOLERANCE = 1e-6
"""How far RᵀR of a pose may be from 1, in its largest element."""
SYMMETRY_TOLERANCE = 1e-6
"""How far an inertia tensor may be from symmetric, relative to its largest element."""

V = TypeVar("V", bound="_Value")
S = TypeVar("S", bound="_SixVector")


class _Value:
    """Base of all kinds: an array with leading axes for the states and fixed last ones."""

    __slots__ = ("_numbers",)
    __array_ufunc__ = None  # array * value calls the value's operator, array + value is refused
    __hash__ = None  # type: ignore[assignment]
    _fixed: ClassVar[int]
    """How many of the last axes belong to one value."""
    _numbers: Floats

    @property
    def shape(self) -> tuple[int, ...]:
        """The leading shape: () is one value."""
        return self._numbers.shape[: -self._fixed]

    @property
    def ndim(self) -> int:
        """Number of leading axes; 0 is one value."""
        return len(self.shape)

    @property
    def dtype(self) -> np.dtype[np.floating[Any]]:
        """Type of the numbers: float32 or float64."""
        return self._numbers.dtype

    def __len__(self) -> int:
        if not self.shape:
            raise TypeError(f"{self._name()} is one value and has no length")
        return self.shape[0]

    def __getitem__(self: V, index: Any) -> V:
        """Indexes the leading axes only, as NumPy does."""
        index = index if isinstance(index, tuple) else (index,)
        if not any(i is Ellipsis for i in index):
            index += (Ellipsis,)
        return self._with(self._numbers[index + (slice(None),) * self._fixed])

    def __iter__(self: V) -> Iterator[V]:
        return (self[i] for i in range(len(self)))

    def astype(self: V, dtype: DTypeLike) -> V:
        """The same values in float32 or float64."""
        if np.dtype(dtype) not in (np.float32, np.float64):
            raise TypeError(f"{self._name()}.astype({np.dtype(dtype)}); expected float32 or float64")
        return self._with(self._numbers.astype(dtype, copy=False))

    def __eq__(self, other: object) -> bool:
        """Same kind, frames, order, shape and numbers; see `allclose`."""
        return type(other) is type(self) and self._labels() == other._labels() and np.array_equal(self._numbers, other._numbers)

    def __radd__(self, other: object) -> NoReturn:
        _refuse(other, "+", self)

    def allclose(self: V, other: V, rtol: float = 1e-5, atol: float = 1e-8) -> bool:
        """numpy.allclose of the numbers of two values of one kind, in one frame and order."""
        self._meet("allclose", other)
        return np.allclose(self._numbers, other._numbers, rtol=rtol, atol=atol)

    def __array__(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError(f"{self._name()} isn't an array: its numbers are in {self._doors}")

    _doors: ClassVar[str]

    def _labels(self) -> dict[str, Any]:
        """Frames and order, under the names of the constructor's keywords."""
        raise NotImplementedError

    def _with(self: V, numbers: Floats, **labels: Any) -> V:
        """A value of this kind and with these labels, of other numbers, without checks."""
        raise NotImplementedError

    def _meet(self, operation: str, other: object) -> None:
        """Refuses another kind, other frames, and shapes that don't broadcast."""
        if not isinstance(other, _Value) or type(other) is not type(self):
            _refuse(self, operation, other)
        theirs = other._labels()
        for label, mine in self._labels().items():
            if label != "order":
                _same_frame(self, operation, other, mine, theirs[label])

    def _name(self) -> str:
        """Pose(to='a', of='b'), Twist(frame='b', order='ang_lin'): a value in an error message."""
        labels = ", ".join(f"{k}={v!r}" for k, v in self._labels().items() if v is not None and v != "lin_ang")
        return f"{type(self).__name__}({labels})"

    def __repr__(self) -> str:
        labels = "".join(f", {k}={v!r}" for k, v in self._labels().items() if v is not None)
        kind = type(self).__name__
        numbers = np.array2string(self._shown(), separator=", ", prefix=f"{kind}(") if not self.shape else f"shape {self.shape}, {self.dtype}"
        return f"{kind}({numbers}{labels})"

    def _shown(self) -> Floats:
        """What the constructor takes, for one value."""
        return self._numbers


class _SixVector(_Value):
    """Six numbers in the axes of a frame and about its origin; base of twists, accelerations, wrenches and momenta."""

    __slots__ = ("_frame", "_order")
    _fixed = 1
    _doors = ".array (in the order of .order), .lin and .ang"
    _dual: ClassVar[bool]
    """True for wrenches and momenta, which transform with CoAd; the others transform with Ad."""

    def __init__(self, x: ArrayLike, *, order: Order = "lin_ang", frame: str | None = None) -> None:
        kind = type(self).__name__
        self._order = _checked_order(order, kind)
        self._frame = _checked_frame(frame, f"{kind}(frame=…)")
        self._numbers = _frozen(_floats(x, (6,), kind))

    @classmethod
    def from_parts(cls: type[S], lin: ArrayLike, ang: ArrayLike, *, order: Order = "lin_ang", frame: str | None = None) -> S:
        """From the linear and the angular part, each (…, 3); `order` is how they are stored."""
        parts = [_floats(lin, (3,), f"{cls.__name__} lin"), _floats(ang, (3,), f"{cls.__name__} ang")]
        if _checked_order(order, cls.__name__) == "ang_lin":
            parts.reverse()
        return cls(np.concatenate(np.broadcast_arrays(*parts), axis=-1), order=order, frame=frame)

    @property
    def array(self) -> Floats:
        """The numbers (…, 6), in the order of `order`; read-only, no copy."""
        return self._numbers

    @property
    def order(self) -> Order:
        """Order of the numbers in `array`: "lin_ang", linear first, or "ang_lin"."""
        return self._order

    @property
    def frame(self) -> str | None:
        """The frame whose axes and origin are used; None if it has no name."""
        return self._frame

    @property
    def lin(self) -> Floats:
        """(…, 3): v, f or p, whatever the order; read-only, no copy."""
        return self._numbers[..., :3] if self._order == "lin_ang" else self._numbers[..., 3:]

    @property
    def ang(self) -> Floats:
        """(…, 3): ω, τ or l, whatever the order; read-only, no copy."""
        return self._numbers[..., 3:] if self._order == "lin_ang" else self._numbers[..., :3]

    def in_order(self: S, order: Order) -> S:
        """The same value in that order; a copy if it is another one."""
        if _checked_order(order, type(self).__name__) == self._order:
            return self
        return self._with(_swapped(self._numbers), order=order)

    def named(self: S, frame: str | None) -> S:
        """The same numbers under another frame's name; a change of frame is `pose @ self`."""
        return self._with(self._numbers, frame=_checked_frame(frame, f"{type(self).__name__}.named"))

    def __add__(self: S, other: S) -> S:
        self._meet("+", other)
        return self._with(self._numbers + other._numbers)

    def __sub__(self: S, other: S) -> S:
        self._meet("-", other)
        return self._with(self._numbers - other._numbers)

    def __neg__(self: S) -> S:
        return self._with(-self._numbers)

    def __pos__(self: S) -> S:
        return self

    def __mul__(self: S, k: ArrayLike) -> S:
        """k: numbers, one or an array that broadcasts with the leading shape."""
        return self._with(self._numbers * _factor(self, "*", k))

    def __rmul__(self: S, k: ArrayLike) -> S:
        return self._with(self._numbers * _factor(self, "*", k, reflected=True))

    def __truediv__(self: S, k: ArrayLike) -> S:
        return self._with(self._numbers / _factor(self, "/", k))

    def __matmul__(self, other: Any) -> Any:
        _refuse(self, "@", other)

    def _labels(self) -> dict[str, Any]:
        return {"frame": self._frame, "order": self._order}

    def _with(self: S, numbers: Floats, **labels: Any) -> S:
        return _six(type(self), numbers, **(self._labels() | labels))

    def _meet(self, operation: str, other: object) -> None:
        super()._meet(operation, other)
        assert isinstance(other, _SixVector)
        _same_order(self, operation, other)

    @property
    def _linear_first(self) -> Floats:
        return self._numbers if self._order == "lin_ang" else _swapped(self._numbers)


class Twist(_SixVector):
    """Velocity (v, ω) of a body: m/s of its point at the frame's origin, rad/s.

    x: (…, 6), linear first or, with order="ang_lin", angular first.
    frame: the name of the frame in whose axes and about whose origin the numbers are; None has no name.
    Raises ValueError for other shapes and orders, TypeError for what isn't real numbers.
    """

    __slots__ = ()
    _dual = False

    @overload
    def cross(self, other: Twist | Acceleration) -> Acceleration:
        """ad(self) other, of a twist or an acceleration: an acceleration."""

    @overload
    def cross(self, other: Wrench | Momentum) -> Wrench:
        """ad*(self) other, of a momentum or a wrench: a wrench."""

    def cross(self, other: Any) -> Any:
        """The rate of change of `other` while it is carried along with this twist, in the same frame and order.

        ad(self) other for a twist or an acceleration, ad*(self) other for a momentum or a wrench (coscrews (12)).  The
        rate of a twist is an acceleration, that of a momentum a wrench; those of an acceleration and of a wrench, per
        second, keep their kind.  30 flops.
        """
        if not isinstance(other, _SixVector):
            _refuse(self, "cross", other)
        _same_frame(self, "cross", other, self._frame, other._frame)
        _same_order(self, "cross", other)
        product = ufuncs.cross_sc if other._dual else ufuncs.cross_ss
        numbers = product(self._linear_first, other._linear_first)
        return _six(Wrench if other._dual else Acceleration, _ordered(numbers, self._order), self._frame, self._order)


class Acceleration(_SixVector):
    """Spatial acceleration: the componentwise rate of a twist in a frame at rest, m/s², rad/s² (RBDA, section 2.11).

    Its linear part isn't the acceleration of a point.  Made as :class:`Twist`.
    """

    __slots__ = ()
    _dual = False


class _Coscrew(_SixVector):
    __slots__ = ()
    _dual = True

    def __matmul__(self, other: Twist) -> Floats:
        if not isinstance(other, Twist):
            _refuse(self, "@", other)
        _same_frame(self, "@", other, self._frame, other._frame)
        _same_order(self, "@", other)
        return np.asarray(ufuncs.dot_cs(self._numbers, other._numbers))[()]


class Wrench(_Coscrew):
    """Force and moment (f, τ): N, N m about the frame's origin.  Made as :class:`Twist`.

    `wrench @ twist` is their power f · v + τ · ω, W, shape (…), the same in every frame (coscrews (2)).  11 flops.
    Models take it as `external={"tool": wrench}`, where its frame is that link or has no name.
    """

    __slots__ = ()

    def on_link(self, link: str, axes: str) -> Floats:
        """The numbers (…, 6) that models take as external wrench on a link, force first.

        axes: "link" or "world", those of the numbers; the moment is about the link's origin.  Raises :class:`ksl.FrameError` for the
        wrench in another frame: its moment is about that frame's origin.
        """
        if self._frame is not None and not (axes == "link" and self._frame == link):
            wanted = f"the frame {link!r}" if axes == "link" else f"the axes of the world, about the origin of {link!r}, and no frame's name"
            raise FrameError(
                f"external[{link!r}] is {self._name()}; expected it in {wanted}: "
                f"ksl.Pose(M, to={link!r}, of={self._frame!r}) @ wrench, where M is m.relative_pose(q, {self._frame!r}, {link!r})"
            )
        return self._linear_first


class Momentum(_Coscrew):
    """Momentum and moment of momentum (p, l): N s, N m s about the frame's origin.  Made as :class:`Twist`.

    `momentum @ twist`, of one body, is twice its kinetic energy, J.
    """

    __slots__ = ()


class Inertia(_Value):
    """Inertia of a rigid body.

    mass (…), kg; com (…, 3), the centroid in the frame, m; tensor (…, 3, 3) about the centroid in the frame's axes, kg m²,
    products with their signs as matrix elements (Ixy = −∫xy dm).  See `from_numbers` for the ten numbers.
    `inertia @ twist` is the :class:`Momentum` (42 flops), `inertia @ acceleration` a :class:`Wrench`, `+` welds bodies.
    Raises ValueError for other shapes, a tensor that isn't symmetric to 1e-6, a negative mass, numbers that aren't finite.
    """

    __slots__ = ("_frame",)
    _fixed = 1
    _doors = ".numbers (10), .mass, .com, .tensor and .matrix()"

    def __init__(self, mass: ArrayLike, com: ArrayLike, tensor: ArrayLike, *, frame: str | None = None) -> None:
        m, c, I = _floats(mass, (), "Inertia mass"), _floats(com, (3,), "Inertia com"), _floats(tensor, (3, 3), "Inertia tensor")
        leading = _leading("Inertia", mass=m.shape, com=c.shape[:-1], tensor=I.shape[:-2])
        m, c, I = np.broadcast_to(m, leading), np.broadcast_to(c, (*leading, 3)), np.broadcast_to(I, (*leading, 3, 3))
        _all_or_raise(np.isfinite(m) & np.isfinite(c).all(axis=-1) & np.isfinite(I).all(axis=(-1, -2)), "Inertia", "has numbers that aren't finite")
        It = np.swapaxes(I, -1, -2)
        _all_or_raise(np.abs(I - It).max(axis=(-1, -2)) <= SYMMETRY_TOLERANCE * np.abs(I).max(axis=(-1, -2)), "Inertia tensor", "isn't symmetric")
        centroidal = np.concatenate([m[..., None], m[..., None] * c, _six_elements(0.5 * (I + It))], axis=-1)
        self._set(ufuncs.inertia_toSpatialInertia(centroidal), frame)

    @classmethod
    def from_numbers(cls, x: ArrayLike, *, frame: str | None = None) -> Inertia:
        """From (…, 10): m, hx hy hz = m × centroid, Ixx Iyy Izz Ixy Iyz Izx about the frame's **origin**.

        The layout of the C type, and of `ksl.Link`: [link.mass, *link.first_moment, *link.inertia].
        """
        inertia = cls.__new__(cls)
        inertia._set(_floats(x, (10,), "Inertia.from_numbers"), frame)
        return inertia

    def _set(self, numbers: Floats, frame: str | None) -> None:
        self._frame = _checked_frame(frame, "Inertia(frame=…)")
        _all_or_raise(np.isfinite(numbers).all(axis=-1), "Inertia", "has numbers that aren't finite")
        _all_or_raise(numbers[..., 0] >= 0, "Inertia", "has a negative mass")
        self._numbers = _frozen(numbers)

    @property
    def numbers(self) -> Floats:
        """(…, 10) as in `from_numbers`; read-only, no copy."""
        return self._numbers

    @property
    def frame(self) -> str | None:
        return self._frame

    @property
    def mass(self) -> Floats:
        """(…), kg."""
        return self._numbers[..., 0]

    @property
    def com(self) -> Floats:
        """(…, 3), the centroid, m; zero where there is no mass."""
        m = self._numbers[..., :1]
        return np.where(m > 0, self._numbers[..., 1:4] / np.where(m > 0, m, 1), 0).astype(self.dtype, copy=False)

    @property
    def tensor(self) -> Floats:
        """(…, 3, 3) about the centroid, kg m².  Loses digits where the centroid is far from the origin."""
        return _tensor(ufuncs.spatial_inertia_toInertia(self._numbers))

    @property
    def tensor_at_origin(self) -> Floats:
        """(…, 3, 3) about the frame's origin, kg m²."""
        return _tensor(self._numbers)

    def matrix(self, order: Order = "lin_ang") -> Floats:
        """(…, 6, 6): takes a twist in that order to a momentum in that order."""
        m, h = self._numbers[..., 0, None, None] * np.eye(3, dtype=self.dtype), _tilde(self._numbers[..., 1:4])
        return _blocks([[m, -h], [h, _tensor(self._numbers)]], _checked_order(order, "Inertia.matrix"))

    def named(self, frame: str | None) -> Inertia:
        """The same numbers under another frame's name; a change of frame is `pose @ self`."""
        return self._with(self._numbers, frame=_checked_frame(frame, "Inertia.named"))

    def __add__(self, other: Inertia) -> Inertia:
        """The inertia of two bodies welded together; exact up to rounding."""
        self._meet("+", other)
        return self._with(self._numbers + other._numbers)

    @overload
    def __matmul__(self, other: Twist) -> Momentum: ...
    @overload
    def __matmul__(self, other: Acceleration) -> Wrench: ...
    def __matmul__(self, other: Any) -> Any:
        if not isinstance(other, (Twist, Acceleration)):
            _refuse(self, "@", other)
        _same_frame(self, "@", other, self._frame, other._frame)
        numbers = ufuncs.product_Ms(self._numbers, other._linear_first)
        return _six(Momentum if isinstance(other, Twist) else Wrench, _ordered(numbers, other._order), other._frame, other._order)

    def _labels(self) -> dict[str, Any]:
        return {"frame": self._frame}

    def _with(self, numbers: Floats, **labels: Any) -> Inertia:
        inertia = type(self).__new__(type(self))
        inertia._numbers, inertia._frame = _frozen(numbers), labels.get("frame", self._frame)
        return inertia


class Pose(_Value):
    """Placement of frame `of` in frame `to`: D_ab = (R, t) carries coordinates of b to a, x_a = R x_b + t, m.

    matrix: (…, 4, 4) with last row 0 0 0 1; copied into the C layout, see `from_columns`.
    to, of: the frames' names a and b; both or neither.
    project: True takes the nearest rotation (singular value decomposition) instead of refusing R.
    `X_ab @ X_bc` is X_ac (63 flops); `X_ab @ value` expresses a six-vector (42 flops) or an inertia of b in a (120).
    Raises ValueError for other shapes, other last rows, an R with det R < 0 or |RᵀR − 1| > 1e-6 in any element.
    """

    __slots__ = ("_of", "_to")
    _fixed = 2
    _doors = ".matrix, .columns, .R and .t"

    def __init__(self, matrix: ArrayLike, *, to: str | None = None, of: str | None = None, project: bool = False) -> None:
        M = _floats(matrix, (4, 4), "Pose")
        last = M[..., 3, :] == np.array([0, 0, 0, 1])
        _all_or_raise(last.all(axis=-1), "Pose", "has a last row that isn't 0 0 0 1; a matrix by columns would need a transpose")
        self._set(np.ascontiguousarray(np.swapaxes(M[..., :3, :], -1, -2)), to, of, project)

    @classmethod
    def from_columns(cls, columns: ArrayLike, *, to: str | None = None, of: str | None = None, project: bool = False) -> Pose:
        """From the C layout (…, 4, 3): the three columns of R, then t.  Shares the array's memory (not with project)."""
        pose = cls.__new__(cls)
        pose._set(_floats(columns, (4, 3), "Pose.from_columns"), to, of, project)
        return pose

    @classmethod
    def from_Rt(cls, R: ArrayLike, t: ArrayLike, *, to: str | None = None, of: str | None = None, project: bool = False) -> Pose:
        """From R (…, 3, 3) and t (…, 3), m."""
        r, p = _floats(R, (3, 3), "Pose R"), _floats(t, (3,), "Pose t")
        leading = _leading("Pose", R=r.shape[:-2], t=p.shape[:-1])
        columns: Floats = np.empty((*leading, 4, 3), np.result_type(r, p))
        columns[..., :3, :], columns[..., 3, :] = np.swapaxes(r, -1, -2), p
        return cls.from_columns(columns, to=to, of=of, project=project)

    @classmethod
    def from_rpy(cls, xyz: ArrayLike = (0.0, 0.0, 0.0), rpy: ArrayLike = (0.0, 0.0, 0.0), *, to: str | None = None, of: str | None = None) -> Pose:
        """From t = xyz (…, 3), m, and rpy (…, 3): roll, pitch, yaw, rad, about the fixed axes x, y, z in this order, as `<origin>` of URDF.

        R = Rz(yaw) Ry(pitch) Rx(roll).

            X = ksl.Pose.from_rpy((0, 0, 0.1), (0, 0, 1.5708), to="flange", of="tool")
        """
        return cls._turned(rotation_of_rpy, xyz, rpy, 3, "rpy", to, of)

    @classmethod
    def from_quaternion(
        cls, xyz: ArrayLike = (0.0, 0.0, 0.0), quaternion: ArrayLike = (0.0, 0.0, 0.0, 1.0), *, to: str | None = None, of: str | None = None
    ) -> Pose:
        """From t = xyz (…, 3), m, and a unit quaternion (…, 4), **x, y, z, w**: `np.roll(q, -1, axis=-1)` of one with w first.

        It is normalised; raises ValueError where its length is not 1 within 1e-2.

            X = ksl.Pose.from_quaternion((0, 0, 0.1), (0, 0, 0.7071, 0.7071), to="flange", of="tool")
        """
        return cls._turned(rotation_of_quaternion, xyz, quaternion, 4, "quaternion", to, of)

    @classmethod
    def _turned(cls, rotation: Callable[[Floats], Floats], xyz: ArrayLike, turn: ArrayLike, count: int, what: str, to: str | None, of: str | None) -> Pose:
        t, given = _floats(xyz, (3,), "Pose xyz"), _floats(turn, (count,), f"Pose {what}")
        _all_or_raise(np.isfinite(given).all(axis=-1), f"Pose {what}", "has numbers that aren't finite")
        try:
            R = rotation(given.astype(np.float64)).astype(given.dtype)
        except ValueError as error:
            raise ValueError(f"Pose: {error}") from None
        return cls.from_Rt(R, t, to=to, of=of)

    @classmethod
    def identity(cls, *, to: str | None = None, of: str | None = None, dtype: DTypeLike = np.float64) -> Pose:
        """Frame `of` where frame `to` is."""
        return cls.from_columns(np.eye(4, 3, dtype=dtype), to=to, of=of)

    @classmethod
    def exp(cls, twist: Twist) -> Pose:
        """The displacement (…) of a body that moves for unit time with that constant twist; from its frame to its frame.

        Error below (8 + |ω|) u of R and, relative to |v|, of t, for |ω| ≤ π.  96 flops, a root, 2 sines.
        """
        if not isinstance(twist, Twist):
            raise TypeError(f"Pose.exp of {_name_of(twist)}; expected a Twist")
        return cls._made(ufuncs.SE3_exp(twist._linear_first), twist._frame, twist._frame)

    def log(self, order: Order = "lin_ang") -> Twist:
        """The twist of smallest |ω| ≤ π whose exponential is this pose; at π either of the two.

        Its own numbers are the same in both frames; it is given in frame `to`.  83 flops, a root, an arctangent.
        """
        numbers = ufuncs.SE3_log(self._numbers)
        return _six(Twist, _ordered(numbers, _checked_order(order, "Pose.log")), self._to, order)

    def inv(self) -> Pose:
        """D_ba = (Rᵀ, −Rᵀ t).  15 flops."""
        return self._made(ufuncs.SE3_inverted(self._numbers), self._of, self._to)

    @property
    def to(self) -> str | None:
        return self._to

    @property
    def of(self) -> str | None:
        return self._of

    @property
    def matrix(self) -> Floats:
        """(…, 4, 4), a copy."""
        M: Floats = np.zeros((*self.shape, 4, 4), self.dtype)
        M[..., :3, :] = np.swapaxes(self._numbers, -1, -2)
        M[..., 3, 3] = 1
        return M

    def array_in(self, to: str | None = None) -> Floats:
        """(…, 4, 4), as calls of models take poses.  Raises :class:`ksl.FrameError` for the pose in a frame of another name than `to`, unless it has none."""
        if self._to is not None and to is not None and self._to != to:
            raise FrameError(f"{self._name()} is given in {_frame(self._to)}; expected it in {_frame(to)}")
        return self.matrix

    @property
    def columns(self) -> Floats:
        """(…, 4, 3): the three columns of R, then t; read-only, no copy."""
        return self._numbers

    @property
    def R(self) -> Floats:
        """(…, 3, 3); read-only, no copy."""
        return np.swapaxes(self._numbers[..., :3, :], -1, -2)

    @property
    def t(self) -> Floats:
        """(…, 3), m; read-only, no copy."""
        return self._numbers[..., 3, :]

    def named(self, to: str | None, of: str | None) -> Pose:
        """The same numbers under other frames' names."""
        return self._made(self._numbers, *_checked_frames(to, of))

    def Ad(self, order: Order = "lin_ang") -> Floats:
        """(…, 6, 6) [R t̃R; 0 R]: takes twists of frame `of` in that order to frame `to` (coscrews (3))."""
        zero, tR = np.zeros_like(self.R), _tilde(self.t) @ self.R
        return _blocks([[self.R, tR], [zero, self.R]], _checked_order(order, "Pose.Ad"))

    def CoAd(self, order: Order = "lin_ang") -> Floats:
        """(…, 6, 6) [R 0; t̃R R] = Ad⁻ᵀ: takes wrenches of frame `of` in that order to frame `to` (coscrews (6))."""
        zero, tR = np.zeros_like(self.R), _tilde(self.t) @ self.R
        return _blocks([[self.R, zero], [tR, self.R]], _checked_order(order, "Pose.CoAd"))

    @overload
    def __matmul__(self, other: Pose) -> Pose: ...
    @overload
    def __matmul__(self, other: S) -> S: ...
    @overload
    def __matmul__(self, other: Inertia) -> Inertia: ...
    def __matmul__(self, other: Any) -> Any:
        if isinstance(other, Pose):
            _same_frame(self, "@", other, self._of, other._to)
            return self._made(ufuncs.product_dd(self._numbers, other._numbers), self._to, other._of)
        if isinstance(other, _SixVector):
            _same_frame(self, "@", other, self._of, other._frame)
            # a twist with its halves swapped transforms like a wrench, and vice versa
            dual = other._dual == (other._order == "lin_ang")
            return other._with((ufuncs.product_CoAdc if dual else ufuncs.product_Ads)(self._numbers, other._numbers), frame=self._to)
        if isinstance(other, Inertia):
            _same_frame(self, "@", other, self._of, other._frame)
            return other._with(ufuncs.spatial_inertia_transformed(other._numbers, self._numbers), frame=self._to)
        _refuse(self, "@", other)

    def _shown(self) -> Floats:
        return self.matrix

    def _labels(self) -> dict[str, Any]:
        return {"to": self._to, "of": self._of}

    def _with(self, numbers: Floats, **labels: Any) -> Pose:
        return self._made(numbers, self._to, self._of)

    @classmethod
    def _made(cls, numbers: Floats, to: str | None, of: str | None) -> Pose:
        pose = cls.__new__(cls)
        pose._numbers, pose._to, pose._of = _frozen(numbers), to, of
        return pose

    def _set(self, columns: Floats, to: str | None, of: str | None, project: bool) -> None:
        self._to, self._of = _checked_frames(to, of)
        _all_or_raise(np.isfinite(columns).all(axis=(-1, -2)), "Pose", "has numbers that aren't finite")
        C = columns[..., :3, :].astype(np.float64, copy=False)
        if project:
            _all_or_raise(np.linalg.det(C) > 0, "Pose", "has det R ≤ 0, so no nearest rotation; are its axes left-handed?")
            u, _, vt = np.linalg.svd(C)
            columns = columns.copy()
            columns[..., :3, :] = u @ vt
        else:
            off = np.abs(C @ np.swapaxes(C, -1, -2) - np.eye(3)).max(axis=(-1, -2))
            right_handed = np.linalg.det(C) > 0
            fault = f"isn't a rotation: |RᵀR − 1| is {off.max(initial=0):.3g}, det R {'> 0' if right_handed.all() else '< 0: left-handed axes?'}"
            mend = f"{ROTATION_TOLERANCE:g} is tolerated, project=True takes the nearest rotation"
            _all_or_raise((off <= ROTATION_TOLERANCE) & right_handed, "Pose", f"{fault}; {mend}")
        self._numbers = _frozen(columns)


def _six(kind: type[S], numbers: Floats, frame: str | None, order: Order) -> S:
    value = kind.__new__(kind)
    value._numbers, value._frame, value._order = _frozen(numbers), frame, order
    return value


def _frozen(x: Floats) -> Floats:
    view = np.asarray(x)[...]
    view.flags.writeable = False
    return view


def _swapped(x: Floats) -> Floats:
    return np.concatenate([x[..., 3:], x[..., :3]], axis=-1)


def _ordered(linear_first: Floats, order: Order) -> Floats:
    return linear_first if order == "lin_ang" else _swapped(linear_first)


def _tensor(inertia: Floats) -> Floats:
    """The symmetric matrix (…, 3, 3) in the last six of ten numbers, Ixx Iyy Izz Ixy Iyz Izx."""
    xx, yy, zz, xy, yz, zx = range(4, 10)
    return inertia[..., [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]]


def _six_elements(tensor: Floats) -> Floats:
    """Ixx Iyy Izz Ixy Iyz Izx (…, 6) of a symmetric matrix."""
    return tensor[..., [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]


def _tilde(v: Floats) -> Floats:
    """ṽ, (…, 3, 3): ṽ w = v × w."""
    out: Floats = np.zeros((*v.shape, 3), v.dtype)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., j, i], out[..., i, j] = v[..., k], -v[..., k]
    return out


def _blocks(blocks: list[list[Floats]], order: Order) -> Floats:
    """(…, 6, 6) of four blocks, linear first, in either order."""
    if order == "ang_lin":
        blocks = [row[::-1] for row in blocks[::-1]]
    return np.concatenate([np.concatenate(row, axis=-1) for row in blocks], axis=-2)


def _floats(x: ArrayLike, fixed: tuple[int, ...], what: str) -> Floats:
    """Converts to an array (…, *fixed) of float32 or float64, without a copy if it is one."""
    if isinstance(x, _Value):
        raise TypeError(f"{what} of {x._name()}; expected numbers: {x._doors}")
    try:
        a = np.asarray(x)
    except ValueError as error:
        raise ValueError(f"{what}: {error}") from None
    if isinstance(x, np.ma.MaskedArray):
        raise TypeError(f"{what} is a masked array; expected real numbers: .filled() or .compressed() take those that are meant")
    if a.dtype.kind not in "fiub":
        raise TypeError(f"{what} of dtype {a.dtype}; expected real numbers")
    if a.ndim < len(fixed) or a.shape[a.ndim - len(fixed) :] != fixed:
        raise ValueError(f"{what} has shape {a.shape}; expected {_shape(fixed)}")
    return a if a.dtype in (np.float32, np.float64) and a.dtype.isnative else a.astype(np.float64)


def _shape(fixed: tuple[int, ...]) -> str:
    return f"(…, {', '.join(map(str, fixed))})" if fixed else "(…)"


def _leading(what: str, **shapes: tuple[int, ...]) -> tuple[int, ...]:
    try:
        return np.broadcast_shapes(*shapes.values())
    except ValueError:
        raise ValueError(f"{what}: leading shapes don't broadcast: {', '.join(f'{k} {s}' for k, s in shapes.items())}") from None


def _all_or_raise(fine: NDArray[np.bool_] | np.bool_, what: str, fault: str) -> None:
    if not np.all(fine):
        first = np.argwhere(~np.asarray(fine))[0].tolist()
        raise ValueError(f"{what}{first or ''} {fault}")


def _factor(value: _SixVector, operation: str, k: ArrayLike, reflected: bool = False) -> Any:
    """Converts k to a factor for (…, 6).  A Python number doesn't change the dtype."""
    if type(k) in (int, float):
        return k
    if isinstance(k, _Value) or np.asarray(k).dtype.kind not in "fiub":
        _refuse(*((k, operation, value) if reflected else (value, operation, k)))
    factor = _floats(k, (), "factor")
    _leading(f"{_name_of(value)} {operation} {_name_of(k)}", left=value.shape, right=factor.shape)
    return factor[..., None]


def _checked_order(order: Any, what: str) -> Order:
    if order not in ("lin_ang", "ang_lin"):
        raise ValueError(f"{what}: order={order!r}; {near_names(order, ('lin_ang', 'ang_lin'))}expected 'lin_ang' (linear first) or 'ang_lin'")
    return order  # type: ignore[no-any-return]


def _checked_frame(frame: Any, what: str) -> str | None:
    if frame is not None and not isinstance(frame, str):
        raise TypeError(f"{what}: a frame's name is a string or None, found {frame!r}")
    if frame == "":
        raise ValueError(f"{what}: a frame's name is empty; None is no name")
    return frame


def _checked_frames(to: Any, of: Any) -> tuple[str | None, str | None]:
    if (to is None) != (of is None):
        raise ValueError(f"Pose(to={to!r}, of={of!r}): name both frames or neither")
    return _checked_frame(to, "Pose(to=…)"), _checked_frame(of, "Pose(of=…)")


def _name_of(x: object) -> str:
    if isinstance(x, _Value):
        return x._name()
    return f"array of shape {x.shape}" if isinstance(x, np.ndarray) else f"{type(x).__name__} {x!r}"


def _same_frame(a: _Value, operation: str, b: _Value, left: str | None, right: str | None) -> None:
    """Refuses two frames that differ, and leading shapes that don't broadcast."""
    if left != right:
        mend = "; .named(…) names it" if left is None or right is None else ""
        raise FrameError(f"{a._name()} {operation} {b._name()}: {_frame(left)} meets {_frame(right)}{mend}")
    _leading(f"{a._name()} {operation} {b._name()}", left=a.shape, right=b.shape)


def _frame(name: str | None) -> str:
    return "a frame without a name" if name is None else f"frame {name!r}"


def _same_order(a: _SixVector, operation: str, b: _SixVector) -> None:
    if a._order != b._order:
        raise ValueError(
            f"{type(a).__name__}(order={a._order!r}) {operation} {type(b).__name__}(order={b._order!r}): the orders differ; "
            f"convert one with .in_order({a._order!r})"
        )


_MEANT = {
    "@": "Pose @ any kind, Wrench @ Twist, Momentum @ Twist, Inertia @ Twist, Inertia @ Acceleration",
    "+": "two six-vectors, or two inertias, of one kind",
    "-": "two six-vectors of one kind",
    "*": "a six-vector and numbers",
    "/": "a six-vector and numbers",
    "cross": "Twist.cross of a Twist, Acceleration, Wrench or Momentum",
    "allclose": "two values of one kind",
}


def _refuse(a: object, operation: str, b: object) -> NoReturn:
    raise TypeError(f"{_name_of(a)} {operation} {_name_of(b)} has no meaning; {operation} is for {_MEANT[operation]}")
