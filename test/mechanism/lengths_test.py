"""Lengths that people type are judged by the extent of the robot, in every option and every field of a file that takes one.

The tables below name them all.  A new option, or a new key, must enter one of them."""

import re
import warnings

import numpy as np
import pytest
import typer

import ksl
from ksl.commands import app
from ksl.load_cases.case_files import case_file, simulate_keys
from ksl.robot_files import loops_file
from ksl.mechanism.lengths import extent, far, far_inertia
from ksl.sizing.catalogue.catalogue import KINDS
from ksl.sizing.catalogue.catalogue_numbers import lengths_of
from ksl.sweeps import description
from ksl_command import run_ksl

ROBOT = """<robot name="arm"><link name="wall"/>
<link name="cart"><inertial><mass value="4"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="rod"><inertial><mass value="2"/><origin xyz="0.3 0 0"/><inertia ixx="0" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="tip"/>
<joint name="slide" type="prismatic"><parent link="wall"/><child link="cart"/><axis xyz="0 0 1"/><limit lower="-0.4" upper="0.4" effort="900" velocity="9"/></joint>
<joint name="pin" type="revolute"><parent link="cart"/><child link="rod"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="900" velocity="9"/></joint>
<joint name="end" type="fixed"><parent link="rod"/><child link="tip"/><origin xyz="0.6 0 0"/></joint></robot>"""

CASES = """[cases.one]\nmotion = "m.csv"\n"""
SWEEP = """[base]\nmotion = "m.csv"\n[[vary]]\n"""
COMPONENTS = """[[component]]\nkind = "limits"\njoint = "pin"\nradial_force = 1e6\nat = [0, 0, 5]\n"""

OPTIONS = {
    ("loads", "--payload"): (
        ["loads", "arm.urdf", "m.csv", "-o", "out", "--payload", "2,0,0,50", "--on-link", "tip"],
        "the payload on tip is 50 m from the link's origin",
    ),
    ("loads", "--at"): (
        ["loads", "arm.urdf", "m.csv", "-o", "out", "--at", "0,0,50", "--at", "pin=0,70,0"],
        "the point of the moments of pin is 70 m from the joint's origin",
    ),
    ("loads", "--gravity"): (["loads", "arm.urdf", "m.csv", "-o", "out", "--gravity", "0,0,-9810"], "is that in mm/s²?"),
    ("hold", "--payload"): (["hold", "arm.urdf", "--payload", "2,0,0,50", "--on-link", "tip"], "not green: the payload on tip is 50 m"),
    ("hold", "--at"): (["hold", "arm.urdf", "--at", "0,0,50"], "the point of the moments is 50 m from the joint's origin"),
    ("hold", "--pose"): (["hold", "arm.urdf", "--pose", "slide=300"], "slide reaches 300 m, and its limits are -0.4 and 0.4 m: are these millimetres?"),
    ("hold", "--gravity"): (["hold", "arm.urdf", "--gravity", "0,0,-9810"], "is that in mm/s²?"),
    ("actuation", "--start"): (
        ["actuation", "arm.urdf", "--joints", "pin", "-o", "a", "--start", "slide=300"],
        "start: slide reaches 300 m, and its limits are -0.4 and 0.4 m",
    ),
    ("actuation", "--gravity"): (["actuation", "arm.urdf", "--joints", "pin", "-o", "a", "--gravity", "0,0,-9810"], "is that in mm/s²?"),
    ("size", "--at"): (["size", "results", "--at", "pin=0,0,50"], "the point of the moments of pin is 50 m from the joint's origin"),
    ("free-bodies", "--frame"): (["free-bodies", "results", "-o", "parts", "--frame", "rod=0,0,50"], "the frame of rod is 50 m from the link's origin"),
    ("free-bodies", "--section"): (
        ["free-bodies", "results", "-o", "parts", "--section", "rod=0,70,0,1,0,0"],
        "the section of rod is 70 m from the link's origin",
    ),
    ("free-bodies", "--radius"): (["free-bodies", "results", "-o", "parts", "--deck", "nastran", "--radius", "pin=50"], "the radius of pin is 50 m"),
    ("view", "--gravity"): (["view", "arm.urdf", "--export", "v.html", "--gravity", "0,0,-9810"], "is that in mm/s²?"),
    ("info", "--gravity"): (["info", "arm.urdf", "--gravity", "0,0,-9810"], "is that in mm/s²?"),
    ("modes", "--payload"): (["modes", "arm.urdf", "--stiffness", "s.toml", "--payload", "2,0,0,50", "--on-link", "tip"], "the payload on tip is 50 m"),
    ("modes", "--pose"): (
        ["modes", "arm.urdf", "--stiffness", "s.toml", "--pose", "slide=300"],
        "slide reaches 300 m, and its limits are -0.4 and 0.4 m: are these millimetres?",
    ),
    ("modes", "--grid"): (
        ["modes", "arm.urdf", "--stiffness", "s.toml", "--grid", "slide=0:300:2"],
        "slide reaches 300 m, and its limits are -0.4 and 0.4 m: are these millimetres?",
    ),
    ("modes", "--gravity"): (["modes", "arm.urdf", "--stiffness", "s.toml", "--gravity", "0,0,-9810"], "is that in mm/s²?"),
    ("simulate", "--payload"): (
        ["simulate", "arm.urdf", "--until", "0.01", "-o", "out", "--payload", "2,0,0,50", "--on-link", "tip"],
        "the payload on tip is 50 m",
    ),
    ("simulate", "--pose"): (
        ["simulate", "arm.urdf", "--until", "0.01", "-o", "out", "--pose", "slide=300"],
        "slide reaches 300 m, and its limits are -0.4 and 0.4 m",
    ),
    ("simulate", "--gravity"): (["simulate", "arm.urdf", "--until", "0.01", "-o", "out", "--gravity", "0,0,-9810"], "is that in mm/s²?"),
    ("generate", "--gravity"): (["generate", "arm.urdf", "--algorithms", "bias", "-o", "c", "--gravity", "0,0,-9810"], "is that in mm/s²?"),
    ("motion", "--gravity"): (["motion", "arm.urdf", "--kind", "template", "-o", "t.csv", "--gravity", "0,0,-9810"], "is that in mm/s²?"),
}
"""Options that take a length, and what is said of one in millimetres."""
SPEEDS = {(command, "--friction-width") for command in ("generate", "loads", "simulate", "view")} | {("motion", "--acceleration"), ("simulate", "--velocity")}
EFFORTS = {("simulate", option) for option in ("--gains", "--brake", "--dry-friction")} | {("free-bodies", "--units")}
"""Options whose help names metres, and that take no length: speeds and accelerations, which have limits of their own, efforts in N m, and the name of a system of units."""

