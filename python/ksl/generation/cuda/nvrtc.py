"""NVRTC, NVIDIA's compiler at run time: text of CUDA C++ to machine code for one kind of card, without a card and without a toolkit.

It is a library of 100 MB that PyPI has (`pip install 'ksl[cuda]'`), that torch brings along, and that toolkits have.  Results keep the engine's bits: products
and sums aren't fused, roots and quotients are rounded as IEEE 754 has it, and small numbers aren't flushed to zero.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import importlib.util
import os
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from ksl.base.errors import CompilerError, close_names
from ksl.generation.cache import cache_folder

VARIABLE = "KSL_NVRTC"
"""The variable of the environment that names the library."""
BRING = f"`pip install 'ksl[cuda]'` brings it along; or name the library in the variable {VARIABLE}"
EXACT = ("--std=c++17", "--fmad=false", "--ftz=false", "--prec-div=true", "--prec-sqrt=true")
"""Options that keep the engine's bits; `--fmad=true` behind them lets products and sums be fused."""
PACKAGES = (("nvidia.cuda_nvrtc", "lib"), ("nvidia.cuda_nvrtc", "bin"), ("nvidia.cu13", "lib"), ("nvidia.cu13", "bin/x86_64"), ("torch", "lib"))
"""Packages that have it, and the folders in them: of CUDA 12, of 13, and torch with one of its own."""
LIBRARIES = ("libnvrtc.so.13", "libnvrtc.so.12") if sys.platform != "win32" else ("nvrtc64_130_0.dll", "nvrtc64_120_0.dll")
SHOWN_LINES = 6
"""So many of what it says are shown."""
INVALID_OPTION = 5
"""The status of NVRTC for options that it doesn't know, architectures included."""


@dataclass(frozen=True)
class Nvrtc:
    """One library of it."""

    path: str

    @cached_property
    def library(self) -> ctypes.CDLL:
        try:
            return ctypes.CDLL(self.path)
        except OSError as error:
            raise CompilerError(f"{self.path}: can't be loaded as NVRTC: {error}; {BRING}") from None

    @cached_property
    def version(self) -> tuple[int, int]:
        """As (12, 9).  Machine code of 12 is for drivers of CUDA 12 and newer, that of 13 for those of 13."""
        major, minor = ctypes.c_int(), ctypes.c_int()
        self._checked(self.library.nvrtcVersion(ctypes.byref(major), ctypes.byref(minor)))
        return major.value, minor.value

    @cached_property
    def architectures(self) -> tuple[str, ...]:
        """Kinds of cards that it knows, as sm_90."""
        many = ctypes.c_int()
        self._checked(self.library.nvrtcGetNumSupportedArchs(ctypes.byref(many)))
        found = (ctypes.c_int * many.value)()
        self._checked(self.library.nvrtcGetSupportedArchs(found))
        return tuple(f"sm_{number}" for number in found)

    def _checked(self, status: int) -> None:
        if status:
            self.library.nvrtcGetErrorString.restype = ctypes.c_char_p
            raise CompilerError(f"{self.path}: NVRTC says {self.library.nvrtcGetErrorString(status).decode()}")

    def refuse_unknown(self, architecture: str) -> None:
        """Raises CompilerError where it makes no code for such cards."""
        if re.fullmatch(r"sm_[0-9]+[af]?", architecture) and architecture.rstrip("af") in self.architectures:
            return
        known = self.architectures
        near = close_names(architecture, list(known), 1)
        newer = f"; a newer one may: it is that of CUDA {'.'.join(map(str, self.version))}" if re.fullmatch(r"sm_[0-9]+[af]?", architecture) else ""
        guess = f"; did you mean {near[0]}?" if near and not newer else ""
        raise CompilerError(f"architecture: NVRTC at {self.path} makes no code for {architecture!r}; it knows {', '.join(known)}{guess}{newer}")

    def compile(self, text: str, architecture: str, options: Sequence[str] = (), name: str = "kernels.cu") -> bytes:
        """The machine code (cubin) of a text.  options: behind those of EXACT.  Raises CompilerError with its first lines; the text is then kept in the cache folder."""
        return self.compiled(text, architecture, options, name)[0]

    def compiled(self, text: str, architecture: str, options: Sequence[str] = (), name: str = "kernels.cu") -> tuple[bytes, str]:
        """Machine code, as :meth:`compile` has it, and what the compiler says besides."""
        self.refuse_unknown(architecture)
        library, program = self.library, ctypes.c_void_p()
        self._checked(library.nvrtcCreateProgram(ctypes.byref(program), text.encode(), name.encode(), 0, None, None))
        try:
            said = [option.encode() for option in (f"--gpu-architecture={architecture}", *EXACT, *options)]
            status = library.nvrtcCompileProgram(program, len(said), (ctypes.c_char_p * len(said))(*said))
            if status:
                raise CompilerError(_failure(self._text(program, "ProgramLog"), text, status, options))
            return self._bytes(program, "CUBIN"), self._text(program, "ProgramLog")
        finally:
            library.nvrtcDestroyProgram(ctypes.byref(program))

    def _bytes(self, program: ctypes.c_void_p, what: str) -> bytes:
        size = ctypes.c_size_t()
        self._checked(getattr(self.library, f"nvrtcGet{what}Size")(program, ctypes.byref(size)))
        found = ctypes.create_string_buffer(size.value)
        self._checked(getattr(self.library, f"nvrtcGet{what}")(program, found))
        return found.raw

    def _text(self, program: ctypes.c_void_p, what: str) -> str:
        return self._bytes(program, what).rstrip(b"\0").decode("utf-8", "replace")


