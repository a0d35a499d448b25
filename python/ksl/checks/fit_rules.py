"""Rules that compare masses and inertias with the size of the link's geometry: wrong points and wrong units.

The second moment of a body about its centroid along an axis is at most m (upper − c)(c − lower), when the body lies between lower
and upper and c is its centroid (Bhatia and Davis, A better bound on the variance, American Mathematical Monthly 107, 2000).
So there are inertias that no distribution of the mass within the geometry has.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ksl.checks.extent import link_box
from ksl.checks.inertia_rules import TOLERANCE, placeholders, principal_moments, usable
from ksl.checks.repair import shown
from ksl.checks.robot import Array, Inertial, Link, RobotFile
from ksl.checks.rule import Broken, rule

MARGIN = 0.25
"""Of the box's diagonal, by which the body may reach beyond its geometry: covers, cables, screws and motors are often not drawn."""
ROOM = 0.01
"""m, the least margin."""
MARKER = 0.011
"""m.  Shapes up to this size often only mark a frame."""
DENSEST = 25_000.0
"""kg/m³ of the box around the geometry.  Tungsten and gold have 19,300, osmium has 22,600."""
LIGHTEST = 0.1
"""kg/m³ of the box.  Air has 1.2; hollow parts, thin legs and plates in their boxes have at least 10."""
SMALLEST = 1e-3
"""m³: lightweight parts below it are not judged by their density: markers, sensors and points of contact are given token masses."""
WRONG_UNITS = 100.0
"""Ratio of second moments beyond which units are the likely cause: 10 times in length."""
LOOSE = 1.5
"""How much more room than its geometry a body may need: drives are often drawn with the link before."""
FACTORS = ((1e3, "g m²"), (1e4, "kg cm²"), (1e6, "kg mm²"), (1e7, "g cm²"), (1e9, "g mm²"))
"""How many times too large a number in these units is, when it is read as kg m²."""


@dataclass
class Fit:
    """An inertia and the box that the body must lie in."""

    link: Link
    inertial: Inertial
    box: Array
    size: Array
    """(3,) of the geometry."""

    @property
    def inside(self) -> bool:
        return bool((self.inertial.centroid >= self.box[0]).all() and (self.inertial.centroid <= self.box[1]).all())

    def excess(self, moments: Array) -> float:
        """Largest ratio of a second moment (3, 3 in link axes) to what the box allows."""
        second = (np.trace(moments) / 2 - np.diag(moments)) / (self.inertial.mass or 1.0)
        allowed = (self.box[1] - self.inertial.centroid) * (self.inertial.centroid - self.box[0])
        return float((second / allowed).max())


def _fits(robot: RobotFile) -> list[Fit]:
    """Of all links whose inertia and geometry are known; computed once for each file."""
    cached: list[Fit] | None = robot.__dict__.get("_fits")
    if cached is None:
        cached = []
        told = {link.name for links in placeholders(robot) for link in links}
        for link in robot.links:
            inertial = None if link.name in told else usable(link)
            box = link_box(robot, link) if inertial is not None and link.shapes and robot.matters(link) else None
            if inertial is None or box is None or (box[1] - box[0]).max() <= MARKER:
                continue
            size = box[1] - box[0]
            margin = max(MARGIN * float(np.linalg.norm(size)), ROOM)
            cached.append(Fit(link, inertial, box + [[-margin], [margin]], size))
        robot.__dict__["_fits"] = cached
    return cached


def about_origin(fit: Fit) -> Array | None:
    """The moments about the centroid (link axes), if those of the file are about the link's origin; None if no body in the box has them."""
    I, c, m = fit.inertial.in_link_axes, fit.inertial.centroid, fit.inertial.mass or 0.0
    assert I is not None
    moved = I - m * (c @ c * np.eye(3) - np.outer(c, c))
    low, middle, high = principal_moments(moved)
    possible = low >= -TOLERANCE * high and high <= (middle + low) * (1 + 1e-3) and high > 0
    return moved if possible and fit.excess(moved) <= 1 else None


def _of_size(size: Array) -> str:
    return f"geometry {' × '.join(shown(x) for x in size)} m"


@rule(
    "centroid-outside",
    "warning",
    condition="The centroid lies within the link's geometry, or near it.",
    cause="The centroid is in millimetres, in other axes or from another origin than the link's.",
    repair="Give the centroid in m, in the link's axes, from its origin.",
)
def centroid_outside(robot: RobotFile) -> Iterator[Broken]:
    for fit in _fits(robot):
        if not fit.inside:
            c = fit.inertial.centroid
            away = float(np.linalg.norm(np.maximum(np.maximum(fit.box[0] - c, c - fit.box[1]), 0)))
            cause = "The centroid is in millimetres." if away > 50 * float(fit.size.max()) else None
            found = f"centroid {' '.join(shown(x) for x in c)} m, {_of_size(fit.size)}"
            yield Broken(found, fit.inertial.line, "link", fit.link.name, away, cause=cause)


