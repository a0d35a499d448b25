"""A scene in the scene tree of viser: what the live page and the exported file share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ksl.mechanism.mechanism import Joint, Loop
from ksl.mechanism.states import Array
from ksl.viewer.labels import labels
from ksl.viewer.scene import ACTUATION, CENTRE, CONSTRAINT, ELEMENT, EXTERNAL, LOOP, SCREW, Scene, has_axis, moves, sizes
from ksl.viewer.shapes import GREY, ellipsoid, unit_head, unit_shaft
from ksl.viewer.still import LEVELS, link_colours

if TYPE_CHECKING:
    import viser

BACKGROUND = (226, 231, 237)
"""Before which links are seen: many are white or light grey, which is lost before white."""
OF_ELLIPSOIDS, DARKER = 0.55, 0.6
"""Opacity of ellipsoids of inertia, and the share of their colour: thinner and lighter ones are lost before the background."""
ENVIRONMENT = 0.5
"""The share of the light from all sides.  The whole of it, as viser has it, leaves no side of a link in its own colour."""


@dataclass
class Shown:
    """What is drawn besides the links."""

    wrenches: str = "moving"
    """At which joints: "moving", "all", "none", or the name of one."""
    forces: bool = True
    moments: bool = True
    frames: bool = False
    """Frames of links, which are those of the joints that carry them, with the names of the links."""
    joints: bool = False
    """Axes of all joints, with their names.  The axes of robots without surfaces are always drawn."""
    centre_of_mass: bool = False
    external: bool = True
    screw_axis: bool = False
    utilisation: bool = False
    selected: str = ""
    """The joint whose screw axis is drawn, and whose label is shown."""
    arrow_factor: float = 1.0
    recorded: bool = False
    """Whether what is hidden moves, too, since the reader of a file can show it."""


class Stage:
    """Nodes of a scene in the tree of a viser server, and their motion from state to state."""

    def __init__(self, server: viser.ViserServer, scene: Scene, shown: Shown) -> None:
        self.server, self.scene, self.shown = server, scene, shown
        self._tree = server.scene
        self._quaternions: dict[int, Array] = {}
        self._tree.set_up_direction("+z")
        self._tree.configure_environment_map("warehouse", environment_intensity=ENVIRONMENT)
        self._tree.set_background_image(np.full((2, 2, 3), BACKGROUND, dtype=np.uint8))
        self._add_ground()
        links, joints = scene.model.link_names, [j.name for j in scene.joints]
        self._link_nodes = dict(zip(links, _nodes(links, "link"), strict=True))
        self._shown_joints = labels(joints, "joint")
        self._links = [
            self._tree.add_frame(f"/links/{node}", show_axes=False, axes_length=0.06 * scene.size, axes_radius=0.002 * scene.size)
            for node in self._link_nodes.values()
        ]
        self._surfaces = {name: self._add_surfaces(name) for name in links}
        shown_links = zip(self._link_nodes.values(), labels(links, "link"), strict=True)
        self._frame_names = [self._tree.add_label(f"/links/{node}/name", label, visible=False, anchor="bottom-right") for node, label in shown_links]
        self._bones = self._segments("/mechanism/links", scene.bones(0), (115, 122, 133), 4.0)
        self._axes = self._segments("/mechanism/axes", scene.axes(0), (50, 55, 64), 5.0)
        self._all_axes = self._segments("/mechanism/joint_axes", self._axis_segments(scene, 0), (50, 55, 64), 3.0)
        self._loops = self._segments("/mechanism/loops", scene.loop_marks(0), LOOP, 5.0)
        self._gaps = self._segments("/mechanism/gaps", scene.loop_gaps(0), LOOP, 1.5)
        self._elements = self._segments("/mechanism/force_elements", scene.force_elements(0), ELEMENT, 4.0)
        self._labels = [
            self._tree.add_label(f"/joints/{node}", label, visible=False) for node, label in zip(_nodes(joints, "joint"), self._shown_joints, strict=True)
        ]
        self._structure, self._drive = (_Arrows(self._tree, name, 2 * len(scene.joints), c) for name, c in (("structure", CONSTRAINT), ("drive", ACTUATION)))
        self._external = _Arrows(self._tree, "external", 2 * len(scene.placed), EXTERNAL) if scene.placed else None
        ball = ellipsoid(np.full(3, 0.015 * scene.size))
        self._centre = self._tree.add_mesh_simple("/centre_of_mass", _f4(ball.vertices), ball.faces.astype(np.uint32), color=CENTRE)
        self._screw = _Arrows(self._tree, "screw_axis", 1, SCREW)
        self._screw_line = self._segments("/screw_axis/line", np.zeros((1, 2, 3)), SCREW, 2.0)
        self._set_camera()
        self.show(scene, 0)

    def show(self, scene: Scene, sample: int) -> None:
        """Moves everything to one state of a scene of the same robot."""
        shown, poses = self.shown, scene.poses[sample]
        with self.server.atomic():
            for i, (node, wxyz) in enumerate(zip(self._links, _quaternions(poses[:, :3, :3]), strict=True)):
                _set(node, "position", poses[i, :3, 3])
                _set(node, "wxyz", wxyz)
                _set(node, "show_axes", shown.frames)
            for name in self._frame_names:
                _set(name, "visible", shown.frames)
            self._show_colours(scene, sample)
            self._show_lines(scene, sample)
            self._show_wrenches(scene, sample)
            self._show_labels(scene, sample)
            _set(self._centre, "visible", shown.centre_of_mass)
            _set(self._centre, "position", scene.centre_of_mass[sample])
            self._show_screw(scene, sample)

    # ---------------------------------------------------------------------------------------------------------- links

    def _add_ground(self) -> None:
        low, high = self.scene.bounds(0)
        cell = 10.0 ** np.floor(np.log10(self.scene.size / 2))  # 0.1 m for robots from 0.2 m to 20 m
        edge = float(10 * cell * np.ceil(0.22 * self.scene.size / cell))
        self._tree.add_grid("/ground", edge, edge, cell_size=float(cell), section_size=float(10 * cell), position=(0.0, 0.0, min(0.0, float(low[2]))))

    def _add_surfaces(self, name: str) -> list[tuple[Any, tuple[int, int, int]]]:
        surfaces = []
        for k, shape in enumerate(self.scene.look.shapes.get(name, [])):
            inertia = name in self.scene.look.ellipsoids  # no surface of the robot: what is inside must be seen
            colour = _bytes(_darker(shape.colour) if inertia else shape.colour)
            mesh = self._tree.add_mesh_simple(
                f"/links/{self._link_nodes[name]}/surface{k}", _f4(shape.vertices), shape.faces.astype(np.uint32), color=colour, opacity=OF_ELLIPSOIDS if inertia else None,
                flat_shading=not inertia, side="front" if inertia else "double", cast_shadow=not inertia,
            )  # fmt: skip
            surfaces.append((mesh, colour))
        return surfaces

    def _show_colours(self, scene: Scene, sample: int) -> None:
        colours = link_colours(scene, sample) if self.shown.utilisation else {}
        for name, surfaces in self._surfaces.items():
            for mesh, own in surfaces:
                without = _bytes(GREY) if self.shown.utilisation else own
                _set(mesh, "color", _bytes(colours[name]) if name in colours else without)

    def _segments(self, name: str, segments: Array, colour: tuple[int, int, int], width: float) -> Any:
        return self._tree.add_line_segments(name, _f4(segments), colors=colour, thickness=width, thickness_units="screen") if len(segments) else None

    def _axis_segments(self, scene: Scene, sample: int) -> Array:
        joints = [(i, j) for i, j in enumerate(scene.joints) if has_axis(j)]
        origin, direction = scene.origins[sample][[i for i, _ in joints]], _axes_in_world(scene, sample, joints)
        return np.stack([origin - 0.07 * scene.size * direction, origin + 0.07 * scene.size * direction], axis=1)

    def _show_lines(self, scene: Scene, sample: int) -> None:
        lines = (
            (self._bones, scene.bones),
            (self._axes, scene.axes),
            (self._loops, scene.loop_marks),
            (self._gaps, scene.loop_gaps),
            (self._elements, scene.force_elements),
        )
        for node, segments in lines:
            if node is not None:
                _set(node, "points", _f4(segments(sample)))
        if self._all_axes is not None:
            _set(self._all_axes, "visible", self.shown.joints)
            if self.shown.joints or self.shown.recorded:
                _set(self._all_axes, "points", _f4(self._axis_segments(scene, sample)))

    # ------------------------------------------------------------------------------------------------------- wrenches

    def _show_wrenches(self, scene: Scene, sample: int) -> None:
        visible = np.array([self._has_arrows(j) for j in scene.joints])
        for arrows, wrench in ((self._structure, scene.constraint[sample]), (self._drive, scene.actuation[sample])):
            arrows.show(scene.origins[sample], self._lengths(wrench * visible[:, None]), scene.size)
        if self._external is not None:
            names = scene.model.link_names
            origins = np.array([scene.poses[sample, names.index(name), :3, 3] for name in scene.placed])
            wrench = np.array([w[sample] for w in scene.placed.values()])
            self._external.show(origins, self._lengths(wrench * self.shown.external), scene.size)

    def _has_arrows(self, joint: Joint | Loop) -> bool:
        chosen = self.shown.wrenches
        return chosen == "all" or joint.name == chosen or (chosen == "moving" and moves(joint))

    def _lengths(self, wrench: Array) -> Array:
        """Arrows (n, 2, 3) of forces and moments, m, in the scale that all states share."""
        scale, factor = self.scene.scale, self.shown.arrow_factor
        return np.stack([wrench[:, :3] * scale.force * self.shown.forces, wrench[:, 3:] * scale.moment * self.shown.moments], axis=1) * factor

    def _show_labels(self, scene: Scene, sample: int) -> None:
        total = scene.constraint[sample] + scene.actuation[sample]
        for i, (label, joint) in enumerate(zip(self._labels, scene.joints, strict=True)):
            can_move, selected = moves(joint), joint.name == self.shown.selected
            wanted = selected or (self.shown.joints and can_move)
            _set(label, "visible", wanted)
            if wanted or (self.shown.recorded and can_move):
                force, moment = sizes(total[i, :3]), sizes(total[i, 3:])
                numbers = f": {force:.4g} N, {moment:.4g} N m{_effort(scene, sample, i)}" if selected or self.shown.recorded else ""
                _set(label, "text", self._shown_joints[i] + numbers)  # numbers of all joints would cover the robot
                _set(label, "position", scene.origins[sample, i])

    def _show_screw(self, scene: Scene, sample: int) -> None:
        found = scene.screw_axis(sample, self.shown.selected) if self.shown.screw_axis and self.shown.selected else None
        _set(self._screw_line, "visible", found is not None)
        point, angular = (np.zeros(3), np.zeros(3)) if found is None else found[:2]
        length = 0.3 * scene.size * angular / max(float(np.linalg.norm(angular)), 1e-12)
        self._screw.show(point[None], np.stack([length, np.zeros(3)])[None], scene.size)
        _set(self._screw_line, "points", _f4(np.array([[point - 3 * length, point + 3 * length]])))

    def _set_camera(self) -> None:
        """From the front, the right and above; the sphere about all links, wherever the motion takes them, fills the height of the page."""
        low, high = self.scene.reach
        centre, radius = (low + high) / 2, max(float(np.linalg.norm(high - low)), 1e-3) / 2
        camera = self.server.initial_camera
        camera.fov = 0.7
        direction = np.array([1.0, -1.0, 0.55])
        distance = radius / np.sin(camera.fov / 2)
        camera.look_at, camera.position = centre, centre + distance * direction / np.linalg.norm(direction)


class _Arrows:
    """Arrows of one colour under one name of the tree: for each place a force with one head, and a moment with two."""

    def __init__(self, tree: Any, name: str, count: int, colour: tuple[int, int, int]) -> None:
        self._nodes = []
        for part, shape, n in (("shafts", unit_shaft(), count), ("heads", unit_head(), count // 2 * 3 if count > 1 else 1)):
            still, zero = np.tile([1.0, 0, 0, 0], (n, 1)), np.zeros((n, 3))
            self._nodes.append(
                tree.add_batched_meshes_simple(
                    f"/{name}/{part}", _f4(shape.vertices), shape.faces.astype(np.uint32), _f4(still), _f4(zero), batched_scales=_f4(zero), batched_colors=_linear(colour),
                    lod="off", cast_shadow=False, receive_shadow=False,
                )
            )  # fmt: skip

    def show(self, origin: Array, vectors: Array, size: float) -> None:
        """Arrows from origins (n, 3) along vectors (n, 2, 3), m."""
        length = np.linalg.norm(vectors, axis=2)
        radius = 0.005 * size
        heads = np.array([1.0, 2.0])
        head = np.minimum(6 * radius, 0.4 * length / heads)  # short arrows are thinner, too
        thick = head / 6
        along = vectors / np.maximum(length, 1e-300)[..., None]
        wxyz = _turn_of_z(along)
        shaft = np.stack([thick, thick, length - heads * head], axis=-1)
        starts = np.broadcast_to(origin[:, None], vectors.shape)
        tips = np.stack([length[:, 0] - head[:, 0], length[:, 1] - head[:, 1], length[:, 1] - 2 * head[:, 1]], axis=1)
        of = np.array([0, 1, 1])
        cone = np.stack([2.4 * thick, 2.4 * thick, head], axis=-1)[:, of]
        self._set(0, starts, wxyz, shaft)
        self._set(1, origin[:, None] + tips[..., None] * along[:, of], wxyz[:, of], cone)

    def _set(self, k: int, positions: Array, wxyz: Array, scales: Array) -> None:
        node = self._nodes[k]
        n = len(node.batched_positions)  # one arrow alone has no moment
        for name, x, width in (("batched_positions", positions, 3), ("batched_wxyzs", wxyz, 4), ("batched_scales", scales, 3)):
            _set(node, name, _f4(x.reshape(-1, width)[:n]))


def _effort(scene: Scene, sample: int, i: int) -> str:
    if not np.isfinite(scene.effort[sample, i]):
        return ""
    unit = "N m" if scene.model.joints[i].has_angle else "N"  # of loop joints there is none
    share = scene.utilisation[sample, i]
    return f"; drive {scene.effort[sample, i]:.4g} {unit}" + (f", {share:.0%} of its limit" if np.isfinite(share) else "")


def _axes_in_world(scene: Scene, sample: int, joints: list[tuple[int, Joint | Loop]]) -> Array:
    rotations = scene.frames[sample][[i for i, _ in joints], :3, :3]
    both: Array = np.einsum("kij,kj->ki", rotations, np.array([j.axis for _, j in joints]).reshape(-1, 3))
    return both


def legend(scene: Scene, factor: float = 1.0) -> list[tuple[tuple[int, int, int] | None, str]]:
    """Lines of the legend, each with its colour."""
    force, moment = 1 / scene.scale.force / factor, 1 / scene.scale.moment / factor
    lines: list[tuple[tuple[int, int, int] | None, str]] = [(CONSTRAINT, "what the structure carries"), (ACTUATION, "what the drive exerts")]
    lines += [(EXTERNAL, "external wrenches")] if scene.placed else []
    lines += [(LOOP, "joints that close loops")] if scene.model.loops else []
    if scene.model.force_elements:
        acts = "" if "force elements" in scene.model.physics else ", which don't act: physics doesn't name force elements"
        lines.append((ELEMENT, f"springs, dampers and cylinders between points{acts}"))
    return [*lines, (None, f"one head: force, 1 m is {force:.6g} N"), (None, f"two heads: moment, 1 m is {moment:.6g} N m")]


def utilisation_legend() -> list[tuple[tuple[int, int, int], str]]:
    """Colours of links by utilisation."""
    words = ("up to 50 % of the effort limit", "up to 80 %", "up to 100 %", "beyond the limit")
    return [(_bytes(colour), text) for (_, colour), text in zip(LEVELS, words, strict=True)]


def _set(node: Any, name: str, value: Any) -> None:
    """Sets a property if it differs: each assignment is a message to all pages, and a part of an exported file."""
    if name == "visible":
        if node.visible != value:
            node.visible = value
    elif not np.array_equal(getattr(node, name), value):
        setattr(node, name, value)


def _nodes(names: Sequence[str], what: str) -> list[str]:
    """Names of nodes, which a slash would separate in viser's tree."""
    return labels([name.replace("/", "_") for name in names], what)


