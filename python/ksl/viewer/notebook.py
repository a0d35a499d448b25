"""What a notebook shows of a model: its joints in a table, and a picture of the mechanism."""

from __future__ import annotations

from ksl.base.markup import html as escape

from collections.abc import Container
from typing import TYPE_CHECKING

import numpy as np

from ksl.mechanism.calls import Calls
from ksl.mechanism.model_tables import joint_table
from ksl.mechanism.states import Array
from ksl.viewer.closing import open_loops

if TYPE_CHECKING:
    from ksl.viewer.shapes import Shape

ROWS = 60
"""The most rows of the table; longer ones are cut, and say so."""
SIZE = 260
"""Width and height of the picture, pixels."""
TRIANGLES = 1500
"""About so many triangles have all links in the picture together: some 60 kB of HTML."""
LINKS_WITH_SURFACE = 200
"""Robots with more are drawn as lines from joint to joint."""
LIMB, BARREL = (0.72, 0.75, 0.8), (0.45, 0.5, 0.58)
"""Colours of links without a surface, and of their joints."""
EYE = (2.0, -3.0, 1.2)
"""Direction from which it is seen, in the world's axes."""

_FRAME = "display:flex;flex-wrap:wrap;gap:1.5em;align-items:flex-start"
_CELL = "text-align:left;white-space:nowrap;padding:0.15em 0.6em"


def html_of(model: Calls) -> str:
    """A heading, the picture and the table of joints, as a piece of HTML without script and without references."""
    from ksl.viewer.scene import resting_position

    q = resting_position(model)
    links = f"{len(model.links)} link{'s' if len(model.links) != 1 else ''}"
    heading = f"<b>{escape(model.name)}</b>: {_freedoms(model, q)}, {links}, {model.mass:.6g} kg"
    return f'<div><div style="margin-bottom:0.5em">{heading}</div><div style="{_FRAME}">{picture(model, q)}{_table(model)}</div></div>'


def _freedoms(model: Calls, q: Array) -> str:
    """`2 degrees of freedom`; of a mechanism with loops those at the position that the picture shows, if that is closed."""
    if not model.loops:
        return f"{model.nv} degrees of freedom"
    closing = f"{len(model.loops)} joint{'s close' if len(model.loops) != 1 else ' closes'} loops"
    if open_loops(model, q).any():
        return f"{model.nv} coordinates, {closing}, and no closed position was found"
    freedoms = model.mobility(q).mobility
    return f"{freedoms} degree{'s' if freedoms != 1 else ''} of freedom of {model.nv} coordinates, {closing}"


def _table(model: Calls) -> str:
    groups, rows = joint_table(model)
    headings = [heading for group in groups for heading in group]
    shown = [i for i in range(len(headings)) if any(row[i] for row in rows)]
    head = "".join(f'<th style="{_CELL}">{escape(headings[i])}</th>' for i in shown)
    body = "".join("<tr>" + "".join(f'<td style="{_CELL}">{escape(row[i])}</td>' for i in shown) + "</tr>" for row in rows[:ROWS])
    more = f"<div>… and {len(rows) - ROWS} more joints</div>" if len(rows) > ROWS else ""
    return f'<div style="overflow-x:auto"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}</div>'


def picture(model: Calls, q: Array) -> str:
    """A position (nq) as SVG: the surfaces of links where the file gives them, their ellipsoids of inertia elsewhere, and
    the axes of joints; dots at the joints that move, those that close loops too."""
    poses = model.frame_poses(q)
    index = {name: i for i, name in enumerate(model.link_names)}
    corners, colours = _triangles(model, poses)
    moving = [j for j in model.joints if j.kind != "fixed" and j.parent is not None]
    origins = poses[:, :3, 3]
    size = float(np.ptp(np.concatenate([origins, corners.reshape(-1, 3)]), axis=0).max()) or 1.0
    ends = _loop_ends(model, poses)
    axes_of: list[tuple[str, tuple[float, ...]]] = [(j.name, j.axis or (0.0, 0.0, 0.0)) for j in moving]
    axes_of += [(loop.name, loop.axis or (0.0, 0.0, 0.0)) for loop in model.loops]
    frames = [*(poses[index[j.child]] for j in moving), *(end for _, end in ends[1::2])]
    centres = np.array([frame[:3, 3] for frame in frames]).reshape(-1, 3)
    half_axes = np.array([0.05 * size * frame[:3, :3] @ np.array(axis) for (_, axis), frame in zip(axes_of, frames)]).reshape(-1, 3)
    pairs = [(origins[index[j.parent]], origins[index[j.child]]) for j in model.joints if j.parent is not None]
    bones = np.array([*pairs, *((origins[index[link]], end[:3, 3]) for link, end in ends)]).reshape(-1, 2, 3)
    axes = np.stack([centres - half_axes, centres + half_axes], axis=1)[np.any(half_axes != 0, axis=1)]
    flat = _on_screen([origins, corners, bones, axes, centres])
    parts = [_line(start, end, "#8a94a3", 4) for start, end in flat[2]]
    parts += [_triangle(points, colour) for points, colour in zip(flat[1], colours)]
    parts += [_line(start, end, "#d0661f", 2) for start, end in flat[3]]
    parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="#2c6fbb"><title>{escape(name)}</title></circle>' for (name, _), (x, y) in zip(axes_of, flat[4])]
    words = "".join(parts)
    return f'<svg width="{SIZE}" height="{SIZE}" viewBox="0 0 {SIZE} {SIZE}" role="img" aria-label="{escape(model.name)}" stroke-linecap="round">{words}</svg>'


