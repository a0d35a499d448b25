"""How a robot's file is read: every command that reads one takes every option of it."""

import inspect

import pytest
import typer.main

import ksl
import ksl.commands
from ksl.commands.options import COMPUTED, DEFAULT_FRICTION_WIDTH, FIXED, OF_READING, RobotOptions
from ksl.sweeps.description import OF_BASE
from ksl_command import run_ksl

COMMANDS = {name: {p.name: p for p in command.params} for name, command in typer.main.get_command(ksl.commands.app).commands.items()}
READING = sorted(name for name, params in COMMANDS.items() if "robot" in params)
OTHERS = {"path", *COMPUTED, "payloads", "masses"}
"""Arguments of `ksl.load` that say what is computed, and not how the file is read."""
IN_PYTHON = {"model_name": "model", "package": "packages"}

TWO = """<sdf version="1.9">{}</sdf>"""
MODEL = """<model name="{name}"><link name="{name}_post"><inertial><mass>3</mass></inertial></link><link name="{name}_arm"><inertial><mass>{mass}</mass>
<inertia><ixx>1</ixx><iyy>1</iyy><izz>{izz}</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial></link>
<joint name="world_{name}" type="fixed"><parent>world</parent><child>{name}_post</child></joint>
<joint name="{name}_hinge" type="revolute"><parent>{name}_post</parent><child>{name}_arm</child><axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>1</upper><effort>5</effort><velocity>5</velocity></limit></axis></joint></model>"""


def test_options_of_reading_are_all_arguments_of_load_that_are():
    assert {IN_PYTHON.get(name, name) for name in OF_READING} == set(inspect.signature(ksl.load).parameters) - OTHERS
    assert RobotOptions().friction_width == DEFAULT_FRICTION_WIDTH == inspect.signature(ksl.load).parameters["friction_width"].default


@pytest.mark.parametrize("command", READING)
def test_every_command_that_reads_a_robot_takes_every_option_of_reading(command):
    taken = set(COMMANDS[command]) & set(OF_READING)
    assert taken | set(FIXED.get(command, {})) == set(OF_READING) and not taken & set(FIXED.get(command, {}))
    for name in taken:
        option = OF_READING[name].__metadata__[0]
        declared = [*([option.default] if isinstance(option.default, str) and option.default.startswith("--") else []), *option.param_decls] or [
            f"--{name.replace('_', '-')}"
        ]
        assert (COMMANDS[command][name].opts, COMMANDS[command][name].help) == (declared, option.help), "declared elsewhere"
    assert "how" not in COMMANDS[command]


def test_what_is_fixed_is_said():
    """In the file of a sweep, and on the page of comparisons."""
    assert set(FIXED) <= set(READING)
    assert {IN_PYTHON.get(name, name) for name in FIXED["sweep"]} <= set(OF_BASE)


def test_one_model_of_several_is_checked_and_compared(tmp_path):
    file = tmp_path / "two.sdf"
    file.write_text(TWO.format(MODEL.format(name="good", mass=2, izz=1) + MODEL.format(name="bad", mass=2, izz=9)))
    several = run_ksl("check", file)
    assert several.returncode == 2 and "error  not-loaded" in several.stdout
    good, bad = run_ksl("check", file, "--model", "good"), run_ksl("check", file, "--model", "bad")
    assert "error" not in good.stdout and "good_arm" in good.stdout and "bad" not in good.stdout, good.stdout
    assert "error  inertia-triangle" in bad.stdout and "not-loaded" not in bad.stdout and "good" not in bad.stdout, bad.stdout
    absent = run_ksl("check", file, "--model", "better")
    assert absent.returncode == 2 and "better" in absent.stdout
    assert "model" in run_ksl("compare", file).stderr
    assert run_ksl("compare", file, "--model", "good", "--json").stdout.startswith("{")


def test_how_a_file_is_read_decides_what_is_found(tmp_path):
    file = tmp_path / "r.urdf"
    file.write_text(
        '<robot name="r"><link name="base"/><link name="stone"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="9" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="j" type="continuous"><parent link="base"/><child link="stone"/></joint></robot>'
    )
    rules = lambda *options: set(ksl.check(file, ignore="inertia-triangle", **dict(options)).rules)
    assert "not-loaded" in rules(("strict", True)) - rules()
    assert "not-loaded" not in rules(("floating_base", True))
    wrong = run_ksl("check", file, "--mimic", "loosely")
    assert wrong.returncode == 2 and wrong.stderr.startswith("ksl: --mimic loosely: expected one of")
    assert "stone" in run_ksl("compare", file, "--strict").stderr
    assert "stone" in run_ksl("motion", file, "--kind", "template", "-o", tmp_path / "m.csv", "--strict").stderr


def test_the_other_models_of_a_document_are_removed():
    from ksl.comparison.urdf_text import of_one_model, text

    models = MODEL.format(name="a", mass=1, izz=1) + MODEL.format(name="b", mass=1, izz=1)
    for document in (TWO.format(models), TWO.format(f'<world name="w">{models}</world>')):
        left = text(of_one_model(document.encode(), "b"))
        assert "b_hinge" in left and "a_hinge" not in left and ksl.load_string(left).joint_names == ["b_hinge"]
