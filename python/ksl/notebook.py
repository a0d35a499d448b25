"""What a notebook shows of a model: its joints in a table, and a picture of the mechanism."""

from __future__ import annotations

from html import escape

import numpy as np

from ksl.calls import Calls
from ksl.model_tables import joint_table
from ksl.states import Array

ROWS = 60
"""Of the table; longer ones are cut, and say so."""
SIZE = 260
"""Of the picture, pixels."""
EYE = (2.0, -3.0, 1.2)
"""Direction from which it is seen, in the world's axes."""

_FRAME = "display:flex;flex-wrap:wrap;gap:1.5em;align-items:flex-start"
_CELL = "text-align:left;white-space:nowrap;padding:0.15em 0.6em"


def html_of(model: Calls) -> str:
    """A heading, the picture and the table of joints, as a piece of HTML without script and without references."""
    links = f"{len(model.links)} link{'s' if len(model.links) != 1 else ''}"
    heading = f"<b>{escape(model.name)}</b>: {model.nv} degrees of freedom, {links}, {model.mass:.6g} kg"
    return f'<div><div style="margin-bottom:0.5em">{heading}</div><div style="{_FRAME}">{picture(model)}{_table(model)}</div></div>'


def _table(model: Calls) -> str:
    groups, rows = joint_table(model)
    headings = [heading for group in groups for heading in group]
    shown = [i for i in range(len(headings)) if any(row[i] for row in rows)]
    head = "".join(f'<th style="{_CELL}">{escape(headings[i])}</th>' for i in shown)
    body = "".join("<tr>" + "".join(f'<td style="{_CELL}">{escape(row[i])}</td>' for i in shown) + "</tr>" for row in rows[:ROWS])
    more = f"<div>… and {len(rows) - ROWS} more joints</div>" if len(rows) > ROWS else ""
    return f'<div style="overflow-x:auto"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}</div>'


def picture(model: Calls) -> str:
    """The neutral position as SVG: lines from joint to joint, a dot where one moves and its axis."""
    q = np.clip(model.neutral(), model.lower, model.upper)
    poses = model.frame_poses(q)
    index = {name: i for i, name in enumerate(model.link_names)}
    bones = [(index[j.parent], index[j.child]) for j in model.joints if j.parent is not None]
    origins = poses[:, :3, 3]
    size = float(np.ptp(origins, axis=0).max()) or 1.0
    moving = [j for j in model.joints if j.kind != "fixed" and j.parent is not None]
    centres = np.array([origins[index[j.child]] for j in moving]).reshape(-1, 3)
    half_axes = np.array([0.06 * size * poses[index[j.child], :3, :3] @ np.array(j.axis) for j in moving]).reshape(-1, 3)
    across, up, depth = _screen()
    points = np.concatenate([origins, centres - half_axes, centres + half_axes])
    flat = np.stack([points @ across, -(points @ up)], axis=-1)
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = (SIZE - 40) / (float((high - low).max()) or 1.0)
    flat = SIZE / 2 + scale * (flat - (low + high) / 2)
    order = sorted(range(len(bones)), key=lambda i: float(origins[list(bones[i])].mean(axis=0) @ depth))  # far ones first
    n, k = len(origins), len(moving)
    lines = [_line(flat[bones[i][0]], flat[bones[i][1]], "#8a94a3", 5) for i in order]
    lines += [_line(flat[n + i], flat[n + k + i], "#d0661f", 2.5) for i in range(k) if np.any(half_axes[i])]
    dots = [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="#2c6fbb"><title>{escape(j.name)}</title></circle>' for j, (x, y) in zip(moving, flat[[index[j.child] for j in moving]])]
    root = f'<rect x="{flat[0, 0] - 5:.1f}" y="{flat[0, 1] - 5:.1f}" width="10" height="10" fill="#5b6472"><title>{escape(model.root)}</title></rect>'
    words = "".join([*lines, root, *dots])
    return f'<svg width="{SIZE}" height="{SIZE}" viewBox="0 0 {SIZE} {SIZE}" role="img" aria-label="{escape(model.name)}" stroke-linecap="round">{words}</svg>'


def _screen() -> tuple[Array, Array, Array]:
    """Directions in the world: to the right and up in the picture, and to the viewer."""
    depth = np.array(EYE) / np.linalg.norm(EYE)
    across = np.cross((0.0, 0.0, 1.0), depth)
    across /= np.linalg.norm(across)
    return across, np.cross(depth, across), depth


def _line(start: Array, end: Array, colour: str, width: float) -> str:
    return f'<line x1="{start[0]:.1f}" y1="{start[1]:.1f}" x2="{end[0]:.1f}" y2="{end[1]:.1f}" stroke="{colour}" stroke-width="{width}"/>'
