"""The components file: what is refused, with its line; what is left out, and that it is said."""

import copy
import re

import ksl
import ksl.sizing.results
import numpy as np
import pytest
from ksl.base.errors import SizingError
from ksl.base.toml_lines import line_of, toml_lines
from ksl.sizing.catalogue.bolt_numbers import OF_BOLT
from ksl.sizing.catalogue.catalogue import KINDS
from ksl.sizing.catalogue.catalogue_stiffness import OF_STIFFNESS
from ksl.sizing.catalogue.components import components_of, read_components
from ksl.sizing.catalogue.example import example_file
from results_tables import made_table, results_table

ABSENT = object()
HEAD = 'robot = "panda"\n\n[[component]]\njoint = "panda_joint2"\n'


@pytest.fixture(scope="module")
def table(examples):
    m = ksl.load(examples / "robots/panda.urdf")
    t = np.linspace(0, 1, 21)
    q = 0.3 * np.sin(np.outer(t, np.arange(1, 8))) + np.array([0, 0, 0, -2, 0, 2, 0])
    return results_table(m, {"sway": (t, q, np.cos(np.outer(t, np.arange(1, 8))), np.zeros((21, 7)))})


@pytest.fixture
def file(tmp_path):
    def write(text: str):
        path = tmp_path / "parts.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


GEAR = 'kind = "strain wave gear"\nratio = 100\n'


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "holds no components.*ksl size --example"),
        ("component = 3\n", ":1: holds no components"),
        ("[[component]\n", "is not TOML"),
        ('robot = 3\n[[component]]\njoint = "a"\nkind = "motor"\n', ":1: robot = 3: expected the robot's name"),
        ("required_life_h = -1\n" + HEAD + GEAR, ":1: required_life_h = -1: expected a positive number"),
        ("reliability = 92\n" + HEAD + GEAR, "reliability = 92: ISO 281:2007 has factors for 90, 95"),
        ("iso_281 = 2010\n" + HEAD + GEAR, ":1: iso_281 = 2010: expected the edition 2007 or 1990"),
        ("relyability = 90\n" + HEAD + GEAR, ":1: no top-level key named 'relyability'; did you mean 'reliability'"),
        (HEAD, ":3: component without kind; known: motor, strain wave gear"),
        (HEAD + 'kind = "strain gear"\n', ":5: no kind of component named 'strain gear'; did you mean 'strain wave gear'"),
        ('[[component]]\nkind = "motor"\n', ':1: expected joint = "NAME"'),
        ('[[component]]\njoints = []\nkind = "motor"\n', ':2: expected joint = "NAME"'),
        ('[[component]]\njoint = "a"\njoints = ["b"]\nkind = "motor"\n', 'expected joint = "NAME"'),
        (HEAD + GEAR + "rated_torqe = 3\n", ":7: no strain wave gear key named 'rated_torqe'; did you mean 'rated_torque'"),
        (HEAD + GEAR + 'rated_torque = "67"\n', ":7: rated_torque = '67': expected a number, N m"),
        (HEAD + GEAR + "rated_torque = true\n", ":7: rated_torque = True: expected a number, N m$"),
        (HEAD + GEAR + "efficiency = '0.8'\n", ":7: efficiency = '0.8': expected a number$"),
        (HEAD + 'kind = "motor"\ntorque_speed = [[0, 1], [0, 2]]\n', ":6: torque_speed.*increasing speeds"),
        (HEAD + 'kind = "motor"\nname = 3\n', ":6: name = 3: expected text in quotes"),
        (HEAD + 'kind = "bolted flange"\nbolts = 6\n', "a bolt circle needs both bolts and circle_diameter"),
        (HEAD + 'kind = "bolted flange"\n', "a bolted flange needs bolts and circle_diameter, or points"),
        (HEAD + 'kind = "bolted flange"\nbolts = 2\ncircle_diameter = 0.1\n', "at least three bolts"),
        (HEAD + 'kind = "bolted flange"\nbolts = 6.5\ncircle_diameter = 0.1\n', ":6: bolts = 6.5: expected a whole number"),
        (HEAD + 'kind = "bolted flange"\nbolts = 6\ncircle_diameter = -0.1\n', ":7: circle_diameter = -0.1 must be positive"),
        (HEAD + 'kind = "bolted flange"\npoints = [[0, 0], [1, 0]]\n', "at least three bolts"),
        (HEAD + 'kind = "bolted flange"\nbolts = 6\ncircle_diameter = 0.1\nat = [0, 0]\n', ":8: at = .0, 0.: expected three numbers .x, y, z.$"),
        (
            HEAD + 'kind = "bearing pair"\nlocating = { type = "deep groove", position = 0.1 }\n',
            "bearing pair without floating; write a table .component.floating.",
        ),
        (
            HEAD
            + 'kind = "bearing pair"\n[component.locating]\ntype = "deep groove"\nposition = 0\n[component.floating]\ntype = "deep groove"\nposition = 0\n',
            ":11: locating and floating are at the same position",
        ),
        (HEAD + 'kind = "bearing pair"\n[component.locating]\ntype = "deep grove"\n', ":7: locating.type = 'deep grove': did you mean 'deep groove'"),
        (
            HEAD + 'kind = "bearing pair"\n[component.locating]\ntype = "deep groove"\n[component.floating]\ntype = "deep groove"\nposition = 0\n',
            ":6: locating without position",
        ),
        (HEAD + 'kind = "crossed roller bearing"\npitch_diameter = 90\n', ":6: pitch_diameter = 90: lengths are in metres; 90 mm are 0.09"),
        (HEAD + 'kind = "crossed roller bearing"\nposition = -30.5\n', ":6: position = -30.5: lengths are in metres; 30.5 mm are 0.0305"),
        (HEAD + 'kind = "fatigue"\nk = 5\n', "fatigue without stress"),
        (HEAD + 'kind = "fatigue"\nstress = { mx = 3.0 }\n', ":6: no stress key named 'mx'"),
        (HEAD + GEAR + "\n[cases]\npick = -1\n", ":9: cases.pick = -1: expected a number, 0 or more"),
        (HEAD + GEAR + "\n[cases]\na = 1\n[shares]\na = 1\n", "repetitions or shares of time, one of them"),
        (HEAD + GEAR + "\n[shares]\na = 0\n", "one case at least must have a share"),
    ],
)
def test_files_that_are_refused(file, text, words):
    path = file(text)
    with pytest.raises(SizingError) as caught:
        read_components(path)
    assert str(caught.value).startswith(str(path)) and re.search(words, str(caught.value)), caught.value


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(SizingError, match="can't be read .*give a TOML file that describes components"):
        read_components(tmp_path / "none.toml")


