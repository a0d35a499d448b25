"""What links look like: the visuals of a URDF file, and ellipsoids of inertia for links without any."""

from __future__ import annotations

import os
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from ksl.base.limits import PICTURE
from ksl.mechanism.mechanism import Link, Mechanism
from ksl.robot_files.mesh_files import find_mesh, mesh_fault
from ksl.mechanism.states import Array
from ksl.viewer.shapes import GREY, Colour, Shape, box, cylinder, ellipsoid, simplified

TRIANGLES_OF_ALL = 200_000
"""The triangles of all links together: pages and exported files stay quick."""

ELLIPSOID: Colour = (0.55, 0.62, 0.72)
"""The colour of ellipsoids of inertia, which are no surfaces of the robot."""


@dataclass
class Appearance:
    """Surfaces of links, in the axes of the links."""

    shapes: dict[str, list[Shape]] = field(default_factory=dict)
    """By the name of the link.  Links that neither have a surface nor mass are missing."""
    ellipsoids: set[str] = field(default_factory=set)
    """Links that are drawn as ellipsoids of inertia."""
    simplified: dict[tuple[str, int, int], Shape] = field(default_factory=dict)
    """Surfaces with fewer triangles, by link, place in `shapes` and number of triangles: images share them."""
    notes: list[str] = field(default_factory=list)
    """What could not be drawn and why, a line each."""


def appearance(model: Mechanism, package_paths: Sequence[str | os.PathLike[str]] = (), triangles: int = 20_000) -> Appearance:
    """What the links of a model look like.

    The `<visual>` elements of its file where that is URDF: meshes (with the package trimesh), boxes, cylinders and spheres.
    A mesh that can't be found or read is replaced by that of the `<collision>` element, or else by the ellipsoid of inertia.
    package_paths: folders in which packages of `package://` are looked for, before those of the environment; see `ksl.robot_files.mesh_files.find_mesh`.
    triangles: surfaces with more are simplified.
    """
    found = Appearance()
    reader = _Reader(Path(model.file), package_paths, triangles, found.notes)
    for name, link in _urdf_links(model).items():
        shapes = _link_shapes(link, reader)
        if shapes:
            found.shapes[name] = shapes
    _within_budget(found.shapes)
    for each in model.links:
        if each.name not in found.shapes and each.mass > 0:
            found.shapes[each.name] = [inertia_ellipsoid(each)]
            found.ellipsoids.add(each.name)
    found.notes[:] = list(dict.fromkeys(found.notes))
    return found


def of_file(model: Mechanism, package_paths: Sequence[str | os.PathLike[str]] = ()) -> tuple[bool, list[str]]:
    """Whether surfaces of the model's file are drawn, and a line about meshes that can't be.  Looks where they are, and reads none: O(links)."""
    drawn, named, faults, of_packages = False, 0, [], False
    for link in _urdf_links(model).values():
        for kind in (kind for element in link.findall("visual") for kind in element.findall("geometry/*")):
            if kind.tag != "mesh":
                drawn = True
                continue
            named += 1
            filename = kind.get("filename", "")
            path = find_mesh(filename, Path(model.file), package_paths)
            fault = "is not found" if path is None else mesh_fault(path)
            drawn = drawn or fault is None
            faults += [f"{filename} {fault}"] if fault else []
            of_packages |= fault is not None and filename.startswith("package:")
    if named and find_spec("trimesh") is None:
        return drawn, ["pictures show no meshes: reading them needs the extra ksl[view] (pip install 'ksl[view]')"]
    if not faults:
        return drawn, []
    mend = "; ROS_PACKAGE_PATH names folders of packages" if of_packages else ""
    count = f"{len(faults)} of {named} meshes" if named > 1 else "the mesh"
    first = f", the first: {faults[0]}" if len(faults) > 1 else f": {faults[0]}"
    return drawn, [f"pictures are without {count} of the file{first}{mend}"]


