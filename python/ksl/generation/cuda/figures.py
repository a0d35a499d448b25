"""What a kernel takes of a card, as NVIDIA's assembler says it: registers, what didn't fit into them, and instructions."""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from ksl.base.errors import CompilerError
from ksl.generation.cuda.nvrtc import Nvrtc

LOCAL = (0x983, 0x387)
"""LDL and STL, the lowest twelve of the 128 bits of an instruction, since Volta (sm_70)."""


@dataclass(frozen=True)
class Figures:
    registers: int
    """A thread takes so many; 255 is all that it can have."""
    spilled: int
    """Bytes of a thread that didn't fit into registers: stores and loads, of what the kernel calls, too."""
    stack: int
    """Bytes of a thread in local memory: what is spilled, and arrays of its own."""
    shared: int
    """Bytes of a block."""
    instructions: int
    """The code has so many, with functions that it calls, whether they are run or not."""
    local: int
    """So many of them read or write a thread's local memory."""


def figures(nvrtc: Nvrtc, text: str, architecture: str, options: Sequence[str] = ()) -> dict[str, Figures]:
    """{name: figures} of the kernels of a text.  Raises CompilerError."""
    code, said = nvrtc.compiled(text, architecture, [*options, "--ptxas-options=-v"])
    codes = sections(code)
    found = {}
    for of in said.split("Compiling entry function ")[1:]:
        name = re.match(r"'(\w+)'", of)
        used = re.search(r"Used (\d+) registers.*?(\d+) bytes cumulative stack size.*", of)
        if not (name and used):
            raise CompilerError(f"{nvrtc.path}: what it says of registers isn't known here: {of[:200]}")
        shared = re.search(r"(\d+) bytes smem", used[0])
        spilled = sum(map(int, re.findall(r"(\d+) bytes spill", of)))
        words = [word & 0xFFF for (word,) in struct.iter_unpack("<Q8x", codes[f".text.{name[1]}"])]
        found[name[1]] = Figures(int(used[1]), spilled, int(used[2]), int(shared[1]) if shared else 0, len(words), sum(word in LOCAL for word in words))
    return found


def sections(elf: bytes) -> dict[str, bytes]:
    """{name: contents} of the sections of a file of machine code (ELF, 64 bits)."""
    (at,) = struct.unpack_from("<Q", elf, 0x28)
    size, many, names = struct.unpack_from("<HHH", elf, 0x3A)
    headers = [struct.unpack_from("<IIQQQQ", elf, at + k * size) for k in range(many)]
    texts = elf[headers[names][4] : headers[names][4] + headers[names][5]]
    return {texts[header[0] : texts.index(b"\0", header[0])].decode(): elf[header[4] : header[4] + header[5]] for header in headers}