FILES = {
    ("cases", "payloads.center"): (CASES + 'payloads = [{ link = "tip", mass = 1, center = [0, 0, 50] }]', "the payload on tip is 50 m"),
    ("cases", "payloads.inertia"): (CASES + 'payloads = [{ link = "tip", mass = 1, inertia = [400, 400, 400, 0, 0, 0] }]', "the inertia of the payload on tip is that of a body with a radius of 20 m"),
    ("cases", "external.point"): (CASES + 'external = [{ link = "tip", wrench = [1, 0, 0, 0, 0, 0], point = [0, 80, 0] }]', "the point of external wrench 1, on tip, is 80 m"),
    ("cases", "hold.pose"): ("[cases.one]\nhold = { pose = { slide = 300 } }", "slide reaches 300 m"),
    ("cases", "simulate.pose"): ("[cases.one]\nsimulate = { until = 0.01, pose = { slide = 300 } }", "slide reaches 300 m"),
    ("cases", "gravity"): (CASES + "gravity = [0, 0, -9810]", "is that in mm/s²?"),
    ("cases", "motion"): ('[cases.one]\nmotion = "mm.csv"', "slide reaches 300 m, and its limits are -0.4 and 0.4 m: are these millimetres? Then give their unit in a map"),
    ("sweep", "payload.center"): (SWEEP + 'kind = "payload"\nlink = "tip"\ncenter = [0, 0, 50]\nvalues = [1]', "the payload is 50 m from the link's origin"),
    ("sweep", "center"): (SWEEP + 'kind = "center"\nlink = "rod"\naxis = [1, 0, 0]\nfrom = -5\nto = 5\nsteps = 2', "it moves a centre of mass by 5 m"),
    ("sweep", "gravity"): (SWEEP.replace("\n[[", "\ngravity = [0, 0, -9810]\n[[") + 'kind = "speed"\nvalues = [1]', "is that in mm/s²?"),
    ("components", "at"): (COMPONENTS, "limits: at is 5 m"),
    ("choose", "at"): ('[[choose]]\nkind = "limits"\njoint = "pin"\nlink = "tip"\nat = [0, 0, 9]', "given.toml:3: what is chosen for pin is 9 m from the link's origin"),
}  # fmt: skip
"""Fields of files that take a length."""
OTHERS = {
    "cases": {
        "physics", "friction_width", "mounting", "stop", "payloads.link", "payloads.mass", "external.link", "external.wrench", "external.steps",
        "external.file", "external.axes", "external.order", "loops", "drives", "stiffness",
        *(f"simulate.{key}" for key in simulate_keys.KEYS if key != "pose"),
    },
    "sweep": {"simulate", "components", "reading", "physics", "friction_width", "floating_base", "mimic", "model", "payload", "speed", "tilt", "mass", "motion", "loops", "drives", "stiffness", "xacro", "packages", "strict"},
    "components": {"", "°", "N", "N m", "kg m²", "W", "J", "h", "%", "r/min", "r/min, N m", "m/N", "the stress's", "the stress's per N or N m",
        "Pa", "m/s", "W/m²", "m³/(N m)", "m³/s", "N/m", "N m/rad"},
}  # fmt: skip
"""Those that take none; of components their units."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    at = tmp_path_factory.mktemp("lengths")
    (at / "arm.urdf").write_text(ROBOT)
    (at / "catalogue.csv").write_text("kind,name,mass,radial_force\nlimits,a,1,1e9\n")
    for name, x in (("m", 0.3), ("mm", 300)):
        (at / f"{name}.csv").write_text("time,slide,slide.v,slide.a,pin,pin.v,pin.a\n" + "".join(f"{k / 10},{x},0,0,0,0,0\n" for k in range(10)))
    ksl.compute_loads(at / "arm.urdf", at / "m.csv").write(at / "results")
    (at / "s.toml").write_text("slide = 1e5\npin = 1e4\n")
    return at


def said(folder, arguments) -> str:
    p = run_ksl(*arguments, cwd=folder, COLUMNS="10000")
    assert p.returncode in (0, 1, 2), p.stderr
    return " ".join((p.stdout + p.stderr).split())


def commands():
    return typer.main.get_command(app).commands


def test_every_option_that_takes_a_length_is_judged(folder):
    takes = {
        (name, next(o for o in p.opts if o.startswith("--")))
        for name, command in commands().items()
        for p in command.params
        if p.param_type_name == "option" and re.search(r"X,Y,Z|\bm\b", f"{p.metavar} {p.help}")
    }
    assert takes - SPEEDS - EFFORTS == OPTIONS.keys()


@pytest.mark.parametrize("option", OPTIONS, ids=" ".join)
def test_option(folder, option):
    arguments, sentence = OPTIONS[option]
    assert sentence in said(folder, arguments)


def test_every_field_that_takes_a_length_is_judged():
    inner = {"simulate": simulate_keys.KEYS, "payloads": case_file.OF_PAYLOAD, "external": case_file.OF_EXTERNAL, "hold": case_file.OF_HOLD}
    keys = {f"{k}.{i}" for k, of in inner.items() for i in of} | (set(case_file.KEYS) - inner.keys())
    assert keys == OTHERS["cases"] | {key for file, key in FILES if file == "cases"}
    varied = {f"{kind}.center" for kind, takes in description.TAKES.items() if "center" in takes}
    keys = varied | set(description.KINDS) | set(description.OF_BASE)
    assert keys == OTHERS["sweep"] | {key for file, key in FILES if file == "sweep"}
    for kind in KINDS.values():
        for key in (inner for outer in kind.keys for inner in (outer, *outer.keys)):
            assert key.unit in OTHERS["components"] | {"m"}, f"{kind.name}: {key.name}: is it a length? See ksl.sizing.catalogue.catalogue_numbers.lengths_of"


def test_every_length_of_loops_is_judged(folder):
    """Frames in a file beside the robot, for `ksl.load` and for load cases."""
    assert set(loops_file.OF_LOOP) == {
        "name",
        "kind",
        "predecessor",
        "successor",
        "axis",
        "axis2",
        "predecessor_rpy",
        "successor_rpy",
        "predecessor_xyz",
        "successor_xyz",
        "pitch",
    }
    assert set(loops_file.OF_ELEMENT) == {
        "name",
        "link1",
        "link2",
        "point1",
        "point2",
        "stiffness",
        "free_length",
        "damping",
        "preload",
        "stop_stiffness",
        "limits",
    }
    (folder / "loops.toml").write_text(
        'drives = ["pin"]\n[[loop]]\nname = "C"\nkind = "spherical"\npredecessor = "tip"\nsuccessor = "wall"\npredecessor_xyz = [0, 600, 0]\nsuccessor_xyz = [0, 0, 0]\n'
    )
    (folder / "spring.toml").write_text(
        '[[force_element]]\nname = "S"\nlink1 = "tip"\npoint1 = [0, 600, 0]\nlink2 = "wall"\npoint2 = [0, 0, 0]\nstiffness = 5\n'
    )
    with pytest.warns(ksl.DescriptionWarning, match="the end of force element S on tip is 600 m from the link's origin, .*: are these millimetres?"):
        ksl.load(folder / "arm.urdf", loops=folder / "spring.toml")
    spring = '[[force_element]]\nname = "S"\nlink1 = "tip"\npoint1 = [0, 0.1, 0]\nlink2 = "wall"\npoint2 = [0, 0, 0]\nstiffness = 5\n'
    (folder / "spring.toml").write_text(f"{spring}free_length = 300\nlimits = [90, 400]\n")
    with pytest.warns(ksl.DescriptionWarning) as found:
        ksl.load(folder / "arm.urdf", loops=folder / "spring.toml")
    for what in ("free length of force element S is 300 m", "lower limit of force element S is 90 m", "upper limit of force element S is 400 m"):
        assert any(f"the {what}, " in str(w.message) and "are these millimetres?" in str(w.message) for w in found)
    (folder / "screw.toml").write_text(
        'drives = ["pin"]\n[[loop]]\nname = "C"\nkind = "helical"\npredecessor = "tip"\nsuccessor = "wall"\naxis = [0, 0, 1]\npitch = 5\n'
    )
    with pytest.warns(ksl.DescriptionWarning, match="the travel of loop joint C in a turn is 31.4159 m, .*: are these millimetres?"):
        ksl.load(folder / "arm.urdf", loops=folder / "screw.toml")
    (folder / "looped.toml").write_text('[cases.one]\nmotion = "m.csv"\nloops = "loops.toml"\n')
    said = "the frame of loop joint C on tip is 600 m from the link's origin, .*: are these millimetres?"
    with pytest.warns(ksl.DescriptionWarning, match=said):
        ksl.load(folder / "arm.urdf", loops=folder / "loops.toml")
    with pytest.warns(ksl.DescriptionWarning, match=said), pytest.raises(ValueError):
        ksl.compute_loads(folder / "arm.urdf", cases=folder / "looped.toml")


@pytest.mark.parametrize("field", FILES, ids=" ".join)
def test_field(folder, field):
    text, sentence = FILES[field]
    (folder / "given.toml").write_text(text)
    command = {
        "cases": ["loads", "arm.urdf", "--cases", "given.toml", "-o", "out"],
        "sweep": ["sweep", "arm.urdf", "given.toml", "-o", "swept", "--force"],
        "components": ["size", "results", "given.toml"],
        "choose": ["size", "results", "given.toml", "--choose", "catalogue.csv"],
    }[field[0]]
    assert sentence in said(folder, command)


def test_lengths_of_components_are_found():
    """Each key in m, those of tables inside of a component too."""
    shapes = {"vector": [0, -7.0, 1], "points": [[7.0, 0], [0, 1]]}
    value = lambda key: {k.name: value(k) for k in key.keys} if key.shape == "table" else shapes.get(key.shape, 7.0)
    for kind in KINDS.values():
        names = {f"{key.name}.{k.name}" if key.keys else k.name for key in kind.keys for k in (key.keys or (key,)) if k.unit == "m"}
        assert dict(lengths_of(kind.keys, {key.name: value(key) for key in kind.keys})) == dict.fromkeys(names, 7.0)


def test_python_says_the_same(folder):
    far_away = {"tip": (2.0, (0, 0, 50))}
    for load in (lambda: ksl.load(folder / "arm.urdf", payloads=far_away), lambda: ksl.load_string(ROBOT, payloads=far_away)):
        with pytest.warns(ksl.DescriptionWarning, match="the payload on tip is 50 m from the link's origin, .*: 50 mm are 0.05"):
            m = load()
    m = ksl.load(folder / "arm.urdf")
    for made, sentence in (
        (lambda: m.with_payload("tip", 2.0, (0, 0, 50)), "the payload on tip is 50 m from the link's origin, .*: 50 mm are 0.05"),
        (lambda: m.with_payload("tip", 1.0, inertia=400 * np.eye(3)), "the inertia of the payload on tip is that of a body with a radius of 20 m"),
        (lambda: m.with_frame("tool", "tip", ksl.Pose.from_rpy((0, 0, 80))), "frame tool is 80 m from the origin of tip, .*are these millimetres"),
        (lambda: m.merged(m, "tip", ksl.Pose.from_rpy((0, 0, 80)), prefix="two_"), "pose of merged: it is 80 m from the origin of tip"),
        (lambda: m.with_gravity((0, 0, -9810)), "is that in mm/s²"),
    ):
        with pytest.warns(ksl.DescriptionWarning, match=sentence) as found:
            made()
        assert [w.filename for w in found] == [__file__]
    for run in (
        ksl.compute_loads(m, folder / "m.csv", payloads=far_away),
        ksl.compute_loads(m, folder / "m.csv", at={"pin": (0, 0, 50)}),
        ksl.hold(m, at=(0, 0, 50)),
        ksl.hold(m, {"slide": 300}),
    ):
        assert run.verdict.level != "green" and "are these millimetres?" in run.verdict.reasons[0]
    assert "are these millimetres?" in ksl.size(ksl.compute_loads(m, folder / "m.csv"), at={"pin": (0, 0, 50)}).notes[0]


def test_what_is_likely_is_not_named(folder):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        m = (
            ksl.load(folder / "arm.urdf", payloads={"tip": (2.0, (0, 0, 0.5))})
            .with_payload("tip", 2.0, (0, 0, 0.5))
            .with_gravity((0, 0, 9.81))
            .with_frame("tool", "tip")
        )
    run = ksl.compute_loads(m, folder / "m.csv", payloads={"tip": (1.0, (0, 0, 1.0))}, at=(0, 0, 0.7))
    assert run.verdict.level == "green" and not run.verdict.reasons


@pytest.mark.filterwarnings("ignore:the (payload|inertia of the payload) on")
def test_extent(folder):
    """The slide's travel of 0.4 m, the rod of 0.6 m; or the travel and the radius of a mass at 0.3 m, √(0.3² + 0.04 / 2 / 2)."""
    m = ksl.load(folder / "arm.urdf")
    assert extent(m) == pytest.approx(1.0, rel=1e-12)
    loaded = m.with_payload("tip", 2.0, (0, 0, 50))
    assert extent(loaded) > 50
    rng = np.random.default_rng(0)
    for _ in range(40):  # payloads count nothing, on links with and without a mass of their own
        loaded, carried = m, []
        for link in ("tip", "rod", "link:tip", "cart"):
            mass, point, moment = rng.uniform(0.1, 3), tuple(50 * rng.normal(size=3)), rng.uniform(0, 9)
            loaded = loaded.with_payload(link, mass, point, moment * np.eye(3))
            carried.append((link, mass, point, 3 * moment))
        assert extent(loaded) > 10 and extent(loaded, carried) == pytest.approx(1.0, rel=1e-9)
    point = ksl.load_string(
        '<robot name="p"><link name="l"><inertial><mass value="1"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    assert extent(point) == 0.0 and far("it is", 1e9, extent(point)) == []  # nothing to judge by


def test_what_is_far_in_millimetres_too_is_said_otherwise():
    assert "check its unit" in far("it is", 1e6, 1.0)[0] and "millimetres" not in far("it is", 1e6, 1.0)[0]
    assert "1e6" in far_inertia("it", 2.0, (400.0, 300.0, 200.0), 1.0)[0] and far_inertia("it", 2.0, (4.0, 3.0, 2.0), 1.0) == []
