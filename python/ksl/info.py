"""The contents of a robot file as text: the tree, joints, limits, masses, gravity, and unused contents."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text
from rich.tree import Tree

from ksl.mechanism import Joint, Link, Mechanism


def print_info(model: Mechanism, console: Console) -> None:
    """Prints everything that `ksl info` shows of a model."""
    moving, following = len(model.joint_names), len(model.follower_names)
    mass = sum(link.mass for link in model.links)
    of_followers = f"mimic joints {following}, " if following else ""
    console.print(Text(f"{model.name} ({model.file})", style="bold"))
    console.print(f"degrees of freedom {model.nv} (nq {model.nq}), moving joints {moving}, {of_followers}fixed joints {len(model.joints) - moving - following}, links {len(model.links)}")
    console.print(f"total mass {mass:.6g} kg, gravity ({', '.join(f'{g:g}' for g in model.gravity)}) m/s²")
    console.print(f"physics of joints: {', '.join(model.physics) or 'none; --physics applies what joints have'}\n" if model.physics or _given(model.joints) else "")
    console.print(_tree(model))
    console.print()
    console.print(_joint_table(model))
    console.print(_link_table(model))
    for title, lines in (("Warnings", model.warnings), ("In the file and not used", model.unused)):
        if lines:
            console.print(Text(f"\n{title}", style="bold"))
            for line in lines:
                console.print(Text(f"  {line}"))


def _tree(model: Mechanism) -> Tree:
    by_parent: dict[str | None, list[Joint]] = {}
    order = {link.name: i for i, link in enumerate(model.links)}
    for joint in sorted(model.joints, key=lambda j: order[j.child]):
        by_parent.setdefault(joint.parent, []).append(joint)
    tree = Tree(Text("ground"))
    branches: dict[str | None, Tree] = {None: tree}
    pending: list[str | None] = [None]
    while pending:
        parent = pending.pop()
        for joint in by_parent.get(parent, []):
            branches[joint.child] = branches[parent].add(Text.assemble(f"{joint.child}  ", (f"{joint.name}, {joint.kind}", "dim")))
            pending.append(joint.child)
    return tree


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


def _given(joints: Sequence[Joint]) -> list[tuple[str, str]]:
    """The groups that any joint has."""

    def has(group: tuple[tuple[str, str], ...]) -> bool:
        return any(getattr(j, name) for _, name in group for j in joints if name not in ("gear_ratio", "spring_rest"))

    return [each for group in PHYSICS if has(group) for each in group]


def _joint_table(model: Mechanism) -> Table:
    table = Table(title=f"Joints, in the order of q, then {'the mimic joints and ' if model.follower_names else ''}the fixed ones", title_justify="left")
    given = _given(model.joints)
    headings = ["joint", "kind", "parent → child", "q", "v", "axis", "lower", "upper", "effort", "velocity"]
    for heading in headings + [title for title, _ in given]:
        table.add_column(heading, justify="left" if heading in ("joint", "kind", "parent → child", "axis") else "right")
    for j in model.joints:
        axis = " ".join(f"{x:.4g}" for x in j.axis) if j.has_axis else ""
        if j.axis2:
            axis += ", " + " ".join(f"{x:.4g}" for x in j.axis2)
        if j.pitch:
            axis += f", {j.pitch:.4g} m/rad"
        table.add_row(
            Text(j.name), j.kind, Text(f"{j.parent or 'ground'} → {j.child}"), _span(j.q_index, j.nq) or _following(j), _span(j.v_index, j.nv), axis,
            *(_limits(j, side) for side in (0, 1)), _number(j.effort), _number(j.velocity),
            *(_number((name != "gear_ratio" or j.rotor_inertia) and getattr(j, name) or None) for _, name in given),
        )
    return table


def _link_table(model: Mechanism) -> Table:
    table = Table(title="Links with mass: centroid in the link's frame (m), inertia about it (kg m²)", title_justify="left")
    table.add_column("link")
    for heading in ("mass", "x", "y", "z", "Ixx", "Iyy", "Izz", "Ixy", "Iyz", "Izx"):
        table.add_column(heading, justify="right")
    for link in model.links:
        if link.mass > 0:
            c, tensor = centroidal(link)
            table.add_row(Text(link.name), _number(link.mass), *(_number(x, 4) for x in (*c, *tensor)))
    return table


def centroidal(link: Link) -> tuple[np.ndarray, np.ndarray]:
    """Centroid and inertia about it (Ixx Iyy Izz Ixy Iyz Izx), in the link's axes."""
    c = np.array(link.first_moment) / link.mass
    x, y, z = c
    shift = link.mass * np.array([y * y + z * z, z * z + x * x, x * x + y * y, -x * y, -y * z, -z * x])
    tensor = np.array(link.inertia) - shift
    tensor[np.abs(tensor) < 1e-12 * np.abs(link.inertia).max(initial=0.0)] = 0.0
    return c, tensor
