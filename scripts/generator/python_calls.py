"""Python methods (ksl.mechanism.calls), and types of the compiled calls that nanobind can't derive for the stub of ksl._core."""

import re
import textwrap

from generator.rows import ALGORITHMS, MARK, Algorithm, has, ordered, sentence

from algorithms.examples import EXAMPLES  # the rows have made its folder known

WIDTH = 160

EXPRESSED = 'axes: Expressed = "frame", at: Expressed = "frame", order: Order = "lin_ang"'
EXTERNAL_AXES = 'external_axes: ExternalAxes = "link"'
HELD = """\
        if external_axes != "link":
            external = external_in(external, external_axes)
"""
OFFSET = "offset: ArrayLike | None = None"
WRENCHES = 'on: Side = "child", at: Point = "joint", axes: str = "joint", order: Order = "lin_ang", part: Part = "total", joints: Iterable[str] | None = None'

REQUEST = {
    "": ("", "None"),
    "link": ("name: str", "self._links_of((name,))"),
    "frame": (f"name: str, {EXPRESSED}, {OFFSET}", "self._frames_of((name,), axes, at, order, offset)"),
    "frames": (f"names: Iterable[str] | None = None, {EXPRESSED}", "self._frames_of(names, axes, at, order, None)"),
    "relative": (f"name: str, seen_from: str, {EXPRESSED}, {OFFSET}", "self._frames_of((name, seen_from), axes, at, order, offset)"),
    "links": ("names: Iterable[str] | None = None", "self._links_of(names)"),
    "joints": (WRENCHES, "self.reaction_request(on, at, axes, order, part, joints)"),
    "reactions": (WRENCHES, "self.reaction_request(on, at, axes, order, part, joints)"),
}

INPUTS_AT_MOST = 4
"""As many as the compiled calls have arguments for; None for the others."""

ALIASES = {"inverse_dynamics": "rnea", "forward_dynamics": "aba", "mass_matrix": "crba"}

METHOD = '''\
    def {name}(
        {arguments}
    ) -> {result}:
        """{summary}
{paragraphs}{example}
        """
{first}{held}{choice}        return self._core.{compiled}({passed})
'''

FIRST = {
    "reactions": """\
        if stiffness is not None:
            stiff: Calls = self._with_stiffness(stiffness)
            return stiff.reactions(q, v, a, external, on, at, axes, order, part, joints, out, threads, external_axes)
""",
    "forward_dynamics": """\
        if stabilise is not None:
            return self._stabilised(q, v, tau, external, out, external_axes, stabilise, threads)
""",
    "reactions_derivatives": """\
        if self.loops:
            return self._reactions_along((q, v, a), external, on, at, axes, order, part, joints, out, external_axes, undetermined, threads)
""",
    "inverse_dynamics_derivatives": """\
        if self.loops:
            return self._along("inverse_dynamics_derivatives", q, v, (a, "a"), external, out, external_axes, threads)
""",
    "forward_dynamics_derivatives": """\
        if self.loops:
            return self._along("forward_dynamics_derivatives", q, v, (tau, "tau"), external, out, external_axes, threads)
""",
}
"""What methods do first for mechanisms with loops."""
FURTHER = {
    "reactions": "stiffness: Stiffnesses | None = None",
    "forward_dynamics": "stabilise: Gains | None = None",
    "reactions_derivatives": 'undetermined: Undetermined = "refuse"',
}
"""Keywords of that."""

CHOICE = """\
        if type({keyword}) is not str or {keyword} != "{default}":
            compiled = {{{others}}}[one_of({keyword}, "{keyword}", {values})]
            return compiled({passed})
"""


