"""`ksl info`: what it prints, and that its work grows with the number of links alone."""

import re
from itertools import count

import ksl
import pytest
from growth import assert_linear, work
from ksl.commands.options import RobotOptions, read_model
from ksl.commands.print_info import DEEPEST_INDENT, print_info, table_lines, tree_lines
from rich.cells import cell_len
from rich.console import Console


def chain(n: int, prefix: str = "") -> ksl.Model:
    b = ksl.Builder("chain").add_link(f"l{prefix}0")
    for i in range(1, n):
        b.add_link(f"l{prefix}{i}", 1.0, (0, 0, 0.05)).add_joint(
            f"j{prefix}{i}", "revolute", f"l{prefix}{i - 1}", f"l{prefix}{i}", axis=(0, 1, 0), limits=(-1, 1), effort=10
        )
    return b.build()


def text(m: ksl.Model, width: int) -> str:
    console = Console(width=width, highlight=False)
    with console.capture() as captured:
        print_info(m, console)
    return captured.get()


def test_work_is_linear_in_links():
    """With rich's trees it grew with the square.  Names are new each time, since rich remembers how wide a text is."""
    times = count()
    assert_linear(lambda n: work(lambda m=chain(n, f"{next(times)}_"): text(m, 200)), 50)


def test_tree():
    b = ksl.Builder("r")
    for name in ("root", "arm", "hand", "leg"):
        b.add_link(name, 1.0)
    b.add_joint("shoulder", "continuous", "root", "arm", axis=(0, 0, 1)).add_joint("wrist", "fixed", "arm", "hand").add_joint("hip", "fixed", "root", "leg")
    assert list(tree_lines(b.build())) == [
        "ground",
        "└── root  base, fixed",
        "    ├── arm  shoulder, continuous",
        "    │   └── hand  wrist, fixed",
        "    └── leg  hip, fixed",
    ]


def test_a_deep_tree_says_its_levels():
    lines = list(tree_lines(chain(60)))
    assert len(lines) == 61 and lines[60].endswith("└── (60) l59  j59, revolute")
    assert max(map(len, lines)) < 4 * DEEPEST_INDENT + 40


@pytest.mark.parametrize("width", [80, 120])
def test_nothing_is_cut(examples, width):
    m = ksl.load(examples / "robots/panda.urdf")
    printed = text(m, width)
    assert "…" not in printed and max(map(cell_len, printed.splitlines())) <= width
    for j in m.joints:
        assert printed.count(j.name) >= 2 and (j.effort is None or f"{j.effort:g}" in printed)
    blocks = re.split(r"\n\n", printed)
    assert any(re.search(r"lower +upper +effort +velocity\n", block) for block in blocks), "limits stay together"


@pytest.mark.parametrize(
    ("physics", "width", "warned"),
    [("", 0.05, "--physics names no friction"), ("damping", 0.05, "--physics names no friction"), ("exact friction", 0.05, "exact friction has none"),
     ("friction", 0.05, ""), ("all", 0.05, ""), ("", 0.01, "")],
)  # fmt: skip
def test_a_width_without_friction_is_said(examples, capsys, physics, width, warned):
    m = read_model(examples / "robots/ur5.urdf", RobotOptions(physics=physics, friction_width=width))
    said = capsys.readouterr().err
    assert m.friction_width == width and (f"--friction-width {width} has no effect" in said) == bool(warned) and warned in said


def test_table_of_wide_characters():
    lines = list(table_lines([["joint"], ["q"]], [["肩", "0"], ["elbow", "1.5"]], 80))
    assert lines == ["joint    q", "──────────", "肩       0", "elbow  1.5"]
