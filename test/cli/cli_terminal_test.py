"""Terminals: their words, width and quotes, help, and what programs read."""

import os
import re
import subprocess
import sys

import pytest

import ksl
from ksl_command import run_ksl
from loads_runs import run


def test_words_that_the_terminal_lacks(two, tmp_path):
    for arguments in (("info", two[0]), ("loads", *two, "-o", tmp_path / "o"), ("loads", "--help")):
        p = run(*arguments, PYTHONIOENCODING="ascii")
        assert p.returncode == 0 and "UnicodeEncodeError" not in p.stderr, p.stderr
    assert run("loads", two[0], tmp_path / "naïve.csv", "-o", tmp_path / "o", PYTHONIOENCODING="ascii").returncode == 2


def test_what_programs_read_is_utf8_whatever_the_terminal_has(two, tmp_path):
    """On Windows pipes and files have another encoding, and `ksl size --example > components.toml` is read again."""
    robot = tmp_path / "named.urdf"
    robot.write_text(two[0].read_text().replace('"slide"', '"Größe→slide"'), encoding="utf-8")
    for arguments in (("check", robot, "--json"), ("size", "--example")):
        p = subprocess.run(
            [sys.executable, "-m", "ksl", *map(str, arguments)], capture_output=True, env=os.environ | {"PYTHONIOENCODING": "cp1252"}, timeout=120
        )
        assert p.stdout.decode("utf-8") == run(*arguments).stdout and not p.stdout.isascii(), p.stderr


def test_the_command_line_in_the_shells_own_quotes(monkeypatch):
    from ksl.commands.app import command_line

    monkeypatch.setattr(sys, "argv", ["ksl", "info", "a b\\c.urdf"])
    assert command_line() == "ksl info 'a b\\c.urdf'"
    monkeypatch.setattr(os, "name", "nt")
    assert command_line() == 'ksl info "a b\\c.urdf"'


def test_help_and_version():
    assert run("--version").stdout == f"ksl {ksl.__version__}\n"
    p = run("loads", "--help")
    assert p.returncode == 0
    for columns in ("floating_base.x .y .z .qx .qy .qz .qw", "NAME.qx .qy .qz .qw", "NAME.wx .wy .wz", "NAME.bx .by .bz"):
        assert columns in " ".join(p.stdout.split()), columns
    for option in (
        "--output",
        "--csv",
        "--on",
        "--at",
        "--axes",
        "--order",
        "--payload",
        "--on-link",
        "--external",
        "--floating-base",
        "--mimic",
        "--strict",
        "--gravity",
    ):
        assert option in p.stdout, option
    p = run("lods")
    assert p.returncode == 2 and "lods" in p.stderr


@pytest.fixture(scope="module")
def terminal(tmp_path_factory):
    """What commands print to a terminal of 80 columns, line by line, without colours."""
    folder = tmp_path_factory.mktemp("terminal")
    (folder / "deep.urdf").write_text(chain_with_long_names(30))
    (folder / "sweep.toml").write_text('[base]\nmotion = "m.csv"\n[[vary]]\nkind = "speed"\nvalues = [0.5, 1]\n')

    def printed(*arguments: object) -> list[str]:
        p = run_ksl(*arguments, cwd=folder, TTY_COMPATIBLE="1", NO_COLOR="1", COLUMNS="80", TERM="xterm")
        assert p.returncode in (0, 1), p.stderr
        assert "\\x1b" not in p.stdout + p.stderr, "what moves a bar is for the terminal, and not text"
        seen = re.sub("\x1b\\[[0-9;?]*[A-Za-z]", "", p.stdout + p.stderr).split("\n")
        return [line.rpartition("\r")[2] for line in seen]  # a bar begins each of its pictures at the left

    return printed


def chain_with_long_names(n: int) -> str:
    """A chain whose tree would be wider than any terminal, with contents that are not used."""
    links = "".join(f'<link name="link_{k:02}_of_some_length"/>' for k in range(n))
    joints = "".join(
        f'<joint name="joint_{k:02}_of_some_length" type="continuous"><parent link="link_{k:02}_of_some_length"/>'
        f'<child link="link_{k + 1:02}_of_some_length"/><gazebo_{k:02} with="contents that nobody uses"/></joint>'
        for k in range(n - 1)
    )
    return f'<robot name="deep">{links}{joints}</robot>'


def test_a_terminal_of_80_columns_is_wide_enough(terminal, ur5, tmp_path):
    """Of each command: nothing is cut, and lines break between words."""
    commands = (
        ("info", ur5[0]), ("info", "deep.urdf"), ("loads", *ur5, "-o", "o", "--payload", "900,0,0,60", "--on-link", "tool0"), ("hold", ur5[0]),
        ("check", ur5[0]), ("motion", ur5[0], "--kind", "minjerk", "-o", "m.csv"), ("size", "o"), ("--help",), ("loads", "--help"),
        ("simulate", ur5[0], "--until", "0.02", "-o", "s"), ("sweep", ur5[0], "sweep.toml", "-o", "w"), ("motion", ur5[0], "--kind", "excite", "--iterations", "1", "-o", "e.csv"),
    )  # fmt: skip
    for command in commands:
        lines = terminal(*command)
        wide = [line for line in lines if len(line) > 80 and len(line.split()) > 1]
        assert not wide, (command[0], wide[:3])
        if command[0] == "loads" and "--help" not in command:
            assert any("are these millimetres?" in " ".join(lines[k : k + 3]).replace("  ", " ") for k in range(len(lines)))


def test_the_verdict_is_seen_at_last(terminal, ur5):
    """On 24 lines: the verdict is the last sentence, and its reasons and the shares of the limits stand above it."""
    for command in (("loads", *ur5, "-o", "v"), ("hold", ur5[0])):
        last = terminal(*command)[-24:]
        assert any(line.startswith("verdict: ") for line in last[-3:]), last
    assert any(line.startswith("Share of limits used") for line in terminal("loads", *ur5, "-o", "v")[-24:])


def test_help_has_whole_sentences_and_groups(terminal):
    whole = " ".join(" ".join(terminal("--help")).split())
    assert "..." not in whole.replace("[ARGS]...", "") and "in a page on this machine or in a file." in whole
    from ksl.commands.app import GROUPS

    for name in ("loads", "hold", "view"):
        lines = terminal(name, "--help")
        heads = [line.removesuffix(":") for line in lines if re.fullmatch(r"[A-Z][a-z ]+:", line)]
        assert heads[0] == "Arguments" and set(heads[1:-1]) <= set(GROUPS) and heads[-1] == "Other options"
        others = [line for line in lines[lines.index("Other options:") :] if re.match("  (-., )?--", line)]
        assert len(others) == 1 and "--help" in others[0], "a new option needs a group"
