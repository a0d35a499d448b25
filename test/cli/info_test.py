"""`ksl info`: what it prints of joints."""

import io
import re

import pytest
from ksl.commands.print_info import print_info
from rich.console import Console

TEXT = """<robot name="r"><link name="a"/><link name="b"/>
<link name="c"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="near" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>{dynamics}</joint>
<joint name="far" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/></joint></robot>"""

LIMITED = '<limit effort="9" velocity="7"/></joint></robot>'


def printed(m) -> list[str]:
    console = Console(file=io.StringIO(), width=300)
    print_info(m, console)
    return console.file.getvalue().splitlines()


def shown(lines: list[str], joint: str) -> dict[str, str]:
    """A joint's row of the table: {heading: cell}."""
    start = next(i for i, line in enumerate(lines) if line.split()[:2] == ["joint", "kind"])
    row = next(line for line in lines[start:] if line.startswith(joint + " "))
    columns = list(re.finditer(r" *\S+(?: \S+)*", lines[start]))  # of two blanks one ends a column
    edges = [0, *(m.end() for m in columns)] if joint else []
    headings = [m.group().strip() for m in columns]
    starts = [lines[start].index(h) for h in headings]
    last = headings.index("velocity")  # from there on numbers, aligned to the right
    return {h: row[edges[i] : edges[i + 1]].strip() for i, h in enumerate(headings) if i >= last} | {
        h: row[starts[i] :].split("  ")[0].strip() for i, h in enumerate(headings) if i < last
    }


def test_damping_and_friction_are_printed(robot):
    lines = printed(robot(TEXT.format(dynamics='<dynamics damping="0.125" friction="3.5"/>').replace("</joint></robot>", LIMITED)))
    assert list(shown(lines, "near"))[:2] == ["velocity", "damping"]
    assert [shown(lines, "near")[h] for h in ("damping", "friction")] == ["0.125", "3.5"]
    assert [shown(lines, "far")[h] for h in ("damping", "friction")] == ["", ""]


@pytest.mark.parametrize(("dynamics", "heading", "expected"), [('damping="0.5"', "damping", "0.5"), ('friction="2"', "friction", "2")])
def test_one_of_them_is_enough(robot, dynamics, heading, expected):
    """The column of the other, which would be empty, is left out."""
    row = shown(printed(robot(TEXT.format(dynamics=f"<dynamics {dynamics}/>").replace("</joint></robot>", LIMITED))), "near")
    assert row[heading] == expected and len({"damping", "friction"} & row.keys()) == 1


def test_without_them_there_is_no_column(robot):
    lines = printed(robot(TEXT.format(dynamics="")))
    assert not any("damping" in line or "friction" in line for line in lines)