def _f4(x: Array) -> Any:
    return np.ascontiguousarray(x, dtype=np.float32)


def _linear(colour: tuple[int, int, int]) -> tuple[int, int, int]:
    """A colour without the gamma of sRGB, as the page takes it for meshes that it draws in batches."""
    r, g, b = ((c / 255) ** 2.2 for c in colour)
    return _bytes((r, g, b))


def _darker(colour: tuple[float, float, float]) -> tuple[float, float, float]:
    r, g, b = colour
    return DARKER * r, DARKER * g, DARKER * b


def _bytes(colour: tuple[float, float, float]) -> tuple[int, int, int]:
    r, g, b = (round(255 * min(max(x, 0.0), 1.0)) for x in colour)
    return (r, g, b)


def _quaternions(rotations: Array) -> Array:
    """Unit quaternions w x y z (n, 4) of rotations (n, 3, 3)."""
    from viser.transforms import SO3

    return np.asarray(SO3.from_matrix(rotations).wxyz)


def _turn_of_z(along: Array) -> Array:
    """Quaternions w x y z (…, 4) of the shortest rotations of z to unit vectors (…, 3)."""
    x, y, z = np.moveaxis(along, -1, 0)
    wxyz = np.stack([1 + z, -y, x, np.zeros_like(z)], axis=-1)
    length = np.linalg.norm(wxyz, axis=-1, keepdims=True)
    turned: Array = np.where(length > 1e-9, wxyz / np.maximum(length, 1e-9), np.array([0.0, 1.0, 0.0, 0.0]))
    return turned
