"""Why dynamics differ: what, applied to KSL's model or its results, gives the other library's numbers.

Each hypothesis is tried: a reason is given where the numbers then agree, and not because it is likely.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ksl.comparison.bodies import lumped, tensor
from ksl.comparison.body_changes import changed_links
from ksl.comparison.coordinates import Array
from ksl.comparison.differences import ACCELERATIONS, DYNAMIC, EFFORTS, MASS_MATRIX, Pair, close, largest, pairs
from ksl.comparison.file_rules import rule
from ksl.comparison.kinematic_reasons import QUATERNION, with_other_quaternions
from ksl.comparison.other_robot import Numbers, OtherRobot, States, numbers_of_ksl
from ksl.comparison.results import Note
from ksl.mechanism.joint_kinds import KINDS
from ksl.model.model import Model

PHYSICS = {"damping": "damping", "friction": "friction", "armature": "armature", "rotor": "rotor_inertia", "spring": "spring_stiffness"}
"""Physics of joints, and the number of a joint that gives it."""
MOST_TOGETHER = 4
"""Hypotheses that are tried together: four of eight are 162 sets."""

Variant = Callable[[Model, States], tuple[Model, States]]


class Hypothesis(NamedTuple):
    topic: str
    text: str
    applied: Variant
    off: bool = False
    """Does it turn an effect of the other robot off, whose topic it has."""


def dynamic_reasons(other: OtherRobot, states: States, numbers: Numbers, differing: list[str]) -> list[Note]:
    """The smallest set of hypotheses that accounts for each dynamic quantity; quantities with the same set are said together."""
    wanted = [name for name in DYNAMIC if name in differing]
    if not wanted:
        return []
    found: dict[tuple[str, ...], list[str]] = {}
    texts: dict[str, str] = {}
    left = list(wanted)
    known: dict[frozenset[str], Numbers] = {frozenset(): numbers}
    for chosen in _sets(_hypotheses(other)):
        off = frozenset(h.topic for h in chosen if h.off)
        if off not in known:
            with other.without(off):
                known[off] = other.numbers(states)
        agreeing = _agreeing(other.model, states, known[off], chosen, left)
        if agreeing:
            found.setdefault(tuple(h.topic for h in chosen), []).extend(agreeing)
            texts.update({h.topic: h.text for h in chosen})
            left = [name for name in left if name not in agreeing]
        if not left:
            break
    explained: dict[str, list[str]] = {}
    for topics, names in found.items():
        for topic in topics:
            explained.setdefault(topic, []).extend(names)
    return [Note(topic, texts[topic], tuple(names)) for topic, names in explained.items()] + _reordered(other.model, states, numbers, left)


def _sets(hypotheses: list[Hypothesis]) -> Iterator[tuple[Hypothesis, ...]]:
    for size in range(1, min(len(hypotheses), MOST_TOGETHER) + 1):
        yield from combinations(hypotheses, size)
    if len(hypotheses) > MOST_TOGETHER:
        yield tuple(hypotheses)


def _agreeing(model: Model, states: States, numbers: Numbers, chosen: tuple[Hypothesis, ...], wanted: list[str]) -> list[str]:
    varied = states
    for hypothesis in chosen:
        model, varied = hypothesis.applied(model, varied)
    try:
        found = numbers_of_ksl(model, varied, [])
    except ValueError:  # a body that no joint can carry, say
        return []
    return [pair.name for pair in pairs(model, found, numbers) if pair.name in wanted and close(pair.other, pair.ksl, pair.scale)]


def _hypotheses(other: OtherRobot) -> list[Hypothesis]:
    model = other.model
    found = list(_of_physics(other))
    found += [Hypothesis(topic, f"{text}: {rule(other.library, topic)}", lambda m, s: (m, s), True) for topic, text in other.effects().items()]
    bodies = {link: P for link, P in other.bodies().items() if link in model.link_names}
    if bodies and (which := changed_links(model, bodies)):
        found.append(Hypothesis("masses", f"{which}: {rule(other.library, 'masses')}", lambda m, s: (_with_bodies(m, bodies), s)))
    if largest(other.gravity - np.array(model.gravity)) > 0.0:
        text = f"gravity is ({_numbers(other.gravity)}) there and ({_numbers(np.array(model.gravity))}) in KSL m/s²: {rule(other.library, 'gravity')}"
        found.append(Hypothesis("gravity", text, lambda m, s: (m.with_gravity(other.gravity), s)))
    else:
        found.append(Hypothesis("gravity", "the numbers are those of no gravity", lambda m, s: (m.with_gravity((0.0, 0.0, 0.0)), s)))
    if any(KINDS[model.joint(name).kind].quaternion is not None for name in model.joint_names):
        found.append(Hypothesis("quaternion", QUATERNION, lambda m, s: (m, with_other_quaternions(m, s))))
    return found


def _of_physics(other: OtherRobot) -> Iterator[Hypothesis]:
    """Hypotheses about what joints of the file have: applied where KSL's model doesn't, left out where it does."""
    model = other.model
    have = {name: [joint for joint in model.joint_names if getattr(model.joint(joint), number)] for name, number in PHYSICS.items()}
    have["force elements"] = [element.name for element in model.force_elements]
    for name, names in have.items():
        if names:
            here = name in model.physics
            some = f"{', '.join(names[:3])}{' …' if len(names) > 3 else ''}"
            text = f"KSL applies it (physics), {other.library} doesn't" if here else f"{other.library} applies it ({some}), KSL where physics= names it"
            yield Hypothesis(name, f"{text}: {rule(other.library, name)}", _toggled(name))


def _toggled(name: str) -> Variant:
    def applied(model: Model, states: States) -> tuple[Model, States]:
        others = [x for x in model.physics if x != name]
        return model.with_physics(others if name in model.physics else [*others, name], model.friction_width), states

    return applied


def _with_bodies(model: Model, bodies: dict[str, Array]) -> Model:
    """With each body's mass as the other library has it: all of it at one link."""
    ours, parameters = lumped(model, bodies), {}
    for link, P in bodies.items():
        more = P - ours[link]  # added to what the link has: welded ones stay
        own = np.array(model.link(link).parameters)
        I = tensor(more)
        parameters[link] = own + [more[3, 3], *more[:3, 3], I[0, 0], I[0, 1], I[1, 1], I[0, 2], I[1, 2], I[2, 2]]
        parameters[link][0] = max(parameters[link][0], 0.0)
    return model.with_parameters(parameters)


