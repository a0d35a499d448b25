"""What is asked for, `jacobian:tool0`, and the functions that it becomes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ksl.base.errors import ArgumentError, close_names, of_argument
from ksl.generation.arguments import OF_MODELS, Arguments, model_with
from ksl.generation.open_reactions import Undetermined, refuse_open
from ksl.generation.recording import DERIVATIVES, Recording, record, request_of
from ksl.generation.rows import ROWS

if TYPE_CHECKING:
    from ksl.model.model import Model

KEYWORDS = frozenset(
    "auto break case char const continue default do double else enum extern float for goto if inline int long register restrict return short signed sizeof static "
    "struct switch typedef union unsigned void volatile while _Bool _Complex _Imaginary "
    "alignas alignof and and_eq asm bitand bitor bool catch class compl concept const_cast consteval constexpr constinit co_await co_return co_yield decltype delete "
    "dynamic_cast explicit export false friend mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected public reinterpret_cast requires "
    "static_assert static_cast template this thread_local throw true try typeid typename using virtual wchar_t xor xor_eq".split()
)
"""Words of C99 and C++: the header is read by both."""
TAKEN = frozenset(
    "assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdarg stdbool stddef stdint stdio stdlib string tgmath time wchar wctype "
    "all clean help install package test".split()
)
"""Headers of C, before which NAME.h would be found, and targets that CMake and CTest have."""
MOST_STATEMENTS = 400_000
"""Statements of a function at most: some 20 MB of text.  The second derivatives of a humanoid have 107,000."""
ALONG = ("inverse_dynamics_derivatives", "forward_dynamics_derivatives", "reactions_derivatives")
"""Derivatives that closed mechanisms have along their motion, by independent coordinates."""
MOST_IN_NAME = 63
"""Characters that C99 compares of a name."""


def checked_prefix(name: str) -> str:
    """The prefix of all names, if C and C++ take it."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or name in KEYWORDS or name.lower() in TAKEN or len(name) > MOST_IN_NAME // 2:
        raise of_argument(
            ArgumentError, "name",
            f": is no name for C; expected at most {MOST_IN_NAME // 2} letters, digits and _, a letter first, and none of the words of C, its headers and CMake", name,
        )  # fmt: skip
    return name


def in_c(name: str) -> str:
    """A name of the robot with `_` for each character that C doesn't take."""
    return re.sub(r"[^A-Za-z0-9_]", "_", name)


@dataclass(frozen=True)
class Function:
    """A generated function: its name without the prefix, the call of the model that has the same results, and what it computes."""

    name: str
    row: str
    names: tuple[str, ...]
    keywords: dict[str, Any]
    """What the model's call is given besides inputs."""
    request: Any
    """The request of the compiled call."""
    recording: Recording
    arguments: Arguments
    """The arguments that the results depend on."""
    derivative: str
    """"", or "jvp" or "vjp" of the row."""
    text: str = ""
    """What headers say of it; that of the row where it is empty."""

    def results(self, model: Model, inputs: Sequence[Any]) -> tuple[Any, ...]:
        """The engine's results, for the numbers of each input; of derivatives the recording's."""
        if self.derivative:
            return tuple(self.recording.play(inputs))
        given = dict(zip((name for name, _ in self.recording.inputs), inputs))
        keywords = dict(self.keywords)
        if self.arguments.external:
            wrenches = given.pop("external").reshape(-1, 6)
            keywords["external"] = dict(zip(self.arguments.external, wrenches))
        model = model_with(model, self.arguments, {name: given.pop(name) for name in OF_MODELS if name in given})
        found = getattr(model, self.row)(*given.values(), **keywords)
        pivots = self.recording.play(inputs)[-1:] if self.has_pivots else ()
        return (*(found if isinstance(found, tuple) else (found,)), *pivots)

    @property
    def has_pivots(self) -> bool:
        """Are the sizes of pivots its last result?"""
        return self.recording.results[-1][0] == "pivots"


def functions_of(model: Model, algorithms: Sequence[str], arguments: Arguments, single: bool, undetermined: Undetermined) -> list[Function]:
    """A function for each of the algorithms, recorded.  Raises ArgumentError, or what the model's call raises."""
    made: dict[str, Function] = {}
    if model.nv == 0:
        raise ArgumentError(f"{model.name} has no joint that moves: there is nothing to compute")
    if not algorithms:
        raise ArgumentError("algorithms is empty; name some, as inverse_dynamics or jacobian:LINK")
    for asked in algorithms:
        function = _function_of(model, asked.strip(), arguments, single, undetermined)
        if function.name in made:
            raise ArgumentError(f"algorithms: {asked} and an earlier one would both be called {function.name}; ask for one of them")
        made[function.name] = function
    if arguments.pivots and not any(function.has_pivots for function in made.values()):
        raise ArgumentError("pivots=True (--pivots): none of the algorithms is computed by pivots, as dynamics of closed mechanisms are; leave it out")
    return list(made.values())


