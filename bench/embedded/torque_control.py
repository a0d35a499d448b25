"""The example of torque control on an emulated Cortex-M7: instructions of a period, and what that may be in time."""

import re
from pathlib import Path

from targets import TARGETS

import ksl

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "examples/embedded/torque_control"
CLOCK, INSTRUCTIONS_A_CYCLE, PERIODS = 480e6, 1.0, 1000.0
"""Hz, as an STM32H743 has; assumed; 1/s."""


def commands() -> list[list[str]]:
    """The arguments of `ksl generate` that the sources of the example state."""
    text = "\n".join((EXAMPLE / file).read_text() for file in ("control.c", "main.c"))
    return [found.replace("\\\n", " ").split() for found in re.findall(r"ksl generate ((?:.*\\\n)*.*)", text)]


def generated(build: Path) -> list[Path]:
    """Generates them, each in a folder of its own, and returns the sources."""
    sources = []
    for robot, *options in commands():
        given = dict(zip(options[::2], options[1::2]))
        name, arguments = given["--name"], [given["--arguments"]] if "--arguments" in given else []
        ksl.generate(ksl.load(ROOT / robot), given["--algorithms"].split(","), build / name, name=name, scalar="float", arguments=arguments)
        sources.append(build / name / f"{name}.c")
    return sources


def figures(build: Path, plugin: Path) -> str:
    """Sentences.  Raises RuntimeError where the example fails."""
    target, sources = TARGETS["m7"], generated(build)
    objects = []
    for source in (*sources, *EXAMPLE.glob("*.c")):
        objects.append(build / f"{source.stem}.o")
        target.compile(source, objects[-1], *(source.parent for source in sources))
    program = build / "control.elf"
    target.link(program, [Path(__file__).with_name("control_marks.c"), *objects], [EXAMPLE, *(source.parent for source in sources)], "-Wl,--wrap=control_step")
    printed, counts = target.emulated(program, plugin)
    most = max(taken - nothing for nothing, taken in zip(counts[2::4], counts[3::4]))
    flash = sum(target.flash(build / f"{name}.o") for name in ("arm", "control"))
    contact, noticed = re.findall(r"contact at (\d+) ms, noticed at (\d+) ms", printed)[0]
    share = most / INSTRUCTIONS_A_CYCLE / CLOCK * PERIODS
    return (
        f"A period takes {most:,} instructions at most and {flash:,} bytes of flash on the {target.title}; a contact at {contact} ms is noticed at {noticed} ms. "
        f"At {CLOCK / 1e6:.0f} MHz and {INSTRUCTIONS_A_CYCLE:g} instruction a cycle, **an estimate**, this is {most / INSTRUCTIONS_A_CYCLE / CLOCK * 1e6:.0f} µs, {share:.1%} of a period of {1e3 / PERIODS:g} ms."
    )
