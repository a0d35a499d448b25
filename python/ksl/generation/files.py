"""The files of generated code: header, source, CMakeLists.txt, library.json, README.md."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

from ksl import _core
from ksl.base.errors import ArgumentError
from ksl.generation.arguments import argument_texts, least_pivot
from ksl.generation.c99 import NOT_FUSED, Printer, about_bytes
from ksl.generation.casadi_files import casadi_source
from ksl.generation.cuda.files import cuda_header, cuda_source, of_the_card
from ksl.generation.cuda.simulation import StepFunctions, motion_of, simulation
from ksl.generation.flash import flash_bytes, of_soft_float
from ksl.generation.lanes_files import lanes_files
from ksl.generation.manifest import manifest
from ksl.generation.open_reactions import Undetermined
from ksl.generation.recording import DERIVATIVES, Operation
from ksl.generation.requests import ALONG, Function
from ksl.generation.rows import ROWS
from ksl.generation.self_test import STATES, SelfTest
from ksl.generation.sine_cosine import sine_cosine
from ksl.generation.words import WIDTH, ascii_text, comment, string, string_bytes

if TYPE_CHECKING:
    from ksl.model.model import Model

LARGE = 16
"""From so many coordinates on the engine is faster for one state where it has AVX-512: Panda (7) takes 0.137 us there and 0.126 us here, Talos (32) 0.55 and 0.66."""


@dataclass(frozen=True)
class Code:
    """What is generated.  name: of files, and before those of functions; scalar: double or float."""

    model: Model
    name: str
    scalar: Literal["double", "float"]
    contract: bool
    functions: Sequence[Function]
    lanes: int = 0
    """So many states are computed at a time by functions of many; 0: there are none."""
    casadi: bool = False
    """Is there NAME_casadi.c?"""
    cuda: bool = False
    """Are there NAME.cuh and NAME.cu?"""
    derivatives: int = 1
    undetermined: Undetermined = "refuse"
    """Both of the functions for CasADi."""

    @property
    def prefix(self) -> str:
        return f"{self.name}_"

    @property
    def macro(self) -> str:
        return self.name.upper()

    def function(self, of: Function) -> str:
        return f"{self.prefix}{of.name}"

    def files(self) -> dict[str, str]:
        """{name: text}, the same each time.  It is the list of all files that are generated."""
        many: dict[str, str] = {}
        if self.lanes:
            many |= lanes_files(self.first_line(), self.name, self.scalar, self.lanes, self.functions, self.contract)
        if self.cuda:
            many |= {f"{self.name}.cuh": self.cuda_files[0], f"{self.name}.cu": self.cuda_files[1]}
        return many | {
            f"{self.name}.h": self.header(),
            f"{self.name}.c": self.source(),
            f"{self.name}_test.c": self.self_test.text(),
            "CMakeLists.txt": self.cmake(),
            "library.json": manifest(self.name, _core.__version__, self.first_line(), self.contract),
            "README.md": self.readme(),
            **self.casadi_files(),
        }

    def casadi_files(self) -> dict[str, str]:
        if not self.casadi:
            return {}
        inner = f"{self.name}_casadi_"
        source = casadi_source(self.model, self.functions, self.first_line(), inner, inner, self.derivatives, self.undetermined)
        return {f"{self.name}_casadi.c": source}

    @cached_property
    def cuda_files(self) -> tuple[str, str]:
        """Functions of a card, and kernels."""
        motion = self.in_motion if isinstance(self.in_motion, StepFunctions) else None
        header = cuda_header(self.first_line(), self.name, self.scalar, self.functions, self.contract, self.documented, motion)
        return header, cuda_source(self.first_line(), self.name, self.scalar, self.functions, simulation(motion, self.prefix, self.scalar) if motion else "")

    @cached_property
    def in_motion(self) -> StepFunctions | str | None:
        """What a kernel of many steps calls; None where it isn't asked for, and a sentence where there can be none."""
        try:
            return motion_of(self.model, self.functions)
        except ArgumentError as reason:
            return str(reason)

    @cached_property
    def position_names(self) -> list[str]:
        """Names of the numbers of q, as in tables of motions."""
        return self._names("position")

    @property
    def names_bytes(self) -> int:
        """The bytes of what all numbers of q are called."""
        return len(self.position_names) * self.name_bytes

    @cached_property
    def name_bytes(self) -> int:
        """Bytes of the longest of them, with its end."""
        return max(string_bytes(name) for name in self.position_names)

    @cached_property
    def velocity_names(self) -> list[str]:
        """Names of the numbers of v, a and tau."""
        return self._names("velocity", plain=True)

    def _names(self, role: str, plain: bool = False) -> list[str]:
        kinds = {kind.name: kind for kind in _core.joint_kinds}
        moving = sorted((joint for joint in map(self.model.joint, self.model.joint_names) if joint.nv), key=lambda joint: joint.v_index)
        words = {joint.name: getattr(kinds[joint.kind], role) for joint in moving}
        return [joint if plain and len(of) == 1 else f"{joint}.{word}" if word else joint for joint, of in words.items() for word in of]

    @property
    def self_test(self) -> SelfTest:
        return SelfTest(self.model, self.name, self.scalar, self.lanes, self.functions, self.first_line())

    def first_line(self) -> str:
        return f"Generated by KSL {_core.__version__} from the robot {comment(self.model.name)}: do not edit."

    def header(self) -> str:
        names, sizes = self.position_names, (self.model.nq, self.model.nv)
        listed = "".join(f"   q[{k}] {comment(name)}\n" for k, name in enumerate(names))
        moved = "".join(f"   v[{k}] {comment(name)}\n" for k, name in enumerate(self.velocity_names))
        declared = "\n".join(f"{self.documented(f)}void {self.function(f)}({Printer(f.recording, self.prefix).parameters()});" for f in self.functions)
        return f"""\
/* {self.first_line()}

   SI units and radians: m, rad, kg, N, N m, s.  Six-vectors are linear first.  Arrays are row-major; a result is written whole, and may lie where an
   input of the same length is.  No function keeps anything, calls the heap or itself.

{listed}{moved}*/
#ifndef {self.macro}_H
#define {self.macro}_H

#ifdef __cplusplus
extern "C" {{
#endif

#define {self.macro}_NQ {sizes[0]}
#define {self.macro}_NV {sizes[1]}

/* What the numbers of q are called, in UTF-8. */
#define {self.macro}_NAME_BYTES {self.name_bytes}
extern const char {self.prefix}position_names[{self.macro}_NQ][{self.macro}_NAME_BYTES];

{least_pivot(self.macro) if any(f.has_pivots for f in self.functions) else ""}{declared}
#ifdef __cplusplus
}}
#endif

#endif
"""

    def documented(self, of: Function) -> str:
        """The comment above a declaration."""
        how = of.recording
        sizes = [f"{name} ({numbers})" for name, numbers in how.inputs] + [f"{name} ({', '.join(map(str, shape)) or '1'})" for name, shape in how.results]
        text = ascii_text(of.text or ROWS[of.row].text)
        of_derivative = (
            f"{DERIVATIVES[of.derivative]}  {'Of q, v and a they are those of the drives, along the mechanism' if self.model.loops else 'Positions change along joint velocities'}.  They are of: "
            if of.derivative
            else ""
        )
        lines = textwrap.wrap(f"{of_derivative}{text}  Here: {', '.join(sizes)}.", WIDTH)
        if of.names:
            lines += textwrap.wrap(f"Of {', '.join(map(comment, of.names))}.", WIDTH)
        lines += (line for text in argument_texts(of.arguments) for line in textwrap.wrap(text, WIDTH))
        if self.model.loops and not of.text:
            lines += textwrap.wrap(
                "Of a closed mechanism, by the pivots of its plan: NaN at positions that are not closed, and where these pivots are too small.", WIDTH
            )
        if self.model.loops and (of.row in ALONG or of.derivative):
            drives = ", ".join(comment(joint) for joint in sorted(self.model.drives or (), key=lambda name: self.model.joint(name).v_index))
            lines += textwrap.wrap(f"Along the mechanism: columns or rates fewer than coordinates are those of the drives: {drives}.", WIDTH)
        if of.has_pivots:
            lines += textwrap.wrap(
                f"pivots: the size of each pivot at q, the largest about 1.  Results are NaN where one is below {self.macro}_LEAST_PIVOT.", WIDTH
            )
        lines.append(self.counted(of))
        return "/* " + "\n   ".join(line.strip() for line in lines) + " */\n"

    def counted(self, of: Function) -> str:
        r = of.recording
        besides = [(r.angles, "pairs of sine and cosine"), (r.count(Operation.ROOT), "roots"), (r.count(Operation.ARCTANGENT), "arctangents")]
        return f"{r.arithmetic} operations + - * /" + "".join(f", {n} {what}" for n, what in besides if n) + "."

    def source(self) -> str:
        names = ",\n".join(f'    "{string(name)}"' for name in self.position_names)
        trigonometric = any(f.recording.angles for f in self.functions)
        sine = sine_cosine(f"{self.prefix}math_", self.scalar) + "\n" if trigonometric else ""
        bodies = "\n".join(Printer(f.recording, self.prefix).function(self.function(f)) for f in self.functions)
        part = (
            ""
            if "_part_1(" not in bodies
            else f"""\
/* Parts of long functions stay apart: compilers take more than linear time for one function. */
#if defined(__GNUC__)
#define {self.macro}_PART __attribute__((noinline))
#else
#define {self.macro}_PART
#endif

"""
        )
        contract = "" if self.contract else NOT_FUSED
        return f"""\
/* {self.first_line()} */
#include "{self.name}.h"

#include <math.h>
#include <stdint.h>

{contract}const char {self.prefix}position_names[{self.macro}_NQ][{self.macro}_NAME_BYTES] = {{
{names}}};

{part}{sine}{bodies}"""

    def cmake(self) -> str:
        flag = (
            ""
            if self.contract
            else f"target_compile_options({self.name} PRIVATE $<$<C_COMPILER_ID:GNU,Clang,AppleClang>:-ffp-contract=off>) # results are the same everywhere\n"
        )
        return f"""\
cmake_minimum_required(VERSION 3.16)
project({self.name} C)
set(CMAKE_C_STANDARD 99)

add_library({self.name} STATIC {self.name}.c{f" {self.name}_lanes.c" if self.lanes else ""})
target_include_directories({self.name} PUBLIC ${{CMAKE_CURRENT_SOURCE_DIR}})
{flag}if(UNIX)
  target_link_libraries({self.name} PUBLIC m)
endif()
{self.casadi_target()}
enable_testing()
add_executable({self.name}_test {self.name}_test.c)
target_link_libraries({self.name}_test PRIVATE {self.name})
add_test(NAME {self.name}_test COMMAND {self.name}_test)
"""

    def casadi_target(self) -> str:
        """A library that CasADi loads."""
        if not self.casadi:
            return ""
        name = f"{self.name}_casadi"
        return f"""
add_library({name} MODULE {name}.c)
set_target_properties({name} PROPERTIES PREFIX "")
target_compile_options({name} PRIVATE $<$<C_COMPILER_ID:GNU,Clang,AppleClang>:-ffp-contract=off>)
if(UNIX)
  target_link_libraries({name} PRIVATE m)
endif()
"""

    def for_casadi(self) -> str:
        """What is said of functions for CasADi."""
        if not self.casadi:
            return ""
        names = ", ".join(f"`{self.prefix}casadi_{f.name}`" for f in self.functions)
        return (
            f"`{self.name}_casadi.c` has {names} for CasADi, with their Jacobians, and needs no other file: `cc -std=c99 -O2 -ffp-contract=off -fPIC -shared {self.name}_casadi.c "
            f'-o {self.name}_casadi.so -lm`, then `casadi.external("{self.prefix}casadi_{self.functions[0].name}", "./{self.name}_casadi.so")`.\n\n'
        )

    def many(self) -> str:
        """What is said of functions of many states."""
        if not self.lanes:
            return ""
        return (
            f"`{self.name}_lanes.h` and `{self.name}_lanes.c` have the same functions for arrays of states, {self.lanes} of which are computed at a time. They want clang, or gcc 12 or newer, "
            f"and the instructions of the processor: compile them with `-march=native -fno-math-errno`, say. Results are the same.\n\n"
        )

    def for_cards(self) -> str:
        """What is said of kernels."""
        if not self.cuda:
            return ""
        missing = f"There is no kernel of many steps: {ascii_text(self.in_motion)}.\n\n" if isinstance(self.in_motion, str) else ""
        return of_the_card(self.name, self.scalar, self.functions, self.contract, *self.cuda_files) + "\n" + missing

    def slower(self) -> str:
        """What is said of large mechanisms."""
        if self.model.nv < LARGE:
            return ""
        return "KSL's own library computes one state of so large a mechanism faster than straight code does: it takes bodies in lanes (Talos, 32 coordinates, AVX-512: 0.55 against 0.66 us for inverse dynamics).\n\n"

    def readme(self) -> str:
        rows = "".join(
            f"| `{self.function(f)}` | {f.recording.arithmetic} | {f.recording.angles} | {f.recording.count(Operation.DIVIDE)} | {f.recording.count(Operation.ROOT)} | {about_bytes(f.recording)} |\n"
            for f in self.functions
        )
        order = "".join(f"| {k} | {comment(name)} |\n" for k, name in enumerate(self.position_names))
        moved = (
            ""
            if self.position_names == self.velocity_names
            else "The numbers of v, a and tau:\n\n| | |\n|---|---|\n"
            + "".join(f"| {k} | {comment(name)} |\n" for k, name in enumerate(self.velocity_names))
            + "\n"
        )
        bits = (
            "Products and sums may be fused (`--contract`): results differ from KSL's by rounding."
            if self.contract
            else "Results have the bits of KSL's own, on each compiler that keeps to IEEE 754 and doesn't fuse products and sums (`-ffp-contract=off`, which CMakeLists.txt gives)."
        )
        return f"""\
# {self.name}

{self.first_line()} `{self.name}.h` and `{self.name}.c` are all of it: C99 without heap, static data that changes, recursion, or a library but `sqrt`, `fabs`, `fma`, `atan2` of `math.h`.

    cc -std=c99 -O2 -ffp-contract=off -c {self.name}.c
    cmake -S . -B build && cmake --build build && ctest --test-dir build

Numbers are `{self.scalar}`, SI units and radians. Six-vectors are linear first. The world is the frame of the robot's root, or that in which a floating base moves.
{bits}

{self.many()}{self.for_casadi()}{self.slower()}## Functions

| | + - * / | angles | of them / | roots | bytes of code, about |
|---|---|---|---|---|---|
{rows}
The bytes follow from the statements, as gcc and clang take them at `-O2` on x86-64: a third more or less. Constants of {8 if self.scalar == "double" else 4} bytes and 1,300 bytes of the sine are beside them.
On a Cortex-M that computes `{self.scalar}` in hardware all of `{self.name}.c` takes about {flash_bytes(self.functions, self.scalar, self.names_bytes):,} bytes of flash.
{of_soft_float(self.scalar)}`{self.name}.h` says what each reads and writes. A result is written whole, and may lie where an input of the same length is.

{self.for_cards()}## Order of coordinates

The numbers of q:

| | |
|---|---|
{order}
{moved}`{self.name}_test.c` calls each function in {STATES} states, and ends with status 1 where a result differs.
"""
