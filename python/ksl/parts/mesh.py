"""Meshes of parts: nodes, solid elements and node sets of an .inp file, as gmsh, FreeCAD, Abaqus and others write them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import PartError, near_names
from ksl.base.files_read import being_read
from ksl.base.input_files import Unreadable, opened
from ksl.base.limits import PART_BYTES
from ksl.mechanism.states import Array
from ksl.parts.elements import KINDS, Kind

MOST_NODES, MOST_NUMBER = 1 << 24, 1 << 31
"""Nodes of one range, and the numbers of nodes and elements are below."""

Face = tuple[int, int]
"""Element by its number in the file, and face, 1 and up."""


@dataclass(frozen=True)
class Block:
    """Elements of one kind."""

    kind: str
    numbers: NDArray[np.intp]
    nodes: NDArray[np.intp]
    """(elements, nodes): their rows in `Mesh.points`."""

    @property
    def of(self) -> Kind:
        return KINDS[self.kind]


@dataclass(frozen=True)
class Mesh:
    """Solid elements; lengths are in the unit of the file."""

    file: str
    numbers: NDArray[np.intp]
    """Numbers of the nodes in the file."""
    points: Array
    """(nodes, 3)."""
    blocks: tuple[Block, ...]
    sets: Mapping[str, NDArray[np.intp]] = field(default_factory=dict)
    """Rows of the nodes of node sets, and of the elements of element sets, by upper-case names."""

    @property
    def extent(self) -> float:
        """The diagonal of the box around it."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @cached_property
    def integrals(self) -> tuple[Array, Array]:
        """∫ N dV (nodes) and ∫ N r dV (nodes, 3), with the shape functions N of each node.

        Forces of a field that is linear in r are these times density: of gravity, and consistent with the elements.
        """
        of_one, of_r = np.zeros(len(self.points)), np.zeros((len(self.points), 3))
        for block in self.blocks:
            at, weight = block.of.rule
            N, slope = block.of.shape(at), np.moveaxis(block.of.slope(at), 1, 0).reshape(block.of.nodes, -1)
            pairs = (N[:, :, None] * N[:, None]).reshape(len(at), -1)
            for part in np.array_split(np.arange(len(block.nodes)), max(1, len(block.nodes) // 2048)):
                nodes = block.nodes[part]
                x = self.points[nodes]
                by_place = (np.moveaxis(x, 1, 2) @ slope).reshape(len(x), 3, len(at), 3)
                jacobian = np.einsum("eip,eip->ep", by_place[..., 0], np.cross(by_place[..., 1], by_place[..., 2], axis=1))
                if not (jacobian > 0).all():
                    bad = block.numbers[part][int(np.argwhere(~(jacobian > 0))[0, 0])]
                    raise PartError(f"{self.file}: element {bad} ({block.kind}) is turned inside out or has no volume; mesh the part again")
                volume = jacobian * weight
                np.add.at(of_one, nodes, volume @ N)
                np.add.at(of_r, nodes, (volume @ pairs).reshape(len(x), N.shape[1], -1) @ x)
        return of_one, of_r

    @property
    def volume(self) -> float:
        return float(self.integrals[0].sum())

    def inertia(self) -> tuple[float, Array, Array]:
        """Volume, first moment (3) and inertia (3, 3) of unit density, about the origin."""
        of_one, of_r = self.integrals
        second = self.points.T @ of_r
        second = (second + second.T) / 2
        return float(of_one.sum()), of_r.sum(axis=0), np.trace(second) * np.eye(3) - second

    @cached_property
    def boundary(self) -> tuple[tuple[Face, tuple[int, ...]], ...]:
        """Faces of one element alone, with the rows of their nodes."""
        found: dict[tuple[int, ...], list[tuple[Face, tuple[int, ...]]]] = {}
        for block in self.blocks:
            for face, corners in enumerate(block.of.faces):
                every = block.of.face_nodes(face)
                keys = np.sort(block.nodes[:, corners], axis=1)
                for number, key, nodes in zip(block.numbers, keys.tolist(), block.nodes[:, every].tolist(), strict=True):
                    found.setdefault(tuple(key), []).append(((int(number), face + 1), tuple(nodes)))
        return tuple(faces[0] for faces in found.values() if len(faces) == 1)

    def faces_of(self, nodes: NDArray[np.intp]) -> tuple[list[Face], NDArray[np.intp]]:
        """Faces on the boundary all of whose nodes are among these, and the nodes of these faces."""
        among = np.zeros(len(self.points), dtype=bool)
        among[nodes] = True
        found = [(face, own) for face, own in self.boundary if among[list(own)].all()]
        return [face for face, _ in found], np.unique([n for _, own in found for n in own]).astype(np.intp)

    def named(self, name: str) -> NDArray[np.intp] | None:
        return self.sets.get(name.upper())

    def lacks(self, name: str) -> str:
        """What is said of a set that isn't there."""
        return f"{self.file}: no node set {name!r}; {near_names(name.upper(), self.sets)}it has {', '.join(self.sets) or 'none'}"


def read_mesh(path: str | os.PathLike[str]) -> Mesh:
    """Reads nodes, solid elements, node sets and element sets of an .inp file; other keywords are passed over.

    Elements of faces and edges, which gmsh writes for physical groups, make sets and are no part of the mesh.  Raises PartError.
    """
    file = os.fspath(path)
    try:
        with being_read("mesh", file, PartError), opened(file, PART_BYTES) as source:
            text = source.read().decode("utf-8", "replace")
    except (Unreadable, OSError) as e:
        raise PartError(f"{file}: can't be read ({e}); give the mesh of a part as an .inp file, as gmsh and FreeCAD write it") from None
    return _Reader(file).read(text)


class _Reader:
    """What has been read so far."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.nodes: dict[int, Sequence[float]] = {}
        self.elements: dict[str, dict[int, list[int]]] = {}
        self.elements_of: dict[str, list[int]] = {}
        self.nodes_of: dict[str, list[int]] = {}

    def read(self, text: str) -> Mesh:
        for line, words, cards in _keywords(text):
            name, options = words[0], dict(word.partition("=")[::2] for word in words[1:])
            try:
                self._keyword(name, options, cards)
            except PartError:
                raise
            except (ValueError, IndexError, OverflowError):
                raise PartError(f"{self.file}: *{name} at line {line} holds something else than numbers in their places; write the mesh again") from None
        return self._mesh()

    def _keyword(self, name: str, options: Mapping[str, str], cards: list[list[str]]) -> None:
        if name == "INCLUDE":
            raise PartError(f"{self.file}: has *INCLUDE, which is not followed; give the file with the mesh itself")
        if name == "NODE":
            self.nodes |= {_number(card[0]): [float(x or 0) for x in [*card[1:], "", "", ""][:3]] for card in cards}
        elif name == "ELEMENT":
            self._elements(options.get("TYPE", ""), options.get("ELSET", ""), cards)
        elif name in ("NSET", "ELSET"):
            kept = self.nodes_of if name == "NSET" else self.elements_of
            kept.setdefault(options.get(name, ""), []).extend(self._members(kept, cards, "GENERATE" in options))

    def _elements(self, kind: str, elset: str, cards: list[list[str]]) -> None:
        numbers = [_number(x) for card in cards for x in card if x]
        each = KINDS[kind].nodes + 1 if kind in KINDS else 1 + sum(bool(x) for x in cards[0][1:]) if cards else 1
        rows = np.reshape(numbers, (-1, each)).tolist()
        self.elements.setdefault(kind, {}).update({row[0]: row[1:] for row in rows})
        if elset:
            self.elements_of.setdefault(elset, []).extend(row[0] for row in rows)

    @staticmethod
    def _members(known: Mapping[str, list[int]], cards: list[list[str]], generate: bool) -> Iterator[int]:
        for card in cards:
            words = [word for word in card if word]
            if generate:
                first, last, step = (*(_number(word) for word in words), 1)[:3]
                members = range(first, last + 1, step)
                if len(members) > MOST_NODES:
                    raise ValueError("more nodes than a mesh has")
                yield from members
                continue
            for word in words:
                if word.upper() in known:
                    yield from known[word.upper()]
                else:
                    yield _number(word)

    def _mesh(self) -> Mesh:
        self.elements = {kind: of for kind, of in self.elements.items() if of}
        others = sorted(kind for kind in self.elements if kind.startswith("C3D") and kind not in KINDS)
        if others:
            raise PartError(f"{self.file}: elements {others[0]} are not read; mesh the part with tetrahedra or hexahedra: {', '.join(KINDS)}")
        if not any(kind in KINDS for kind in self.elements):
            raise PartError(f"{self.file}: has no solid elements ({', '.join(KINDS)}); give the mesh of the part's volume")
        solid = {number: nodes for kind, of in self.elements.items() if kind in KINDS for number, nodes in of.items()}
        used = np.unique([n for nodes in solid.values() for n in nodes])
        absent = [n for n in used.tolist() if n not in self.nodes]
        if absent:
            raise PartError(f"{self.file}: node {absent[0]} of an element isn't there; write the mesh again")
        row = {n: i for i, n in enumerate(used.tolist())}
        points = np.array([self.nodes[n] for n in used.tolist()])
        if not np.isfinite(points).all():
            raise PartError(f"{self.file}: a coordinate isn't finite; write the mesh again")
        blocks = tuple(
            Block(kind, np.array(list(of)), np.array([[row[n] for n in nodes] for nodes in of.values()])) for kind, of in self.elements.items() if kind in KINDS
        )
        every = {number: nodes for of in self.elements.values() for number, nodes in of.items()}
        by_elements = {name: [n for e in numbers for n in every.get(e, [])] for name, numbers in self.elements_of.items()}
        sets = {name.upper(): np.array(sorted({row[n] for n in nodes if n in row}), dtype=np.intp) for name, nodes in (by_elements | self.nodes_of).items()}
        return Mesh(self.file, used, points, blocks, {name: nodes for name, nodes in sets.items() if len(nodes)})


def _number(word: str) -> int:
    """The number of a node or element.  Raises ValueError for one that no solver takes."""
    number = int(word)
    if not 0 < number < MOST_NUMBER:
        raise ValueError("no number of a node or element")
    return number


def _keywords(text: str) -> Iterator[tuple[int, list[str], list[list[str]]]]:
    """Line, keyword with options in capitals, and the cards below it."""
    head: list[str] | None = None
    at, cards = 0, []  # type: ignore[var-annotated]
    for line, raw in enumerate(text.splitlines(), 1):
        stripped = raw.strip()
        if not stripped or stripped.startswith("**"):
            continue
        if stripped.startswith("*"):
            if head is not None:
                yield at, head, cards
            head, at, cards = [word.strip().replace(" ", "") if "=" in word else word.strip() for word in stripped[1:].upper().split(",")], line, []
        elif head is not None:
            cards.append([word.strip() for word in stripped.split(",")])
    if head is not None:
        yield at, head, cards
