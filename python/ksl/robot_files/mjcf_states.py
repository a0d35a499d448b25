"""States in MuJoCo's layout, for models that were read from MJCF.

Positions, velocities, accelerations and efforts differ from KSL's for free and planar joints, for quaternions, and for joints that follow others.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl.base.rotations import quaternion_of, quaternion_product
from ksl.mechanism.requests import core_of
from ksl.mechanism.states import in_order
from ksl.model.model import Layout, Model, layout_of

Array = NDArray[np.float64]


class MujocoState(NamedTuple):
    """A state in MuJoCo's layout, or in KSL's; None for what was not given."""

    q: Array
    v: Array | None
    a: Array | None
    tau: Array | None


def to_mujoco(model: Model, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None, tau: ArrayLike | None = None) -> MujocoState:
    """qpos (…, nq), qvel (…, nv), qacc (…, nv) and forces (…, nv) in MuJoCo's layout, for a model that was read from MJCF.

    q (…, nq), v, a and tau (…, nv): as KSL has them.  They differ from MuJoCo's where a joint is

    * free: MuJoCo's position is that of the body in the world, KSL's is relative to the pose that the file gives the body; MuJoCo's
      linear velocity, its derivative and the force are in world axes, KSL's in the body's;
    * a ball: the quaternion is [w x y z] in MuJoCo, [x y z w] in KSL;
    * planar: MuJoCo's velocity is along the parent's axes, KSL's along the child's;
    * cylindrical: the order is the file's in MuJoCo, angle and travel in KSL;
    * a follower (an equality constraint of two joints): KSL has no numbers for it.  Its force in MuJoCo's layout is zero, since the effort of its
      leader holds both.
    """
    return _converted(model, True, q, v, a, tau)


def from_mujoco(model: Model, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None, tau: ArrayLike | None = None) -> MujocoState:
    """The inverse of :func:`to_mujoco`: from qpos (…, nq), qvel, qacc and forces (…, nv) to KSL's q, v, a and tau."""
    return _converted(model, False, q, v, a, tau)


def _converted(model: Model, to: bool, q: ArrayLike, v: ArrayLike | None, a: ArrayLike | None, tau: ArrayLike | None) -> MujocoState:
    layout = layout_of(model)
    if layout is None:
        raise ValueError(f"{model.name}: the model has no layout of MuJoCo: it was not read from MJCF, or was made from one that was")
    sizes = (layout["nq"], layout["nv"]) if not to else (model.nq, model.nv)

    def rows(x: ArrayLike, n: int, name: str) -> Array:
        return _rows(in_order(x, name, core_of(model)) if to else x, n, name)

    given_q, out_q = rows(q, sizes[0], "q"), (layout["nq"] if to else model.nq)
    out_v = layout["nv"] if to else model.nv
    rates = {name: rows(x, sizes[1], name) for name, x in (("v", v), ("a", a), ("tau", tau)) if x is not None}
    if "a" in rates and "v" not in rates:
        raise ValueError("a is given without v; accelerations of free and planar joints need both")
    leading = np.broadcast_shapes(given_q.shape[:-1], *(x.shape[:-1] for x in rates.values()))
    given_q = np.broadcast_to(given_q, leading + given_q.shape[-1:])
    new_q = np.empty(leading + (out_q,))
    new = {name: np.empty(leading + (out_v,)) for name in rates}
    for joint in model.joints[: len(model.joint_names)]:
        entry = layout["joints"][joint.name]
        own_q, own_v = list(range(joint.q_index, joint.q_index + joint.nq)), list(range(joint.v_index, joint.v_index + joint.nv))
        from_q, to_q, from_v, to_v = (own_q, entry["q"], own_v, entry["v"]) if to else (entry["q"], own_q, entry["v"], own_v)
        position = given_q[..., from_q]
        old = {name: np.broadcast_to(x, leading + x.shape[-1:])[..., from_v] for name, x in rates.items()}
        convert = {"free": _free, "ball": _ball, "planar": _planar}.get(entry["kind"], lambda _e, _to, p, r: (p, r))
        new_q[..., to_q], converted = convert(entry, to, position, old)
        for name, x in converted.items():
            new[name][..., to_v] = x
    for q_index, v_index, at in layout.get("held", []) if to else ():
        new_q[..., q_index] = at
        for x in new.values():
            x[..., v_index] = 0.0
    for name in model.follower_names if to else ():
        follower = model.joint(name)
        leader, entry = model.joint(follower.leader or ""), layout["joints"][name]
        new_q[..., entry["q"]] = follower.multiplier * given_q[..., [leader.q_index]] + follower.offset
        for rate, x in new.items():
            own = np.broadcast_to(rates[rate], leading + (model.nv,))[..., [leader.v_index]]
            x[..., entry["v"]] = 0.0 if rate == "tau" else follower.multiplier * own
    return MujocoState(new_q, new.get("v"), new.get("a"), new.get("tau"))


