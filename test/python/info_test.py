"""`ksl info`: what it prints of joints."""

import io

import pytest
from ksl.info import print_info
from rich.console import Console

TEXT = """<robot name="r"><link name="a"/><link name="b"/>
<link name="c"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="near" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>{dynamics}</joint>
<joint name="far" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/></joint></robot>"""


def printed(m) -> list[str]:
    console = Console(file=io.StringIO(), width=300)
    print_info(m, console)
    return console.file.getvalue().splitlines()


def cells(lines: list[str], first: str) -> list[str]:
    """Of the row of the joints' table that begins so."""
    row = next(line for line in lines if line[2:].startswith(first + " ") and line.count("\u2502") + line.count("\u2503") > 8)
    return [cell.strip() for cell in row.replace("\u2503", "\u2502").split("\u2502")[1:-1]]


def test_damping_and_friction_are_printed(robot):
    lines = printed(robot(TEXT.format(dynamics='<dynamics damping="0.125" friction="3.5"/>')))
    assert cells(lines, "joint")[-2:] == ["damping", "friction"]
    assert cells(lines, "near")[-2:] == ["0.125", "3.5"]
    assert cells(lines, "far")[-2:] == ["", ""]


@pytest.mark.parametrize(("dynamics", "expected"), [('damping="0.5"', ["0.5", ""]), ('friction="2"', ["", "2"])])
def test_one_of_them_is_enough(robot, dynamics, expected):
    assert cells(printed(robot(TEXT.format(dynamics=f"<dynamics {dynamics}/>"))), "near")[-2:] == expected


def test_without_them_there_is_no_column(robot):
    lines = printed(robot(TEXT.format(dynamics="")))
    assert cells(lines, "joint")[-1] == "velocity"
    assert not any("damping" in line for line in lines)