def request_of(row: Algorithm) -> tuple[str, str]:
    """Keywords of a method, and the request that they make."""
    keywords, request = (text.replace("names", row.links_keyword) for text in REQUEST[row.request])
    if row.keywords == "kind":
        return keywords.replace("axes:", 'kind: Acceleration = "spatial", axes:'), request[:-1] + ", kind)"
    if row.links_keyword == "links":
        request = "self._own_links_of(links)"
    if row.mimic == "hybrid":
        return keywords, "self._held_of(names)"
    if ordered(row) and row.request == "links":
        return f'{keywords}, order: Order = "lin_ang"', request[:-1] + ", order)"
    if ordered(row):
        return 'order: Order = "lin_ang"', "self._order_of(order)"
    if row.keywords == "point":
        return 'name: str, point: ArrayLike, axes: Expressed = "frame"', "self._point_of(name, axes, point)"
    return keywords, request


def choices(row: Algorithm, passed: str) -> str:
    """The calls of other algorithms that keywords choose."""
    return "".join(
        CHOICE.format(
            keyword=keyword, passed=passed, default=next(iter(rows)), values=", ".join(f'"{value}"' for value in rows),
            others=", ".join(f'"{value}": self._core.{name}' for value, name in rows.items()),
        )
        for keyword, rows in row.choices.items()
    )  # fmt: skip


def several(row: Algorithm) -> bool:
    return len(row.results) > 1


def method(row: Algorithm) -> str:
    array = "tuple[" + ", ".join("Array" for _ in row.results) + "]" if several(row) else "Array"
    keywords, request = request_of(row)
    external = {"optional": "external: External | None = None", "required": "external: External"}.get(row.external, "")
    chosen = ", ".join(f'{keyword}: {keyword.capitalize()} = "{next(iter(rows))}"' for keyword, rows in row.choices.items())
    arguments = [
        "self",
        *(f"{name}: ArrayLike" for name in row.input_names()),
        external,
        keywords,
        chosen,
        f"out: {array} | None = None",
        "threads: int | None = None",
        EXTERNAL_AXES if row.external else "",
        FURTHER.get(row.name, ""),
    ]
    line = ", ".join(filter(None, arguments))
    passed = [
        *("numbers(fraction)" if name == "fraction" else name for name in row.input_names()),
        *("None" for _ in range(INPUTS_AT_MOST - len(row.inputs))),
        "external" if row.external else "None",
        request,
        "out",
        "threads",
    ]
    given = ", ".join(passed)
    text = METHOD.format(
        name=row.name, arguments=line, result=array, summary=row.summary, compiled=row.name, passed=given, choice=choices(row, given), held=HELD if row.external else "", first=FIRST.get(row.name, ""),
        example=textwrap.indent("\n\n" + EXAMPLES[row.name].strip(), " " * 12, lambda l: l.strip() != "") if row.name in EXAMPLES else "",
        paragraphs=textwrap.indent("\n" + row.python.strip(), "        ", lambda l: l.strip() != ""),
    )  # fmt: skip
    one_line = f"    def {row.name}({line}) -> {array}:"
    if len(one_line) <= WIDTH:
        text = one_line + text[text.index(f"    ) -> {array}:") + len(f"    ) -> {array}:") :]
    elif len(line) + 8 > WIDTH:
        whole = re.sub(r"(?<!,) ", "\0", re.sub(r"\[[^]]*\]", lambda brackets: brackets[0].replace(" ", "\0"), line + ","))  # lines break between arguments
        lines = textwrap.fill(whole, WIDTH, initial_indent=8 * " ", subsequent_indent=8 * " ", break_long_words=False).replace("\0", " ")
        text = text.replace(f"        {line}\n    ) -> {array}:\n", f"{lines}\n    ) -> {array}:  # fmt: skip\n")
    return text


