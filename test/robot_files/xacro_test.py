"""Xacro files: run where that is asked for, with arguments; what goes wrong is one sentence."""

import pickle
import sys

import numpy as np
import pytest
from ksl_command import run_ksl

import ksl

pytest.importorskip("xacro")
HEAD = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="arm">'
ARM = f"""{HEAD}
  <xacro:arg name="mass" default="2"/><xacro:arg name="prefix" default=""/>
  <xacro:include filename="rod.xacro"/>
  <link name="$(arg prefix)base"/>
  <xacro:rod name="$(arg prefix)upper" parent="$(arg prefix)base" mass="${{float($(arg mass))}}" length="0.4"/>
  <xacro:rod name="$(arg prefix)fore" parent="$(arg prefix)upper" mass="${{$(arg mass) / 2}}" length="0.3"/>
</robot>"""
ROD = f"""{HEAD}<xacro:macro name="rod" params="name parent mass length">
  <link name="${{name}}"><inertial><origin xyz="0 0 ${{length / 2}}"/><mass value="${{mass}}"/>
    <inertia ixx="${{mass * length**2 / 12}}" iyy="${{mass * length**2 / 12}}" izz="${{mass * 1e-4}}" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="${{name}}_joint" type="revolute"><parent link="${{parent}}"/><child link="${{name}}"/><origin xyz="0 0 ${{length}}"/><axis xyz="0 1 0"/>
    <limit lower="${{-pi}}" upper="${{pi}}" effort="50" velocity="3"/></joint>
</xacro:macro></robot>"""


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "rod.xacro").write_text(ROD)
    (tmp_path / "arm.urdf.xacro").write_text(ARM)
    return tmp_path / "arm.urdf.xacro"


def test_arguments_change_the_robot(arm):
    m = ksl.load(arm, xacro={})
    assert (m.mass, m.joint_names, m.joint("upper_joint").upper) == (3.0, ["upper_joint", "fore_joint"], np.pi)
    m = ksl.load(arm, xacro={"mass": 6, "prefix": "left_"}, floating_base=True)
    assert (m.mass, m.joint_names[1:], m.file) == (9.0, ["left_upper_joint", "left_fore_joint"], f"{arm} (expanded by xacro)")
    assert [(f.role, f.file) for f in m.inputs] == [("robot", str(arm)), ("included", str(arm.parent / "rod.xacro"))] and all(
        len(f.sha256) == 64 for f in m.inputs
    )
    again = pickle.loads(pickle.dumps(m))
    assert again.mass == 9.0 and np.array_equal(again.mass_matrix(m.neutral()), m.mass_matrix(m.neutral()))


def test_arguments_that_the_file_does_not_ask_for_are_named(arm):
    """xacro takes them without a word, and the robot is another than the one that was meant."""
    with pytest.warns(ksl.DescriptionWarning) as said:
        assert ksl.load(arm, xacro={"mas": 6, "prefix": ""}).mass == 3.0
    assert [str(w.message) for w in said] == [f"{arm}: xacro argument 'mas' changes nothing: did you mean 'mass'? the file asks for mass, prefix"]
    arm.write_text(HEAD + '<link name="base"/></robot>')
    with pytest.warns(ksl.DescriptionWarning, match="xacro argument 'mass' changes nothing: the file asks for no argument"):
        ksl.load(arm, xacro={"mass": 6})


def test_without_the_argument_it_is_no_program(arm):
    with pytest.raises(
        ksl.DescriptionError, match=r"<xacro:arg> is not expanded; run xacro first: xacro FILE > robot.urdf, or let KSL run it: xacro={} \(--xacro ''\)"
    ):
        ksl.load(arm)


@pytest.mark.parametrize(
    ("text", "xacro", "said"),
    [
        (ARM.replace('<xacro:arg name="mass" default="2"/>', ""), {}, "; give the argument: --xacro 'NAME:=VALUE'"),
        (ARM, {"mass": "heavy"}, "xacro refuses the file: "),
        (ARM.replace("</robot>", ""), {}, "xacro refuses the file: "),
        (ARM.replace("rod.xacro", "absent.xacro"), {}, "xacro refuses the file: "),
        (ARM.replace("<link name", "<xacro:nothing/><link name", 1), {}, "unknown macro name: xacro:nothing"),
        (ARM.replace('params="name', "x"), {"mass": -1}, "mass"),
        (f'{HEAD}<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/></robot>', {}, "xacro refuses the file: "),
        (f"{HEAD}<link name=\"${{''.__class__}}\"/></robot>", {}, "xacro refuses the file: "),
        (f'{HEAD}<link name="$(find no_such_package)"/></robot>', {}, "xacro refuses the file: "),
        (ARM, [], "xacro is []; expected the arguments"),
        (ARM, {"a b": "c"}, "'a b' is no name of an argument"),
        (ARM, {"mass": None}, "argument 'mass' is NoneType"),
    ],
)
def test_what_goes_wrong_is_one_sentence(arm, text, xacro, said):
    arm.write_text(text)
    with pytest.raises(ValueError) as e:
        ksl.load(arm, xacro=xacro)
    assert said in str(e.value) and "\n" not in str(e.value) and len(str(e.value)) < 4100


def test_lines_are_those_of_the_text_that_xacro_makes(arm):
    arm.write_text(ARM.replace("</robot>", '<joint name="j" type="revolute"><parent link="nowhere"/><child link="x"/></joint></robot>'))
    with pytest.raises(ksl.DescriptionError, match=r"arm.urdf.xacro \(expanded by xacro\):\d\d+: "):
        ksl.load(arm, xacro={})


