"""The wrench through a section of a link: what one part of it exerts on the other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.errors import near_names
from ksl.base.finite_results import require_finite
from ksl.mechanism.requests import one_of, require_once, three_numbers
from ksl.mechanism.states import Array, External, ExternalAxes, Order, argument_rows, items_of, leading_shape

if TYPE_CHECKING:
    from ksl.mechanism.calls import Calls
    from ksl.mechanism.mechanism import Link

Share = float | Literal["body"] | tuple[float, Sequence[float], ArrayLike]
"""How much of a link is beyond a section: a fraction of its inertia; "body", all or nothing, by its centroid; or
mass, first moment and inertia (3, 3) about the link's origin."""


@np.errstate(over="ignore", invalid="ignore")  # what is not finite is an error at the end
def section_wrench(
    m: Calls,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    name: str,
    point: Sequence[float],
    normal: Sequence[float],
    share: Share = "body",
    beyond: Iterable[str] | None = None,
    external: External | None = None,
    axes: Literal["link", "world"] = "link",
    order: Order = "lin_ang",
    external_axes: ExternalAxes = "link",
) -> Array:
    """See :meth:`ksl.Model.section_wrench`."""
    link, at = m.link(name), np.array(three_numbers(point, "point"))
    name, frame = link.name, f"link:{link.name}"
    n = np.array(three_numbers(normal, "normal"))
    if not np.linalg.norm(n) > 0:
        raise ValueError(f"normal={normal!r}; expected a direction")
    one_of(axes, "axes", "link", "world")
    one_of(order, "order", "lin_ang", "ang_lin")
    one_of(external_axes, "external_axes", "link", "world")
    wrenches = items_of(external, external_axes)
    for target, _ in wrenches:
        m.link(target)
    parent = next(j for j in m.joints if j.child == name)
    q, v, a = (argument_rows(x, *role, m._core) for x, role in ((q, ("q", m.nq)), (v, ("v", m.nv)), (a, ("a", m.nv))))
    forces = {f"external[{link!r}]": argument_rows(f, f"external[{link!r}]", 6, m._core) for link, f in wrenches}
    leading = leading_shape({"q": q, "v": v, "a": a, **forces})
    sides = _joints_beyond(m, name, n, at, beyond)
    wrench = _inertial_wrench(m, q, v, a, frame, _inertia_beyond(link, share, n, at))
    carried = {parent.name, *(x.name for x in m.loops if x.successor == name)}  # joints with the link on their child's side
    for joint in (x for x, beyond_plane in sides.items() if beyond_plane):
        found = m.reactions(q, v, a, external, joints=[joint], at=frame, axes=frame, external_axes=external_axes)[..., 0, :]
        wrench = wrench - (found if joint in carried else -found)
    wrench = wrench - _of_elements(m, q, v, name, n, at)
    R = m.frame_pose(q, frame)[..., :3, :3]
    for given in (f for target, f in wrenches if target == name and sides[parent.name]):
        f = np.asarray(given, float)
        wrench = wrench - (_turned(np.swapaxes(R, -1, -2), f) if external_axes == "world" else f)
    wrench = np.broadcast_to(wrench, (*leading, 6)).copy()
    wrench[..., 3:] -= np.cross(at, wrench[..., :3])  # about the point
    if axes == "world":
        wrench = _turned(R, wrench)
    if order == "ang_lin":
        wrench = np.roll(wrench, 3, axis=-1)
    require_finite("section_wrench", "wrench", wrench)
    return wrench


def _joints_beyond(m: Calls, link: str, n: Array, at: Array, beyond: Iterable[str] | None) -> dict[str, bool]:
    """{joint of the link: is it beyond the section}: by where it stands, or as `beyond` says."""
    parent = next(j for j in m.joints if j.child == link)
    sides = {parent.name: bool(-(n @ at) > 0)}  # its frame is the link's; what lies in the plane keeps to its own side
    for j in (j for j in m.joints if j.parent == link):
        origin = m.relative_pose(m.neutral(), f"link:{j.child}", f"link:{link}")[:3, 3]  # where no joint has moved its child
        sides[j.name] = bool(n @ (origin - at) >= 0)
    ends = {x.name: x.successor_pose if x.successor == link else x.predecessor_pose for x in m.loops if link in (x.predecessor, x.successor)}
    sides |= {loop: bool(n @ (np.reshape(pose, (4, 4))[:3, 3] - at) >= 0) for loop, pose in ends.items()}
    if beyond is None:
        return sides
    if not isinstance(beyond, Iterable):
        raise ValueError(f"beyond={beyond!r}; expected a list of joints of {link}: some of {', '.join(sides)}")
    listed = (beyond,) if isinstance(beyond, str) else tuple(beyond)
    for joint in listed:
        if joint not in sides:
            raise ValueError(f"beyond names {joint!r}, which is no joint of {link}; {near_names(joint, sides)}expected some of {', '.join(sides)}")
    require_once(listed, "beyond")
    return {joint: joint in listed for joint in sides}


