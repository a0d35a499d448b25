"""Masses of moving bodies in both libraries: links that are welded together are one body.

A pseudo-inertia is the matrix [[Σ, h], [hᵀ, m]] (4, 4) with mass m, first moment h = m c and second moments Σ = ∫ x xᵀ dm = ½ tr(I) E − I
(Wensing, Kim and Slotine, Linear matrix inequalities for physically consistent inertial parameter identification, RA-L 3 (2018)).
It moves as T P Tᵀ with a pose T, and adds up, which ten parameters in different frames don't.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from ksl.comparison.coordinates import Array
from ksl.mechanism.mechanism import Link
from ksl.model.model import Model


def pseudo_inertia(mass: float, centroid: Array, about_centroid: Array) -> Array:
    """The pseudo-inertia of a body with that tensor (3, 3) about its centroid, in the same axes."""
    P = of_moments(mass, mass * np.asarray(centroid), about_centroid)
    P[:3, :3] += mass * np.outer(centroid, centroid)
    return P


def of_moments(mass: float, first: ArrayLike, about_origin: Array) -> Array:
    """The pseudo-inertia of a body with that first moment (3) and that tensor (3, 3) about the frame's origin."""
    P = np.empty((4, 4))
    P[:3, :3], P[:3, 3], P[3, :3], P[3, 3] = 0.5 * np.trace(about_origin) * np.eye(3) - about_origin, first, first, mass
    return P


def of_link(link: Link) -> Array:
    """The pseudo-inertia of a link of KSL, in its frame."""
    xx, yy, zz, xy, yz, zx = link.inertia
    return of_moments(link.mass, link.first_moment, np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]))


def tensor(P: Array) -> Array:
    """The tensor (3, 3) about the frame's origin."""
    second = P[:3, :3]
    return np.asarray(np.trace(second) * np.eye(3) - second)


def about_centroid(P: Array) -> Array:
    """The tensor (3, 3) about the centroid; about the origin where there is no mass."""
    if P[3, 3] == 0.0:
        return tensor(P)
    own = P.copy()
    own[:3, :3] -= np.outer(P[:3, 3], P[:3, 3]) / P[3, 3]
    return tensor(own)


def welded(model: Model) -> dict[str, list[str]]:
    """{the link at each moving joint: it and the links that are welded to it}.  Links that stand on the ground are in none.  O(links)."""
    above = {joint.child: joint for joint in model.joints}
    body: dict[str, str | None] = {}
    for name in model.link_names:
        chain, at = [name], name
        while at not in body and above[at].kind == "fixed" and above[at].parent is not None:
            at = str(above[at].parent)
            chain.append(at)
        found = body[at] if at in body else None if above[at].kind == "fixed" else at
        body.update(dict.fromkeys(chain, found))
    groups: dict[str, list[str]] = {at: [] for at in model.link_names if body[at] == at}
    for name, top in body.items():
        if top is not None:
            groups[top].append(name)
    return groups


Change = Callable[[Array], Array]
"""What another library may make of the pseudo-inertia of a link."""


def lumped(model: Model, at: Iterable[str], changed: Mapping[str, Change] | None = None) -> dict[str, Array]:
    """{link: pseudo-inertia of the body that it is a part of, in its frame} for these links, with some links changed.  O(links)."""
    changes, groups = changed or {}, welded(model)
    body = {link: top for top, links in groups.items() for link in links}
    poses = dict(zip(model.link_names, model.frame_poses(model.neutral(), [f"link:{name}" for name in model.link_names])))
    found: dict[str, Array] = {}
    for name in at:
        found[name] = np.zeros((4, 4))
        for part in groups[body[name]] if name in body else ():
            own = of_link(model.link(part))
            X = np.linalg.solve(poses[name], poses[part])
            found[name] += X @ (changes[part](own) if part in changes else own) @ X.T
    return found
