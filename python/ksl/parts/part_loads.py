"""What a deck says of a part: where its wrenches act on the mesh, and the loads of each case, in the units of the deck."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import PartError, of_argument, unknown_name
from ksl.base.printable import one_line
from ksl.mechanism.lengths import far
from ksl.mechanism.requests import one_of
from ksl.mechanism.states import Array
from ksl.parts.cases import Cases
from ksl.parts.free_body import FreeBody, PartWrench
from ksl.parts.mesh import Face, Mesh
from ksl.parts.units import SYSTEMS, Material, Units

Coupling = Literal["distributing", "rigid"]
FAR = 30.0
"""A mesh that is so many times as large as what its loads reach, or so small a share of it, is in other units."""

NOTICED = 1e-6
"""What three nodes hold of the balance is said from this share of the largest force on."""


@dataclass(frozen=True)
class DeckOptions:
    """How parts are loaded, held and written in decks."""

    units: str = "m-kg-s"
    """"m-kg-s" or "mm-t-s"; the mesh is in these units."""
    material: Material = Material()
    sets: Mapping[str, str] = field(default_factory=dict)
    """{wrench: the node set that it acts on}; by default the set with its name."""
    radius: Mapping[str, float] = field(default_factory=dict)
    """{wrench: m}: it acts on the nodes of the surface that are so near to its point."""
    coupling: Coupling = "distributing"
    relief: bool = False
    """The accelerations are those with which the mesh's own mass is in balance with the wrenches, and not those of the link."""


@dataclass(frozen=True)
class Seat:
    """Where a wrench acts: a reference node, which nodes of the mesh carry."""

    name: str
    """Name of the wrench."""
    word: str
    """The wrench's name in decks."""
    node: int
    point: Array
    """(3)."""
    faces: Sequence[Face] = ()
    nodes: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    """Rows of the mesh."""


@dataclass(frozen=True)
class DeckCase:
    """The loads of one case, in the part's axes."""

    title: str
    at_seats: Array
    """(seats, 6): force and moment at the reference nodes."""
    field: Array
    """(3): the acceleration of free fall minus that of the origin."""
    spin: Array
    """(3): angular velocity, rad/s."""
    turn: Array
    """(3): angular acceleration, rad/s²."""
    unbalance: Array
    """(6): what is left of the balance, about the origin; nodes that hold the part carry it.  Zero without a mesh."""


@dataclass(frozen=True)
class PartLoads:
    """A part with its loads, in the units of the deck."""

    link: str
    units: Units
    material: Material
    density: float
    seats: tuple[Seat, ...]
    cases: tuple[DeckCase, ...]
    mesh: Mesh | None
    holding: tuple[tuple[int, int], ...]
    """Row of a node and its direction, 0 to 2: six that hold the part without constraint."""
    coupling: Coupling
    relief: bool
    notes: tuple[str, ...]

    def node_forces(self, case: DeckCase) -> Array:
        """(nodes, 3): minus density times angular acceleration × r, as the elements distribute it."""
        assert self.mesh is not None
        return -self.density * np.cross(case.turn, self.mesh.integrals[1])


def part_loads(cases: Cases, link: str, mesh: Mesh | None, options: DeckOptions) -> PartLoads:
    """The loads of a link's part.  Raises PartError for sets that the mesh lacks, meshes in other units and sets that don't carry a moment."""
    if options.units not in SYSTEMS:
        raise PartError(f"units={options.units!r}; expected one of {', '.join(map(repr, SYSTEMS))}")
    one_of(options.coupling, "coupling", "distributing", "rigid")
    units, bodies = SYSTEMS[options.units], [case.bodies[link] for case in cases]
    material = options.material.checked()
    if mesh is not None:
        _check_extent(mesh, bodies, units, link)
    density = _density(bodies[0], mesh, material, units, link)
    seats = _seats(link, bodies, mesh, options, units)
    titles = [one_line(f"{link} {i}: {case.case} at {case.time:.6g} s, {case.reason}") for i, case in enumerate(cases, 1)]
    named = _names(bodies)
    at_seats = [[named[seat.name][i] for seat in seats] for i in range(len(bodies))]
    made = tuple(_case(*of, seats, mesh, density, units, options.relief) for of in zip(titles, bodies, at_seats, strict=True))
    holding = () if mesh is None else _holding(mesh, seats)
    notes = tuple(_notes_of_mesh(link, bodies[0], made, mesh, density, units) if mesh else _notes_without(link, bodies, options.radius))
    return PartLoads(link, units, material, density, seats, made, mesh, holding, options.coupling, options.relief, notes)


def word_of(name: str) -> str:
    """A name that every solver takes: capitals, digits and _."""
    word = re.sub(r"[^A-Z0-9_]", "_", name.upper())
    return (word if word[:1].isalpha() else f"N{word}")[:60]


def _density(body: FreeBody, mesh: Mesh | None, material: Material, units: Units, link: str) -> float:
    if material.density is not None:
        return material.density * units.density
    if mesh is None:
        return 0.0
    if body.mass <= 0:
        raise PartError(f"{link}: has no mass in the robot file, from which the density of its mesh would follow; give the density, kg/m³")
    return body.mass * units.mass / mesh.volume