CALLS = '''\
# {mark}
"""Algorithms over arrays with any leading shape."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from numpy.typing import ArrayLike

from ksl import _core
from ksl.mechanism.loops import Gains, LoopCalls
from ksl.mechanism.requests import one_of, requests_given
from ksl.mechanism.states import Acceleration, Array, Expressed, External, ExternalAxes, Order, Part, Point, Side, Triangle, Undetermined, external_in, numbers
from ksl.mechanism.stiffness import Stiffnesses


class Calls(LoopCalls):
    """A method for each algorithm."""

    def inverse_dynamics_with_reactions(
        self, q: ArrayLike, v: ArrayLike, a: ArrayLike, requests: Sequence[_core.Request] | _core.Request, external: External | None = None, threads: int | None = None,
        external_axes: ExternalAxes = "link",
    ) -> tuple[Array, ...]:  # fmt: skip
        """Efforts (…, nv) and, for each request, reactions (…, joints, 6), in one pass over the states; N m, N.

        requests: made by :meth:`reaction_request`, which takes the keywords of :meth:`reactions`.  Several ones cost little more than one.
        q, v, a, external, threads, external_axes: as in :meth:`inverse_dynamics`.  Results are those of :meth:`inverse_dynamics` and
        :meth:`reactions`, to the bit.
        """
        return self._core.inverse_dynamics_with_reactions(q, v, a, None, external_in(external, external_axes), requests_given(requests), None, threads)

{methods}
{aliases}
'''

STUB = """\
# {mark}
# Types that nanobind can't derive for the stub of ksl._core: the calls take all that ksl.mechanism.states can convert to arrays.

^_core\\.__prefix__$:
    from typing import Any
    import numpy
    from numpy.typing import NDArray

^_core\\.joint_kinds$:
    joint_kinds: tuple[JointKind, ...]

{calls}
Model\\.inverse_kinematics$:
    def inverse_kinematics(
        self, frames: list[tuple[int, float, float]], target: Any, start: Any, position_tolerance: float, orientation_tolerance: float,
        iterations: int, starts: int, seed: int, limits: bool, threads: int | None,
    ) -> tuple[NDArray[numpy.floating], NDArray[numpy.floating], NDArray[numpy.intc], NDArray[numpy.intc], NDArray[numpy.intc]]: ...

Model\\.(loop_error|loop_jacobian|reaction_patterns)$:
    def \\1(self, q: NDArray[numpy.floating]) -> NDArray[numpy.floating]: ...

Model\\.loop_acceleration$:
    def loop_acceleration(self, q: NDArray[numpy.floating], v: NDArray[numpy.floating], a: NDArray[numpy.floating]) -> NDArray[numpy.floating]: ...

Model\\.force_element_states$:
    def force_element_states(self, q: NDArray[numpy.floating], v: NDArray[numpy.floating]) -> NDArray[numpy.floating]: ...

Model\\.mobility$:
    def mobility(self, q: NDArray[numpy.floating]) -> tuple[int, int, int, float, float, float, list[int]]: ...

Model\\.consistent_velocity$:
    def consistent_velocity(self, q: NDArray[numpy.floating], v: NDArray[numpy.floating], given: list[int]) -> tuple[NDArray[numpy.floating], list[int]]: ...

Model\\.consistent_acceleration$:
    def consistent_acceleration(
        self, q: NDArray[numpy.floating], v: NDArray[numpy.floating], a: NDArray[numpy.floating], given: list[int]
    ) -> tuple[NDArray[numpy.floating], list[int]]: ...

Model\\.close$:
    def close(
        self, q: NDArray[numpy.floating], hold: list[int], limits: bool, iterations: int, starts: int
    ) -> tuple[NDArray[numpy.floating], list[int], list[float]]: ...

Model\\.closed_derivatives$:
    def closed_derivatives(
        self, q: NDArray[numpy.floating], v: NDArray[numpy.floating], x: NDArray[numpy.floating], links: list[int],
        wrenches: list[NDArray[numpy.floating]], in_world: bool, forward: bool,
    ) -> tuple[NDArray[numpy.floating], NDArray[numpy.floating], NDArray[numpy.floating], int]: ...

Model\\.simulate$:
    def simulate(
        self, q: NDArray[numpy.floating], v: NDArray[numpy.floating], times: NDArray[numpy.floating], how: dict[str, Any], drives: dict[str, Any],
        external: list[tuple[int, Any]], in_world: bool, laws: dict[str, Any], events: list[tuple[int, bool]], event_values: Any, threads: int | None, progress: Any,
    ) -> tuple[dict[str, NDArray[numpy.floating]], list[tuple[int, float, int, int, int, int, int]], list[tuple[int, float, int, int, float]]]: ...

Model\\.stabilised_forward_dynamics$:
    def stabilised_forward_dynamics(
        self, q: NDArray[numpy.floating], v: NDArray[numpy.floating], tau: NDArray[numpy.floating], links: list[int],
        wrenches: list[NDArray[numpy.floating]], in_world: bool, alpha: float, beta: float,
    ) -> NDArray[numpy.floating]: ...

Model\\.reaction_variations$:
    def reaction_variations(
        self, q: NDArray[numpy.floating], v: NDArray[numpy.floating], a: NDArray[numpy.floating], links: list[int],
        wrenches: list[NDArray[numpy.floating]], in_world: bool,
    ) -> tuple[NDArray[numpy.floating], NDArray[numpy.floating], NDArray[numpy.floating], NDArray[numpy.floating], int]: ...

Model\\.(joints|links|loops|force_elements)$:
    @property
    def \\1(self) -> list[dict[str, Any]]: ...

Model\\.joint_kinds$:
    joint_kinds: tuple[JointKind, ...]

Operator\\.compute$:
    def compute(self, stage: int, inputs: list[Any], outputs: list[Any], threads: int) -> None: ...

^_core\\.xla_handler$:
    xla_handler: Any

^_core\\.xla_handler_on_card$:
    xla_handler_on_card: Any

^_core\\.joint_kinds$:
    joint_kinds: tuple[JointKind, ...]

# Some versions of nanobind write it, too: one declaration is enough.
^_core\\.QUATERNION_(TOLERANCE|ROUNDING)$:

^_core\\.__suffix__$:
    __version__: str
    QUATERNION_TOLERANCE: float
    QUATERNION_ROUNDING: float
"""

