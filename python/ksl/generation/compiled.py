"""`m.compile`: batches of a model by code for this mechanism alone."""

from __future__ import annotations

import ctypes
import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ksl import _core
from ksl.base.errors import ArgumentError, CompilerError
from ksl.generation.batches import instruction_bytes, source
from ksl.generation.cache import cached
from ksl.generation.card.compiled import compiled_for_card
from ksl.generation.compiler import Compiler, find_compiler
from ksl.generation.arguments import Arguments
from ksl.generation.requests import functions_of, is_differentiated, refuse_unwritten
from ksl.model.model import with_code

if TYPE_CHECKING:
    from ksl.model.model import Model

PREFIX = "k_"
"""All names in the text begin with it.  No name of a robot is in it."""
_loaded: list[ctypes.CDLL] = []
"""Libraries stay loaded: a call on another thread may still run in one."""


def compiled(
    model: Model,
    algorithms: str | Sequence[str],
    scalar: Literal["double", "float"] = "double",
    external: Sequence[str] = (),
    compiler: str | None = None,
    device: str = "cpu",
    parameters: Sequence[str] = (),
) -> Model:
    """See `ksl.Model.compile`."""
    if scalar not in ("double", "float"):
        raise ArgumentError(f"scalar={scalar!r}: expected double or float")
    single = scalar == "float"
    links, with_inertias = _links(model, external, "external"), _links(model, parameters, "parameters")
    algorithms = algorithms.split(",") if isinstance(algorithms, str) else list(algorithms)
    if device != "cpu":
        if compiler is not None:
            raise ArgumentError(f"compiler={compiler!r}: code for a card is compiled by NVRTC, which the variable KSL_NVRTC names; leave it out")
        return compiled_for_card(model, algorithms, scalar, Arguments(links, parameters=with_inertias), device)
    if with_inertias:
        raise ArgumentError(
            "parameters=: calls on the processor have none; with_parameters makes a model that has them, ksl.torch.differentiable and ksl.jax.differentiable take them, and ksl.generate makes a function that does"
        )
    functions = functions_of(model, algorithms, Arguments(links), single, "least-norm")
    for function in functions:
        if function.derivative:
            raise ArgumentError(f"algorithms: models have no call {function.derivative}.{function.row}; ksl.generate makes a function of it")
        if model.loops and is_differentiated(model, function.row):
            raise ArgumentError(
                f"algorithms: {function.row} of this closed mechanism is put together by the library from several calls, whose bits code doesn't have; ksl.generate makes a function of it"
            )
    refuse_unwritten(functions, "isn't compiled; the whole matrix is")
    lanes = instruction_bytes(_core.instruction_set()) // (4 if single else 8)
    text, memory = source(functions, PREFIX, scalar, lanes, bool(model.loops))
    library = load(text, find_compiler(compiler))
    code = []
    for number, function in enumerate(functions):
        address = ctypes.cast(getattr(library, f"{PREFIX}call_{number}"), ctypes.c_void_p).value
        assert address is not None
        code.append(
            (
                algorithms[number],
                function.row,
                function.request,
                [model.link_names.index(link) for link in function.arguments.external],
                single,
                lanes,
                memory[number],
                address,
            )
        )
    return with_code(model, code)


def _links(model: Model, given: Sequence[str], what: str) -> tuple[str, ...]:
    """Names of links, by those of frames.  Raises ArgumentError where one comes twice."""
    links = tuple(model.link_names[model.frame_link(link)] for link in ([given] if isinstance(given, str) else given))
    if len(set(links)) < len(links):
        raise ArgumentError(f"{what} names a link twice: {', '.join(links)}; name each once")
    return links


def load(text: str, compiler: Compiler) -> ctypes.CDLL:
    """The library of a text, from the cache if it is there.  Raises CompilerError."""
    library = _opened(built(text, compiler))
    _loaded.append(library)
    return library


def built(text: str, compiler: Compiler) -> Path:
    """The file of the library of a text, in the cache.  Raises CompilerError."""
    said = "\0".join([text, compiler.version, *compiler.command, *compiler.flags()])
    return cached(hashlib.sha256(said.encode()).hexdigest(), compiler.compile, text)


def _opened(path: Path) -> ctypes.CDLL:
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise CompilerError(f"{path}: can't be loaded: {error}; a cache that may hold code is named by the variable KSL_CACHE") from None
