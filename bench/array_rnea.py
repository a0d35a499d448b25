"""Inverse dynamics of a fixed-base robot with revolute joints, written with arrays: a loop over bodies, in which each line
computes all states at once.  The same code runs with NumPy and with JAX, and is compared with KSL."""

from types import ModuleType
from typing import Any


def parameters(model: Any) -> list[dict[str, Any]]:
    """The data of each body that the recursion needs, from a Pinocchio model: parent, placement, axis, mass, centroid, inertia."""
    import numpy as np

    axes = dict(zip("XYZ", np.eye(3)))
    return [
        {
            "parent": model.parents[i] - 1,
            "R": model.jointPlacements[i].rotation.copy(),
            "p": model.jointPlacements[i].translation.copy(),
            "axis": axes[model.joints[i].shortname()[-1]],
            "mass": model.inertias[i].mass,
            "c": model.inertias[i].lever.copy(),
            "I": model.inertias[i].inertia.copy(),
        }
        for i in range(1, model.njoints)
    ]


def bodies_of(m: Any) -> list[dict[str, Any]]:
    """The bodies of a model of KSL; links that fixed joints weld are lumped."""
    import numpy as np

    poses, bodies = dict(zip(m.link_names, m.frame_poses(m.neutral()))), []
    moving = [m.joint(name) for name in m.joint_names]
    carried = {link: name for joint in moving for link in m.subtree_links(joint.name) for name in [joint.name]}  # the last joint that carries it
    for joint in moving:
        up = m.support(joint.child)[:-1]
        base = poses[m.joint(up[-1]).child] if up else np.eye(4)
        placement = np.linalg.solve(base, poses[joint.child])
        mass, first, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
        for link in (m.link(name) for name, of in carried.items() if of == joint.name):
            D = np.linalg.solve(poses[joint.child], poses[link.name])
            xx, yy, zz, xy, yz, zx = link.inertia
            c, I = np.array(link.first_moment), np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
            square = lambda x: x @ x * np.eye(3) - np.outer(x, x)
            if link.mass > 0:
                at_centre = I - link.mass * square(c / link.mass)
                centre = D[:3, :3] @ c / link.mass + D[:3, 3]
                inertia += D[:3, :3] @ at_centre @ D[:3, :3].T + link.mass * square(centre)
                mass, first = mass + link.mass, first + link.mass * centre
        c = first / mass
        about_centre = inertia - mass * (c @ c * np.eye(3) - np.outer(c, c))
        parent = m.joint_names.index(up[-1]) if up else -1
        bodies.append({"parent": parent, "R": placement[:3, :3], "p": placement[:3, 3], "axis": np.array(joint.axis), "mass": mass, "c": c, "I": about_centre})
    return bodies


def rnea(xp: ModuleType, bodies: list[dict[str, Any]], q: Any, v: Any, a: Any) -> Any:
    """Joint efforts (n, nv) for q, v, a (n, nv)."""
    count, zero = q.shape[0], xp.zeros((q.shape[0], 3))
    rotations, speed, turning, acceleration, force, moment = [], [], [], [], [], []
    for i, b in enumerate(bodies):
        K = xp.array([[0, -b["axis"][2], b["axis"][1]], [b["axis"][2], 0, -b["axis"][0]], [-b["axis"][1], b["axis"][0], 0]])
        sine, cosine = xp.sin(q[:, i])[:, None, None], xp.cos(q[:, i])[:, None, None]
        R = b["R"] @ (xp.eye(3) + sine * K + (1 - cosine) * (K @ K))  # (n, 3, 3), of the body in its parent
        up = b["parent"]
        w, dw, acc = (speed[up], turning[up], acceleration[up]) if up >= 0 else (zero, zero, zero + xp.array([0, 0, 9.81]))
        acc = acc + xp.cross(dw, b["p"]) + xp.cross(w, xp.cross(w, b["p"]))
        w, dw, acc = (xp.einsum("nij,ni->nj", R, x) for x in (w, dw, acc))
        joint = v[:, i, None] * b["axis"]
        dw = dw + xp.cross(w, joint) + a[:, i, None] * b["axis"]
        w = w + joint
        f = b["mass"] * (acc + xp.cross(dw, b["c"]) + xp.cross(w, xp.cross(w, b["c"])))
        rotations.append(R), speed.append(w), turning.append(dw), acceleration.append(acc), force.append(f)
        moment.append(dw @ b["I"] + xp.cross(w, w @ b["I"]) + xp.cross(b["c"], f))
    tau = [None] * len(bodies)
    for i in reversed(range(len(bodies))):
        b = bodies[i]
        tau[i] = moment[i] @ b["axis"]
        if (up := b["parent"]) >= 0:
            f = xp.einsum("nij,nj->ni", rotations[i], force[i])
            force[up] = force[up] + f
            moment[up] = moment[up] + xp.einsum("nij,nj->ni", rotations[i], moment[i]) + xp.cross(b["p"], f)
    return xp.stack(tau, axis=1).reshape(count, len(bodies))