@rule(
    "inertia-about-origin",
    "warning",
    condition="Moments are about the centroid; about it, the mass fits into the link's geometry.",
    cause="The moments are about the link's origin: taken about the origin they are those of a body of this size.",
    repair="Subtract m (c² 1 − c cᵀ), c being the centroid.",
    fix="subtracts m (c² 1 − c cᵀ) from the moments",
)
def inertia_about_origin(robot: RobotFile) -> Iterator[Broken]:
    for fit in _fits(robot):
        I = fit.inertial.in_link_axes
        assert I is not None
        if not fit.inside or fit.excess(I) <= 1:
            continue
        moved = about_origin(fit)
        if moved is not None:
            found = f"moments {_diagonal(I)} kg m² need more room than the {_of_size(fit.size)}; about the origin they leave {_diagonal(moved)}"
            yield Broken(found, fit.inertial.line, "link", fit.link.name, fit.excess(I), fix=_moved(fit.inertial, moved) if robot.format == "urdf" else None)


def _diagonal(I: Array) -> str:
    return ", ".join(shown(x) for x in np.diag(I))


def _moved(inertial: Inertial, moments: Array):  # type: ignore[no-untyped-def]
    def change() -> str:
        from ksl.checks.repair import digits

        assert inertial.element is not None
        own = inertial.rotation.T @ moments @ inertial.rotation  # in the axes of the file's <origin>
        inertia = inertial.element.find("inertia")
        for name, (i, j) in {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}.items():
            inertia.set(name, digits(float(own[i, j])))
        return f"moments are now about the centroid: {_diagonal(own)} kg m²"

    return change


@rule(
    "inertia-units",
    "warning",
    condition=f"Moments in kg m² agree with the mass and the size of the geometry, to a factor of {WRONG_UNITS:g}.",
    cause="The moments are in other units than kg m².",
    repair="Convert the moments to kg m², and look whether the mass is in kg.",
)
def inertia_units(robot: RobotFile) -> Iterator[Broken]:
    for fit in _fits(robot):
        I = fit.inertial.in_link_axes
        assert I is not None
        if not I.any() or (fit.inside and about_origin(fit) is not None and fit.excess(I) > 1):
            continue
        mass = fit.inertial.mass or 1.0
        # centre the box on the centroid where that is outside: another rule says so
        half = np.maximum(np.linalg.norm(fit.size) / 2 * (1 + 2 * MARGIN), ROOM)
        ratio = float(np.trace(I) / 2 / mass / half**2)
        gyration = float(np.sqrt(max(np.trace(I) / 2, 0) / mass))
        found = f"moments {_diagonal(I)} kg m² and mass {shown(mass)} kg: radius of gyration {shown(gyration)} m, {_of_size(fit.size)}"
        if ratio > WRONG_UNITS:
            likely = [unit for factor, unit in FACTORS if 1e-3 < ratio / factor < 1]
            cause = f"The moments are in {' or '.join(likely)}." if likely else None
            if np.ptp(np.diag(I)) == 0:
                cause = "A placeholder: all moments are equal." + (f" Otherwise they are in {' or '.join(likely)}." if likely else "")
            yield Broken(found, fit.inertial.line, "link", fit.link.name, gyration, cause=cause)
        elif 0 < gyration < float(fit.size.max()) / 300 and fit.size.max() > 0.02:
            yield Broken(found, fit.inertial.line, "link", fit.link.name, gyration, cause="The moments are too small by a factor of units, or a placeholder.")


@rule(
    "inertia-too-large",
    "warning",
    condition=f"The mass can be distributed within {LOOSE:g} times the room of the geometry so that it has these moments.",
    cause="The moments are of another part, about another point, or a placeholder.",
    repair="Take mass, centroid and moments from the CAD program again.",
)
def inertia_too_large(robot: RobotFile) -> Iterator[Broken]:
    told = {broken.name for broken in inertia_units.check(robot)}
    for fit in _fits(robot):
        I = fit.inertial.in_link_axes
        assert I is not None
        if not fit.inside or fit.link.name in told:
            continue
        excess = fit.excess(I)
        if excess > LOOSE**2 and about_origin(fit) is None:
            found = f"moments {_diagonal(I)} kg m² and mass {shown(fit.inertial.mass or 0.0)} kg need {np.sqrt(excess):.3g} times the room of the {_of_size(fit.size)}"
            yield Broken(found, fit.inertial.line, "link", fit.link.name, excess)


@rule(
    "mass-units",
    "warning",
    condition=f"The mass, in the box around the geometry, has a density between {LIGHTEST:g} and {DENSEST:,.0f} kg/m³.",
    cause="The mass is in grams.",
    repair="Give the mass in kg.",
)
def mass_units(robot: RobotFile) -> Iterator[Broken]:
    for fit in _fits(robot):
        mass, size = fit.inertial.mass or 0.0, np.maximum(fit.size, 1e-3)
        volume = float(np.prod(size))
        density = mass / volume
        found = f"mass {shown(mass)} kg, {_of_size(fit.size)}: {shown(density)} kg/m³"
        # around a small or thin part its fastenings may weigh more than itself
        padded = mass / float(np.prod(size + 2 * ROOM))
        if padded > DENSEST:
            yield Broken(found, fit.inertial.line, "link", fit.link.name, density)
        elif density < LIGHTEST and volume > SMALLEST:
            cause = "The mass is in tonnes, a placeholder, or that of another part, or the geometry is in mm."
            yield Broken(found, fit.inertial.line, "link", fit.link.name, density, cause=cause)


RULES = [centroid_outside, inertia_about_origin, inertia_units, inertia_too_large, mass_units]
