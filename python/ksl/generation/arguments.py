"""What generated functions have besides the inputs and results of rows: its words, what headers say of them, and the engine's model that has their numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ksl import _core
from ksl.base.errors import ArgumentError
from ksl.generation.words import comment

if TYPE_CHECKING:
    from ksl.model.model import Model

Numbers = NDArray[np.floating[Any]]
OF_MODELS = ("gravity", "payload", "parameters")
"""Arguments that are constants of a model otherwise.  Only functions whose results depend on one have it."""


@dataclass(frozen=True)
class Arguments:
    external: tuple[str, ...] = ()
    """Links on which wrenches act."""
    gravity: bool = False
    payload: tuple[str, ...] = ()
    """Links that carry a payload."""
    parameters: tuple[str, ...] = ()
    """Links whose inertias are replaced."""
    pivots: bool = False
    """Are the sizes of pivots a result, of rows that are computed by them?"""


def least_pivot(macro: str) -> str:
    """The limit that headers have where functions give the sizes of pivots."""
    return f"/* Pivots of closed mechanisms that are smaller don't serve. */\n#define {macro}_LEAST_PIVOT {_core.loop_tolerances()['plan_pivot']!r}\n\n"


def arguments_given(model: Model, words: Sequence[str]) -> Arguments:
    """The inputs besides those of rows, by their words."""
    found: dict[str, Any] = {}
    for word in [words] if isinstance(words, str) else words:
        kind, _, rest = word.strip().partition(":")
        if kind == "gravity" and not rest:
            found[kind] = True
            continue
        if kind not in ("external", "payload", "parameters") or not rest:
            raise ArgumentError(f"arguments: {word!r} is none; expected gravity, external:LINK+LINK, payload:LINK, or parameters:LINK")
        links = found.get(kind, ()) + tuple(model.link_names[model.frame_link(link)] for link in rest.split("+"))
        if len(set(links)) < len(links):
            raise ArgumentError(f"arguments: {kind} names a link twice: {', '.join(links)}; name each once")
        found[kind] = links
    return Arguments(**found)


def argument_texts(of: Arguments) -> Iterator[str]:
    """What a header says of them."""
    if of.external:
        yield f"external: the wrench on each of {_listed(of.external)}: force, then moment about the link's origin, in the link's axes."
    if of.gravity:
        yield "gravity: m/s2, in world axes."
    ten = "m, m c (3), Ixx, Ixy, Iyy, Ixz, Iyz, Izz about its origin, in its axes; kg, kg m, kg m2"
    if of.payload:
        yield f"payload: what is added to the inertia of {_listed(of.payload)}: {ten}.  Zeros: no payload."
    if of.parameters:
        yield f"parameters: the inertia of {_listed(of.parameters)}, in place of the robot's: {ten}."


def _listed(links: Sequence[str]) -> str:
    return ", ".join(map(comment, links))


def model_with(model: Model, of: Arguments, given: Mapping[str, Any]) -> Model:
    """The model that has the numbers of these arguments of models."""
    if "gravity" in given:
        model = model.with_gravity(given["gravity"])
    for name, links in (("parameters", of.parameters), ("payload", of.payload)):
        if name in given:
            ten = np.asarray(given[name], dtype=float).reshape(-1, 10)
            model = model.with_parameters({link: x + model.link(link).parameters if name == "payload" else x for link, x in zip(links, ten, strict=True)})
    return model


def some_numbers(model: Model, of: Arguments, name: str, state: int) -> Numbers:
    """Numbers of one of OF_MODELS for a state of the self-test.  In the first there is no payload, and links have their own parameters."""
    if name == "gravity":
        return np.array([0.5 * state, -0.25 * state, -9.81])
    added = 0.5 * state * np.array([1.0, 0.05, -0.1, 0.2, 0.06, 0.005, 0.0525, -0.01, 0.02, 0.0225])
    return np.concatenate([added if name == "payload" else added + model.link(link).parameters for link in getattr(of, name)])
