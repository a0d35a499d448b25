"""What placement means, written out: six-vectors linear first, as KSL's are."""

import numpy as np

from newton_euler import skew


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


def subspace(joint) -> np.ndarray:
    """S (6, nv) of a joint in its own frame, linear first."""
    S = np.zeros((6, joint.nv))
    if joint.kind == "floating":
        return np.eye(6)
    if joint.kind == "spherical":
        return np.eye(6)[:, 3:]
    if joint.nv:
        S[: 3 if joint.kind == "prismatic" else 6, 0][-3:] = joint.axis
    if joint.kind == "helical":
        S[:3, 0] = joint.pitch * np.array(joint.axis)
    return S


def drive(joint) -> np.ndarray:
    """h* (6, nv), the wrenches of unit effort that do nothing else: a helical joint is driven by a moment about its axis."""
    h = subspace(joint)
    if joint.kind == "helical":
        h[:3] = 0
    return h


def placements(rng, m):
    """A random choice of the keywords of `reactions`."""
    link = lambda: str(rng.choice(m.link_names))
    at = ["joint", "world", link(), tuple(rng.normal(size=3))][rng.integers(4)]
    axes = ["joint", "world", link()][rng.integers(3)]
    return {"at": at, "axes": axes, "on": str(rng.choice(["child", "parent"])), "order": str(rng.choice(["lin_ang", "ang_lin"]))}