@pytest.mark.parametrize(
    "text, words",
    [
        ('robot = "ur5"\n\n[[component]]\njoint = "panda_joint2"\n' + GEAR, "is for the robot 'ur5'.*results of 'panda'"),
        ('[[component]]\njoint = "panda_joint22"\n' + GEAR, ":2: no joint named 'panda_joint22'; did you mean 'panda_joint2'"),
        (HEAD + GEAR + "[stiffness.panda_joint22]\naxial = 1e7\n", ":7: no joint named 'panda_joint22'; did you mean 'panda_joint2'"),
        (HEAD + GEAR + "[cases]\nsvay = 3\n", ":8: no case named 'svay'; did you mean 'sway'"),
        ('[[component]]\njoint = "base"\n' + GEAR, ":2: a strain wave gear sits on a joint that turns about one axis, and base is fixed"),
        (
            HEAD + GEAR + "[[component]]\njoints = ['panda_joint2']\n" + GEAR,
            ":8: panda_joint2 has two components of kind strain wave gear named 'strain wave gear'; give each a name",
        ),
        (HEAD + 'kind = "bolted flange"\npoints = [[0, 0], [1, 1], [2, 2]]\n', "the bolts lie on one line"),
        (HEAD + 'kind = "bolted flange"\nbolts = 6\ncircle_diameter = 0.1\nnormal = [0, 0, 0]\n', "normal is zero"),
        (HEAD + 'kind = "bolted flange"\nbolts = 6\ncircle_diameter = 0.1\nnormal = [0, 0, 1]\nx_axis = [0, 0, 2]\n', "x_axis is zero or along the normal"),
        (HEAD + 'kind = "bolted flange"\nbolts = 6\ncircle_diameter = 0.1\nnormal = [0, 0, 1]\nx_axis = [0, 0, 0]\n', "x_axis is zero or along the normal"),
    ],
)
def test_components_that_do_not_fit_the_results(file, table, text, words):
    with pytest.raises(SizingError, match=words):
        ksl.size(table, file(text))


