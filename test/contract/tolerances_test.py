"""Every small constant of engine, readers, checks and sizing is in docs/decisions/0016-tolerances.md, which says what it is relative to."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/decisions/0016-tolerances.md"
ROOMS = ("src/engine", "src/simulate", "src/description", "src/load", "include/ksl/engine", "python/ksl/checks", "python/ksl/sizing")
NONE = {
    "sine_cosine.hpp": "coefficients of series",
    "catalogue.py": "examples of values",
    "large_angle.hpp": "coefficients",
    "dop853_coefficients.hpp": "coefficients",
}
SMALL = re.compile(r"(?<![\w.])\d+(?:\.\d+)?e-(\d+)\b")


def constants(path: Path) -> set[str]:
    """Numbers below 1e-2 in code, without comments and texts: their exponents."""
    text = path.read_text(encoding="utf-8")
    text = re.sub(r'/\*.*?\*/|//[^\n]*|"""(?s:.*?)"""|#[^\n]*|"(?:[^"\\\n]|\\.)*"', "", text, flags=re.DOTALL)
    return {found for found in SMALL.findall(text) if int(found) >= 2}


def test_every_constant_is_in_the_table():
    rows = [re.sub(r"`[\w/]*/", "`", line) for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("|")]
    missing = []
    for path in (
        p for room in ROOMS for p in (ROOT / room).rglob("*") if p.suffix in (".cpp", ".hpp", ".py") and ROOT / "src/engine/kernels/algorithms" not in p.parents
    ):
        for exponent in constants(path) if path.name not in NONE else ():
            if not any(f"`{path.name}`" in row and f"1e−{exponent.lstrip('0')}" in row for row in rows):
                missing.append(f"{path.relative_to(ROOT)}: 1e-{exponent}")
    assert not missing, "enter them, with what they are relative to: " + ", ".join(missing)