def _check_extent(mesh: Mesh, bodies: Sequence[FreeBody], units: Units, link: str) -> None:
    """Refuses a mesh in millimetres under loads in metres, and the other way round."""
    reach = _reach(bodies) * units.length
    if reach <= 0 or 1 / FAR <= mesh.extent / reach <= FAR:
        return
    other = next((name for name, system in SYSTEMS.items() if 1 / FAR <= mesh.extent / (reach / units.length * system.length) <= FAR), None)
    unit = "m" if units.length == 1 else "mm"
    mend = f"is it in {'mm' if unit == 'm' else 'm'}? then take the units {other}" if other and other != units.name else "check its units"
    raise PartError(
        f"{mesh.file}: the mesh is {mesh.extent:.4g} {unit} large, and the points of {link} at which loads act are {reach:.4g} {unit} apart; {mend}"
    )


def _reach(bodies: Sequence[FreeBody]) -> float:
    """How far the origin, joints and centre of mass of a body are apart, m."""
    points = [p for body in bodies for p in (np.zeros(3), body.center_of_mass, *(w.point for w in body.wrenches if w.kind in ("joint", "loop")))]
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _names(bodies: Sequence[FreeBody]) -> dict[str, list[PartWrench | None]]:
    """{name of a wrench: of each case}."""
    keys = list(dict.fromkeys((w.kind, w.name) for body in bodies for w in body.wrenches))
    names = [name for _, name in keys]
    return {
        name if names.count(name) == 1 else f"{kind} {name}": [next((w for w in body.wrenches if (w.kind, w.name) == (kind, name)), None) for body in bodies]
        for kind, name in keys
    }


def _seats(link: str, bodies: Sequence[FreeBody], mesh: Mesh | None, options: DeckOptions, units: Units) -> tuple[Seat, ...]:
    named = {name: of_cases for name, of_cases in _names(bodies).items() if any(w is not None and w.wrench.any() for w in of_cases)}
    node = 90_000_001 if mesh is None else int(mesh.numbers.max()) + 1
    seats: list[Seat] = []
    for name, of_cases in named.items():
        point = next(w.point for w in of_cases if w is not None) * units.length
        word = word_of(name)
        while word in {seat.word for seat in seats}:
            word += "_"
        faces, nodes = ([], np.zeros(0, dtype=np.intp)) if mesh is None else _carrying(link, name, point, mesh, options, units)
        shared = next((seat.name for seat in seats if np.intersect1d(seat.nodes, nodes).size), "") if options.coupling == "rigid" else ""
        if shared:
            said = f"{link}: {shared} and {name} act on the same nodes, which can't be of two rigid bodies"
            raise PartError(f"{said}; take coupling='distributing' (--coupling distributing), or other sets")
        seats.append(Seat(name, word, node, point, faces, nodes))
        node += 2  # rigid bodies have a node for rotations, too
    return tuple(seats)


def _carrying(link: str, name: str, point: Array, mesh: Mesh, options: DeckOptions, units: Units) -> tuple[list[Face], NDArray[np.intp]]:
    """The faces and nodes that carry a wrench: those of a set, or those around its point."""
    if name in options.radius:
        radius = options.radius[name] * units.length
        if not 0 < radius <= mesh.extent:
            raise PartError(
                f"radius of {name}: {options.radius[name]:g} m, and the part is {mesh.extent / units.length:.3g} m large; radii are in m: is it in millimetres?"
            )
        near = np.flatnonzero(np.linalg.norm(mesh.points - point, axis=1) <= radius)
        where = f"within {options.radius[name]:g} m of {name}"
        mend = f"its point is {np.linalg.norm(mesh.points - point, axis=1).min() / units.length:.3g} m from the nearest node"
    else:
        asked = options.sets.get(name, name)
        found = mesh.named(asked)
        if found is None:
            by_set, by_radius = f"sets= (--set '{name}=SET')", f"radius= (--radius '{name}=0.02')"
            raise PartError(f"{mesh.lacks(asked)}; say on which set {name} of {link} acts, {by_set}, or how near to it nodes carry it, {by_radius}")
        near, where, mend = found, f"in the set {asked}", "the set must hold all nodes of some faces"
    faces, nodes = mesh.faces_of(near)
    if not faces:
        raise PartError(f"{mesh.file}: no face of the surface has all its nodes {where}; {mend}")
    return faces, nodes


