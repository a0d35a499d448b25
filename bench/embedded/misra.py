"""Deviations of generated code from MISRA C:2012, as cppcheck's addon finds them (it knows rules by number; their text is MISRA's)."""

import re
from collections import Counter
from pathlib import Path

import ksl
import tables
from programs import code_of, write
from targets import run

ROOT = Path(__file__).resolve().parents[2]
WHY = {
    "2.5": "sizes and names for the program that includes the header",
    "7.2": "`UINT64_C` of stdint.h gives the suffix",
    "8.9": "the bits of 2/π stay beside the comment that explains them",
    "9.3": "names are shorter than the longest",
    "10.1": "words are shifted by signed numbers, and asked for zero by `!`",
    "10.4": "masks, zeros and ones without `u` beside words",
    "10.5": "a comparison is converted to the carry of a sum",
    "10.6": "a sign is kept in 64 bits",
    "10.7": "a table is read at a sum of indices",
    "10.8": "products and differences of 64 bits are converted as a whole",
    "12.1": "products before sums, and sums before shifts, as C has them",
    "12.3": "several variables in one declaration",
    "13.4": "both results of an angle that is not finite",
    "14.4": "a bit as a condition",
    "15.5": "an angle that is not finite returns at once",
    "19.2": "the bits of a number are read by a union, which C99 defines",
}
"""Rules that generated code deviates from, and why.  A rule that is not here ends the measurement."""


def deviations(source: Path) -> Counter[str]:
    """{rule: places}."""
    found = run("cppcheck", "--addon=misra", "--quiet", "--std=c99", "--suppress=missingIncludeSystem", "--template={id}", source)
    return Counter(re.findall(r"misra-c2012-([\d.]+)", found))


def figures(build: Path) -> str:
    """A table of the deviations of the UR5's code.  Raises RuntimeError at a rule that WHY doesn't have."""
    model = ksl.load(ROOT / "examples/robots/ur5.urdf")
    algorithms = ["inverse_dynamics", "frame_poses", "jacobian:tool0", "reactions", "gravity_torque"]
    found = {scalar: deviations(write(code_of(model, "ur5", scalar, algorithms), build / f"misra_{scalar}")) for scalar in ("float", "double")}
    rules = sorted(found["float"] | found["double"], key=lambda rule: list(map(int, rule.split("."))))
    new = [rule for rule in rules if rule not in WHY]
    if new:
        raise RuntimeError(f"generated code deviates from rules of MISRA C:2012 that have no reason in {Path(__file__).name}: {', '.join(new)}")
    rows = [[f"{rule}: {WHY[rule]}", *(str(found[scalar][rule]) for scalar in found)] for rule in rules]
    version = run("cppcheck", "--version").strip()
    return f"*{version}:*\n\n" + tables.table(["rule: why", "places in float", "in double"], rows)
