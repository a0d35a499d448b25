"""What placement means, written out: six-vectors linear first, as KSL's are."""

import numpy as np

from newton_euler import in_plane, skew, turn


def coadjoint(R, p) -> np.ndarray:
    """(…, 6, 6): takes wrenches, force first, from a frame with rotation R and origin p into the frame that sees them so."""
    R, p = np.asarray(R, dtype=float), np.asarray(p, dtype=float)
    X = np.zeros((*np.broadcast_shapes(R.shape[:-2], p.shape[:-1]), 6, 6))
    X[..., :3, :3] = X[..., 3:, 3:] = R
    X[..., 3:, :3] = skew(p) @ R
    return X


def requested(m, q, joint, at="joint", axes="joint") -> np.ndarray:
    """The coadjoint (n, 6, 6) from a joint's frame to the point `at` and the axes `axes`, from frame_pose and nothing else."""
    J = m.frame_pose(q, joint.child)
    if isinstance(at, str):
        point = {"joint": J[:, :3, 3], "world": np.zeros((len(q), 3))}[at] if at in ("joint", "world") else m.frame_pose(q, at)[:, :3, 3]
    else:
        point = J[:, :3, 3] + J[:, :3, :3] @ np.asarray(at)
    R = J[:, :3, :3] if axes == "joint" else np.broadcast_to(np.eye(3), (len(q), 3, 3)) if axes == "world" else m.frame_pose(q, axes)[:, :3, :3]
    back = np.swapaxes(R, 1, 2)
    return coadjoint(back @ J[:, :3, :3], (back @ (J[:, :3, 3] - point)[..., None])[..., 0])


def swapped(w) -> np.ndarray:
    """The other order of the six numbers."""
    return np.concatenate([w[..., 3:], w[..., :3]], axis=-1)


def subspace(joint, q) -> np.ndarray:
    """S (n, 6, nv) of a joint in its own frame, linear first, at the states q (n, nq)."""
    axis, S = np.array(joint.axis), np.zeros((len(q), 6, joint.nv))
    if joint.kind == "floating":
        S[:] = np.eye(6)
    elif joint.kind == "spherical":
        S[:] = np.eye(6)[:, 3:]
    elif joint.kind == "translation":
        S[:] = np.eye(6)[:, :3]
    elif joint.kind == "planar":
        S[:, :3, 0], S[:, :3, 1], S[:, 3:, 2] = *in_plane(axis), axis
    elif joint.kind == "cylindrical":
        S[:, 3:, 0] = S[:, :3, 1] = axis
    elif joint.kind == "universal":
        back = turn(np.array(joint.axis2), -q[:, joint.q_index + 1])[:, :3, :3]
        S[:, 3:, 0], S[:, 3:, 1] = back @ axis, joint.axis2
    elif joint.kind == "prismatic":
        S[:, :3, 0] = axis
    elif joint.nv:
        S[:, 3:, 0], S[:, :3, 0] = axis, joint.pitch * axis
    return S


def drive(joint, q) -> np.ndarray:
    """h* (n, 6, nv), the wrenches of unit effort that do nothing else: a helical joint is driven by a moment about its axis, a
    universal one by moments in the plane of its axes, of which each works on one axis alone."""
    h = subspace(joint, q)
    if joint.kind == "helical":
        h[:, :3] = 0
    if joint.kind == "universal":
        h = h @ np.linalg.inv(np.swapaxes(h, 1, 2) @ h)
    return h


def placements(rng, m):
    """A random choice of the keywords of `reactions`."""
    link = lambda: str(rng.choice(m.link_names))
    at = ["joint", "world", link(), tuple(rng.normal(size=3))][rng.integers(4)]
    axes = ["joint", "world", link()][rng.integers(3)]
    return {"at": at, "axes": axes, "on": str(rng.choice(["child", "parent"])), "order": str(rng.choice(["lin_ang", "ang_lin"]))}
