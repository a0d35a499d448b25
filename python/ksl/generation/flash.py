"""How many bytes of a microcontroller's flash generated code takes, about (docs/microcontrollers.md)."""

from __future__ import annotations

from collections.abc import Sequence

from ksl.base.errors import ArgumentError, of_argument
from ksl.generation.c99 import STRAIGHT
from ksl.generation.recording import Operation, Recording
from ksl.generation.requests import Function

STATEMENT = {"float": 5.0, "double": 6.0}
SPILLED = 0.6e-3
"""Bytes of a statement of a short function, and what each further one of the function adds to it: long ones keep numbers on the stack."""
RESULT, CONSTANT, SINE = 4, 10, 1150
"""Bytes of a number of the results, of a constant with the instructions that read it, and of the sine."""


def flash_bytes(functions: Sequence[Function], scalar: str, names: int) -> int:
    """Bytes of flash that NAME.c takes, to three digits: code, constants, the sine, and `names` bytes of what the coordinates are called.

    gcc 12 makes 0.94 to 1.10 of it at -O2 (ten files each of the UR5 and the Panda; Cortex-M4F in float, M7 in double)."""
    recordings = [f.recording for f in functions]
    statements = sum(_statements(r, STATEMENT[scalar]) for r in recordings)
    sine = SINE if any(r.angles for r in recordings) else 0
    constants = len(set[float]().union(*map(_constants, recordings)))
    return int(float(f"{statements + RESULT * sum(sum(r.sizes()) for r in recordings) + CONSTANT * constants + sine + names:.3g}"))


def _statements(of: Recording, each: float) -> float:
    count = len(of.operations) - of.count(Operation.CONSTANT)
    return count * (each + SPILLED * min(count, STRAIGHT))


def _constants(of: Recording) -> set[float]:
    return {float(number) for number, what in zip(of.numbers, of.operations) if what == Operation.CONSTANT}


def of_soft_float(scalar: str) -> str:
    """What README.md says of double where there is no hardware for it."""
    if scalar == "float":
        return ""
    return (
        "Processors that have single precision alone (Cortex-M4F, Cortex-M33, RV32IMF) leave `double` to the compiler's library, soft-float: some 40 to 80 times the instructions, "
        "and 2 to 4 times the flash. `--scalar float` is for them.\n"
    )


def refuse_larger(functions: Sequence[Function], scalar: str, names: int, flash: int) -> None:
    """Raises ArgumentError where the code takes more than `flash` bytes; 0 takes any.  names: as of flash_bytes."""
    if not isinstance(flash, int) or flash < 0:
        raise of_argument(ArgumentError, "flash", ": expected a number of bytes, or 0 for any", flash)
    needed = flash_bytes(functions, scalar, names)
    if flash and needed > flash:
        largest = max(functions, key=lambda f: len(f.recording.operations))
        raise of_argument(
            ArgumentError, "flash",
            f": the code takes about {needed:,} bytes on a Cortex-M that computes {scalar} in hardware, most of them for {largest.name}; "
            "ask for fewer algorithms, or for the links and joints that you need, or state more flash",
            flash,
        )  # fmt: skip
