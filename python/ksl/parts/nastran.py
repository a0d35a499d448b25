"""Decks for Nastran: a subcase for each case."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ksl.base.printable import one_line
from ksl.mechanism.states import Array
from ksl.parts.mesh import Block
from ksl.parts.part_loads import DeckCase, PartLoads, Seat

OF_FORCES, OF_FALL, OF_SPIN = 10_000, 20_000, 30_000
"""Numbers of sets of loads begin there; that of a case is added."""
OF_TWENTY = [*range(12), *range(16, 20), *range(12, 16)]
"""Nodes of a hexahedron in the order of Nastran, whose upright edges come before the upper ones."""


def deck(part: PartLoads, head: Sequence[str]) -> Iterator[str]:
    """The lines of a deck.  Static cases; with relief, the solver itself finds the accelerations that are in balance with the loads (PARAM,INREL)."""
    yield f"$ Load cases of {part.link}"
    yield from (f"$ {line}" for line in head)
    yield f"$ units: {part.units.text}; all in the axes of the part, from its origin"
    yield from (f"$ {note}" for note in part.notes)
    yield from ("SOL 101", "CEND")
    if part.holding and not part.relief:
        yield "SPC = 1"
    for i, case in enumerate(part.cases, 1):
        yield f"SUBCASE {i}"
        yield f"$ {case.title}"
        yield f"  LOAD = {i}"
        yield "  DISPLACEMENT = ALL"
        yield "  STRESS = ALL"
    yield "BEGIN BULK"
    yield "PARAM,POST,-1"
    if part.relief:
        yield "PARAM,INREL,-2"
    if part.mesh is not None:
        yield from _mesh(part)
    for k, seat in enumerate(part.seats, 1):
        yield from _seat(seat, part, k)
    for i, case in enumerate(part.cases, 1):
        yield from _loads(part, case, i)
    yield "ENDDATA"


def _mesh(part: PartLoads) -> Iterator[str]:
    assert part.mesh is not None
    yield f"$ mesh: {one_line(part.mesh.file)}"
    yield from (_grid(n, x) for n, x in zip(part.mesh.numbers.tolist(), part.mesh.points, strict=True))
    for block in part.mesh.blocks:
        yield from _elements(block, part.mesh.numbers)
    yield _small("PSOLID", 1, 1)
    yield f"{'MAT1*':<8}{1:>16}{_number(part.material.young * part.units.stress)}{'':16}{_number(part.material.poisson)}\n{'*':<8}{_number(part.density)}"
    if not part.relief:
        yield from (_small("SPC1", 1, axis + 1, int(part.mesh.numbers[row])) for row, axis in part.holding)


def _elements(block: Block, numbers: np.ndarray) -> Iterator[str]:
    order = OF_TWENTY if block.of.nodes == 20 else list(range(block.of.nodes))
    for number, nodes in zip(block.numbers.tolist(), numbers[block.nodes[:, order]].tolist(), strict=True):
        yield _small(block.of.nastran, number, 1, *nodes)


def _seat(seat: Seat, part: PartLoads, k: int) -> Iterator[str]:
    yield f"$ {seat.name}"
    yield _grid(seat.node, seat.point)
    if part.mesh is None:
        yield f"$ carry grid {seat.node} by nodes of your mesh: RBE3"
        return
    nodes, number = part.mesh.numbers[seat.nodes].tolist(), 90_000_000 + k
    yield (
        _small("RBE3", number, "", seat.node, 123456, 1.0, 123, *nodes)
        if part.coupling == "distributing"
        else _small("RBE2", number, seat.node, 123456, *nodes)
    )


def _loads(part: PartLoads, case: DeckCase, i: int) -> Iterator[str]:
    yield f"$ {case.title}"
    sets = [OF_FORCES + i]
    for seat, wrench in zip(part.seats, case.at_seats, strict=True):
        for card, x in (("FORCE*", wrench[:3]), ("MOMENT*", wrench[3:])):
            yield _vector(card, OF_FORCES + i, seat.node, x)
    if part.mesh is not None and case.turn.any() and not part.relief:
        yield "$ angular acceleration: -density * (angular acceleration x r), as the elements distribute it"
        yield from (_vector("FORCE*", OF_FORCES + i, n, x) for n, x in zip(part.mesh.numbers.tolist(), part.node_forces(case), strict=True) if x.any())
    spin = float(np.linalg.norm(case.spin))
    if case.field.any() and not part.relief:
        sets.append(OF_FALL + i)
        x = case.field
        yield f"{'GRAV*':<8}{OF_FALL + i:>16}{0:>16}{_number(1.0)}{_number(x[0])}\n{'*':<8}{_number(x[1])}{_number(x[2])}"
    if spin > 0:
        sets.append(OF_SPIN + i)
        n = case.spin / spin
        yield f"{'RFORCE*':<8}{OF_SPIN + i:>16}{0:>16}{0:>16}{_number(spin / (2 * np.pi))}\n{'*':<8}{_number(n[0])}{_number(n[1])}{_number(n[2])}"
    yield _small("LOAD", i, 1.0, *(x for each in sets for x in (1.0, each)))


def _vector(card: str, load: int, node: int, x: Array) -> str:
    """A force or moment with the factor 1."""
    return f"{card:<8}{load:>16}{node:>16}{0:>16}{_number(1.0)}\n{'*':<8}{_number(x[0])}{_number(x[1])}{_number(x[2])}"


def _grid(number: int, x: Array) -> str:
    return f"{'GRID*':<8}{number:>16}{'':16}{_number(x[0])}{_number(x[1])}\n{'*':<8}{_number(x[2])}"


def _number(x: float) -> str:
    """16 characters, ten digits; what would need three digits of exponent is zero in any unit."""
    return f"{x if abs(x) > 1e-99 else 0.0:16.9E}"


def _small(card: str, *words: object) -> str:
    """A card in fields of eight characters, eight to a line."""
    rows = [words[i : i + 8] for i in range(0, len(words), 8)]
    return "\n".join(f"{card if i == 0 else '+':<8}" + "".join(f"{word!s:>8}" for word in row) for i, row in enumerate(rows))