@pytest.mark.parametrize(
    "lines, figure, why",
    [
        ('kind = "motor"\nrotor_inertia = 1e-5\n', "everything at the rotor", "gear_ratio is not given, and no gear"),
        ('kind = "motor"\ngear_ratio = 100\n', "rms torque, peak torque", "rotor_inertia is not given"),
        ('kind = "motor"\ngear_ratio = 100\nrotor_inertia = 1e-5\nrated_torque = -0.5\n', "the limit of “rms torque”", "rated_torque = -0.5 must be positive"),
        ('kind = "motor"\ngear_ratio = 100\nrotor_inertia = 1e-5\nmax_power = 0\n', "the limit of “peak power”", "max_power = 0 must be positive"),
        ('kind = "motor"\ngear_ratio = 100\ngear_efficiency = 80\n', "the efficiency of the gear", "gear_efficiency is not given"),
        ('kind = "strain wave gear"\nratio = 100\nrated_torque = nan\n', "life of the wave generator", "rated_torque = nan must be finite"),
        ('kind = "planetary gear"\nnominal_torque = 10\n', "input speeds", "ratio is not given"),
        ('kind = "crossed roller bearing"\nC = 1e4\n', "everything", "pitch_diameter is not given"),
        ('kind = "crossed roller bearing"\npitch_diameter = 0.1\nC0 = 1e4\n', "life", "C is not given"),
        ('kind = "crossed roller bearing"\npitch_diameter = 0.1\nC = 1e4\nC0 = -2\n', "static safety", "C0 = -2 must be positive"),
        (
            'kind = "bearing pair"\n[component.locating]\ntype = "deep groove"\nposition = 0\nC = 1e4\nC0 = 5e3\n'
            '[component.floating]\ntype = "deep groove"\nposition = 0.1\nC = 1e4\nC0 = 1e4\n',
            "locating: life",
            "locating.f0 is not given",
        ),
        (
            'kind = "bolted flange"\nbolts = 6\ncircle_diameter = 0.1\npreload = 1e4\n',
            "bolt force, clamp force, slip",
            "bolt_resilience is not given; plate_resilience is not given",
        ),
        ('kind = "bolted flange"\nbolts = 6\ncircle_diameter = 0.1\nload_factor = 0.1\npreload = 1e4\n', "slip and required preload", "friction is not given"),
        ('kind = "fatigue"\nstress = { tx = 1.0 }\nk = 5\n', "damage and life", "knee_amplitude is not given"),
        ('kind = "limits"\n', "everything", "no limit is given"),
    ],
)
def test_missing_and_negative_numbers_leave_figures_out(file, table, lines, figure, why):
    path = file(HEAD + lines)
    sizing = ksl.size(table, path)
    found = [x for x in sizing.left_out if x.figure.startswith(figure) and why in x.why]
    assert found, [str(x) for x in sizing.left_out]
    assert found[0].joint == "panda_joint2" and "left out" in str(found[0])
    negative = re.search("must be", why)
    assert not negative or f"{path}:" in found[0].why  # with the line
    assert all(np.isfinite(f.value) or f.unit == "h" for f in sizing.figures)


def test_the_example_has_every_kind_and_key_and_can_be_used(file, table):
    sliding = {name for name, kind in KINDS.items() if kind.joints == "sliding"}
    text = example_file("panda_joint2", sliding=None)
    used = text.replace('joint = "panda_joint2"           #', 'joint = "panda_joint2" #')
    parts = read_components(file(example_file("panda_joint2"))).parts
    assert [p.kind.name for p in parts] == list(KINDS) and 'joint = "SLIDING_JOINT"' in example_file()
    for part in parts:
        for key in part.kind.keys:
            assert key.name in part.values or key.name in ("points", "load_factor", *OF_BOLT, *OF_STIFFNESS), (part.name, key.name)
    sizing = ksl.size(table, file(used))
    assert {f.kind for f in sizing.figures} == set(KINDS) - sliding and not sizing.left_out