def _reordered(model: Model, states: States, numbers: Numbers, left: list[str]) -> list[Note]:
    """Reasons about the results alone: the same numbers in another order, or with the other sign."""
    ours = {pair.name: pair for pair in pairs(model, numbers_of_ksl(model, states, []), numbers) if pair.name in left}
    opposite = tuple(name for name, pair in ours.items() if close(-pair.other, pair.ksl, pair.scale))
    notes = [Note("sign", "the numbers are the same with the opposite sign", opposite)] if opposite else []
    moved = tuple(name for name in (EFFORTS, ACCELERATIONS, MASS_MATRIX) if name in ours and name not in opposite and _is_permuted(ours[name]))
    return [*notes, Note("order", "the numbers are the same, of joints in another order", moved)] if moved else notes


def _is_permuted(pair: Pair) -> bool:
    """Whether one permutation of the coordinates gives the other numbers, in all states."""
    of_ours, of_theirs = (x if x.ndim == 2 else np.einsum("nii->ni", x) for x in (pair.ksl, pair.other))
    scale = largest(of_ours) or 1.0
    order = [int(np.abs(of_theirs - of_ours[:, [j]]).max(axis=0).argmin()) for j in range(of_ours.shape[1])]
    if sorted(order) != list(range(len(order))):
        return False
    theirs = pair.other[:, order] if pair.other.ndim == 2 else pair.other[:, order][:, :, order]
    return close(theirs, pair.ksl, scale)


def _numbers(x: Array) -> str:
    return ", ".join(f"{number:.6g}" for number in x)