def _turned(R: Array, wrench: Array) -> Array:
    """A wrench in other axes, about the same point."""
    return np.concatenate([np.einsum("...ij,...j->...i", R, wrench[..., k : k + 3]) for k in (0, 3)], axis=-1)


def _of_elements(m: Calls, q: Array, v: Array, link: str, n: Array, at: Array) -> Array | float:
    """What force elements whose points are beyond the plane, or in it, exert on the link, about its origin and in its axes."""
    total: Array | float = 0.0
    for k, element in enumerate(m.force_elements if "force elements" in m.physics else ()):
        points = ((element.link1, np.array(element.point1)), (element.link2, np.array(element.point2)))
        for own, (other, far) in (points, points[::-1]):
            if own[0] != link or n @ (own[1] - at) < 0:
                continue
            relative = m.relative_pose(q, f"link:{other}", f"link:{link}")
            apart = relative[..., :3, :3] @ far + relative[..., :3, 3] - own[1]
            states = m.force_element_states(q, v)
            tension, length = states.tension[..., k, None], states.length[..., k, None]
            force = tension * apart / np.where(length > 0, length, 1)
            total = total + np.concatenate([force, np.cross(own[1], force)], axis=-1)
    return total


def _skew(x: Array) -> Array:
    """skew(x) @ y = x × y."""
    return np.cross(np.eye(3), x)


def _inertia_matrix(mass: float, first_moment: ArrayLike, inertia: ArrayLike) -> Array:
    """(6, 6) about the link's origin, linear first."""
    h = _skew(np.asarray(first_moment, float))
    return np.block([[mass * np.eye(3), -h], [h, np.asarray(inertia, float)]])


def _inertia_beyond(link: Link, share: Share, n: Array, at: Array) -> Array:
    xx, yy, zz, xy, yz, zx = link.inertia
    whole = _inertia_matrix(link.mass, link.first_moment, [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
    if isinstance(share, str):
        one_of(share, "share", "body")
        beyond = n @ np.array(link.first_moment) >= link.mass * (n @ at)
        return whole if beyond and link.mass > 0 else 0 * whole
    if isinstance(share, (tuple, list)):
        try:
            mass, first_moment, inertia = share
            I = _inertia_matrix(float(mass), np.array(three_numbers(first_moment, "share: first moment")), np.asarray(inertia, float).reshape(3, 3))
            if not np.isfinite(I).all():
                raise ValueError
            return I
        except (TypeError, ValueError):
            raise ValueError(f"share={share!r}; expected mass, first moment (3) and inertia (3, 3) about the link's origin") from None
    if not isinstance(share, (int, float, np.number)) or not 0 <= share <= 1:
        raise ValueError(f"share={share!r}; expected a fraction between 0 and 1, 'body', or mass, first moment and inertia")
    return share * whole


def _inertial_wrench(m: Calls, q: Array, v: Array, a: Array, frame: str, inertia: Array) -> Array:
    """I (a − g) + v ×* I v, in the link's frame (Featherstone, RBDA (2008), eq. (5.9))."""
    twist, acceleration = m.frame_velocity(q, v, frame), m.frame_acceleration(q, v, a, frame)
    R = m.frame_pose(q, frame)[..., :3, :3]
    acceleration[..., :3] -= np.einsum("...ji,j->...i", R, m.gravity)
    momentum = twist @ inertia.T
    linear, angular = twist[..., :3], twist[..., 3:]
    bias = [np.cross(angular, momentum[..., :3]), np.cross(angular, momentum[..., 3:]) + np.cross(linear, momentum[..., :3])]
    wrench: Array = acceleration @ inertia.T + np.concatenate(bias, axis=-1)
    return wrench
