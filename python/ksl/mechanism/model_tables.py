"""Joints and links of a model as tables of words: what `ksl info` prints, and notebooks show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ksl.mechanism.mechanism import Joint, Link, Mechanism


def _number(x: float | None, digits: int = 6) -> str:
    return "" if x is None else f"{x:.{digits}g}"


def _limits(joint: Joint, side: int) -> str:
    """Lower or upper limits of the numbers of its position, – for those without."""
    given = [pair[side] for pair in joint.limits]
    return "" if all(x is None for x in given) else ", ".join(_number(x) or "–" for x in given)


def _span(start: int, size: int) -> str:
    return "" if size == 0 else str(start) if size == 1 else f"{start}–{start + size - 1}"


def _following(joint: Joint) -> str:
    """How a mimic joint follows its leader: −1 × finger + 0.5."""
    if joint.leader is None:
        return ""
    offset = f" {'-' if joint.offset < 0 else '+'} {abs(joint.offset):.6g}" if joint.offset else ""
    return f"{joint.multiplier:.6g} × {joint.leader}{offset}"


PHYSICS = (
    (("damping", "damping"), ("friction", "friction")),
    (("friction width", "friction_width"),),
    (("armature", "armature"),),
    (("rotor", "rotor_inertia"), ("gear ratio", "gear_ratio")),
    (("stiffness", "spring_stiffness"), ("rest", "spring_rest")),
)
"""Headings and attributes of the physics of joints, in groups that are shown together."""


def given_physics(joints: Sequence[Joint]) -> list[tuple[str, str]]:
    """The groups that any joint has."""

    def has(group: tuple[tuple[str, str], ...]) -> bool:
        return any(getattr(j, name) for _, name in group for j in joints if name not in ("gear_ratio", "spring_rest"))

    return [each for group in PHYSICS if has(group) for each in group]


def force_element_table(model: Mechanism) -> tuple[list[list[str]], list[list[str]]]:
    """Headings and rows of springs, dampers and cylinders between two points."""
    numbers = ("stiffness", "free_length", "damping", "preload", "lower", "upper", "stop_stiffness")
    rows = []
    for e in model.force_elements:
        ends = [f"{link} ({' '.join(f'{x:.4g}' for x in point)})" for link, point in ((e.link1, e.point1), (e.link2, e.point2))]
        rows.append([e.name, *ends, *(_number(getattr(e, name) or None) for name in numbers)])
    return [["force element"], ["from", "to"], [name.replace("_", " ") for name in numbers]], rows


def joint_table(model: Mechanism) -> tuple[list[list[str]], list[list[str]]]:
    """Headings and rows."""
    given = given_physics(model.joints)
    groups = [["joint"], ["kind", "parent → child", "q", "v", "axis"], ["lower", "upper", "effort", "velocity"], [title for title, _ in given]]
    return groups, [_joint_row(j, [name for _, name in given]) for j in model.joints]


def _joint_row(j: Joint, physics: Sequence[str]) -> list[str]:
    axis = " ".join(f"{x:.4g}" for x in j.axis) if j.has_axis else ""
    if j.axis2:
        axis += ", " + " ".join(f"{x:.4g}" for x in j.axis2)
    if j.pitch:
        axis += f", {j.pitch:.4g} m/rad"
    of_physics = [_number(((name != "gear_ratio" or j.rotor_inertia) and getattr(j, name)) or None) for name in physics]
    place = [_span(j.q_index, j.nq) or _following(j), _span(j.v_index, j.nv), axis]
    limits = [*(_limits(j, side) for side in (0, 1)), _number(j.effort), _number(j.velocity)]
    return [j.name, j.kind, f"{j.parent or 'ground'} → {j.child}", *place, *limits, *of_physics]


def link_table(model: Mechanism) -> tuple[list[list[str]], list[list[str]]]:
    """Headings and rows."""
    groups = [["link"], ["mass", "x", "y", "z"], ["Ixx", "Iyy", "Izz", "Ixy", "Iyz", "Izx"]]
    rows = []
    for link in model.links:
        if link.mass > 0:
            c, tensor = centroidal(link)
            rows.append([link.name, _number(link.mass), *(_number(x, 4) for x in (*c, *tensor))])
    return groups, rows


def centroidal(link: Link) -> tuple[np.ndarray, np.ndarray]:
    """Centroid and inertia about it (Ixx Iyy Izz Ixy Iyz Izx), in the link's axes."""
    c = np.array(link.first_moment) / link.mass
    x, y, z = c
    shift = link.mass * np.array([y * y + z * z, z * z + x * x, x * x + y * y, -x * y, -y * z, -z * x])
    tensor = np.array(link.inertia) - shift
    tensor[np.abs(tensor) < 1e-12 * np.abs(link.inertia).max(initial=0.0)] = 0.0
    return c, tensor