def _rows(x: ArrayLike, n: int, name: str) -> Array:
    rows = np.asarray(x, dtype=float)
    if rows.ndim == 0 or rows.shape[-1] != n:
        raise ValueError(f"{name} has shape {rows.shape}; expected (…, {n})")
    return rows


_Rates = dict[str, Array]


def _ball(_: Layout, to: bool, q: Array, rates: _Rates) -> tuple[Array, _Rates]:
    return (q[..., [3, 0, 1, 2]] if to else q[..., [1, 2, 3, 0]]), rates


def _free(entry: Layout, to: bool, q: Array, rates: _Rates) -> tuple[Array, _Rates]:
    """KSL: pose in the joint's frame, quaternion last, linear velocity in the body's axes; MuJoCo: in the world's, quaternion first."""
    placement = np.array(entry["placement"])
    R, t = placement[:3, :3], placement[:3, 3]
    turn = quaternion_of(R)
    if to:
        own = q[..., 3:] / np.linalg.norm(q[..., 3:], axis=-1, keepdims=True)
        wxyz = quaternion_product(turn, own)[..., [3, 0, 1, 2]]
        new_q = np.concatenate([q[..., :3] @ R.T + t, wxyz], axis=-1)
    else:
        wxyz = q[..., 3:] / np.linalg.norm(q[..., 3:], axis=-1, keepdims=True)
        own = quaternion_product(turn * [-1, -1, -1, 1], wxyz[..., [1, 2, 3, 0]])
        new_q = np.concatenate([(q[..., :3] - t) @ R, own], axis=-1)
    x, y, z, w = np.moveaxis(wxyz[..., [1, 2, 3, 0]], -1, 0)
    u, w = np.stack([x, y, z], axis=-1), w[..., None]

    def turned(p: Array, sign: float) -> Array:
        """Into world axes, or back with sign −1."""
        c = 2 * np.cross(u, p)
        return np.asarray(p + sign * w * c + np.cross(u, c))

    return new_q, _linear_parts(to, rates, lambda p: turned(p, 1.0), lambda p: turned(p, -1.0), lambda r: r[..., 3:], 3)


def _planar(_: Layout, to: bool, q: Array, rates: _Rates) -> tuple[Array, _Rates]:
    c, s = np.cos(q[..., 2]), np.sin(q[..., 2])

    def turned(p: Array, sign: float) -> Array:
        x, y = p[..., 0], p[..., 1]
        return np.stack([c * x - sign * s * y, sign * s * x + c * y], axis=-1)

    return q, _linear_parts(to, rates, lambda p: turned(p, 1.0), lambda p: turned(p, -1.0), lambda r: r[..., 2:], 2)


def _linear_parts(to: bool, rates: _Rates, out: Any, back: Any, angular: Any, n: int) -> _Rates:
    """The first n numbers from the child's axes to those that stand (`out`), or `back`; those after them are the same.

    With R the child's axes: v' = R v, a' = R (a + ω × v), and forces as velocities.
    """

    def spin(v: Array) -> Array:
        """ω × v in the child's axes."""
        linear, w = v[..., :n], angular(v)
        if n == 3:
            return np.cross(w, linear)
        return np.stack([-w[..., 0] * linear[..., 1], w[..., 0] * linear[..., 0]], axis=-1)

    new = {}
    for name, x in rates.items():
        linear = x[..., :n]
        if name == "a" and to:
            linear = out(linear + spin(rates["v"]))
        elif name == "a":
            own_v = np.concatenate([back(rates["v"][..., :n]), angular(rates["v"])], axis=-1)
            linear = back(linear) - spin(own_v)
        else:
            linear = out(linear) if to else back(linear)
        new[name] = np.concatenate([linear, x[..., n:]], axis=-1)
    return new
