"""Still images of a scene as figures of plotly, which a page renders with the plotly.js that it has."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ksl.base.markup import plotly
from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.mechanism import Joint, Loop
from ksl.mechanism.states import Array
from ksl.viewer.scene import ACTUATION, CONSTRAINT, ELEMENT, EXTERNAL, LOOP, Scene, child_of, scale_of
from ksl.viewer.shapes import Colour, Shape, arrows, ellipsoid, joined, rod, simplified

TRIANGLES = 4000
"""About so many triangles have all links in one image together: some 60 kB of JSON."""

HIGHLIGHT: Colour = (0.98, 0.78, 0.25)
"""The colour of the link that the joint in question carries."""

BONE: Colour = (0.45, 0.48, 0.52)
AXIS: Colour = (0.2, 0.22, 0.25)
"""The colour of rods between joints, and of joint axes."""
LOOP_MARK: Colour = (LOOP[0] / 255, LOOP[1] / 255, LOOP[2] / 255)
OF_ELEMENT: Colour = (ELEMENT[0] / 255, ELEMENT[1] / 255, ELEMENT[2] / 255)

LEVELS = ((0.5, (0.35, 0.65, 0.4)), (0.8, (0.9, 0.72, 0.2)), (1.0, (0.93, 0.45, 0.13)), (np.inf, (0.8, 0.15, 0.15)))
"""Colours of links by the utilisation of the joint that carries them: up to half of the limit, 80 %, the limit, and beyond."""

EYE = (1.0, -1.0, 0.5)
"""Direction from which the scene is seen."""

ZOOM = 2.1
"""Aspect ratio with which an orthographic camera of plotly.js shows in the height of the image what the range of an axis spans."""

PALETTE = 256

SEE_THROUGH = 0.35
"""Opacity of ellipsoids of inertia.  They reach beyond slender links: that of a thin rod is 1.29 times as long."""

Figure = dict[str, Any]
"""{"data": traces, "layout": layout}: what plotly.js draws; JSON-able."""


def still(
    scene: Scene, sample: int, joint: str | None = None, *, by_utilisation: bool = False, triangles: int = TRIANGLES, width: int = 480, height: int = 420
) -> Figure:
    """One state of a scene as a figure of plotly, with the wrench of a joint drawn at its origin.

    sample: which state of the scene.  joint: whose wrench is drawn, and whose link is highlighted; None draws no wrench.
    by_utilisation: links in colours of `LEVELS` instead.  triangles: of all links together.  width, height: in pixels.

    Returns {"data": [...], "layout": {...}} with numbers as base64 typed arrays, which plotly.js reads from version 2.35 on; about
    60 kB of JSON.  In a page: `Plotly.toImage({data, layout}, {format: "png", width, height})`, or `Plotly.newPlot` for one that turns.
    Force arrows have one head and moments two.  The longest has 0.4 of the scene's size; the scale is in the legend.  Raises ValueError for unknown joints.
    """
    shapes, ellipsoids = _links(scene, sample, joint, by_utilisation, triangles)
    shapes += _skeleton(scene, sample)
    legend: list[str] = []
    if joint is not None:
        arrows_of_joint, legend = _wrench(scene, sample, joint)
        shapes += arrows_of_joint
    eye = np.array(EYE) / np.linalg.norm(EYE)
    traces = [_mesh_trace(shapes, eye)] + ([_mesh_trace(ellipsoids, eye) | {"opacity": SEE_THROUGH}] if ellipsoids else [])
    return {"data": traces, "layout": _layout(shapes + ellipsoids, eye, legend, width, height)}


def _links(scene: Scene, sample: int, joint: str | None, by_utilisation: bool, triangles: int) -> tuple[list[Shape], list[Shape]]:
    """The surfaces and the ellipsoids of all links in the world, with a share of the triangles by the root of the number that they have."""
    highlighted = None if joint is None else child_of(scene.joints[scene.joint_index(joint)])
    colours = link_colours(scene, sample) if by_utilisation else {}
    counts = {(name, k): len(s.faces) ** 0.5 for name, shapes in scene.look.shapes.items() for k, s in enumerate(shapes)}
    total = sum(counts.values()) or 1.0
    shapes: list[Shape] = []
    ellipsoids: list[Shape] = []
    for i, name in enumerate(scene.model.link_names):
        for k, shape in enumerate(scene.look.shapes.get(name, [])):
            small = _small(scene, name, k, shape, max(12, int(triangles * counts[name, k] / total)))
            colour = colours.get(name) or (HIGHLIGHT if name == highlighted else shape.colour)
            (ellipsoids if name in scene.look.ellipsoids else shapes).append(Shape(small.vertices, small.faces, colour).moved(scene.poses[sample, i]))
    return shapes, ellipsoids


def _skeleton(scene: Scene, sample: int) -> list[Shape]:
    """Rods between the origins of joints, and axes of joints, where links have no surface of their own; joints that close loops, and force elements."""
    rods = [
        (scene.bones(sample), 0.004, BONE), (scene.axes(sample), 0.005, AXIS), (scene.loop_marks(sample), 0.005, LOOP_MARK), (scene.force_elements(sample), 0.004, OF_ELEMENT),
    ]  # fmt: skip
    return [rod(start, end, radius * scene.size, colour) for segments, radius, colour in rods for start, end in segments]


def _small(scene: Scene, name: str, k: int, shape: Shape, most: int) -> Shape:
    """The simplified surface, kept with the appearance, since a report has many images of the same robot."""
    key = (name, k, most)
    if key not in scene.look.simplified:
        scene.look.simplified[key] = simplified(shape, most)
    return scene.look.simplified[key]


def link_colours(scene: Scene, sample: int) -> dict[str, Colour]:
    """Colours of the links whose joint has a limit, by its utilisation."""
    shares = {j.child: x for j, x in zip(scene.model.joints, scene.utilisation[sample]) if np.isfinite(x)}
    return {name: next(colour for level, colour in LEVELS if x <= level) for name, x in shares.items()}


def _wrench(scene: Scene, sample: int, joint: str) -> tuple[list[Shape], list[str]]:
    """Arrows of the wrench at a joint and of external wrenches, and the lines of the legend."""
    i, radius = scene.joint_index(joint), 0.006 * scene.size
    origin = scene.origins[sample, i]
    in_scale = scale_of(np.stack([scene.constraint[sample, i], scene.actuation[sample, i], *(w[sample] for w in scene.placed.values())]), scene.size)
    parts: list[Shape] = []
    legend = []
    drawn = [("structure", CONSTRAINT, scene.constraint[sample, i], origin), (_mover(scene.joints[i]), ACTUATION, scene.actuation[sample, i], origin)]
    for name, wrench in scene.placed.items():
        drawn.append((f"external, on {name}", EXTERNAL, wrench[sample], scene.poses[sample, scene.model.link_names.index(name), :3, 3]))
    for words, colour, wrench, at in drawn:
        shapes, numbers = [], []
        for part, scale, unit, heads in ((wrench[:3], in_scale.force, "N", 1), (wrench[3:], in_scale.moment, "N m", 2)):
            size = float(np.linalg.norm(part))
            if size > 1e-9:
                shapes.append(arrows(at[None], part[None] * scale, radius, heads))
                numbers.append(f"{size:.4g} {unit}")
        if shapes:
            parts += [Shape(s.vertices, s.faces, _share(colour)) for s in shapes]
            legend.append(f'<span style="color:rgb{colour}">■</span> {plotly(words)}: {", ".join(numbers)}')
    ball = ellipsoid(np.full(3, 2.2 * radius), 12)
    parts.append(Shape(ball.vertices + origin, ball.faces, (0.1, 0.1, 0.1)))
    metre = (f"{_plain(1 / in_scale.force)} N", f"{_plain(1 / in_scale.moment)} N m (two heads)")
    return parts, [*legend, f"1 m of arrow: {metre[0]}, {metre[1]}"]


def _mover(joint: Joint | Loop) -> str:
    """What exerts the part of the wrench along the joint's motion: a floating base has no drive, and a mimic joint is moved by its leader."""
    follows = isinstance(joint, Joint) and joint.leader is not None
    return "support" if KINDS[joint.kind].is_free else "coupling" if follows else "drive"


