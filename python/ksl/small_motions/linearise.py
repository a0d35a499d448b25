"""Linear models about states of trees and closed mechanisms."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.errors import near_names
from ksl.mechanism import given
from ksl.base.finite_results import require_finite
from ksl.mechanism.calls import Calls
from ksl.mechanism.joint_kinds import columns_of
from ksl.mechanism.loops import one_position, one_row
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.states import Array
from ksl.small_motions.directions import floats
from ksl.model.linear_model import LinearModel
from ksl.small_motions.tangents import Tangent, tangent

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
AT_REST = 1e-9
"""rad, m or of the efforts: a state that is at rest but for so much is an equilibrium."""


@np.errstate(over="ignore", invalid="ignore")  # what is not finite is an error at the end
def linearise(
    model: Calls, q: ArrayLike, v: ArrayLike | None = None, tau: ArrayLike | None = None, inputs: Iterable[str] | None = None, outputs: Iterable[str] = ()
) -> LinearModel:
    """See :meth:`ksl.Model.linearise`."""
    at = one_position(model, q)
    speeds, efforts = one_row(model, v, "v"), one_row(model, tau, "tau")
    driven, names = _inputs(model, inputs)
    about = tangent(model, at, speeds, efforts, driven)
    wanted = given.names(outputs, "outputs")
    rows = [_output(model, about, name) for name in wanted]
    n, own = about.free, about.independent
    A = np.zeros((2 * n, 2 * n))
    A[:n, :n], A[:n, n:] = -about.turning[own], np.eye(n)
    A[n:, :n], A[n:, n:] = about.acceleration_by_q[own], about.acceleration_by_v[own]
    B = np.vstack([np.zeros((n, len(driven))), about.acceleration_by_tau[own]])
    rate = np.concatenate([speeds[own], about.acceleration[own]])
    rest = bool(np.abs(rate).max(initial=0.0) <= AT_REST * max(1.0, np.abs(A).max(initial=0.0), float((np.abs(B) @ np.abs(efforts[driven])).max(initial=0.0))))
    for what, x in (("A", A), ("B", B), ("rate", rate)):
        require_finite("linearise", what, x)
    C = np.array([row[1] for row in rows]).reshape(len(rows), 2 * n)
    D = np.array([row[2] for row in rows]).reshape(len(rows), len(driven))
    return LinearModel(A, B, C, D, rate, tuple(_coordinates(model)[i] for i in own), names, tuple(wanted), rest, np.array([row[0] for row in rows]))


def _coordinates(model: Calls) -> list[str]:
    """Names (nv) of coordinates: the joint's, or of joints with several those of their velocities."""
    found = []
    for joint in model.joints:
        if joint.nv:
            found += [joint.name] if joint.nv == 1 else columns_of(joint)[1]
    return found


def _inputs(model: Calls, inputs: Iterable[str] | None) -> tuple[list[int], tuple[str, ...]]:
    """Indices into tau of the inputs, and their names: those of joints, or of joints with several coordinates as `linearise` names these."""
    known = _coordinates(model)
    if inputs is None:
        if model.loops and model.drives is None:
            raise ValueError("inputs: the robot has loops and names no drives; say which joints have motors: inputs=, or with_drives")
        motors = [joint.name for joint in model.joints if joint.nv and (not floats(joint) if model.drives is None else joint.name in model.drives)]
    else:
        motors = given.names(inputs, "inputs")
    found: list[int] = []
    for name in motors:
        if name in known:
            found.append(known.index(name))
            continue
        joint = model.joint(name)
        if not joint.nv:
            raise ValueError(f"inputs: joint {joint.name} has no coordinates of its own; inputs are {', '.join(known)}")
        found += range(joint.v_index, joint.v_index + joint.nv)
    if len(set(found)) < len(found):
        raise ValueError(f"inputs: {', '.join(motors)} name a coordinate twice; name it once")
    return found, tuple(known[k] for k in found)


Row = tuple[float, Array, Array]
"""An output at the state, and its derivatives by x and u."""


def _output(model: Calls, about: Tangent, name: str) -> Row:
    """The output that a column names: JOINT, JOINT.v, JOINT.a, or JOINT.fx … .tz."""
    known: dict[str, tuple[str, Joint, int]] = {}
    for joint in model.joints:
        if joint.one_coordinate:
            known |= {column: (role, joint, 0) for role, (column,) in zip("qva", columns_of(joint))}
        elif joint.nv:
            known |= {column: (role, joint, k) for role, columns in zip("va", columns_of(joint)[1:]) for k, column in enumerate(columns)}
    if name in known:
        role, joint, k = known[name]
        return _of_coordinate(model, about, role, joint, k)
    joint_name, dot, component = name.rpartition(".")
    wrenches = [*(joint.name for joint in model.joints), *model.loop_names]
    if component in WRENCH and joint_name in wrenches:
        return _of_wrench(model, about, joint_name, WRENCH.index(component))
    near = near_names(name, [*known, *(f"{joint}.{component or 'fx'}" for joint in wrenches)])
    raise ValueError(f"outputs: {name!r} is no column; {near}columns are JOINT, JOINT.v, JOINT.a, and JOINT.fx, .fy, .fz, .tx, .ty, .tz of wrenches")


def _of_coordinate(model: Calls, about: Tangent, role: str, joint: Joint, k: int) -> Row:
    leader = joint if joint.leader is None else model.joint(joint.leader)
    factor = 1.0 if joint.leader is None else joint.multiplier
    i = leader.v_index + k
    nothing, none = np.zeros(about.free), np.zeros(about.acceleration_by_tau.shape[1])
    if role == "q":
        return float(model.position_of(joint, about.q)), factor * np.concatenate([about.closed[i], nothing]), none
    if role == "v":
        return factor * about.v[i], factor * np.concatenate([about.velocity_by_q[i], about.closed[i]]), none
    by_x = np.concatenate([about.acceleration_by_q[i], about.acceleration_by_v[i]])
    return factor * about.acceleration[i], factor * by_x, factor * about.acceleration_by_tau[i]


def _of_wrench(model: Calls, about: Tangent, joint: str, component: int) -> Row:
    state = (about.q, about.v, about.acceleration)
    value = np.asarray(model.reactions(*state, joints=[joint]))[0, component]
    by_q, by_v, by_a = (np.asarray(x)[0, component] for x in model.reactions_derivatives(*state, joints=[joint], undetermined="nan"))
    if np.isnan(by_q).any():
        raise ValueError(f"outputs: {joint}.{WRENCH[component]} is not determined by rigid bodies; leave it out, or take joints that bear less")
    own = about.independent
    by_x = np.concatenate([by_q + by_a @ about.acceleration_by_q[own], by_v + by_a @ about.acceleration_by_v[own]])
    return float(value), by_x, by_a @ about.acceleration_by_tau[own]
