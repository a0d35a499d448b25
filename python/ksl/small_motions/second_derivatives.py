"""First and second derivatives of potentials and of frames by displacements of joints.

A frame turns by the exponentials of its joints one after the other, those of the root first; of the same joint displacements add up, but for the
axes of universal joints, of which the first turns the second.
"""

from __future__ import annotations

import numpy as np

from ksl.mechanism.calls import Calls
from ksl.mechanism.mechanism import ForceElement
from ksl.mechanism.states import Array
from ksl.small_motions.directions import Directions


def gravity(model: Calls, to: Directions, g: Array) -> tuple[Array, Array]:
    """Gradient (d) and second derivatives (d, d) of the potential of weight; O(links · d + d²)."""
    mass = np.array([link.mass for link in model.links])
    centroid = np.array([[*link.first_moment] for link in model.links])
    first = np.einsum("lij,lj->li", to.pose[:, :3, :3], centroid) + mass[:, None] * to.pose[:, :3, 3]
    moved = to.moves.astype(float)
    M = mass @ moved
    arm = first.T @ moved - M * to.origin.T  # Σ m (c − o) of what a direction moves
    by = M[:, None] * to.linear + np.cross(to.angular, arm.T)  # Σ m ∂c
    return -by @ g, -np.einsum("abi,i->ab", turned_twice(to, by, arm.T), g)


def turned_twice(to: Directions, by: Array, arm: Array) -> Array:
    """Second derivatives (d, d, 3) of points: by (d, 3), the first ones; arm (d, 3), from the origin of the direction's joint to the point."""
    outer = np.where(to.before[:, :, None], np.cross(to.angular[:, None], by[None]), 0.0)
    inner = np.cross(to.angular[:, None], np.cross(to.angular[None], arm[None]))  # the second turns first
    same = to.beside[:, :, None] * (inner + inner.transpose(1, 0, 2)) / 2
    for a in np.flatnonzero(to.first_axis):
        same[a, a + 1] = same[a + 1, a] = inner[a, a + 1]
    out: Array = outer + outer.transpose(1, 0, 2) + same
    return out


def point(to: Directions, link: int, position: Array) -> tuple[Array, Array]:
    """First (d, 3) and second (d, d, 3) derivatives of a point (3) of a link, in world axes."""
    by = to.of_point(link, position)
    both = to.moves[link][:, None] & to.moves[link][None]
    return by, turned_twice(to, by, position - to.origin) * both[:, :, None]


def rotation(to: Directions, link: int) -> tuple[Array, Array]:
    """First (d, 3) and second (d, d, 3) derivatives of the rotation vector of a link, in world axes."""
    by = to.moves[link][:, None] * to.angular
    half = np.cross(by[:, None], by[None]) / 2
    outer = np.where(to.before[:, :, None], half, 0.0)
    out = outer + outer.transpose(1, 0, 2)
    for a in np.flatnonzero(to.first_axis):
        out[a, a + 1] = out[a + 1, a] = half[a, a + 1]
    return by, out


def force_elements(model: Calls, to: Directions, q: Array) -> tuple[Array, Array, Array]:
    """Gradient (d) and second derivatives (d, d) of the energy of springs between two points; and the part of these that is their stiffness alone."""
    d = len(to.joint)
    gradient, second, material = np.zeros(d), np.zeros((d, d)), np.zeros((d, d))
    states = model.force_element_states(q)
    for element, length, tension in zip(model.force_elements, states.length, states.tension):
        (p, one, one_two), (r, other, other_two) = (_end(model, to, *end) for end in ((element.link1, element.point1), (element.link2, element.point2)))
        k = _stiffness(element, float(length))
        n = (r - p) / length if length > 0 else np.zeros(3)
        per_length = tension / length if length > 0 else k
        by, along = other - one, (other - one) @ n
        gradient += tension * along
        material += k * np.outer(along, along)
        second += per_length * (by @ by.T - np.outer(along, along)) + tension * (other_two - one_two) @ n
    return gradient, second + material, material


def _end(model: Calls, to: Directions, link: str, at: tuple[float, float, float]) -> tuple[Array, Array, Array]:
    i = model.frame_link(f"link:{link}")
    position = to.pose[i, :3, :3] @ np.array(at) + to.pose[i, :3, 3]
    return position, *point(to, i, position)


def _stiffness(element: ForceElement, length: float) -> float:
    beyond = (element.lower is not None and length < element.lower) or (element.upper is not None and length > element.upper)
    return element.stiffness + (element.stop_stiffness if beyond else 0.0)