@pytest.mark.parametrize("kind", KINDS)
def test_any_wrong_value_is_a_sentence(table, kind):
    """Every key of every kind with values of all types: a SizingError or a result, and nothing else."""
    tomllib = pytest.importorskip("tomllib")
    whole = next(c for c in tomllib.loads(example_file("panda_joint2"))["component"] if c["kind"] == kind)
    results = ksl.sizing.results.Results(table)
    for path in [(k,) for k in whole] + [(k, sub) for k, x in whole.items() if isinstance(x, dict) for sub in x]:
        for wrong in ("x", -1, 0, float("nan"), 1e308, 10**400, [], {}, True, [[1, 2]], ABSENT):
            tables = copy.deepcopy(whole)
            inner = tables if len(path) == 1 else tables[path[0]]
            inner[path[-1]] = wrong
            if wrong is ABSENT:
                del inner[path[-1]]
            try:
                ksl.size(results, {"component": [tables]}, joints=["panda_joint2"]).as_dict()
            except SizingError as error:
                assert len(str(error)) > 20


def test_the_pandas_components_fit_the_panda(examples, table):
    parts = read_components(examples / "components/panda.toml")
    assert parts.robot == "panda" and {j for p in parts.parts for j in p.joints} == {*(f"panda_joint{i}" for i in range(1, 8)), "base"}


def test_tables_of_a_program_are_the_same_as_a_file(file, table):
    tables = {"component": [{"joint": "panda_joint2", "kind": "limits", "torque": 50}]}
    a, b = ksl.size(table, tables), ksl.size(table, file(HEAD + 'kind = "limits"\ntorque = 50\n'))
    assert a.figures == b.figures
    with pytest.raises(SizingError, match="components: no limits key named 'torqe'; did you mean 'torque'"):
        components_of({"component": [{"joint": "a", "kind": "limits", "torqe": 5}]})


def test_tables_may_hold_tuples_and_arrays():
    points = np.array([[0.1, 0], [0, 0.1], [-0.1, 0]])
    parts = components_of(
        {"component": ({"joint": "a", "kind": "bolted flange", "points": points, "at": (0, 0, 1), "preload": np.float32(500), "required_clamp": np.int64(3)},)}
    ).parts
    assert parts[0].get("points") == points.tolist() and parts[0].get("preload") == 500 and parts[0].get("at") == [0, 0, 1]


def test_lines_of_keys():
    text = 'a = 1\n[b]\n"c d" = 2\n[[e]]\nf = 3\n[e.g]\nh = 4\n[[e]]\n  f=5\ni.j = 6\n'
    lines = toml_lines(text)
    paths = [("a",), ("b",), ("b", "c d"), ("e", 0), ("e", 0, "f"), ("e", 0, "g", "h"), ("e", 1), ("e", 1, "f"), ("e", 1, "i", "j")]
    assert [lines[p] for p in paths] == [1, 2, 3, 4, 5, 7, 8, 9, 10]
    assert line_of(lines, "e", 0, "g", "missing") == 6 and line_of(lines, "z") is None


