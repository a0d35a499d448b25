"""Instructions, flash and stack of generated code on emulated microcontrollers: `make embedded`, or measure.py BUILD_DIR.

Each program computes the engine's bits and passes its self-test, or this ends with an error.  Figures go into docs/microcontrollers.md; they are those of
compilers and sources: of no machine.
"""

import sys
from pathlib import Path

import ksl

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "bench"))

import torque_control  # noqa: E402
import misra  # noqa: E402
import tables  # noqa: E402
from programs import Measured, code_of, measured, write  # noqa: E402
from targets import TARGETS, run  # noqa: E402

from ksl.generation.files import Code  # noqa: E402
from ksl.generation.flash import flash_bytes  # noqa: E402

PAGE = ROOT / "docs/microcontrollers.md"
ROBOTS = {"UR5": ("ur5", "tool0"), "Panda": ("panda", "panda_flange")}
ALGORITHMS = {
    "inverse_dynamics": "inverse dynamics",
    "frame_poses": "poses of all links",
    "jacobian:LINK": "Jacobian of the flange",
    "reactions": "reactions of all joints",
    "gravity_torque": "gravity",
}
SCALARS = ("float", "double")
ESTIMATED = {
    "on a Cortex-M that computes the scalar in hardware": [("float", "m4f"), ("float", "m7"), ("float", "m33"), ("double", "m7")],
    "in float on RV32IMF": [("float", "rv32imf")],
    "in double on a Cortex-M without hardware for it": [("double", "m4f"), ("double", "m33")],
    "in double on RV32IMF": [("double", "rv32imf")],
}
"""Scalars and targets of which a ratio is told."""
Key = tuple[str, str, str, str]
"""Robot, algorithm, scalar, target."""


def plugin(build: Path) -> Path:
    build.mkdir(parents=True, exist_ok=True)
    library = build / "count_instructions.so"
    run("cc", "-O2", "-shared", "-fPIC", "-fvisibility=hidden", ROOT / "bench/arm/count_instructions.c", "-o", library)
    return library


def estimated(code: Code) -> int:
    """The flash that `ksl generate` says."""
    return flash_bytes(code.functions, code.scalar, code.names_bytes)


def figures(build: Path) -> tuple[dict[Key, Measured], dict[Key, int], dict[Key, int]]:
    """What functions take; the flash of files with one algorithm, and what of it `ksl generate` estimates."""
    counting, taken, flash, said = plugin(build), {}, {}, {}
    for robot, (file, link) in ROBOTS.items():
        model = ksl.load(ROOT / f"examples/robots/{file}.urdf")
        asked = {a: a.replace("LINK", link) for a in ALGORITHMS}
        for scalar in SCALARS:
            code = code_of(model, file, scalar, list(asked.values()))
            alone = {a: code_of(model, file, scalar, [name]) for a, name in asked.items()}
            for target, how in TARGETS.items():
                folder = build / f"{file}_{scalar}_{target}"
                found = measured(how, code, folder, counting)
                for a, f in zip(ALGORITHMS, code.functions):
                    key = (robot, a, scalar, target)
                    taken[key], said[key] = found[f.name], estimated(alone[a])
                    obj = folder / f"{f.name}.o"
                    how.compile(write(alone[a], folder / f.name), obj)
                    flash[key] = how.flash(obj)
    return taken, flash, said


def table(what: str, numbers: dict[Key, int]) -> str:
    rows = [
        [f"{robot}, {label}, {scalar}", *(f"{numbers[robot, a, scalar, target]:,}" for target in TARGETS)]
        for robot in ROBOTS for a, label in ALGORITHMS.items() for scalar in SCALARS
    ]  # fmt: skip
    return tables.table([what, *(target.title for target in TARGETS.values())], rows)


def of_estimate(flash: dict[Key, int], said: dict[Key, int], whose: list[tuple[str, str]]) -> str:
    ratios = sorted(flash[key] / said[key] for key in flash if key[2:] in whose)
    return f"{ratios[0]:.2f} to {ratios[-1]:.2f}"


def version(*command: str) -> str:
    return run(*command, "--version").splitlines()[0]


def main(build: str) -> None:
    folder = Path(build).resolve()
    taken, flash, said = figures(folder)
    tools = f"*{version('arm-none-eabi-gcc')}, {version('riscv64-unknown-elf-gcc')}, {version('qemu-system-arm')}:*"
    text = "\n\n".join([
        tools,
        table("instructions a call", {key: m.instructions for key, m in taken.items()}),
        table("flash of a file with one algorithm, bytes", flash),
        table("stack of a call, bytes", {key: m.stack for key, m in taken.items()}),
        "Of what `--flash` estimates these files take " + "; ".join(f"{what}, {of_estimate(flash, said, whose)}" for what, whose in ESTIMATED.items()) + ".",
    ])  # fmt: skip
    print(text)
    tables.renew(PAGE, "calls", text)
    tables.renew(PAGE, "control", torque_control.figures(folder, plugin(folder)))
    tables.renew(PAGE, "MISRA", misra.figures(folder))


if __name__ == "__main__":
    main(*sys.argv[1:])
