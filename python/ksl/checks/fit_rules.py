"""Rules that compare masses and inertias with the size of the link's geometry: wrong points and wrong units.

The second moment of a body about its centroid along an axis is at most m (upper − c)(c − lower), when the body lies
between lower
and upper and c is its centroid (Bhatia and Davis, A better bound on the variance, American Mathematical Monthly 107,
2000).
So there are inertias that no distribution of the mass within the geometry has.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ksl.checks.extent import link_box
from ksl.checks.description.findings import Repair
from ksl.checks.inertia_rules import TOLERANCE, placeholders, principal_moments, usable
from ksl.checks.description.repair import digits, shown
from ksl.checks.description.robot import Array, Inertial, FileLink, RobotFile
from ksl.checks.rule import Broken, rule

MARGIN = 0.25
"""The share of the box's diagonal by which the body may reach beyond its geometry: covers, cables, screws and motors are often
not drawn."""
ROOM = 0.01
"""m, the least margin."""
MARKER = 0.011
"""m.  Shapes up to this size often only mark a frame."""
DENSEST = 25_000.0
"""kg/m³ of the box around the geometry.  Tungsten and gold have 19,300, osmium has 22,600."""
LIGHTEST = 0.1
"""kg/m³ of the box.  Air has 1.2; hollow parts, thin legs and plates in their boxes have at least 10."""
SMALLEST = 1e-3
"""m³: lightweight parts below it are not judged by their density: markers, sensors and points of contact are given
token masses."""
WRONG_UNITS = 100.0
"""Ratio of second moments beyond which units are the likely cause: 10 times in length."""
LOOSE = 1.5
"""How much more room than its geometry a body may need: drives are often drawn with the link before."""
ABOUT_END, NEAR, ORDINARY, CHANGES = 2.0, 0.25, (0.15, 2.0), 0.1
"""What makes it likely that moments are about the link's origin; see about_origin."""
PARTS = ("bumper", "sensor", "antenna", "marker", "contact", "caster")
"""Words in names of shapes that stand for a part of a link."""
SOLID = 6000.0
"""kg/m³ of the box around a geometry.  Motors in their boxes have less: where it is more, the geometry is not the whole link."""
SLACK = 1.1
"""So much larger than the box with a link's moments a geometry may be to be a part in it."""
LIKELY = (0.02, 1.0)
"""Ratio of the squares of radius of gyration and half diagonal: a bar has 1/3, a hollow part more, a heavy core
0.05."""
FACTORS = ((1e3, "g m²"), (1e4, "kg cm²"), (1e6, "kg mm²"), (1e7, "g cm²"), (1e9, "g mm²"))
"""How many times too large a number in these units is, when it is read as kg m²."""


@dataclass
class Fit:
    """An inertia and the box that the body must lie in."""

    link: FileLink
    inertial: Inertial
    box: Array
    size: Array
    """(3,) of the geometry."""
    mass: float
    """kg, above zero."""

    @property
    def inside(self) -> bool:
        return bool((self.inertial.centroid >= self.box[0]).all() and (self.inertial.centroid <= self.box[1]).all())

    def excess(self, moments: Array) -> float:
        """Largest ratio of a second moment (3, 3 in link axes) to what the box allows."""
        second = (np.trace(moments) / 2 - np.diag(moments)) / self.mass
        allowed = (self.box[1] - self.inertial.centroid) * (self.inertial.centroid - self.box[0])
        return float((second / allowed).max())