def refuse_unwritten(functions: Sequence[Function], without: str) -> None:
    """Raises ArgumentError for results that aren't written whole, where rows of many states are.  without: what there isn't of them."""
    for function in functions:
        if (function.recording.outputs < 0).any():
            raise ArgumentError(f"algorithms: {function.row} leaves numbers of its result unwritten, and {without}")


def _function_of(model: Model, asked: str, arguments: Arguments, single: bool, undetermined: Undetermined) -> Function:
    head, colon, rest = asked.partition(":")
    derivative, _, row = head.rpartition(".")
    if derivative not in DERIVATIVES and row != head:
        raise ArgumentError(f"algorithms: {asked!r}: a derivative is {' or '.join(f'{kind}.{row}' for kind in DERIVATIVES)}")
    if row not in ROWS:
        near = close_names(row, list(ROWS), 1)
        raise ArgumentError(f"algorithms: there is no {row!r}" + (f"; did you mean {near[0]}?" if near else f"; there are {', '.join(ROWS)}"))
    names = tuple(name for name in rest.split("+") if name)
    if colon and not names:
        raise ArgumentError(f"algorithms: {asked!r} names nothing behind the colon")
    keywords = _keywords(model, row, names)
    how = ROWS[row]
    external = arguments.external if how.external else ()
    if how.external == "required" and not external:
        raise ArgumentError(f"algorithms: {row} needs wrenches; name their links with arguments external:LINK")
    wrenches = {"external": {name: np.zeros(6) for name in external}} if external else {}
    request = _request(model, row, keywords | wrenches, len(how.inputs))
    if isinstance(request, tuple):  # of several requests for reactions, of which one is made here
        (request,) = request
    if how.request in ("reactions", "joints") and (undetermined == "refuse" or row == "reactions_derivatives"):
        refuse_open(model, f"algorithms: {row}", f"{row}:JOINT+JOINT", names or model.joint_names, has_values=row != "reactions_derivatives")
    taken = replace(arguments, external=external)
    recording = record(model, row, request, taken, single, "")
    unread = [name for name, _ in recording.inputs if name in OF_MODELS and not recording.reads(name)]
    if unread:
        taken = replace(taken, **{name: getattr(Arguments, name) for name in unread})
    if unread or derivative:
        recording = record(model, row, request, taken, single, derivative)
    if len(recording.operations) > MOST_STATEMENTS:
        raise ArgumentError(
            f"algorithms: {asked} of this robot is {len(recording.operations):,} statements, more than the {MOST_STATEMENTS:,} that are written; call the library for it"
        )
    in_name = names if how.request in ("link", "frame", "relative") else ()
    kind = [derivative] if derivative else []
    return Function("_".join([row, *map(in_c, in_name), *kind]), row, names, keywords, request, recording, taken, derivative)


def _request(model: Model, row: str, keywords: dict[str, Any], inputs: int) -> Any:
    """The request of the model's compiled call."""
    if not model.loops or row not in ALONG:
        return request_of(model, row, keywords, inputs)
    return request_of(model, "reactions", keywords, inputs) if row == "reactions_derivatives" else None


def is_differentiated(model: Model, row: str) -> bool:
    """Is a row of derivatives along a closed mechanism recorded by differentiating its dynamics?  It agrees with the library to rounding."""
    acting = bool(model.force_elements) and "force elements" in model.physics
    return row == "reactions_derivatives" or (row in ALONG and acting)


def _keywords(model: Model, row: str, names: tuple[str, ...]) -> dict[str, Any]:
    """The keywords of the model's call that names these links or joints; all else has the call's defaults."""
    how, some = ROWS[row], list(names) or None
    counts = {"link": 1, "frame": 1, "relative": 2, "": 0}
    if how.request in counts and len(names) != counts[how.request]:
        expected = {0: f"{row} names no links", 1: f"{row} is of one link: {row}:LINK", 2: f"{row} is of a link as seen from another: {row}:LINK+LINK"}
        raise ArgumentError(f"algorithms: {expected[counts[how.request]]}; given {':'.join([row, '+'.join(names)]) if names else row}")
    if how.request in ("link", "frame"):
        point = {"point": (0.0, 0.0, 0.0)} if row.startswith("point_") else {}
        return {"name": names[0], **point}
    if how.request == "relative":
        return {"name": names[0], "seen_from": names[1]}
    if row == "inverse_dynamics_with_reactions":
        return {"requests": model.reaction_request(joints=some)}
    if how.request in ("joints", "reactions"):
        return {"joints": some}
    if how.request in ("links", "frames"):
        if row == "hybrid_dynamics" and some is None:
            raise ArgumentError("algorithms: hybrid_dynamics needs the joints whose accelerations are given: hybrid_dynamics:JOINT+JOINT")
        return {how.links_keyword: some}
    return {}