def _within_budget(shapes: dict[str, list[Shape]]) -> None:
    """Simplifies the surfaces of a robot so that they have about TRIANGLES_OF_ALL triangles together, all by the same factor."""
    total = sum(len(s.faces) for parts in shapes.values() for s in parts)
    if total > TRIANGLES_OF_ALL:
        for name, parts in shapes.items():
            shapes[name] = [simplified(s, max(200, len(s.faces) * TRIANGLES_OF_ALL // total)) for s in parts]


def inertia_ellipsoid(link: Link) -> Shape:
    """The solid ellipsoid of uniform density that has the link's mass, centroid and inertia.

    Its semi-axes follow from I_x = m (b² + c²) / 5, cyclically.  Where the inertia is none that a body can have, a semi-axis is small.
    """
    centre = np.array(link.first_moment) / link.mass
    xx, yy, zz, xy, yz, zx = link.inertia
    about_origin = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
    about_centre = about_origin - link.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    principal, axes = np.linalg.eigh(about_centre)
    squares = 2.5 / link.mass * (principal.sum() - 2 * principal)
    semi_axes = np.sqrt(np.maximum(squares, 0.0))
    semi_axes = np.maximum(semi_axes, max(0.05 * float(semi_axes.max()), 1e-3))  # a rod or a point must be visible, too
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = axes * np.sign(np.linalg.det(axes)), centre
    return replace(ellipsoid(semi_axes).moved(pose), colour=ELLIPSOID)


# ---------------------------------------------------------------------------------------------------------------- URDF


def _urdf_links(model: Mechanism) -> dict[str, ET.Element]:
    """Elements of the links of a URDF file by name; none for other formats, and for models that were not loaded from a file."""
    try:
        root = ET.parse(model.file).getroot()
    except (OSError, ET.ParseError, ValueError):
        return {}
    if root.tag != "robot":
        return {}
    colours = {str(m.get("name")): c for m in root.findall("material") if (c := _colour(m.find("color"))) is not None}
    links = {}
    for link in root.findall("link"):
        for material in link.iter("material"):  # a name alone refers to a material of the whole robot
            own = _colour(material.find("color"))
            if own is None and material.get("name") in colours:
                ET.SubElement(material, "color", rgba=" ".join(map(str, (*colours[str(material.get("name"))], 1))))
            elif own is not None:
                colours.setdefault(str(material.get("name")), own)
        if link.get("name") in model.link_names:
            links[str(link.get("name"))] = link
    return links


def _colour(element: ET.Element | None) -> Colour | None:
    rgba = _numbers(element, "rgba")
    return None if len(rgba) < 3 else (float(rgba[0]), float(rgba[1]), float(rgba[2]))


def _numbers(element: ET.Element | None, attribute: str, otherwise: Sequence[float] = ()) -> Array:
    """The numbers of an attribute; `otherwise` where it is missing or holds anything else.  What is wrong in a file is for `ksl check` to say."""
    try:
        values = np.array([float(x) for x in ("" if element is None else element.get(attribute, "")).split()])
    except ValueError:
        values = np.empty(0)
    fits = len(values) == len(otherwise) or not len(otherwise)
    return values if len(values) and fits and np.isfinite(values).all() else np.array(otherwise, dtype=float)


def _pose(origin: ET.Element | None) -> Array:
    xyz, rpy = _numbers(origin, "xyz", (0, 0, 0)), _numbers(origin, "rpy", (0, 0, 0))
    pose = np.eye(4)
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    pose[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    pose[:3, 3] = xyz
    return pose


@dataclass(frozen=True)
class _Reader:
    """Reads surfaces that a robot file names."""

    robot_file: Path
    package_paths: Sequence[str | os.PathLike[str]]
    triangles: int
    notes: list[str]
    read: dict[Path, list[Shape]] = field(default_factory=dict)
    """Surfaces of the files that have been read: the legs of a robot often share theirs."""

    def shapes(self, element: ET.Element) -> list[Shape]:
        """Surfaces of a `<visual>` or `<collision>` element."""
        geometry, pose = element.find("geometry"), _pose(element.find("origin"))
        kind = None if geometry is None else next(iter(geometry), None)
        material = element.find("material")
        colour = _colour(material.find("color")) if material is not None else None
        shapes = [] if kind is None else self._mesh(kind, colour) if kind.tag == "mesh" else _primitive(kind)
        return [replace(s, colour=colour or s.colour).moved(pose) for s in shapes]

    def _mesh(self, element: ET.Element, colour: Colour | None) -> list[Shape]:
        filename = element.get("filename", "")
        path = find_mesh(filename, self.robot_file, self.package_paths)
        if path is None:
            mend = "--package-path DIR names a folder that has the package" if filename.startswith("package:") else "correct its name in the robot file"
            self.notes.append(f"mesh {filename} is not found: {mend}")
            return []
        scale = _numbers(element, "scale", (1, 1, 1))
        if path not in self.read:
            shapes, fault = read_mesh(path)
            if fault:
                self.notes.append(fault)
            limit = max(200, self.triangles // max(1, len(shapes)))
            self.read[path] = [simplified(s, limit) for s in shapes]
        return [replace(s, vertices=s.vertices * scale, colour=colour or s.colour) for s in self.read[path]]


def _link_shapes(link: ET.Element, reader: _Reader) -> list[Shape]:
    for tag in ("visual", "collision"):
        shapes = [shape for element in link.findall(tag) for shape in reader.shapes(element)]
        if shapes:
            return shapes
        if not link.findall(tag):  # collision bodies of links that the file means to be invisible stay so
            return []
    return []


def _primitive(element: ET.Element) -> list[Shape]:
    size = _numbers(element, "size", (0, 0, 0))
    radius, length = (_numbers(element, name, (0,)) for name in ("radius", "length"))
    if element.tag == "box":
        return [box(size)]
    if element.tag == "cylinder":
        return [cylinder(float(radius[0]), float(length[0]))]
    return [ellipsoid(np.full(3, float(radius[0])))] if element.tag == "sphere" else []


# --------------------------------------------------------------------------------------------------------------- meshes


def read_mesh(path: Path) -> tuple[list[Shape], str | None]:
    """The surfaces of a mesh file, one for each colour, and what went wrong if there are none."""
    known = mesh_fault(path)
    if known:
        return [], f"mesh {path} {known}"
    try:
        import trimesh
    except ImportError:
        return [], "meshes are not drawn: reading them needs the extra ksl[view] (pip install 'ksl[view]')"
    try:
        with _bounded_pictures():
            loaded = trimesh.load_scene(path)
        parts = [part for part in loaded.dump() if isinstance(part, trimesh.Trimesh) and len(part.faces)]
    except ImportError as e:
        return [], f"{path.suffix} meshes are not drawn: reading them needs the package {e.name or 'pycollada'}"
    except Exception as e:  # readers of many formats raise what they like
        return [], f"mesh {path} can't be read ({type(e).__name__}: {e}); export it again as STL or OBJ"
    if not parts:
        return [], f"mesh {path} has no triangles"
    for part in parts:
        part.merge_vertices(merge_tex=True, merge_norm=True)  # flat shading needs neither; a third of the numbers
    return [Shape(np.asarray(part.vertices, dtype=float), np.asarray(part.faces, dtype=np.int32), _mesh_colour(part)) for part in parts], None


@contextmanager
def _bounded_pictures() -> Iterator[None]:
    """Pictures of materials that unpack to more are left out by trimesh, as those that it can't read; only colours of materials are drawn."""
    try:
        from PIL import Image
    except ImportError:
        yield
        return
    before, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, PICTURE // 2  # Pillow warns from there on, and refuses twice as many
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            yield
    finally:
        Image.MAX_IMAGE_PIXELS = before


def _mesh_colour(mesh: object) -> Colour:
    """The colour of the material, or the mean of the colours of faces; grey where the file gives none."""
    visual = getattr(mesh, "visual", None)
    material = getattr(visual, "material", None)
    rgba = getattr(material, "main_color", None) if material is not None else getattr(visual, "main_color", None)
    if rgba is None or not getattr(visual, "defined", False):
        return GREY
    r, g, b = (float(x) / 255 for x in rgba[:3])
    return (r, g, b)