def _fits(robot: RobotFile) -> list[Fit]:
    """The fits of all links whose inertia and geometry are known; computed once for each file."""
    cached: list[Fit] | None = robot.__dict__.get("_fits")
    if cached is None:
        cached = []
        told = {link.name for links in placeholders(robot) for link in links}
        for link in robot.links:
            inertial = None if link.name in told else usable(link)
            box = link_box(robot, link) if inertial is not None and link.shapes and robot.matters(link) else None
            if inertial is None or inertial.mass is None or box is None or (box[1] - box[0]).max() <= MARKER:
                continue
            size = box[1] - box[0]
            moments = inertial.in_link_axes
            if moments is None or not (np.isfinite(size).all() and np.isfinite(moments).all()):
                continue  # beyond the range of numbers
            margin = max(MARGIN * float(np.linalg.norm(size)), ROOM)
            cached.append(Fit(link, inertial, box + [[-margin], [margin]], size, inertial.mass))
        robot.__dict__["_fits"] = cached
    return cached


def about_origin(fit: Fit) -> Array | None:
    """The moments about the centroid (3, 3 in link axes), if those of the file are likely about the link's origin;
    None otherwise.

    Looks along the line from the origin to the centroid.  A uniform bar of length L has the second moment m L²/12
    about its centroid
    and m L²/3 about its end.  So it is likely that moments are about the origin if they are more than ABOUT_END times
    those of a
    uniform bar, if subtracting m c² leaves those of an ordinary part, and if a body can have what is left.  Of the
    links of
    example-robot-data whose centroid is farther than NEAR of their size from the origin this holds for 1 %, and if
    their moments were
    about the origin for two thirds.
    """
    I, c, m = fit.inertial.in_link_axes, fit.inertial.centroid, fit.mass
    assert I is not None
    away = float(np.linalg.norm(c))
    if away == 0:
        return None
    u = c / away
    length = float(abs(u) @ fit.size)  # of the box, along the line
    uniform = length * length / 12
    along = float(np.trace(I) / 2 - u @ I @ u) / m
    if uniform == 0 or away < NEAR * length or along < ABOUT_END * uniform or not ORDINARY[0] < (along - away * away) / uniform < ORDINARY[1]:
        return None
    moved = I - m * (c @ c * np.eye(3) - np.outer(c, c))
    if not np.isfinite(moved).all():
        return None
    low, middle, high = principal_moments(moved)
    possible = low >= -TOLERANCE * high and high <= (middle + low) * (1 + 1e-3) and high > 0
    return moved if possible and m * away * away > CHANGES * np.diag(I).max() else None


def _of_size(size: Array) -> str:
    return f"geometry {' × '.join(shown(x) for x in size)} m"


@rule(
    "centroid-outside",
    "warning",
    condition="The centroid lies within the link's geometry, or near it.",
    cause="The centroid is in millimetres, in other axes or from another origin than the link's.",
    repair="Give the centroid in m, in the link's axes, from its origin.",
    accept="multiplies a centroid by 0.001 that then lies in the geometry (other causes are left)",
)
def centroid_outside(robot: RobotFile) -> Iterator[Broken]:
    for fit in _fits(robot):
        if not fit.inside and not _is_of_a_part(fit):
            c = fit.inertial.centroid
            away = float(np.linalg.norm(np.maximum(np.maximum(fit.box[0] - c, c - fit.box[1]), 0)))
            millimetres = away > 50 * float(fit.size.max())
            cause = "The centroid is in millimetres." if millimetres else _cause_outside(fit)
            inside = bool((c / 1000 >= fit.box[0]).all() and (c / 1000 <= fit.box[1]).all())
            guess = _set_centroid(fit.inertial, c / 1000) if millimetres and inside and robot.format == "urdf" else None
            out = [i for i in range(3) if not fit.box[0, i] <= c[i] <= fit.box[1, i]]
            middle = fit.box.mean(axis=0)
            ends = ", ".join(f"{'xyz'[i]} from {shown(middle[i] - fit.size[i] / 2)} to {shown(middle[i] + fit.size[i] / 2)} m" for i in out)
            found = f"centroid {' '.join(shown(x) for x in c)} m; the geometry has {ends}"
            yield Broken(found, fit.inertial.line, "link", fit.link.name, away, cause=cause, guess=guess)