DEFAULTS = {
    ("strain wave gear", "rated_input_rpm"): 2000.0, ("strain wave gear", "rated_life_h"): 7000.0, ("planetary gear", "torque_exponent"): 3.0,
    ("crossed roller bearing", "position"): 0.0, ("crossed roller bearing", "load_factor"): 1.2, ("crossed roller bearing", "required_static_safety"): 2.0,
    ("bearing pair", "contact_angle_deg"): 40.0, ("bearing pair", "required_static_safety"): 1.0, ("opposed angular contact bearings", "shaft"): "child",
    ("opposed angular contact bearings", "contact_angle_deg"): 40.0, ("opposed angular contact bearings", "required_static_safety"): 1.0,
    ("bolted flange", "first_angle_deg"): 0.0, ("bolted flange", "at"): [0.0, 0.0, 0.0], ("bolted flange", "shank_length"): 0.0, ("bolted flange", "thread_in"): "plate",
    ("bolted flange", "tightening"): "torque wrench", ("bolted flange", "thread_friction"): 0.12, ("bolted flange", "yield_share"): 0.9,
    ("bolted flange", "tightening_factor"): 1.6, ("bolted flange", "embedding_loss"): 0.0, ("bolted flange", "load_introduction"): 1.0,
    ("bolted flange", "on"): "child", ("fatigue", "on"): "child", ("limits", "on"): "child", ("pin", "inner_diameter"): 0.0, ("pin", "gap"): 0.0,
    ("pin", "position"): 0.0, ("pin", "moment"): "carried", ("plain bush", "position"): 0.0, ("plain bush", "moment"): "carried",
    ("hydraulic cylinder", "extends"): "positive", ("hydraulic cylinder", "efficiency"): 1.0, ("hydraulic cylinder", "back_pressure"): 0.0,
    ("hydraulic cylinder", "retracted_position"): 0.0, ("hydraulic cylinder", "buckling_factor"): 1.0, ("hydraulic cylinder", "rod_material"): "E335",
    ("hydraulic cylinder", "elastic_modulus"): 2.1e11, ("hydraulic cylinder", "required_buckling_safety"): 3.5,
    ("bolted flange", "required_clamp"): 0.0, ("bolted flange", "interfaces"): 1.0, ("fatigue", "unit"): "Pa", ("fatigue", "at"): [0.0, 0.0, 0.0],
    ("fatigue", "below_knee"): "elementary", ("fatigue", "mean_stress"): "none", ("fatigue", "residue"): "half cycles", ("limits", "at"): [0.0, 0.0, 0.0],
}  # fmt: skip
"""What is taken for a key that a file leaves out: numbers of catalogues and guidelines, which size what nobody states."""


def test_what_is_taken_for_keys_that_are_left_out():
    keys = [(kind.name, key) for kind in KINDS.values() for outer in kind.keys for key in (outer, *outer.keys)]
    assert {(kind, key.name): key.default for kind, key in keys if key.default is not None} == DEFAULTS
    shares = {"efficiency", "gear_efficiency", "thread_friction", "yield_share", "load_introduction", "load_factor"}  # at most the whole
    largest = {(kind, key.name): key.largest for kind, key in keys if key.largest is not None}
    assert {name for _, name in largest} == {*shares, "torque_exponent", "k"} and ("crossed roller bearing", "load_factor") not in largest
    assert all(x == (1 if name in shares else 100) for (_, name), x in largest.items())


CIRCLE = {"kind": "bolted flange", "bolts": 3, "circle_diameter": 0.1}
NAMED = CIRCLE | {"bolt": "M8 8.8", "clamp_length": 0.02}
BEARING = {"kind": "crossed roller bearing"}
BOUNDS = {  # what is used, and what is beside it and not
    "position": (BEARING, (9.999, -9.999, 0), (10.0, -10.0, float("inf"))), "pitch_diameter": (BEARING, (2.999, 1e-30), (3.0, 0, -0.1, 0.9e-30)),
    "C": (BEARING, (1e30, 1e-30, 10**22), (1.1e30, 0.9e-30, 0, -1, True)), "efficiency": ({"kind": "planetary gear"}, (1.0, 1e-9), (1.001, 0)),
    "rotor_inertia": ({"kind": "motor"}, (0, 1e-30), (-1e-9, 0.9e-30)), "at": ({"kind": "limits"}, ([0, -9.9, 9.9], [0.0, 0, 0]), ([0, 0, 10.1], [0, 0], 3)),
    "contact_angle_deg": ({"kind": "opposed angular contact bearings", "arrangement": "back-to-back", "a": {"position": 0}, "b": {"position": 1}}, (20, 25.0, 45), (26, 0)),
    "torque_speed": ({"kind": "motor"}, ([[0, 1], [1, 0]], [[5, 0]]), ([[-0.1, 1], [1, 1]], [[1, 1], [1, 2]], [[2, 1], [1, 2]], [[0, 1], [1, -0.1]], [], [[1, 2, 3]])),
    "bolts": (CIRCLE, (3, 4), (2, 5.0, True, -3)), "points": ({"kind": "bolted flange"}, ([[0, 0], [1, 0], [0, 1]],), ([[0, 0], [1, 0]], [[0, 0, 0]] * 3, [1, 2, 3])),
    "shank_length": (NAMED, (0, 0.02), (0.0201, -0.001)), "thread_friction": (NAMED, (1.0,), (1.1, 0)),
}  # fmt: skip