def _case(
    title: str, body: FreeBody, at_seats: Sequence[PartWrench | None], seats: Sequence[Seat], mesh: Mesh | None, density: float, units: Units, relief: bool
) -> DeckCase:
    rows = np.zeros((len(seats), 6))
    for i, (seat, w) in enumerate(zip(seats, at_seats, strict=True)):
        if w is not None:
            force, moment = w.wrench[:3] * units.force, w.wrench[3:] * units.moment
            rows[i] = np.concatenate([force, moment + np.cross(w.point * units.length - seat.point, force)])
    fall, spin, turn = (body.gravity_field - body.acceleration) * units.length, body.angular_velocity, body.angular_acceleration
    if mesh is None:
        return DeckCase(title, rows, fall, spin, turn, np.zeros(6))
    volume, first, about = (x * density for x in mesh.inertia())
    held = np.concatenate([rows[:, :3].sum(axis=0), (rows[:, 3:] + np.cross([seat.point for seat in seats], rows[:, :3])).sum(axis=0)])
    held -= np.concatenate([np.cross(spin, np.cross(spin, first)), np.cross(spin, about @ spin)])
    skew = np.cross(np.eye(3), first)
    by_motion = np.block([[volume * np.eye(3), skew], [skew, -about]])  # of fall and turn
    if relief:
        found = np.linalg.solve(by_motion, -held)
        fall, turn = found[:3], found[3:]
    return DeckCase(title, rows, fall, spin, turn, held + by_motion @ np.concatenate([fall, turn]))


def _holding(mesh: Mesh, seats: Sequence[Seat]) -> tuple[tuple[int, int], ...]:
    """Six directions at three corner nodes far from each other, at which nothing reacts if the part is in balance.

    None of a seat's: of rigid bodies they can't be held as well, and of distributing couplings what they react has the coupling's share in it.
    """
    corners = np.unique(np.concatenate([block.nodes[:, : block.of.corners].ravel() for block in mesh.blocks]))
    carried = np.unique(np.concatenate([seat.nodes for seat in seats])) if seats else np.zeros(0, dtype=np.intp)
    free = np.setdiff1d(corners, carried)
    if len(free) < 3:
        raise PartError(f"{mesh.file}: the sets take all nodes but {len(free)}, and three others must hold the part; take smaller sets, or a finer mesh")
    x = mesh.points[free]
    a = int(np.linalg.norm(x - x.mean(axis=0), axis=1).argmax())
    b = int(np.linalg.norm(x - x[a], axis=1).argmax())
    c = int(np.linalg.norm(np.cross(x - x[a], x[b] - x[a]), axis=1).argmax())
    best, chosen = 0.0, ((0, 1), 2)
    for pair in combinations(range(3), 2):
        for last in range(3):
            rows = [np.cross(x[n] - x[a], np.eye(3)[d]) for n, d in ((b, pair[0]), (b, pair[1]), (c, last))]
            if abs(np.linalg.det(rows)) > best * (1 + 1e-9):
                best, chosen = abs(float(np.linalg.det(rows))), (pair, last)
    at = [int(free[n]) for n in (a, b, c)]
    return ((at[0], 0), (at[0], 1), (at[0], 2), (at[1], chosen[0][0]), (at[1], chosen[0][1]), (at[2], chosen[1]))


def _notes_without(link: str, bodies: Sequence[FreeBody], radius: Mapping[str, float]) -> list[str]:
    """What a deck without a mesh lacks, and radii that are likely in millimetres."""
    doubts = [line for name, r in radius.items() for line in far(f"the radius of {name} is", r, _reach(bodies))]
    return [*doubts, f"{link}: without a mesh the deck has the loads and their reference nodes, and no forces of the angular acceleration"]


def _notes_of_mesh(link: str, body: FreeBody, cases: Sequence[DeckCase], mesh: Mesh, density: float, units: Units) -> list[str]:
    """How the part's own mass compares with that of the link, and what nodes hold of it."""
    volume, first, _ = mesh.inertia()
    apart = float(np.linalg.norm(first / volume / units.length - body.center_of_mass))
    mass = f"{density * volume / units.mass:.4g} kg ({density / units.density:.4g} kg/m³)"
    found = [f"{link}: the mesh has {mass}, the link {body.mass:.4g} kg; their centres are {apart * 1e3:.3g} mm apart"]
    largest = max(float(np.linalg.norm(case.at_seats[:, :3], axis=1).max(initial=0)) for case in cases)
    left = max(float(np.linalg.norm(case.unbalance[:3])) for case in cases)
    turned = max(float(np.linalg.norm(case.unbalance[3:])) for case in cases)
    if left > NOTICED * largest or turned > NOTICED * largest * mesh.extent:
        held = f"three nodes hold up to {left / units.force:.3g} N and {turned / units.moment:.3g} N m"
        of_joints = f"of {largest / units.force:.4g} N at the joints"
        found.append(
            f"{link}: {held} that the mesh's own mass leaves of the balance, {of_joints}; relief=True (--relief) takes the accelerations with which it is in balance"
        )
    return found


def check_links(cases: Cases, meshes: Mapping[str, object]) -> None:
    """Raises PartError for a mesh of a link that has no free body."""
    for link in meshes:
        if link not in cases.links:
            raise PartError(unknown_name("meshes", "body", link, cases.links))


def check_wrenches(cases: Cases, links: Iterable[str], options: DeckOptions) -> None:
    """Raises PartError for a set or a radius of a wrench that acts on none of the parts."""
    known = list(dict.fromkeys(name for link in links for name in _names([case.bodies[link] for case in cases])))
    for argument, of_wrenches in (("sets", options.sets), ("radius", options.radius)):
        for name in of_wrenches:
            if name not in known:
                raise of_argument(PartError, argument, f": {unknown_name('the parts', 'wrench', name, known)}")