def _is_of_a_part(fit: Fit) -> bool:
    """Whether the geometry is only that of a part of the link: a bumper, something in which the mass has no room, or in a body that its moments make larger."""
    words = [f"{shape.name} {shape.uri.rpartition('/')[2]}".lower() for shape in fit.link.shapes]
    if all(any(part in each for part in PARTS) for each in words):
        return True
    volume = float(np.prod(np.maximum(fit.size, 1e-3) + 2 * ROOM))
    return fit.mass > SOLID * volume or _is_within_its_body(fit)


def _is_within_its_body(fit: Fit) -> bool:
    """Whether the geometry is inside the box about the centroid that has the link's moments: a centroid that is misplaced moves that box out of the geometry."""
    I, c = fit.inertial.in_link_axes, fit.inertial.centroid
    if I is None:
        return False
    second = np.maximum(np.trace(I) / 2 - np.diag(I), 0.0)  # ∫x² dm of each axis
    half = np.sqrt(3 * second / fit.mass)
    reach = np.maximum(np.abs(fit.box[0] - c), np.abs(fit.box[1] - c))
    return bool((reach <= SLACK * half).all())


@rule(
    "inertia-about-origin",
    "warning",
    condition="Moments are about the centroid: along the line to the origin they are those of a body of this length.",
    cause=("The moments are about the link's origin. With m (c² 1 − c cᵀ) subtracted, they are those of a body of this size."),
    repair=("Look whether the program that made them takes the origin. If so, subtract m (c² 1 − c cᵀ), c being the centroid."),
    accept="subtracts m (c² 1 − c cᵀ) from the moments",
)
def inertia_about_origin(robot: RobotFile) -> Iterator[Broken]:
    for fit in _fits(robot):
        I = fit.inertial.in_link_axes
        moved = about_origin(fit)
        if moved is not None and I is not None:
            found = (
                f"moments {_diagonal(I)} kg m² with the centroid "
                f"{shown(float(np.linalg.norm(fit.inertial.centroid)))} m from the origin, {_of_size(fit.size)}; "
                f"about the origin they would leave {_diagonal(moved)}"
            )
            guess = _set_moments(fit.inertial, moved, "about the centroid") if robot.format == "urdf" else None
            yield Broken(found, fit.inertial.line, "link", fit.link.name, guess=guess)


def _diagonal(I: Array) -> str:
    return ", ".join(shown(x) for x in np.diag(I))


def _set_moments(inertial: Inertial, moments: Array, how: str) -> Repair:
    """Writes moments, given in link axes, into the file."""

    def change() -> str:
        assert inertial.element is not None
        own = inertial.rotation.T @ moments @ inertial.rotation  # in the axes of the file's <origin>
        inertia = inertial.element.find("inertia")
        for name, (i, j) in {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}.items():
            inertia.set(name, digits(float(own[i, j])))
        return f"moments are now {how}: {_diagonal(own)} kg m²"

    return change


@rule(
    "inertia-units",
    "warning",
    condition=f"Moments in kg m² agree with the mass and the size of the geometry, to a factor of {WRONG_UNITS:g}.",
    cause="The moments are in other units than kg m².",
    repair="Convert the moments to kg m², and look whether the mass is in kg.",
    accept="divides the moments, where exactly one unit is likely",
)
def inertia_units(robot: RobotFile) -> Iterator[Broken]:
    for fit in _fits(robot):
        I = fit.inertial.in_link_axes
        assert I is not None
        if not I.any():
            continue
        mass = fit.mass
        # centre the box on the centroid where that is outside: another rule says so
        half = np.maximum(np.linalg.norm(fit.size) / 2 * (1 + 2 * MARGIN), ROOM)
        ratio = float(np.trace(I) / 2 / mass / half**2)
        gyration = float(np.sqrt(max(np.trace(I) / 2, 0) / mass))
        found = f"moments {_diagonal(I)} kg m² and mass {shown(mass)} kg: radius of gyration {shown(gyration)} m, {_of_size(fit.size)}"
        if ratio > WRONG_UNITS:
            likely = {unit: factor for factor, unit in FACTORS if LIKELY[0] < ratio / factor < LIKELY[1]}
            cause = f"The moments are in {' or '.join(likely)}." if likely else None
            guess = None
            if len(likely) == 1 and robot.format == "urdf":
                ((unit, factor),) = likely.items()
                guess = _set_moments(fit.inertial, I / factor, f"in kg m², taken as {unit}")
            if np.ptp(np.diag(I)) == 0:
                cause = "A placeholder: all moments are equal." + (f" Otherwise they are in {' or '.join(likely)}." if likely else "")
            yield Broken(found, fit.inertial.line, "link", fit.link.name, gyration, cause=cause, guess=guess)
        elif 0 < gyration < float(fit.size.max()) / 300 and fit.size.max() > 0.02:
            yield Broken(found, fit.inertial.line, "link", fit.link.name, gyration, cause="The moments are too small by a factor of units, or a placeholder.")


