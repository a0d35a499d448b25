"""Each option of `ksl loads`, and what the page says of it: no sentence contradicts what was computed."""

import re
from html import unescape
from pathlib import Path

import numpy as np
import pytest
import typer.main
from ksl_command import run_ksl
from linkages import FOURBAR

import ksl.commands

TIME = np.linspace(0, 2, 101)
PHYSICAL = FOURBAR.replace('<limit effort="5" velocity="10"/>', '<limit effort="5" velocity="10"/><dynamics damping="0.3" friction="0.1"/>', 1)
CHAIN = """<robot name="chain"><link name="b"/>
<link name="l1"><inertial><origin xyz="0.2 0 0"/><mass value="2"/><inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="l2"><inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="b"/><child link="l1"/><axis xyz="0 1 0"/><limit lower="-1" upper="4" effort="50" velocity="9"/></joint>
<joint name="k" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/><limit lower="-4" upper="4" effort="50" velocity="9"/>
<mimic joint="j" multiplier="-0.5"/></joint></robot>"""
RIGID = "Every component of every reaction is determined by rigid bodies"
STIFFNESS = "\n".join(f"[{name}]\naxial = 2e7\nradial = 1e8\ntilting = 1e5" for name in "ABCD")
PART = '[[component]]\njoint = "A"\nkind = "limits"\naxial_force = 100.0\n[cases]\nnamed = 3\n'

