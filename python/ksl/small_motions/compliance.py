"""Compliances of frames, and where frames are off under the loads of a motion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.finite_results import require_finite
from ksl.mechanism.calls import Calls
from ksl.mechanism.gear_classes import has_classes
from ksl.mechanism.loops import one_position
from ksl.mechanism.requests import core_of, one_of
from ksl.mechanism.states import Array, External, ExternalAxes, argument_rows, items_of, leading_shape
from ksl.mechanism.stiffness import Flexibility, Stiffnesses, flexibilities_of, steady_motion, table_of
from ksl.small_motions.directions import floats, has_motor, spring_load
from ksl.small_motions.elastic import Elastic, elastic, falls, flexibilities

Axes = Literal["frame", "world"]
By = Literal["frame", "joint"]
WEAK = 1e-12
"""Stiffnesses below it, relative to the largest of unit displacements, are zero."""


@np.errstate(over="ignore", invalid="ignore")  # what is not finite is an error at the end
def compliance(model: Calls, q: ArrayLike, frame: str, stiffness: Stiffnesses | None = None, axes: Axes = "frame") -> Array:
    """See :meth:`ksl.Model.compliance`."""
    link = model.frame_link(frame)
    at = one_position(model, q)
    body = elastic(model, at, flexibilities(model, table_of(model, stiffness), at))
    J = _twists(body, link, axes)
    C = J @ _given_way(body, J.T)
    return (C + C.T) / 2


@np.errstate(over="ignore", invalid="ignore")  # what is not finite is an error at the end
def deflection(
    model: Calls, q: ArrayLike, v: ArrayLike, a: ArrayLike, frame: str, stiffness: Stiffnesses | None = None, external: External | None = None,
    axes: Axes = "frame", by: By = "frame", external_axes: ExternalAxes = "link",
) -> Array:  # fmt: skip
    """See :meth:`ksl.Model.deflection`."""
    link = model.frame_link(frame)
    one_of(by, "by", "frame", "joint")
    one_of(axes, "axes", "frame", "world")
    given = table_of(model, stiffness)
    flexible = flexibilities(model, given)
    if name := falls(model, flexible):
        raise ValueError(f"{name} holds nothing, so that no frame is off by a certain way: give {name} a stiffness, or use with_frozen_joints")
    arrays = {name: argument_rows(x, name, columns, core_of(model)) for name, x, columns in (("q", q, model.nq), ("v", v, model.nv), ("a", a, model.nv))}
    wrenches = {name: argument_rows(x, f"external[{name!r}]", 6, core_of(model)) for name, x in items_of(external, external_axes)}
    leading = leading_shape({**arrays, **wrenches})
    names = [*(joint.name for joint in model.joints), *model.loop_names]
    through = np.asarray(model.reactions(q, v, a, external, joints=names, external_axes=external_axes))
    poses = np.broadcast_to(arrays["q"], (*leading, model.nq)).reshape(math.prod(leading), model.nq)
    through = np.broadcast_to(through, (*leading, *through.shape[-2:])).reshape(len(poses), *through.shape[-2:])
    gears = given if given is not None and has_classes(given) else None
    at_load = (flexible if gears is None else flexibilities_of(model, gears, _efforts(model, x, f), "twist") for x, f in zip(poses, through))
    out = np.array([_of_state(model, x, f, link, each, axes, by) for x, f, each in zip(poses, through, at_load)])
    shape = (6,) if by == "frame" else (len(model.joints), 2, 6)
    return out.reshape(*leading, *shape)


def _efforts(model: Calls, q: Array, through: Array) -> dict[str, float]:
    """What twists the gears of joints with one coordinate, of wrenches (joints and loops, 6): what they transmit and what springs beside them take, of leaders also what their followers do."""
    found = {
        joint.name: float((steady_motion(joint).T @ f)[0]) + spring_load(model, joint, q) for joint, f in zip(model.joints, through) if joint.one_coordinate
    }
    leaders = [(joint.leader, joint.multiplier * found[joint.name]) for joint in model.joints if joint.leader is not None]
    for leader, effort in leaders:
        found[leader] += effort
    return found


def _of_state(model: Calls, q: Array, through: Array, link: int, flexible: Mapping[str, Flexibility], axes: Axes, by: By) -> Array:
    """The displacement (6) of a link under wrenches (joints and loops, 6), or the shares (joints, 2, 6) of the joints in it."""
    body = elastic(model, q, flexible)
    to = body.to
    loads = -np.einsum("id,di->d", to.column, through[to.joint]) @ to.factors - to.pull  # springs of the physics carry their share already
    passive = np.array([not has_motor(model, joint) and not floats(joint) for joint in model.joints])
    loads[to.along & passive[to.owner]] = 0.0  # and so do dampers where no motor is
    for loop, wrench in zip(body.loops, through[len(model.joints) :]):
        loads -= loop.displacement.T @ wrench @ to.factors
    u = _given_way(body, loads[:, None])[:, 0]
    moved = _twists(body, link, axes) * u
    if by == "frame":
        total: Array = moved.sum(axis=1)
        return total
    shares = np.zeros((len(model.joints), 2, 6))
    for joint, along, x in zip(to.owner, to.along, moved.T):
        shares[joint, 0 if along else 1] += x
    return shares


def _twists(body: Elastic, link: int, axes: Axes) -> Array:
    """(6, n): of a link at its origin."""
    J = body.to.twists[link] @ body.to.factors
    if one_of(axes, "axes", "frame", "world") == "world":
        R = body.to.pose[link, :3, :3]
        J = np.vstack([R @ J[:3], R @ J[3:]])
    return np.asarray(J)


def _given_way(body: Elastic, loads: Array) -> Array:
    """Displacements (n, k) under loads (n, k), which the springs balance.  Raises ValueError where nothing resists a load."""
    N = body.closed
    K, F = N.T @ (body.springs + body.elements[2]) @ N, N.T @ loads
    for what, x in (("stiffness", K), ("load", F)):
        require_finite("displacements", what, x)
    size = np.sqrt(np.diag(K))
    scale = 1 / np.where(size > 0, size, 1.0)
    values, V = np.linalg.eigh(K * np.outer(scale, scale))
    weak = values <= WEAK * values.max(initial=0.0)
    parts = V.T @ (scale[:, None] * F)
    most = np.abs(scale[:, None] * F).max(initial=0.0)
    if (np.abs(parts[weak]) > 1e-9 * most).any():
        pushed = np.flatnonzero(weak)[np.argmax(np.abs(parts[weak]).max(axis=1))]
        names = body.names(N @ (scale * V[:, pushed]))
        raise ValueError(
            f"{', '.join(names)}: the stiffnesses leave a motion that nothing resists, under a load; give one of these joints a stiffness along its motion"
        )
    found: Array = N @ (scale[:, None] * (V[:, ~weak] @ (parts[~weak] / values[~weak][:, None])))
    return found
