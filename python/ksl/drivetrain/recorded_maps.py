"""Maps of positions as recorded functions: a fitted start, a fixed number of Newton's steps over the rows of the loops, and the Jacobian and an error there.

Poses, Jacobians and how positions move are the engine's, recorded for the tree of the part.  What is put around them is noted by :mod:`ksl.generation.expressions`: rows of
loops, elimination with pivots in an order that serves over the range, and the error by which a caller knows that a position is one of the assembly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from ksl.drivetrain.elimination import PivotOrder, above, pivot_order, solved
from ksl.drivetrain.loop_rows import distances, rows_of_loops
from ksl.drivetrain.motion import MotionMap
from ksl.generation.arguments import Arguments
from ksl.generation.expressions import Graph, Objects, played
from ksl.generation.recording import Operation, Recording, record, request_of
from ksl.generation.rows import ROWS
from ksl.mechanism.states import Array
from ksl.model.model import Model

MOST_STEPS, LAST = 10, 1e-8
"""How many Newton's steps there are: the fewest of which the last is no longer over the range, rad or m, so that what is left is below rounding."""
DEGREES, OF_ANGLE = (3, 4, 5), 40
"""Degrees of the polynomials in the given coordinates that starts are fitted with: what takes the fewest operations is kept.  So many a sine and a cosine take."""
MARGIN = 0.25
"""The share of the range of given coordinates by which they may be out of it."""
DRIFT, LEAST_DRIFT = 20.0, 1e-2
"""So many times the largest error of starts over the range a position may be from its start, or rad or m where that is small."""


@dataclass(frozen=True)
class Direction:
    """One of the two maps.  Coordinates are those of v of the tree of the part alone."""

    word: str
    """"motors_of" or "joints_of"."""
    held: list[int]
    """The numbers that are given."""
    wanted: list[int]
    others: list[int]
    centre: Array
    """(held): powers are those of the given numbers less these."""
    box: Array
    """(2, held): the least and the largest given numbers."""
    powers: list[tuple[int, ...]]
    """Monomials, each as the numbers that it multiplies."""
    coefficients: Array
    """(monomials, nq) of the positions of the tree."""
    order: PivotOrder
    drift: float
    steps: int = 0
    """Newton's steps, the last of which is that of the end."""
    error: float = np.inf
    """The largest error of the wanted positions over the range, rad or m."""

    @property
    def given(self) -> str:
        return "joints" if self.word == "motors_of" else "motors"

    @property
    def found(self) -> str:
        return "motors" if self.word == "motors_of" else "joints"