def _plain(x: float) -> str:
    return f"{x:.6g}"


def _share(colour: tuple[int, int, int]) -> Colour:
    r, g, b = colour
    return (r / 255, g / 255, b / 255)


def _mesh_trace(shapes: list[Shape], towards_eye: Array) -> dict[str, Any]:
    """All surfaces as one mesh, shaded here: a triangle's intensity is the place of its colour in a palette of 256.

    One mesh is drawn much faster than one for each link, and the light of plotly.js leaves flat sides without contrast.
    """
    if not shapes:
        return {"type": "mesh3d", "x": [], "y": [], "z": [], "i": [], "j": [], "k": []}
    colours = list(dict.fromkeys(s.colour for s in shapes))[:PALETTE]
    shades = PALETTE // len(colours)
    whole = joined(shapes)
    brightness = _brightness(whole, towards_eye)
    of = np.concatenate([np.full(len(s.faces), colours.index(s.colour) if s.colour in colours else 0) for s in shapes])
    level = of * shades + np.minimum((brightness * shades).astype(int), shades - 1)
    dimmed = np.array(colours)[:, None] * (0.4 + 0.6 * (np.arange(shades) + 0.5) / shades)[:, None]
    palette = [f"rgb({r},{g},{b})" for r, g, b in np.rint(255 * np.clip(dimmed, 0.0, 1.0)).astype(int).reshape(-1, 3).tolist()]
    palette += [palette[-1]] * (PALETTE - len(palette))  # plotly.js samples a scale at 256 places: each is then one colour
    x, y, z = (_typed(whole.vertices[:, c], "f4") for c in range(3))
    i, j, k = (_typed(whole.faces[:, c], "u2" if len(whole.vertices) < 1 << 16 else "u4") for c in range(3))
    return {
        "type": "mesh3d", "x": x, "y": y, "z": z, "i": i, "j": j, "k": k,
        "intensity": _typed(level, "u1"), "intensitymode": "cell", "cmin": 0, "cmax": PALETTE - 1,
        "colorscale": [[n / (PALETTE - 1), c] for n, c in enumerate(palette)], "showscale": False, "flatshading": True, "hoverinfo": "skip",
        "lighting": {"ambient": 1, "diffuse": 0, "specular": 0, "fresnel": 0},
    }  # fmt: skip