def _failure(log: str, text: str, status: int, options: Sequence[str]) -> str:
    """What is said of a text that isn't compiled."""
    lines = [line for line in log.splitlines() if line.strip()][:SHOWN_LINES]
    if status == INVALID_OPTION:
        return f"NVRTC doesn't take the options {' '.join(options)!r}: {'; '.join(lines)}"
    kept = cache_folder() / f"failed-{hashlib.sha256(text.encode()).hexdigest()[:16]}.cu"
    kept.write_text(text, encoding="utf-8", newline="\n")
    return f"NVRTC ended with status {status} for {kept}, which is kept: {'; '.join(line.strip() for line in lines)}"


def compile(text: str, architecture: str, options: Sequence[str] = ()) -> bytes:
    """The machine code (cubin) of a text of CUDA C++ for an architecture, as "sm_90".  options: behind those that keep the engine's bits (EXACT).

    The driver loads it by cuModuleLoadData.  Raises CompilerError: no NVRTC, an architecture that it doesn't know, and errors, with the first lines and the
    place where the text is kept.  Some 0.1 s for an arm's inverse dynamics, seconds for derivatives of a humanoid."""
    return find().compile(text, architecture, options)


def find(name: str | None = None) -> Nvrtc:
    """The library of this name, of KSL_NVRTC, of packages of this Python, of a toolkit, or of the system.  Raises CompilerError."""
    named = name or os.environ.get(VARIABLE) or ""
    if named:
        if os.sep in named and not Path(named).is_file():
            raise CompilerError(f"there is no library {named!r} of NVRTC; {BRING}")
        return _loaded(named)
    for candidate in _candidates():
        found = _loaded(candidate)
        with contextlib.suppress(CompilerError):
            if found.version:
                return found
    raise CompilerError(f"kernels for a graphics card need NVRTC, NVIDIA's compiler, and there is none: {BRING}")


@cache
def _loaded(path: str) -> Nvrtc:
    """One object a library, so that it is loaded and asked once."""
    return Nvrtc(path)


def _candidates() -> Iterator[str]:
    """Paths and names in the order that they are tried."""
    pattern = "libnvrtc.so.[0-9]*" if sys.platform != "win32" else "nvrtc64_*_0.dll"
    for package, inner in PACKAGES:
        for folder in _package_folders(package):
            yield from (str(path) for path in sorted((folder / inner).glob(pattern), reverse=True))
    for variable in ("CUDA_PATH", "CUDA_HOME"):
        if os.environ.get(variable):
            for inner in ("lib64", "lib", "bin"):
                yield from (str(path) for path in sorted((Path(os.environ[variable]) / inner).glob(pattern), reverse=True))
    yield from LIBRARIES


def _package_folders(package: str) -> list[Path]:
    """Where a package lies; it isn't imported."""
    try:
        spec: Any = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        return []
    return [Path(place) for place in (spec.submodule_search_locations or ())] if spec else []