@rule(
    "inertia-too-large",
    "warning",
    condition=(f"The mass can be distributed within {LOOSE:g} times the room of the geometry so that it has these moments."),
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
        if excess > LOOSE**2 and about_origin(fit) is None:  # one finding is enough
            found = f"moments {_diagonal(I)} kg m² and mass {shown(fit.mass)} kg need {np.sqrt(excess):.3g} times the room of the {_of_size(fit.size)}"
            yield Broken(found, fit.inertial.line, "link", fit.link.name, excess)


@rule(
    "mass-units",
    "warning",
    condition=f"The mass, in the box around the geometry, has a density between {LIGHTEST:g} and {DENSEST:,.0f} kg/m³.",
    cause="The mass is in grams.",
    repair="Give the mass in kg.",
    accept="divides a mass that is too large by 1000",
)
def mass_units(robot: RobotFile) -> Iterator[Broken]:
    for fit in _fits(robot):
        mass, size = fit.mass, np.maximum(fit.size, 1e-3)
        volume = float(np.prod(size))
        density = mass / volume
        found = f"mass {shown(mass)} kg, {_of_size(fit.size)}: {shown(density)} kg/m³"
        # around a small or thin part its fastenings may weigh more than itself
        padded = mass / float(np.prod(size + 2 * ROOM))
        if padded > DENSEST:
            guess = _set_mass(fit.inertial, mass / 1000) if robot.format == "urdf" else None
            yield Broken(found, fit.inertial.line, "link", fit.link.name, density, guess=guess)
        elif density < LIGHTEST and volume > SMALLEST:
            cause = "The mass is in tonnes, a placeholder, or that of another part, or the geometry is in mm."
            yield Broken(found, fit.inertial.line, "link", fit.link.name, density, cause=cause)


def _cause_outside(fit: Fit) -> str | None:
    """Why a centroid may be outside: left at the origin, or with a wrong sign."""
    c = fit.inertial.centroid
    if not c.any():
        return "<origin> of <inertial> was left out or at zero: the centroid of this link is not at its origin."
    for axis, name in enumerate("xyz"):
        mirrored = c.copy()
        mirrored[axis] = -mirrored[axis]
        if (mirrored >= fit.box[0]).all() and (mirrored <= fit.box[1]).all():
            return f"The sign of {name} is wrong, or the mesh is mirrored and the centroid is not: with the other sign it lies within."
    return None


def _set_centroid(inertial: Inertial, centroid: Array) -> Repair:
    def change() -> str:
        assert inertial.element is not None
        element = inertial.element.find("origin")
        element.set("xyz", " ".join(digits(float(x)) for x in centroid))
        return f"centroid is now {element.get('xyz')} m"

    return change


def _set_mass(inertial: Inertial, mass: float) -> Repair:
    def change() -> str:
        assert inertial.element is not None
        element = inertial.element.find("mass")
        old = element.get("value")
        element.set("value", digits(mass))
        return f"mass {old} is now {digits(mass)} kg"

    return change
