"""Robots whose links and joints have names of ours, or names that are hard to tell apart, through every command."""

import csv
import json
import sys
from pathlib import Path

import ksl
import pytest
from ksl_command import run_ksl

sys.path.append(str(Path(__file__).parents[1] / "viewer"))
from names import OURS, chain

NAMES = [name for name in OURS if name.strip()]

COMMANDS = {
    "actuation": [("ROBOT", "--joints", "joint,-,Arm,🦾", "--start", "Arm=0.1", "-o", "DIR/actuation")],
    "check": [("ROBOT",)],
    "compare": [("ROBOT", "--with", "mujoco", "--states", "1")],
    "free-bodies": [
        ("DIR/results", "-o", "DIR/parts", "--links", "case,Arm"),
        ("DIR/results", "-o", "DIR/decks", "--deck", "calculix", "--deck", "nastran", "--apart"),
    ],
    "generate": [
        ("ROBOT", "--algorithms", "reactions", "-o", "DIR/c"),
        ("ROBOT", "--algorithms", "bias", "--cuda", "-o", "DIR/cuda"),
        ("ROBOT", "--fmu", "forward", "-o", "DIR/fmu"),
    ],
    "hold": [("ROBOT",), ("ROBOT", "--payload", "1", "--on-link", "case")],
    "info": [("ROBOT",)],
    "motion": [("ROBOT", "--kind", "minjerk", "-o", "DIR/motion.csv"), ("ROBOT", "--kind", "minjerk", "-o", "DIR/motion.parquet")],
    "loads": [
        ("ROBOT", "DIR/motion.csv", "-o", "DIR/results", "--csv", "--json", "--mcap", "--mat"),
        ("ROBOT", "DIR/motion.parquet", "-o", "DIR/some", "--joints", "joint,-,Arm,arm,🦾", "--at", "-=0,0,0.1"),
    ],
    "modes": [
        ("ROBOT", "--stiffness", "DIR/stiffness.toml", "--motion", "DIR/motion.csv", "-o", "DIR/modes.csv"),
        ("ROBOT", "--stiffness", "DIR/stiffness.toml", "--grid", "-=0:1:2"),
    ],
    "simulate": [("ROBOT", "--until", "0.02", "--pose", "case=0.1", "--dry-friction", "Arm=1", "-o", "DIR/simulated")],
    "size": [
        ("DIR/results", "DIR/components.toml", "-o", "DIR/sizes"),
        ("DIR/results", "--example"),
        ("DIR/results", "--spectra", "-o", "DIR/spectra"),
        ("DIR/results", "DIR/choose.toml", "--choose", "DIR/catalogue.toml"),
    ],
    "sweep": [("ROBOT", "DIR/sweep.toml", "-o", "DIR/sweep")],
    "view": [("ROBOT", "--export", "DIR/rest.html", "--joint", "world")],
}
"""Every command, in an order in which later ones read what earlier ones wrote."""
SWEEP = '[base]\nmotion = "motion.csv"\n[[vary]]\nkind = "payload"\nlink = "case"\nvalues = [0, 1]\n'
COMPONENTS = '[[component]]\njoints = ["world", "-", "Arm"]\nkind = "motor"\nname = "total"\npeak_torque = 9\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("names")
    (folder / "robot.urdf").write_text(chain(NAMES, "world", "base link"), encoding="utf-8")
    (folder / "sweep.toml").write_text(SWEEP)
    (folder / "components.toml").write_text(COMPONENTS)
    (folder / "choose.toml").write_text('[[choose]]\njoint = "-"\nkind = "limits"\nlink = "Arm"\n')
    (folder / "catalogue.toml").write_text('[[component]]\nkind = "limits"\nname = "-"\nmass = 1\ntorque = 1e9\n')
    (folder / "stiffness.toml").write_text('"world" = 1e4\n"-" = 1e4\n[Arm]\nmotion = 1e4\nradial = 1e7\n')
    return folder


def test_every_command_is_in_the_table():
    from ksl.commands.app import app

    import ksl.commands  # noqa: F401  the commands

    assert {command.name or command.callback.__name__ for command in app.registered_commands} == set(COMMANDS)


def test_every_command_takes_such_names(folder):
    for command in (
        "info",
        "check",
        "compare",
        "actuation",
        "motion",
        "hold",
        "loads",
        "modes",
        "free-bodies",
        "generate",
        "simulate",
        "size",
        "sweep",
        "view",
    ):
        for given in COMMANDS[command]:
            if command == "view":
                pytest.importorskip("viser")
            done = run_ksl(command, *(a.replace("ROBOT", str(folder / "robot.urdf")).replace("DIR", str(folder)) for a in given))
            assert done.returncode == (2 if command in ("check", "compare") else 0), (command, given, done.stderr)
            if command == "info":
                assert all(name in "".join(done.stdout.split()) for name in NAMES), command
    from ksl.load_cases.results_table import read_results
    from ksl.viewer.results_scene import scene_of_results

    scene, notes = scene_of_results(ksl.load(folder / "robot.urdf"), read_results(folder / "results"))
    assert not notes and len(scene.time) > 10, "results are shown with the joints whose they are"
    with open(folder / "results" / "summary.csv", newline="", encoding="utf-8") as f:
        rows = list(csv.DictReader(line for line in f if not line.startswith("#")))
    assert [row["joint"].removeprefix("'") for row in rows][: len(NAMES)] == NAMES
    said = json.loads((folder / "results" / "report.json").read_text(encoding="utf-8"))
    assert [row["joint"] for row in said["summary"]][: len(NAMES)] == NAMES


@pytest.mark.parametrize(("names", "column"), [(["time", "b"], "time"), (["a", "a.v"], "a.v")])
def test_a_motion_that_could_not_be_read_is_not_written(tmp_path, names, column):
    """The joint's column took the place of the times."""
    (tmp_path / "r.urdf").write_text(chain(names))
    done = run_ksl("motion", tmp_path / "r.urdf", "--kind", "minjerk", "-o", tmp_path / "m.csv")
    assert done.returncode == 2 and f"two columns would be called {column!r}" in done.stderr and not (tmp_path / "m.csv").exists()