class RecordedMaps:
    """Recordings of the maps of `a`, fitted over positions q (n, joints).  Raises ValueError for joints that it doesn't have."""

    def __init__(self, a: MotionMap, q: Array) -> None:
        rods, balls, self.idle = distances(a.equations)
        self.map, self.length = a, a.equations.length
        self.tree, order = _alone(a, balls)
        self.rows = rods + rows_of_loops(a.equations, a.start, [a.model.joint(name).child for name in balls])
        self.links = list(dict.fromkeys([link for row in self.rows for link, _ in row.sides] + [rod.link for rod in self.idle]))
        jacobians = [self._record("jacobian", name=link) for link in self.links]
        self._recordings = [self._record("integrate"), self._record("frame_poses", names=self.links), *jacobians] if self.links else []
        """How positions move, poses of the links, and their Jacobians."""
        self._places = {joint.v_index + i: joint.q_index + i for joint in self.tree.joints if joint.nv and joint.quaternion is None for i in range(joint.nv)}
        Q = a.state(q)[0]
        self._states = np.zeros((len(q), self.tree.nq))
        for joint in self.tree.joints:
            if joint.nv:
                of = a.model.joint(joint.name)
                self._states[:, joint.q_index : joint.q_index + joint.nq] = Q[:, of.q_index : of.q_index + of.nq]
        self.rates = a.motor_jacobian(q)
        """(n, motors, joints) over the range."""
        index = {i: k for k, i in enumerate(order)}
        joints, motors = ([index[i] for i in part] for part in (a.part.of_joints, a.part.of_motors))
        self.directions = {"motors_of": self._direction("motors_of", joints, motors), "joints_of": self._direction("joints_of", motors, joints)}

    # what is recorded

    def _record(self, row: str, **keywords: Any) -> Recording:
        """The tree's own call with these keywords: names of links are no words of a request here, nor names in C."""
        return record(self.tree, row, request_of(self.tree, row, keywords, len(ROWS[row].inputs)), Arguments(), False, "")

    def start(self, graph: Graph, d: Direction, given: Objects) -> Objects:
        """The fitted position (nq) of the tree."""
        x = given - d.centre
        terms = [np.prod(x[list(p)]) if p else 1.0 for p in d.powers]
        q = np.array([sum((c * term for c, term in zip(column, terms) if abs(c) > 1e-13), 0.0) for column in d.coefficients.T], object)
        for joint in self.tree.joints:
            if joint.nv and joint.quaternion is not None:
                part = slice(joint.q_index, joint.q_index + 4)
                q[part] = q[part] / graph.put(Operation.ROOT, q[part] @ q[part])
        q[[self._places[i] for i in d.held]] = given
        return q

    def step(self, graph: Graph, d: Direction, q: Objects) -> Objects:
        """The position after one of Newton's steps."""
        if not d.others:
            return q
        e, G = self.equations(graph, q)
        dv = np.zeros(self.tree.nv, object)
        dv[d.others] = -solved(G[:, d.others], e[:, None], d.order)[0][:, 0]
        return graph.replayed(self._recordings[0], q, dv)[0]

    def end(self, graph: Graph, d: Direction, given: Objects, q: Objects) -> tuple[Objects, Objects, Any]:
        """The wanted positions after one step more, their Jacobian (wanted, held) by the given ones at q, and how long that step is, rad or m: NaN where q may be of
        another assembly."""
        e, G = self.equations(graph, q)
        both, pivots = solved(G[:, d.others], np.column_stack([-e, -G[:, d.held]]), d.order)
        dv, whole = np.zeros(self.tree.nv, object), np.zeros((self.tree.nv, len(d.held)), object)
        dv[d.others], whole[d.held], whole[d.others] = both[:, 0], np.eye(len(d.held)), both[:, 1:]
        moved = graph.replayed(self._recordings[0], q, dv)[0] if d.others else q
        positions = [self._places[i] for i in d.wanted]
        off = q[positions] - self.start(graph, d, given)[positions]
        margin = MARGIN * (d.box[1] - d.box[0])
        must = [*(given - (d.box[0] - margin)), *((d.box[1] + margin) - given), *(d.drift - off), *(off + d.drift), *above(pivots, d.order)]
        return moved[positions], whole[d.wanted], only_where(graph, must, sum((graph.put(Operation.ABSOLUTE, x) for x in dv), 0.0))

    def equations(self, graph: Graph, q: Objects) -> tuple[Objects, Objects]:
        """Errors (rows) and their Jacobian (rows, nv)."""
        if not self.links:
            return np.zeros(0, object), np.zeros((0, self.tree.nv), object)
        poses = dict(zip(self.links, graph.replayed(self._recordings[1], q)[0]))
        jacobians = {link: graph.replayed(recording, q)[0] for link, recording in zip(self.links, self._recordings[2:])}
        found = [row.numbers(poses, jacobians) for row in self.rows] + [(0.0, rod.direction @ jacobians[rod.link][3:]) for rod in self.idle]
        return np.array([error for error, _ in found], object), np.array([row for _, row in found], object)

    def position(self, graph: Graph, d: Direction, given: Objects, steps: int) -> tuple[Objects, Objects, Any]:
        """The start, so many steps, the last of which is that of the end."""
        q = self.start(graph, d, given)
        for _ in range(steps - 1):
            q = self.step(graph, d, q)
        return self.end(graph, d, given, q)

    @cached_property
    def rates_order(self) -> PivotOrder:
        """Pivots of the motors' rates by those of joints."""
        graph = Graph()
        d = self.directions["motors_of"]
        _, W, _ = self.position(graph, d, graph.inputs("q", len(d.held)), 1)
        return pivot_order(self.rates, W)

    # how it is fitted

    def _direction(self, word: str, held: list[int], wanted: list[int]) -> Direction:
        """With starts of the degree that makes it cheapest."""
        others = [i for i in range(self.tree.nv) if i not in held]
        order, found = self._order(others), list[tuple[int, Direction]]()
        for degree in DEGREES:
            d = self._fitted(word, held, wanted, others, order, degree)
            graph = Graph()
            _, _, last = self.position(graph, d, graph.inputs("x", len(held)), d.steps)
            recording = graph.recording("", {"last": last})
            found.append((recording.arithmetic + OF_ANGLE * recording.angles, d))
        return min(found, key=lambda x: x[0])[1]

    def _fitted(self, word: str, held: list[int], wanted: list[int], others: list[int], order: PivotOrder, degree: int) -> Direction:
        given, positions = self._states[:, [self._places[i] for i in held]], [self._places[i] for i in wanted]
        centre, box = given.mean(axis=0), np.array([given.min(axis=0), given.max(axis=0)])
        powers = [p for k in range(degree + 1) for p in combinations_with_replacement(range(len(held)), k)]
        monomials = np.stack([np.prod((given - centre)[:, list(p)], axis=1) for p in powers], axis=1)
        coefficients = np.linalg.lstsq(monomials, self._states, rcond=None)[0]
        off = np.abs(monomials @ coefficients - self._states)[:, positions].max(initial=0.0)
        d = Direction(word, held, wanted, others, centre, box, powers, coefficients, order, max(DRIFT * float(off), LEAST_DRIFT))
        starting, stepping = Graph(), Graph()
        (q,) = played(starting.recording("", {"q": self.start(starting, d, starting.inputs("x", len(held)))}), given)
        step = stepping.recording("", {"q": self.step(stepping, d, stepping.inputs("q", self.tree.nq))})
        for steps in range(1, MOST_STEPS + 1):
            before, (q,) = q, played(step, q)
            if np.abs(q - before).max() < LAST or steps == MOST_STEPS:
                break
        return replace(d, steps=steps, error=float(np.abs(q - self._states)[:, positions].max(initial=0.0)))

    def _order(self, others: Sequence[int]) -> PivotOrder:
        graph = Graph()
        _, G = self.equations(graph, graph.inputs("q", self.tree.nq))
        A = G[:, others]
        return pivot_order(played(graph.recording("", {"A": A}), self._states)[0], A)


def only_where(graph: Graph, positive: Sequence[Any], number: Any) -> Any:
    """A number where all of others are positive, and NaN elsewhere."""
    for x in positive:
        number = graph.put(Operation.SELECT, graph.put(Operation.LESS, 0.0, x), number, np.nan)
    return number


def _alone(a: MotionMap, balls: Sequence[str]) -> tuple[Model, list[int]]:
    """The tree of the part, in which all other joints stand at neutral, and balls of rods too, and for each of its coordinates that of the model."""
    m = a.model
    bare, neutral = m.with_physics(None).without_loops(), m.neutral()
    others = {
        joint.name: neutral[joint.q_index : joint.q_index + joint.nq]
        for joint in bare.joints
        if joint.nv and (joint.v_index not in a.part.all or joint.name in balls)
    }
    tree = bare.with_frozen_joints(others) if others else bare
    order = [0] * tree.nv
    for joint in tree.joints:
        for i in range(joint.nv):
            order[joint.v_index + i] = m.joint(joint.name).v_index + i
    return tree, order