def test_names_from_xacro_are_printed_safely(arm):
    arm.write_text(ARM.replace('name="arm"', 'name="ar\u202em"'))
    done = run_ksl("info", arm, "--xacro", "mass:=4 prefix:='l_'")
    assert (
        done.returncode == 0
        and "\\u202e" in done.stdout
        and "\u202e" not in done.stdout
        and "l_upper_joint" in done.stdout
        and "total mass 6 kg" in done.stdout
    )


def test_check(arm):
    pytest.importorskip("lxml")
    found = ksl.check(arm)
    assert "xacro-unexpanded" in {f.rule for f in found}
    found = ksl.check(arm, xacro={"mass": 0})
    assert found.file == f"{arm} (expanded by xacro)" and "xacro-unexpanded" not in {f.rule for f in found} and len(found)
    done = run_ksl("check", arm, "--xacro", "")
    assert done.returncode in (0, 1) and "(expanded by xacro)" in done.stdout
    done = run_ksl("check", arm, "--xacro", "", "--fix", arm.parent / "out.urdf")
    assert done.returncode == 2 and "what xacro makes is repaired where it comes from" in done.stderr


def test_loads_say_what_was_given(arm, tmp_path):
    pytest.importorskip("pyarrow")
    time = np.linspace(0, 1, 11)
    np.savez(tmp_path / "motion.npz", time=time, q=np.column_stack([np.sin(time), np.cos(time)]))
    done = run_ksl("loads", arm, tmp_path / "motion.npz", "--xacro", "mass:=5", "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    head = (tmp_path / "out/summary.csv").read_text().split("case,")[0]
    assert "mass:=5" in head and "rod.xacro" in head and "arm.urdf.xacro" in head


@pytest.mark.parametrize(
    ("given", "said"), [("mass=5", "'mass=5' is no argument; expected NAME:=VALUE"), ("a:='b", "a quote has no end"), (":=5", "is no argument")]
)
def test_the_option(arm, given, said):
    done = run_ksl("info", arm, "--xacro", given)
    assert done.returncode == 2 and said in done.stderr


def test_without_the_package(arm, monkeypatch):
    monkeypatch.setitem(sys.modules, "xacro", None)
    with pytest.raises(ksl.DescriptionError, match=r"pip install 'ksl\[xacro\]'"):
        ksl.load(arm, xacro={})


FINDS = f'{HEAD}<xacro:include filename="$(find parts)/rod.xacro"/><link name="base"/><xacro:rod name="rod" parent="base" mass="2" length="0.4"/></robot>'


@pytest.fixture
def finds(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts/rod.xacro").write_text(ROD)
    (tmp_path / "arms/urdf").mkdir(parents=True)
    (tmp_path / "arms/urdf/arm.xacro").write_text(FINDS)
    return tmp_path / "arms/urdf/arm.xacro"


def test_packages_are_found_without_ros(finds, tmp_path, monkeypatch):
    """In the folders above the file, or where the caller says."""
    assert ksl.load(finds, xacro={}).mass == 2
    far = tmp_path / "far"
    (tmp_path / "parts").rename(far)
    with pytest.raises(ksl.DescriptionError, match=r"package not found: parts.*; packages are looked for in the folders above the file.*--package NAME=DIR"):
        ksl.load(finds, xacro={})
    m = ksl.load(finds, xacro={}, packages={"parts": far})
    assert m.mass == 2 and m.inputs[1].file == str(far / "rod.xacro")
    monkeypatch.chdir(tmp_path)
    assert ksl.load("arms/urdf/arm.xacro", xacro={}, packages={"parts": "far"}).mass == 2  # from the current folder, as any path
    assert ksl.check(finds, xacro={}, packages={"parts": far}).file.endswith("(expanded by xacro)")
    with pytest.raises(ValueError, match="packages are for a xacro file"):
        ksl.load(finds, packages={"parts": far})
    with pytest.raises(ValueError, match="packages: parts is .*, which is no folder"):
        ksl.load(finds, xacro={}, packages={"parts": tmp_path / "absent"})


def test_all_commands_that_read_a_robot_find_packages(finds, tmp_path):
    """Those that lack --xacro or --package are asked for, whatever their number."""
    import typer.main

    from ksl.commands import app

    commands = typer.main.get_command(app).commands
    reading = [name for name, command in commands.items() if any(p.name == "robot" for p in command.params)]
    lacking = [name for name in reading if not {"xacro", "package"} <= {p.name for p in commands[name].params}]
    assert len(reading) >= 9 and not lacking
    (tmp_path / "parts").rename(tmp_path / "far")
    options = ("--xacro", "", "--package", f"parts={tmp_path / 'far'}")
    assert "total mass 2 kg" in run_ksl("info", finds, *options).stdout
    done = run_ksl("view", finds, "--export", tmp_path / "view.html", *options)
    assert done.returncode == 0 or "viser" in done.stderr, done.stderr
    (tmp_path / "motion.csv").write_text("time,rod_joint\n" + "".join(f"{k / 10},{k / 100}\n" for k in range(20)))
    (tmp_path / "sweep.toml").write_text('[base]\nmotion = "motion.csv"\n[[vary]]\nkind = "payload"\nlink = "rod"\nvalues = [0.0, 1.0]\n')
    done = run_ksl("sweep", finds, tmp_path / "sweep.toml", "-o", tmp_path / "swept", *options)
    assert done.returncode == 0, done.stderr
    for given, said in (("parts", "expected NAME=DIR"), ("parts=/nowhere", "expected NAME=DIR")):
        done = run_ksl("info", finds, "--xacro", "", "--package", given)
        assert done.returncode == 2 and said in done.stderr
    done = run_ksl("info", finds, "--package", f"parts={tmp_path}")
    assert done.returncode == 2 and "is for --xacro" in done.stderr
