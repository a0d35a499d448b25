"""Microcontrollers that qemu emulates: how programs for them are compiled, run and looked into."""

import subprocess
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent
CODE = ["-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror"]
"""How generated code is compiled."""
LONGEST = 900
"""s; more than any of these programs takes.  gcc takes a minute for a Panda's functions in double where other work runs beside it."""
SEMIHOSTING = ["-nographic", "-monitor", "none", "-serial", "none", "-semihosting-config", "enable=on,target=native"]


@dataclass(frozen=True)
class Target:
    """A processor on a board of qemu.  title: of its column; tools: prefix of the compiler's commands."""

    title: str
    tools: str
    processor: list[str]
    emulator: list[str]
    start: list[str] = field(default_factory=list)
    """How programs are linked: their start, and where their memory is."""

    def tool(self, name: str, *arguments: object) -> str:
        return run(f"{self.tools}{name}", *arguments)

    def compile(self, source: Path, obj: Path, *include: Path) -> None:
        """Generated code, and beside it a list of the stack that each function takes."""
        self.tool("gcc", *self.processor, *CODE, "-fstack-usage", *(f"-I{folder}" for folder in include), "-c", source, "-o", obj)

    def link(self, program: Path, files: list[Path], include: list[Path], *options: str) -> None:
        self.tool("gcc", *self.processor, "-O1", *(f"-I{folder}" for folder in (HERE, *include)), *files, *self.start, *options, "-lm", "-o", program)

    def emulated(self, program: Path, plugin: Path | None = None) -> tuple[str, list[int]]:
        """What the program prints, and instructions between its marks."""
        counts = program.with_suffix(".counts")
        counting = ["-plugin", f"{plugin.resolve()},counts={counts.resolve()},mark={self.symbols(program)['mark']:#x}"] if plugin else []
        printed = run(*self.emulator, *SEMIHOSTING, *counting, "-kernel", program)
        return printed, [int(line) for line in counts.read_text().split()] if plugin else []

    def symbols(self, file: Path) -> dict[str, int]:
        return {words[2]: int(words[0], 16) for words in map(str.split, self.tool("nm", file).splitlines()) if len(words) == 3}

    def asked(self, obj: Path) -> set[str]:
        """What an object needs of libraries."""
        return {line.split()[-1] for line in self.tool("nm", "-u", obj).splitlines()}

    def flash(self, obj: Path) -> int:
        """Bytes of code and constants."""
        text, data, *_ = self.tool("size", obj).splitlines()[1].split()
        return int(text) + int(data)


def run(*command: object) -> str:
    """What the command prints; semihosting of picolibc goes to the standard error of qemu.  Raises RuntimeError where it ends with a status."""
    words = list(map(str, command))
    done = subprocess.run(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=LONGEST)
    if done.returncode:
        raise RuntimeError(f"{' '.join(words)} ends with {done.returncode}: {done.stdout}")
    return done.stdout


def arm(title: str, processor: str, unit: str, board: str, flash: str = "0", ram: str = "0x20000000") -> Target:
    flags = [f"-mcpu={processor}", "-mthumb", "-mfloat-abi=hard", f"-mfpu={unit}"]
    memory = [f"-Wl,--defsym=FLASH_AT={flash}", f"-Wl,--defsym=RAM_AT={ram}"]
    start = [HERE / "arm_start.c", "--specs=rdimon.specs", f"-T{HERE}/arm.ld"]
    return Target(title, "arm-none-eabi-", flags, ["qemu-system-arm", "-machine", board], list(map(str, start)) + memory)


RAM = 0x80000000
PICOLIBC = ["--specs=picolibc.specs"]
TARGETS = {
    "m4f": arm("Cortex-M4F", "cortex-m4", "fpv4-sp-d16", "mps2-an386"),
    "m7": arm("Cortex-M7", "cortex-m7", "fpv5-d16", "mps2-an500"),
    "m33": arm("Cortex-M33", "cortex-m33", "fpv5-sp-d16", "mps2-an505", "0x10000000", "0x38000000"),
    "rv32imf": Target(
        "RV32IMF", "riscv64-unknown-elf-", ["-march=rv32imf", "-mabi=ilp32f", *PICOLIBC],
        ["qemu-system-riscv32", "-machine", "virt", "-cpu", "rv32,a=off,c=off,d=off", "-bios", "none"],
        ["--oslib=semihost", "--crt0=hosted", *(f"-Wl,--defsym={name}={value:#x}" for name, value in
                                                {"__flash": RAM, "__flash_size": 1 << 22, "__ram": RAM + (1 << 22), "__ram_size": 1 << 22, "__stack_size": 1 << 15}.items())],
    ),
}  # fmt: skip