@pytest.mark.parametrize("key", BOUNDS)
def test_the_numbers_that_a_catalogue_can_have(key):
    """Others are an error, or are not used, and that is said."""
    part, used, beside = BOUNDS[key]
    for value in (*used, *beside):
        try:
            (found,) = components_of({"component": [{"joint": "a", **part, key: value}]}).parts
            is_used = not found.refused
            assert found.get(key) == (value if is_used else None)
        except SizingError:
            is_used = False
        assert is_used == (value in used and not isinstance(value, bool)), value


@pytest.mark.parametrize(
    ("top", "is_taken"),
    [
        ({"required_life_h": 1e30}, True), ({"required_life_h": 1.1e30}, False), ({"required_life_h": 0}, False), ({"cases": {"a": 0}}, True), ({"cases": {"a": 1e30}}, True),
        ({"cases": {"a": -1e-9}}, False), ({"cases": {"a": 1.1e30}}, False), ({"shares": {"a": 0, "b": 1e-9}}, True), ({"shares": {"a": True}}, False), ({"shares": 3}, False),
        ({"iso_281": 1990, "reliability": 99}, True), ({"iso_281": True}, False), ({"iso_281": 2007.0}, False), ({"component": []}, False), ({"component": [3]}, False),
    ],
)  # fmt: skip
def test_the_numbers_of_a_whole_file(top, is_taken):
    tables = {"component": [{"joint": "a", "kind": "limits"}]} | top
    if is_taken:
        assert components_of(tables).parts and components_of({"component": tables["component"], "reliability": None}).reliability == 90
        return
    with pytest.raises(SizingError):
        components_of(tables)


def test_integers_that_are_beyond_any_number():
    for number, said in ((-(10**299), "is out of range: magnitudes are between 1e-30 and 1e[+]30"), (-105 * 10**298, "expected factors")):
        with pytest.raises(SizingError, match=said):
            components_of({"component": [{"joint": "b", "kind": "fatigue", "stress": {"fx": number}}]})


ROWS = {"type": "deep groove", "position": 0.0}


@pytest.mark.parametrize(
    ("name", "of"),
    [
        ("position", lambda x: BEARING | {"position": -x}), ("at", lambda x: {"kind": "limits", "torque": 1, "at": [0, -x, x / 2]}),
        ("locating.position", lambda x: {"kind": "bearing pair", "locating": ROWS | {"position": x}, "floating": ROWS}),
        ("points", lambda x: {"kind": "bolted flange", "points": [[0, 0], [1, 0], [0.5, -x]]}),
    ],
)  # fmt: skip
def test_lengths_beyond_the_extent_of_the_robot_are_doubted(name, of):
    """From once its extent on; the point of the moments in the simultaneous sets from twice."""
    table = made_table({"a": {"time": [0.0, 1.0]}}, extent=2.0)
    for length, doubted in ((1.99, False), (2.01, True)):
        notes = ksl.size(table, {"component": [{"joint": "j", **of(length)}]}).notes
        assert any(f"{name} is 2.01 m, 1 times the robot's extent of 2 m" in note for note in notes) == doubted, notes
        assert len(notes) == doubted
        assert len(ksl.size(table, at={"j": (0, 0, 2 * length)}).notes) == doubted
    assert not ksl.size(made_table({"a": {"time": [0.0, 1.0]}}), {"component": [{"joint": "j", **of(9.0)}]}).notes, "nobody knows the extent"


