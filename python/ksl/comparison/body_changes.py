"""What another library made of masses: which links, and how."""

from __future__ import annotations

import numpy as np

from ksl.comparison.bodies import Change, about_centroid, lumped, of_link, of_moments, pseudo_inertia, welded
from ksl.comparison.coordinates import Array
from ksl.comparison.differences import TOLERANCE, largest
from ksl.model.model import Model

SHOWN = 5
"""Links that are named at most."""


def _point(P: Array) -> Array:
    return pseudo_inertia(P[3, 3], _centroid(P), np.zeros((3, 3)))


def _without_products(P: Array) -> Array:
    return pseudo_inertia(P[3, 3], _centroid(P), np.diag(np.diag(about_centroid(P))))


def _other_products(P: Array) -> Array:
    I = about_centroid(P)
    return pseudo_inertia(P[3, 3], _centroid(P), 2 * np.diag(np.diag(I)) - I)


def _at_origin(P: Array) -> Array:
    return pseudo_inertia(P[3, 3], np.zeros(3), about_centroid(P))


def _about_origin(P: Array) -> Array:
    """The tensor about the centroid taken for that about the origin."""
    return of_moments(P[3, 3], P[:3, 3], about_centroid(P))


def _balanced(P: Array) -> Array:
    return pseudo_inertia(P[3, 3], _centroid(P), np.trace(about_centroid(P)) / 3 * np.eye(3))


def _sphere(P: Array) -> Array:
    """What Drake has for a tensor that no body can have: that of a solid sphere of 1000 kg/m³, of 1 kg where there is no mass."""
    m = P[3, 3] or 1.0
    radius = np.cbrt(3 * m / (4 * np.pi * 1000.0))
    return pseudo_inertia(m, _centroid(P), 0.4 * m * radius**2 * np.eye(3))


CHANGES: dict[str, Change] = {
    "its mass and tensor are dropped": np.zeros_like,
    "its tensor is replaced by that of a solid sphere of 1000 kg/m³, and a mass of 0 by 1 kg": _sphere,
    "its tensor is dropped: a point mass": _point,
    "its products of inertia are dropped": _without_products,
    "its products of inertia have the other sign": _other_products,
    "its centroid is dropped: the mass is at the link's origin": _at_origin,
    "its tensor is taken about the link's origin, and not about the centroid": _about_origin,
    "its moments of inertia are made equal": _balanced,
}
"""What may have become of a link.  Each is tried; the first that gives the other library's body is said."""


def _centroid(P: Array) -> Array:
    return np.asarray(P[:3, 3] / P[3, 3]) if P[3, 3] else np.zeros(3)


def changed_links(model: Model, bodies: dict[str, Array]) -> str:
    """A sentence about the bodies whose masses differ, {link: pseudo-inertia} being the other library's; empty where none does."""
    ours = lumped(model, bodies)
    groups = {link: links for links in welded(model).values() for link in links}
    found: dict[str, list[str]] = {}
    for link, P in bodies.items():
        if not _same(P, ours[link]):
            what, links = _what(model, link, P, groups.get(link, [link]))
            found.setdefault(what, []).extend(links)
    shown = [f"{', '.join(links[:SHOWN])}{f' and {len(links) - SHOWN} more' if len(links) > SHOWN else ''}: {what}" for what, links in found.items()]
    return "; ".join(shown)


def _same(P: Array, other: Array) -> bool:
    """Whether all ten numbers agree, as shares of the body's own."""
    m = max(abs(P[3, 3]), abs(other[3, 3]))
    root = np.sqrt([max(largest(P[:3, :3]), largest(other[:3, :3]))] * 3 + [m])
    return bool((np.abs(P - other) <= TOLERANCE * np.outer(root, root)).all())


def _what(model: Model, body: str, P: Array, links: list[str]) -> tuple[str, list[str]]:
    """What happened, and to which links of the body: to one, or to all."""
    heavy = [link for link in links if of_link(model.link(link)).any()]
    for some in (*([link] for link in heavy), heavy):
        for text, change in CHANGES.items():
            if _same(P, lumped(model, [body], dict.fromkeys(some, change))[body]):
                return text, some
    ours = lumped(model, [body])[body]
    if abs(P[3, 3] - ours[3, 3]) > TOLERANCE * max(P[3, 3], ours[3, 3]):
        return f"{P[3, 3]:.6g} kg there, {ours[3, 3]:.6g} kg in KSL", [body]
    moments = [np.linalg.eigvalsh(about_centroid(x)) for x in (P, ours)]
    if largest(moments[0] - moments[1]) <= TOLERANCE * largest(moments[1]):
        return "the same principal moments about other axes", [body]
    return "another tensor or centroid", [body]