COMPILED = """\
Model\\.{name}$:
    def {name}(self, q: Any, x: Any, y: Any, z: Any, external: Any, request: {request}, out: Any, threads: int | None) -> {result}: ...
"""


def compiled(row: Algorithm) -> str:
    array = "NDArray[numpy.floating]"
    result = f"tuple[{', '.join(array for _ in row.results)}]" if several(row) else array
    if row.request == "reactions" and row.results:
        result = f"tuple[{array}, ...]"
    request = {"": "Links | None" if ordered(row) else "None", "joints": "Request", "reactions": "Request | tuple[Request, ...]"}.get(row.request, "Links")
    return COMPILED.format(name=row.name, request=request, result=result)


GENERATION_ROWS = '''\
# {mark}
"""What the call of each algorithm asks for, to generate code of it."""

from __future__ import annotations

from ksl.generation.row import Row

ROWS: dict[str, Row] = {{
{rows}}}
'''


def generation_rows() -> str:
    """As Python writes them; a long one is a line all the same."""
    rows = "".join(
        f"    {quoted(row.name)}: Row(({', '.join(map(quoted, row.input_names()))},), {quoted(row.request)}, {quoted(row.links_keyword)}, {quoted(row.external)}, {row.needs_mass}, {quoted(sentence(row))}),\n"
        for row in ALGORITHMS
        if row.loops != "plan"
    )
    return GENERATION_ROWS.format(mark=MARK, rows=rows)


def quoted(text: str) -> str:
    return '"' + text.replace('"', '\\"') + '"'


def files() -> dict[str, str]:
    methods = "\n".join(method(row) for row in ALGORITHMS if has(row, "python"))
    aliases = "\n".join(f"    {alias} = {name}" for name, alias in ALIASES.items())
    return {
        "python/ksl/mechanism/calls.py": CALLS.format(mark=MARK, methods=methods, aliases=aliases),
        "python/ksl/generation/rows.py": generation_rows(),
        "python/core_stub.txt": STUB.format(mark=MARK, calls="\n".join(map(compiled, (row for row in ALGORITHMS if row.loops != "plan")))),
    }