def test_what_is_said_of_the_spectrum_and_of_numbers_that_are_not_used():
    table = made_table({case: {"time": [0.0, 1.0]} for case in "abc"})
    part = {"joint": "j", "kind": "limits", "torque": 1.0}
    notes = lambda **top: list(ksl.size(table, {"component": [part], **top}).notes)
    assert notes() == notes(cases={"a": 2}) == [] and notes(shares=dict.fromkeys("abc", 0.2)) == []
    assert notes(cases={"a": 0, "b": 1, "c": 0}) == ["exceptional cases (0 repetitions) count for peaks and static safety and not for life: a, c"]
    assert notes(shares={"b": 1.0}) == ["cases without a share of the time count for peaks and not for life: a, c"]
    unused = ksl.size(table, {"component": [{"joint": "j", "kind": "planetary gear", "ratio": 3, "efficiency": -0.9}]})
    assert list(unused.notes) == ["components: efficiency = -0.9 must be positive; it is not used"]
    made = [ksl.size(table, {"component": [part], **top}).provenance for top in ({}, {"cases": {"a": 2.0}}, {"shares": {"b": 0.5}})]
    assert [x["cases"] for x in made] == [{"a": 1.0, "b": 1.0, "c": 1.0}, {"a": 2.0, "b": 1.0, "c": 1.0}, {"a": 0.0, "b": 0.5, "c": 0.0}]
    assert [x["cases are"] for x in made] == ["repetitions", "repetitions", "share of time"] and ksl.size(table).provenance["cases"] == {}


def test_the_first_gear_of_a_joint_and_what_its_motor_states():
    """Of two gears the first counts; what the motor states comes before both; without any it is a direct drive, or none."""
    table = made_table({"a": {"time": [0.0, 1.0], "effort": 6.0, "speed": 2.0}})
    gears = [{"joint": "j", "kind": "planetary gear", "name": n, "ratio": r, "efficiency": e} for n, r, e in (("x", 10, 0.5), ("y", 20, 0.6))]
    for own, torque in (({}, 6 / 10 / 0.5), ({"gear_ratio": 4}, 6 / 4 / 0.5), ({"gear_efficiency": 0.8}, 6 / 10 / 0.8)):
        sizing = ksl.size(table, {"component": [{"joint": "j", "kind": "motor", "rotor_inertia": 0, **own}, *gears]})
        assert next(f for f in sizing.figures if f.figure == "peak torque").value == pytest.approx(torque, rel=1e-12)
        assert not any("without losses" in str(x) for x in sizing.left_out)
        assert any("η = 0.5 (x)" in f.inputs for f in sizing.figures) == ("gear_efficiency" not in own)
    for ratio, said in ((1, False), (3, True)):
        alone = ksl.size(table, {"component": [{"joint": "j", "kind": "motor", "rotor_inertia": 0, "gear_ratio": ratio}]})
        assert any("gear_efficiency is not given" in str(x) for x in alone.left_out) == said
    idle = ksl.size(
        made_table({"a": {"time": [0.0, 1.0], "effort": np.nan}}),
        {"component": [{"joint": "j", "kind": "motor", "gear_ratio": 1}, *gears, {"joint": "j", "kind": "limits", "torque": 1}]},
    )
    assert [str(x) for x in idle.left_out] == [
        f"j: {name}: everything is left out: j has no drive in these results: it follows other joints" for name in ("motor", "x", "y")
    ]


def test_the_example_says_each_default():
    text = example_file()
    for kind in KINDS.values():
        part = text.partition(f'kind = "{kind.name}"')[2].partition("[[component]]")[0]
        for key in [inner for outer in kind.keys for inner in (outer, *outer.keys)]:
            lines = [line for line in part.splitlines() if line.removeprefix("# ").startswith(f"{key.name} = ")]
            shown = key.default is not None and key.shape not in ("vector", "table")
            wanted = f"; {key.default:g} if left out" if isinstance(key.default, float) else f"; {key.default} if left out"
            assert (lines or key.shape == "table") and all(line.endswith(wanted) if shown else not line.endswith("left out") for line in lines), key.name
        positions = re.findall("^position = (\\S+)", part, re.M)
        assert len(set(positions)) == len(positions), "two bearings are not at one place"
