"""C of the maps in both directions: a fitted start, a fixed number of Newton's steps over the rows of the loops, and the Jacobian there.

Poses and Jacobians of the links at the loops are generated code of the tree; what is written here puts rows together and solves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations_with_replacement

import numpy as np

from ksl.drivetrain.c_rows import LoopRow, distances, rows_of_loops
from ksl.drivetrain.c_text import Direction, MapText
from ksl.drivetrain.idle import IdleRod
from ksl.drivetrain.motion import MotionMap
from ksl.generation.arguments import arguments_given
from ksl.generation.files import Code
from ksl.generation.requests import checked_prefix, functions_of
from ksl.mechanism.states import Array
from ksl.model.model import Model

STEPS, ENOUGH = range(2, 9), 1e-12
"""How many Newton's steps there are: the fewest that leave no larger error over the range, rad or m."""
DEGREE = 3
"""The degree of the polynomials in the given coordinates that starts are fitted with."""


def maps_in_c(a: MotionMap, q: Array, name: str) -> dict[str, str]:
    """{file: text} of NAME.h and NAME.c, the tree, and NAME_maps.h and NAME_maps.c, for positions q (n, joints), over which starts are fitted.

    Raises ValueError for kinds of loops and joints that it doesn't have.
    """
    prefix = checked_prefix(name)
    rods, balls, idle = distances(a.equations)
    tree, order = _alone(a, balls)
    rows = rods + rows_of_loops(a.equations, a.start, [a.model.joint(name).child for name in balls])
    links = list(dict.fromkeys([link for row in rows for link, _ in row.sides] + [rod.link for rod in idle]))
    functions = (
        functions_of(tree, [f"frame_poses:{'+'.join(links)}", *(f"jacobian:{link}" for link in links)], arguments_given(tree, []), False, "refuse")
        if links
        else []
    )
    code = Code(tree, prefix, "double", False, functions)
    Q = a.state(q)[0]
    states = np.zeros((len(q), tree.nq))
    for joint in tree.joints:
        if joint.nv:
            of = a.model.joint(joint.name)
            states[:, joint.q_index : joint.q_index + joint.nq] = Q[:, of.q_index : of.q_index + of.nq]
    index = {i: k for k, i in enumerate(order)}
    of_joints, of_motors = ([index[i] for i in part] for part in (a.part.of_joints, a.part.of_motors))
    maps = [
        _direction(tree, f"{prefix}_{word}", *sides, states, rows, idle)
        for word, sides in (("motors_of", (of_joints, of_motors)), ("joints_of", (of_motors, of_joints)))
    ]
    text = MapText(a, tree, code, links, rows, idle, maps)
    files = {file: x for file, x in code.files().items() if file in (f"{prefix}.h", f"{prefix}.c")} if links else {}
    return files | {f"{prefix}_maps.h": text.header(), f"{prefix}_maps.c": text.source()}


def _alone(a: MotionMap, balls: Sequence[str]) -> tuple[Model, list[int]]:
    """The tree of the part, in which all other joints stand at neutral, and balls of rods too, and for each of its coordinates that of the model."""
    m = a.model
    for joint in m.joints:
        if joint.nv and joint.v_index in a.part.all and joint.nq != joint.nv and joint.kind != "spherical":
            raise ValueError(f"joint {joint.name} is {joint.kind}, and C of maps has no such joint; the Python map has it")
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


def _direction(tree: Model, name: str, held: list[int], wanted: list[int], states: Array, rows: list[LoopRow], idle: list[IdleRod]) -> Direction:
    own = {joint.v_index + i: joint.q_index + i for joint in tree.joints if joint.nv and joint.quaternion is None for i in range(joint.nv)}
    given = states[:, [own[i] for i in held]]
    centre = given.mean(axis=0)
    powers = [p for degree in range(DEGREE + 1) for p in combinations_with_replacement(range(len(held)), degree)]
    monomials = np.stack([np.prod((given - centre)[:, list(p)], axis=1) for p in powers], axis=1)
    coefficients = np.linalg.lstsq(monomials, states, rcond=None)[0]
    others = [i for i in range(tree.nv) if i not in held]
    d = Direction(name, held, wanted, others, centre, powers, coefficients, 0, 0.0)
    out = started(tree, d, given)
    for steps in STEPS:
        newton(tree, d, rows, idle, out, steps if steps == STEPS[0] else 1)
        d = replace(d, steps=steps, error=float(np.abs(out - states)[:, [own[i] for i in wanted]].max(initial=0.0)))
        if d.error < ENOUGH:
            break
    return d


def started(tree: Model, d: Direction, given: Array) -> Array:
    """Positions (n, nq) of the tree by the fit."""
    own = {joint.v_index + i: joint.q_index + i for joint in tree.joints if joint.nv and joint.quaternion is None for i in range(joint.nv)}
    out = np.stack([np.prod((given - d.centre)[:, list(p)], axis=1) for p in d.powers], axis=1) @ d.coefficients
    for joint in tree.joints:
        if joint.nv and joint.quaternion is not None:
            part = slice(joint.q_index, joint.q_index + 4)
            out[:, part] /= np.linalg.norm(out[:, part], axis=1, keepdims=True)
    out[:, [own[i] for i in d.held]] = given
    return out


def newton(tree: Model, d: Direction, rows: list[LoopRow], idle: list[IdleRod], out: Array, steps: int) -> None:
    """As the C makes them, in place on positions (n, nq) of the tree."""
    links = {link for row in rows for link, _ in row.sides} | {rod.link for rod in idle}
    for q in out:
        for _ in range(steps if d.others else 0):
            poses, jacobians = ({link: f(q, link) for link in links} for f in (tree.frame_pose, tree.jacobian))
            numbers = [row.numbers(poses, jacobians) for row in rows]
            G = np.array([row for _, row in numbers] + [rod.direction @ jacobians[rod.link][3:] for rod in idle])
            dv = np.zeros(tree.nv)
            dv[d.others] = -np.linalg.solve(G[:, d.others], [e for e, _ in numbers] + [0.0] * len(idle))
            q[:] = tree.integrate(q, dv)