def _loop_ends(model: Calls, poses: Array) -> list[tuple[str, Array]]:
    """(link, frame in the world (4, 4)) of both sides of each joint that closes a loop, the predecessor's first."""
    index = {name: i for i, name in enumerate(model.link_names)}
    sides = [side for loop in model.loops for side in ((loop.predecessor, loop.predecessor_pose), (loop.successor, loop.successor_pose))]
    return [(link, poses[index[link]] @ np.reshape(own, (4, 4))) for link, own in sides]


def _triangles(model: Calls, poses: Array) -> tuple[Array, list[str]]:
    """Triangles of all links (n, 3, 3) that face the viewer, the far ones first, and their colours with the light on them."""
    from ksl.viewer.shapes import simplified
    from ksl.viewer.visuals import Appearance, appearance

    look = appearance(model, triangles=4 * TRIANGLES) if len(model.links) <= LINKS_WITH_SURFACE else Appearance()
    own = {name: shapes for name, shapes in look.shapes.items() if name not in look.ellipsoids or not model.joints}
    shapes = [(shape, pose) for name, pose in zip(model.link_names, poses) for shape in own.get(name, ())]
    share = max(12, TRIANGLES // max(1, len(shapes)))
    small = [simplified(shape, share).moved(pose) for shape, pose in shapes]
    small += _limbs(model, poses, own) if len(model.links) <= LINKS_WITH_SURFACE else []
    if not small:
        return np.empty((0, 3, 3)), []
    corners = np.concatenate([shape.vertices[shape.faces] for shape in small])
    colour = np.concatenate([np.tile(shape.colour, (len(shape.faces), 1)) for shape in small])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    towards = _screen()[2]
    facing = np.divide(normal @ towards, length, out=np.zeros(len(length)), where=length > 0)
    seen = np.flatnonzero(facing > 0)
    order = seen[np.argsort(corners[seen].mean(axis=1) @ towards)]
    light = np.clip(colour[order] * (0.45 + 0.55 * facing[order, None]), 0, 1)
    return corners[order], ["#" + bytes(rgb).hex() for rgb in np.rint(255 * light).astype(np.uint8)]


def _limbs(model: Calls, poses: Array, drawn: Container[str]) -> list[Shape]:
    """Links without a surface as rods from joint to joint, and barrels about the axes of their joints.

    Ellipsoids of inertia, which the viewer draws through which one sees, would be mistaken for the links here: those of slender links are blades that
    reach far beyond them.
    """
    from ksl.viewer.shapes import rod

    index = {name: i for i, name in enumerate(model.link_names)}
    size = float(np.ptp(poses[:, :3, 3], axis=0).max()) or 1.0
    origin = poses[:, :3, 3]
    bare = [j for j in model.joints if j.parent is not None and j.parent not in drawn]
    limbs = [rod(origin[index[j.parent]], origin[index[j.child]], 0.022 * size, LIMB, 12) for j in bare if j.parent is not None]
    limbs += [rod(origin[index[link]], end[:3, 3], 0.022 * size, LIMB, 12) for link, end in _loop_ends(model, poses) if link not in drawn]
    for j in model.joints:
        if j.has_axis and j.child not in drawn:
            along = 0.045 * size * poses[index[j.child], :3, :3] @ np.array(j.axis)
            limbs.append(rod(origin[index[j.child]] - along, origin[index[j.child]] + along, 0.035 * size, BARREL, 16))
    return [limb for limb in limbs if len(limb.faces)]


def _on_screen(groups: list[Array]) -> list[Array]:
    """Points (…, 3) of the world as points (…, 2) of the picture, which they fill but for a margin."""
    across, up, _ = _screen()
    flat = [np.stack([x @ across, -(x @ up)], axis=-1) for x in groups]
    every = np.concatenate([x.reshape(-1, 2) for x in flat])
    low, high = every.min(axis=0), every.max(axis=0)
    scale = (SIZE - 30) / (float((high - low).max()) or 1.0)
    return [SIZE / 2 + scale * (x - (low + high) / 2) for x in flat]


def _screen() -> tuple[Array, Array, Array]:
    """Directions in the world: to the right and up in the picture, and to the viewer."""
    depth = np.array(EYE) / np.linalg.norm(EYE)
    across = np.cross((0.0, 0.0, 1.0), depth)
    across /= np.linalg.norm(across)
    return across, np.cross(depth, across), depth


def _line(start: Array, end: Array, colour: str, width: float) -> str:
    return f'<line x1="{start[0]:.1f}" y1="{start[1]:.1f}" x2="{end[0]:.1f}" y2="{end[1]:.1f}" stroke="{colour}" stroke-width="{width}"/>'


def _triangle(points: Array, colour: str) -> str:
    """A filled triangle, whose edge in the same colour hides the gaps that renderers leave between neighbours."""
    words = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polygon points="{words}" fill="{colour}" stroke="{colour}" stroke-width="0.4"/>'
