"""Coverage of Python modules for libFuzzer, ten times as fast as Atheris counts it.

Atheris calls a function at each branch, and another one for each comparison.  Here a branch stores a 1 into an array of
libFuzzer's counters, which is a single instruction of Python's.  What is lost: how often a loop ran, and the values of
comparisons, for which a dictionary of all words in the modules' code stands.  The bytecode is patched by Atheris.
"""

from __future__ import annotations

import ctypes
import importlib
import os
import re
import sys
import types
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from typing import Any

from atheris import instrument_bytecode as bytecode

MOST = 1 << 16
LATE = 1 << 12
"""Branches of modules that may be imported after the first text."""
WORD = re.compile(r"[\w.:/+-]{2,30}", re.ASCII)
_counters = bytearray(MOST)
_used = 0
_words: set[str] = set()
_kept: list[object] = []
"""Arrays whose addresses libFuzzer keeps."""


class _Marks(bytecode.Instrumentor):
    """`_counters[number] = 1` at the start of each basic block."""

    def _generate_trace_branch_invocation(self, before: Any) -> list[Any]:
        global _used
        if _used == MOST:
            raise RuntimeError(f"more than {MOST} branches; raise MOST")
        self.consts += [1, _counters, _used]  # behind all others: equal constants are not looked for
        _used += 1
        first = len(self.consts) - 3
        made = [bytecode._generate_instruction("LOAD_CONST", first + k, before) for k in range(3)]
        return [*made, bytecode._generate_instruction("STORE_SUBSCR", None, before)]


def _with_marks(code: types.CodeType) -> types.CodeType:
    """The code, and that of all functions, classes and comprehensions in it."""
    _words.update(_words_in(code.co_consts))
    marked = _Marks(code)
    marked.trace_control_flow()
    marked.consts = [_with_marks(x) if isinstance(x, types.CodeType) else x for x in marked.consts]
    made: types.CodeType = marked.to_code()
    return made


def _words_in(constants: Iterable[object]) -> Iterator[str]:
    for x in constants:
        if isinstance(x, (tuple, frozenset)):
            yield from _words_in(x)
        elif isinstance(x, str) and WORD.fullmatch(x):
            yield x


class _Loader(SourceFileLoader):
    def get_code(self, fullname: str) -> types.CodeType | None:
        code = super().get_code(fullname)
        return None if code is None else _with_marks(code)


class _Finder(MetaPathFinder):
    def __init__(self, names: Sequence[str]) -> None:
        self.names = names

    def find_spec(self, name: str, path: Sequence[str] | None, target: types.ModuleType | None = None) -> ModuleSpec | None:
        if not any(name == each or name.startswith(f"{each}.") for each in self.names):
            return None
        spec = PathFinder.find_spec(name, path, target)
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = _Loader(spec.loader.name, spec.loader.path)
        return spec


def guide(*names: str) -> None:
    """Imports modules, and those below packages as they are imported, with coverage.

    Modules that were imported before, or import others of the list first, would run without it: that is an error.
    """
    early = [name for name in names if name in sys.modules]
    if early:
        raise RuntimeError(f"{', '.join(early)}: imported before they could be instrumented")
    sys.meta_path.insert(0, _Finder(names))
    for name in names:
        importlib.import_module(name)


def register() -> None:
    """Tells libFuzzer where the counters are.  Call it once, after all imports.

    libFuzzer uses a mutator only if the library that calls it was loaded before libFuzzer itself, for all to see.
    """
    flags = sys.getdlopenflags()
    sys.setdlopenflags(flags | os.RTLD_GLOBAL)
    import atheris.custom_mutator

    sys.setdlopenflags(flags)
    import atheris.core_with_libfuzzer

    library = ctypes.CDLL(atheris.core_with_libfuzzer.__file__)
    count = min(_used + LATE, MOST)
    counters = (ctypes.c_char * count).from_buffer(_counters)
    places = (ctypes.c_size_t * (2 * count))(*(x for k in range(count) for x in (k + 1, 0)))  # address, kind
    _kept.extend((counters, places))
    for of, array in (("8bit_counters", counters), ("pcs", places)):
        start = ctypes.addressof(array)
        getattr(library, f"__sanitizer_cov_{of}_init")(ctypes.c_void_p(start), ctypes.c_void_p(start + ctypes.sizeof(array)))


@cache
def words() -> list[str]:
    """The words of the instrumented code: names of keys, kinds, units."""
    return sorted(_words)


def dictionary() -> bytes:
    """The words as a dictionary of libFuzzer's."""
    return b"".join(b'"%s"\n' % word.encode() for word in words())