# the words of options, several where each shows in a place of its own; on the page; not on the page
OPTIONS: dict[str, tuple[list[str], list[str], list[str]]] = {
    "none": ([], ["not determined by rigid bodies: the value of least norm", "joints have neither play nor compliance", "none: all joints are rigid", "efforts are those at the joint, not the motor"], []),
    "--stiffness": (["--stiffness", "stiff.toml"], ["values are those of least energy", "stiffnesses of A, B, C, D", "Those with stiffnesses (A, B, C, D) give way"], [RIGID, "neither play nor compliance", "of least norm"]),
    "--stiffness of some": (["--stiffness", "some.toml"], ["B, D, C: without stiffness, and therefore rigid", "without one, and therefore rigid: B, D, C", "Those with stiffnesses (A) give way"], [RIGID, "neither play nor compliance", "of least norm"]),
    "--physics": (["--physics", "damping"], ["Efforts are the motor's. They include these effects, with the numbers of the robot's file: damping", "Left out: friction"], ["not the motor's"]),
    "--friction-width --gravity --payload --external --components": (
        ["--physics", "friction", "--friction-width", "0.05", "--gravity", "0,0,-1.62", "--payload", "2,0.1,0,0", "--on-link", "coupler", "--external", "push.csv", "--components", "parts.toml"],
        ["smooth, width 0.05", "Left out: damping", "(0, 0, -1.62) m/s²", "2 kg on coupler at (0.1, 0, 0) m", "external wrenches rocker", "push.csv", "parts.toml", "Components: <strong"],
        ["not the motor's", "-9.8", "Payloads: none", "external wrenches none"]),
    "--on --axes --order --joints": (
        ["--on", "parent", "--axes", "world", "--order", "ang_lin", "--joints", "A"],
        ["on the parent side of the joint", "axes world", "order ang_lin", 'href="#joint-0">A<'], ["on the child side of the joint", "order lin_ang", 'href="#joint-1"']),
    "--at --map --ignore-extra --positions-only --strict": (
        ["--at", "world", "--map", "map.toml", "--ignore-extra", "--positions-only", "--strict"],
        ["moments about the world's origin", "map.toml", "ignore extra", "positions only", "strict"], []),
    "--drives": ([], ["driven by A"], []),
    "--degrees --time-unit": (["--degrees", "--time-unit", "ms"], ["degrees", "time unit ms"], []),
    "--resample --from": (["--resample", "200", "--from", "0.5"], ["resample 200", "from 0.5 s"], []),
    "--smooth --to": (["--smooth", "20", "--to", "1.5"], ["raw and smoothed", "to 1.5 s"], []),
    "--loops": (["--loops", "more.toml"], ["more.toml", "driven by A"], []),
    "--loops cut": (["--loops", "cut"], ["loops cut"], ["Closed mechanism", RIGID]),
    "--cases": (["--cases", "cases.toml"], ["Load case turn", "held: The mechanism is at rest", "turn, stiff: The motion is followed exactly", "stiff: Links are rigid, and joints have no play"], [RIGID]),
    "--floating-base": (["--floating-base"], ["floating base"], []),
    "--mimic": (["--mimic", "independent"], ["mimic independent"], ["follows"]),
}  # fmt: skip
SILENT = {
    "motion", "output", "deflection", "csv", "xlsx", "mcap", "mat", "rrd", "json", "pdf", "paper", "fail_on", "force", "on_link", "model_name", "xacro", "package", "topic", "robot",
}  # fmt: skip
"""Options that say where results go, or how a file is read whose kind isn't here: other tests have them."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    at = tmp_path_factory.mktemp("options")
    turn = 2 * np.pi * (TIME / 2 - np.sin(np.pi * TIME) / (2 * np.pi))

    def table(name, header, *columns):
        np.savetxt(at / name, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.17g")

    table("crank.csv", "time,A", TIME, turn)
    table("all.csv", "time,A,B,D", TIME, turn, -turn, 0 * turn)
    table("chain.csv", "time,j,k", TIME, np.sin(TIME), -0.5 * np.sin(TIME))
    zero = np.zeros_like(TIME)
    base = ",".join(f"floating_base.{c}" for c in ("x", "y", "z", "qx", "qy", "qz", "qw"))
    table("floating.csv", f"time,{base},j", TIME, *[zero] * 6, zero + 1, np.sin(TIME))
    table("push.csv", "time," + ",".join(f"rocker.{c}" for c in ("fx", "fy", "fz", "tx", "ty", "tz")), TIME, *[zero] * 5, zero + 1)
    files = {
        "fourbar.urdf": PHYSICAL, "chain.urdf": CHAIN, "stiff.toml": STIFFNESS, "some.toml": STIFFNESS[: STIFFNESS.index("[B]")], "parts.toml": PART,
        "map.toml": '[columns]\nA = "A"\n', "more.toml": '[[force_element]]\nname = "strut"\nlink1 = "frame"\npoint1 = [0, 0, 0.5]\nlink2 = "rocker"\npoint2 = [0.1, 0, 0]\nstiffness = 500.0\nfree_length = 0.3\n',
        "cases.toml": '[cases.turn]\n[cases.held]\nhold = {pose = {A = 1.0}}\n[cases.stiff]\nstiffness = "stiff.toml"\n',
    }  # fmt: skip
    for name, text in files.items():
        (at / name).write_text(text)
    return at


def page_of(folder: Path, option: str, words: list[str]) -> str:
    out = option.strip("-").replace(" ", "_")
    robot, motion = (
        ("chain.urdf", "floating.csv")
        if "floating" in option
        else ("chain.urdf", "chain.csv")
        if option == "--mimic"
        else ("fourbar.urdf", "all.csv" if "cut" in words else "crank.csv")
    )
    drives = ["--drives", "A"] if robot == "fourbar.urdf" and "cut" not in words else []
    done = run_ksl("loads", robot, motion, *drives, *words, "-o", out, cwd=folder)
    assert done.returncode == 0, done.stderr
    text = (folder / out / "report.html").read_text(encoding="utf-8")
    return unescape(re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL))


def plain(page: str) -> str:
    """The words of a page, cells of a row beside each other."""
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", re.sub(r"<strong[^>]*>", "<strong", page)))


@pytest.mark.parametrize("option", OPTIONS)
def test_the_page_says_what_was_computed(folder, option):
    words, there, absent = OPTIONS[option]
    page = page_of(folder, option, words)
    for text in there:
        assert text in page or text in plain(page), (option, text)
    for text in absent:
        assert text not in page and text not in plain(page), (option, text)


@pytest.mark.parametrize("shown", ["turn", "stiff"])
def test_a_page_of_one_load_case_says_of_all_what_they_have(folder, shown):
    """Curves are those of some load cases; loops, payloads and what is open are told of all."""
    (folder / "more_cases.toml").write_text((folder / "cases.toml").read_text() + 'payloads = [{ link = "rocker", mass = 2 }]\n')
    model = ksl.load(folder / "fourbar.urdf", drives=["A"])
    run = ksl.compute_loads(model, folder / "crank.csv", cases=folder / "more_cases.toml")
    run.report(folder / f"{shown}.html", shown)
    page = plain(unescape(re.sub(r"<script.*?</script>", "", (folder / f"{shown}.html").read_text(encoding="utf-8"), flags=re.DOTALL)))
    assert "Payloads: none (turn, held); 2 kg on rocker" in page and "turn, held: none: all joints are rigid" in page
    assert "not determined by rigid bodies: the value of least norm. In the load cases stiff stiffnesses decide them" in page


def test_no_option_is_forgotten():
    command = typer.main.get_command(ksl.commands.app).commands["loads"]
    names = {param.name: {opt for opt in param.opts if opt.startswith("--")} for param in command.params}
    tested = {word for key in OPTIONS for word in key.split()}
    forgotten = [name for name, opts in names.items() if name not in SILENT and not opts & tested and name != "help"]
    assert not forgotten