def _brightness(shape: Shape, towards_eye: Array) -> Array:
    """From 0 to 1 for each triangle, by the angle between its normal and a light above and to the left of the eye."""
    corners = shape.vertices[shape.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    normal *= np.where(normal @ towards_eye < 0, -1.0, 1.0)[:, None]  # meshes of which some sides are inside out are usual
    left = np.cross(towards_eye, [0.0, 0.0, 1.0])
    light = towards_eye + 0.9 * np.array([0.0, 0.0, 1.0]) + 0.6 * left
    shade: Array = np.clip(normal @ light / np.linalg.norm(light), 0.0, 1.0)
    return shade


def _typed(x: NDArray[Any], dtype: str) -> dict[str, str]:
    """Numbers as plotly.js reads them: little-endian, in base64."""
    return {"dtype": dtype, "bdata": base64.b64encode(np.ascontiguousarray(x, dtype=f"<{dtype}").tobytes()).decode()}


def _layout(shapes: list[Shape], towards_eye: Array, legend: list[str], width: int, height: int) -> dict[str, Any]:
    """Axes and a camera such that everything fills the image, with the legend below."""
    points = np.concatenate([s.vertices for s in shapes]) if shapes else np.zeros((1, 3))
    right = np.cross([0.0, 0.0, 1.0], towards_eye)
    right /= np.linalg.norm(right)
    seen = points @ np.array([right, np.cross(towards_eye, right), towards_eye]).T
    across, upwards = np.ptp(seen[:, 0]), np.ptp(seen[:, 1])
    below = 18.0 * len(legend) + 8
    span = 1.06 * max(upwards, across * (height - below) / width, 1e-3)  # what the height of the image shows, m
    middle = (seen.max(axis=0) + seen.min(axis=0)) / 2 @ np.array([right, np.cross(towards_eye, right), towards_eye])
    reach = 1.01 * max(float(np.linalg.norm(points - middle, axis=1).max()), span / 2)  # what lies outside of the axes' ranges is cut
    axes = {f"{c}axis": {"visible": False, "range": [float(middle[i] - reach), float(middle[i] + reach)]} for i, c in enumerate("xyz")}
    eye = {c: float(x) for c, x in zip("xyz", 2 * towards_eye, strict=True)}
    lines = {"text": "<br>".join(legend), "xref": "paper", "yref": "paper", "x": 0, "y": 0, "xanchor": "left", "yanchor": "top", "showarrow": False}
    return {
        "width": width, "height": height, "margin": {"l": 0, "r": 0, "t": 0, "b": below}, "showlegend": False, "paper_bgcolor": "rgba(0,0,0,0)",
        "scene": {**axes, "aspectmode": "manual", "aspectratio": dict.fromkeys("xyz", ZOOM * 2 * reach / span), "camera": {"eye": eye, "projection": {"type": "orthographic"}}, "dragmode": "orbit"},
        "annotations": [lines | {"align": "left", "font": {"size": 12}}] if legend else [],
    }  # fmt: skip
