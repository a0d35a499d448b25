"""Decks for CalculiX and Abaqus: a step for each case."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from ksl.base.printable import one_line
from ksl.mechanism.states import Array
from ksl.parts.part_loads import DeckCase, PartLoads, Seat

Solver = Literal["calculix", "abaqus"]
ALL = "PART"
"""The set of all elements of the part."""
ON_LINE = 8


def deck(part: PartLoads, head: Sequence[str], solver: Solver) -> Iterator[str]:
    """The lines of a deck.  One text serves both solvers but for rigid bodies, whose keyword has other options."""
    yield "*HEADING"
    yield f"Load cases of {part.link}"
    yield from (f"** {line}" for line in head)
    yield f"** units: {part.units.text}; all in the axes of the part, from its origin"
    yield from (f"** {note}" for note in part.notes)
    if part.mesh is None:
        yield f"** include this file behind a mesh with the element set {ALL} and, for each reference node, a surface of element faces SURFACE_NAME"
    else:
        yield from _mesh(part)
    for seat in part.seats:
        yield from _seat(seat, part, solver)
    if part.mesh is not None:
        yield "*BOUNDARY"
        yield from (f"{part.mesh.numbers[row]}, {axis + 1}, {axis + 1}" for row, axis in part.holding)
    for case in part.cases:
        yield from _step(part, case, solver)


def _mesh(part: PartLoads) -> Iterator[str]:
    assert part.mesh is not None
    yield f"** mesh: {one_line(part.mesh.file)}"
    yield "*NODE, NSET=PART_NODES"
    yield from (f"{n}, {_row(x)}" for n, x in zip(part.mesh.numbers.tolist(), part.mesh.points, strict=True))
    for block in part.mesh.blocks:
        yield f"*ELEMENT, TYPE={block.kind}, ELSET={ALL}"
        for number, nodes in zip(block.numbers.tolist(), part.mesh.numbers[block.nodes].tolist(), strict=True):
            words = [str(x) for x in (number, *nodes)]
            yield from (", ".join(words[i : i + 11]) + ("," if i + 11 < len(words) else "") for i in range(0, len(words), 11))
    yield "*MATERIAL, NAME=PART_MATERIAL"
    yield "*ELASTIC"
    yield f"{part.material.young * part.units.stress:.10e}, {part.material.poisson:.10e}"
    yield "*DENSITY"
    yield f"{part.density:.10e}"
    yield f"*SOLID SECTION, ELSET={ALL}, MATERIAL=PART_MATERIAL"


def _seat(seat: Seat, part: PartLoads, solver: Solver) -> Iterator[str]:
    """A reference node, and what carries it."""
    yield f"** {seat.name}"
    rotates = part.coupling == "rigid" and solver == "calculix"
    yield f"*NODE, NSET=REFERENCE_{seat.word}"
    yield f"{seat.node}, {_row(seat.point)}"
    if rotates:
        yield f"*NODE, NSET=ROTATION_{seat.word}"
        yield f"{seat.node + 1}, {_row(seat.point)}"
    if part.mesh is not None:
        yield f"*NSET, NSET=ON_{seat.word}"
        numbers = [str(n) for n in part.mesh.numbers[seat.nodes].tolist()]
        yield from (", ".join(numbers[i : i + ON_LINE]) for i in range(0, len(numbers), ON_LINE))
        yield f"*SURFACE, NAME=SURFACE_{seat.word}, TYPE=ELEMENT"
        yield from (f"{element}, S{face}" for element, face in seat.faces)
    if rotates:
        yield f"*RIGID BODY, NSET=ON_{seat.word}, REF NODE={seat.node}, ROT NODE={seat.node + 1}"
        return
    yield f"*COUPLING, REF NODE={seat.node}, SURFACE=SURFACE_{seat.word}, CONSTRAINT NAME=COUPLING_{seat.word}"
    yield "*DISTRIBUTING" if part.coupling == "distributing" else "*KINEMATIC"
    yield "1, 6"


def _step(part: PartLoads, case: DeckCase, solver: Solver) -> Iterator[str]:
    yield "*STEP"
    yield f"** {case.title}"
    yield "*STATIC"
    yield "*CLOAD, OP=NEW"
    for seat, wrench in zip(part.seats, case.at_seats, strict=True):
        of_moments = (seat.node + 1, 1) if part.coupling == "rigid" and solver == "calculix" else (seat.node, 4)
        yield from (f"{seat.node}, {i + 1}, {x:.10e}" for i, x in enumerate(wrench[:3]))
        yield from (f"{of_moments[0]}, {of_moments[1] + i}, {x:.10e}" for i, x in enumerate(wrench[3:]))
    if part.mesh is not None and case.turn.any():
        yield "** angular acceleration, for which there is no keyword: -density * (angular acceleration x r), as the elements distribute it"
        for n, force in zip(part.mesh.numbers.tolist(), part.node_forces(case), strict=True):
            yield from (f"{n}, {i + 1}, {x:.10e}" for i, x in enumerate(force) if x != 0)
    elif case.turn.any():
        yield f"** angular acceleration {_row(case.turn)} rad/s^2: its forces need a mesh"
    yield "*DLOAD, OP=NEW"
    fall, spin = float(np.linalg.norm(case.field)), float(np.linalg.norm(case.spin))
    if fall > 0:
        yield f"{ALL}, GRAV, {fall:.10e}, {_row(case.field / fall)}"
    if spin > 0:
        yield f"{ALL}, CENTRIF, {spin * spin:.10e}, 0., 0., 0., {_row(case.spin / spin)}"
    yield "*NODE FILE"
    yield "U, RF"
    yield "*EL FILE"
    yield "S"
    yield "*END STEP"


def _row(x: Array) -> str:
    return ", ".join(f"{v:.10e}" for v in x)
