"""Catalogues as TOML, CSV and workbooks, the sample catalogue, `ksl size --choose`, and what is said of wrong ones."""

import csv
import json
import re
from pathlib import Path

import ksl
import pytest
from ksl.base.errors import SizingError
from ksl.sizing.bearing_ratings import F_C, deep_groove_ratings
from ksl.sizing.choice.offers import _joined, catalogue_given

ROOT = Path(__file__).resolve().parents[2]
SAMPLE, ASKED = ROOT / "examples/components/catalogue.csv", ROOT / "examples/components/panda_choice.toml"
MOTOR = {"kind": "motor", "name": "a", "mass": 1.0, "rotor_inertia": 1e-5, "rated_torque": 9.0}


@pytest.fixture(scope="module")
def loads(tmp_path_factory, examples):
    folder = tmp_path_factory.mktemp("loads")
    ksl.compute_loads(examples / "robots/panda.urdf", examples / "motions/panda_pick.csv").write(folder)
    return folder


def command(*arguments):
    from ksl.commands import app
    from typer.testing import CliRunner

    return CliRunner().invoke(app, ["size", *map(str, arguments)])


@pytest.mark.parametrize(
    ("name", "balls", "ball", "pitch", "C", "C0"),
    [
        ("6204", 8, 7.938, 33.5, 12.8e3, 6.65e3),
        ("6205", 9, 7.938, 39.04, 14.0e3, 7.85e3),
        ("6206", 9, 9.525, 46, 19.5e3, 11.2e3),
        ("6208", 9, 11.906, 60, 29.1e3, 17.9e3),
    ],
)
def test_ratings_of_bearings_that_are_sold(name, balls, ball, pitch, C, C0):
    """As catalogues print them, for the balls that are in them."""
    found = deep_groove_ratings(balls, ball / 1e3, pitch / 1e3)
    assert found.C == pytest.approx(C, rel=0.01) and found.C0 == pytest.approx(C0, rel=0.015)


def test_the_factor_of_the_standard_is_that_of_the_contact():
    """ISO/TR 1281-1: f_c from the curvature of balls and grooves; its constant is that of the table, and what depends on Dw/Dpw is compared."""
    contact = lambda g: (1 + (1.04 * ((1 - g) / (1 + g)) ** 1.72) ** (10 / 3)) ** -0.3 * g**0.3 * (1 - g) ** 1.39 / (1 + g) ** (1 / 3)
    assert {g: f / contact(g) for g, f in F_C.items()} == pytest.approx(dict.fromkeys(F_C, F_C[0.16] / contact(0.16)), rel=0.004)
    with pytest.raises(ValueError, match="0.05 to 0.3 of the pitch diameter"):
        deep_groove_ratings(9, 0.02, 0.04)


def test_the_sample_catalogue_follows_from_dimensions():
    with open(SAMPLE, newline="", encoding="utf-8") as f:
        rows = [row for row in csv.DictReader(line for line in f if not line.startswith("#")) if row["kind"] == "bearing pair"]
    assert len(rows) == 5
    for row in rows:
        balls, ball, pitch = map(float, re.split(r" x | on ", row["size"]))
        found = deep_groove_ratings(int(balls), ball / 1e3, pitch / 1e3)
        for which in ("locating", "floating"):
            assert [float(row[f"{which}.{key}"]) for key in ("C", "C0")] == pytest.approx(found[:2], abs=5.001)
            assert float(row[f"{which}.f0"]) == pytest.approx(found.f0, abs=0.051)


def test_one_catalogue_in_three_formats(tmp_path):
    """The same entries, with a list in a cell and keys of inner tables."""
    (tmp_path / "c.toml").write_text(
        '[[component]]\nkind = "motor"\nname = "a"\nmass = 1.5\nprice = 9\nrated_torque = 2\ntorque_speed = [[0, 3], [10, 1]]\n'
        '[[component]]\nkind = "bearing pair"\nname = "7"\nsize = "17"\nmass = 1\n[component.locating]\nC = 5\n'
    )
    rows = [
        ["kind", "name", "size", "mass", "price", "rated_torque", "torque_speed", "locating.C"],
        ["motor", "a", "", "1.5", "9", "2", "[[0, 3], [10, 1]]", ""],
        ["bearing pair", "7", "17", "1", "", "", "", "5"],
    ]
    with open(tmp_path / "c.csv", "w", newline="", encoding="utf-8") as f:
        csv.writer(f).writerows([["# ours"], *rows])
    found = [[(o.kind.name, o.name, o.size, o.mass, o.price, o.values) for o in catalogue_given(tmp_path / name).offers] for name in ("c.toml", "c.csv")]
    assert found[0] == found[1] and found[0][0][-1]["torque_speed"] == [[0, 3], [10, 1]]
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append([float(x) if re.fullmatch(r"[\d.]+", x) and k > 2 else x or None for k, x in enumerate(row)])
    book.save(tmp_path / "c.xlsx")
    assert [(o.kind.name, o.name, o.size, o.mass, o.price, o.values) for o in catalogue_given(tmp_path / "c.xlsx").offers] == found[0]


def test_the_command(loads, tmp_path):
    done = command(loads, ASKED, "--choose", SAMPLE, "--brief", "-o", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert (
        re.search(r"panda_joint2\s+motor\s+K85 ", done.output)
        and "K70: rms torque 0.835" in done.output
        and "no combination with less holds" in done.output.replace("\n  ", " ")
    )
    said = json.loads((tmp_path / "out/sizing.json").read_text(encoding="utf-8"))
    assert [c["name"] for c in said["choice"]["choices"]] == ["W20-100", "K85", "W17-100", "K60", "2 x T40"] and said["choice"]["settled"]
    with open(tmp_path / "out/choices.csv", encoding="utf-8", newline="") as f:
        rows = list(csv.DictReader(line for line in f if not line.startswith("#")))
    assert [(row["name"], float(row["utilisation"])) for row in rows] == [(c["name"], c["utilisation"]) for c in said["choice"]["choices"]]
    assert rows[1]["next_smaller_fails"] == "K70: rms torque 0.835" and rows[1]["holds"] == "K85, E85, K85 long, K115" and rows[4]["price"] == "38"
    assert {file["role"] for file in said["inputs"]} == {"results", "components", "catalogue"}
    run = ksl.compute_loads(ROOT / "examples/robots/panda.urdf", ROOT / "examples/motions/panda_pick.csv")
    of_run = ksl.size(run, ASKED, choose=SAMPLE)
    assert [c["utilisation"] for c in said["choice"]["choices"]] == pytest.approx([c.utilisation for c in of_run.choices], rel=1e-12)
    assert "2 of [[choose]] are not answered" not in done.output and "5 of [[choose]] are not answered" in command(loads, ASKED).output.replace("\n  ", " ")


def test_results_that_the_masses_cannot_go_back_into(tmp_path, examples):
    robot, asked = tmp_path / "robot.urdf", {"choose": [{"joint": "panda_joint2", "kind": "motor", "gear_ratio": 100, "link": "panda_link1"}]}
    robot.write_bytes((examples / "robots/panda.urdf").read_bytes())
    run = ksl.compute_loads(robot, examples / "motions/panda_pick.csv", joints=["panda_joint2"])
    run.write(tmp_path / "some")
    with pytest.raises(SizingError, match="these results lack joints: panda_joint1, .*; run `ksl loads` without --joints"):
        ksl.size(tmp_path / "some", asked, choose={"component": [MOTOR]})
    robot.write_text(robot.read_text() + "\n")
    with pytest.raises(SizingError, match="robot.urdf has changed since these results were made; run `ksl loads` again"):
        ksl.size(tmp_path / "some", asked, choose={"component": [MOTOR]})
    with pytest.raises(SizingError, match="these results name no robot file; give ksl.size what ksl.compute_loads returns"):
        m = ksl.load(examples / "robots/panda.urdf")
        x = ksl.read_motion(m, examples / "motions/panda_pick.csv")
        ksl.size(m.wrench_table(x.time, x.q, x.v, x.a), asked, choose={"component": [MOTOR]})


ENTRY = 'kind = "motor"\nname = "a"\nmass = 1\n'
WRONG_CATALOGUES = [
    ("", "holds no components; give a catalogue"),
    ("[[component]]\n" + ENTRY + "rated_torqe = 1\n", r"c.toml:5: no motor key named 'rated_torqe'; did you mean 'rated_torque'"),
    ("[[component]]\n" + ENTRY + "rated_torque = -1\n", r"c.toml:5: rated_torque = -1 must be positive"),
    ('[[component]]\nkind = "motor"\nname = "a"\n', r"c.toml:1: a has no mass, kg"),
    ('[[component]]\nkind = "motor"\nmass = 1\n', r"c.toml:1: an entry of a catalogue needs a name"),
    ("component = 3\n", "holds no components; give a catalogue"),
    ("component = []\n", "holds no components; give a catalogue"),
    ('[[component]]\nkind = "motor"\nmass = 1\nname = ""\n', r"c.toml:4: an entry of a catalogue needs a name"),
    ('[[component]]\nkind = "motor"\nmass = 1\nname = 3\n', r"c.toml:4: an entry of a catalogue needs a name"),
    ('[[component]]\nkind = "fatigue"\nname = "a"\n', r"c.toml:2: no kind in a catalogue named 'fatigue'"),
    ("[[component]]\n" + ENTRY + "[[component]]\n" + ENTRY, r"c.toml:7: a second motor named 'a'"),
    ("[[component]]\n" + ENTRY + "price = 1\ngear_ratio = 3\n", r"c.toml:1: a: gear_ratio is a number of the catalogue, and .* gives it, too"),
    ("[[component]]\n" + ENTRY, r"a has no price, and .*:2 chooses by = \"price\""),
    ('[[component]]\nkind = "limits"\nname = "a"\nmass = 1\n', r"c.toml: has no motor, which .*:2 asks for; it has: limits"),
]


@pytest.mark.parametrize(("text", "sentence"), WRONG_CATALOGUES)
def test_wrong_catalogues(loads, tmp_path, text, sentence):
    (tmp_path / "c.toml").write_text(text)
    (tmp_path / "asked.toml").write_text('[[choose]]\njoint = "panda_joint2"\nkind = "motor"\ngear_ratio = 100\nby = "price"\n')
    with pytest.raises(SizingError, match=sentence):
        ksl.size(loads, tmp_path / "asked.toml", choose=tmp_path / "c.toml")


def test_tables_inside_of_a_request_are_joined_with_those_of_an_entry():
    assert _joined({"a": {"x": 1}, "b": 2}, {"a": {"y": 3}, "c": {"z": 4}}, "o", "r") == {"a": {"x": 1, "y": 3}, "b": 2, "c": {"z": 4}}
    for offered, asked, key in (({"a": 1}, {"a": {"y": 3}}, "a"), ({"a": {"y": 1}}, {"a": 3}, "a"), ({"a": {"y": 1}}, {"a": {"y": 3}}, "y")):
        with pytest.raises(SizingError, match=f"^o: {key} is a number of the catalogue, and r gives it, too"):
            _joined(offered, asked, "o", "r")


ROWS = [
    ("kind,name,mass,mass\nmotor,a,1,1\n", r"c.csv:1: two columns are named 'mass'"),
    ("kind,name,mass\n\nmotor,a,1,5\nmotor,b,2\n", None),
    ("kind,name,mass,\nmotor,a,1,5\n", r"c.csv:2: '5' is in a column without a name"),
    ("kind,name,mass\nmotor,a,heavy\n", r"c.csv:2: mass = 'heavy': expected a number, kg"),
    ("kind,name,mass,torque_speed\nmotor,a,1,[[0\n", r"c.csv:2: torque_speed: is not TOML"),
    ("kind,name,mass,locating,locating.C\nbearing pair,a,1,3,5\n", r"c.csv:2: the columns locating and locating.C exclude each other"),
    ("kind,name,mass\n", "holds no components"),
]


@pytest.mark.parametrize(("text", "sentence"), ROWS)
def test_wrong_rows(tmp_path, text, sentence):
    (tmp_path / "c.csv").write_text(text)
    if sentence is None:
        assert [o.name for o in catalogue_given(tmp_path / "c.csv").offers] == ["a", "b"], "cells beyond the last column and empty rows are no entries"
        return
    with pytest.raises(SizingError, match=sentence):
        catalogue_given(tmp_path / "c.csv")
    (tmp_path / "c.xlsx").write_bytes(b"PK no workbook")
    with pytest.raises(SizingError, match=r"c.xlsx: is no workbook that can be read"):
        catalogue_given(tmp_path / "c.xlsx")


WRONG_REQUESTS = [
    ('kind = "motor"', r":1: a choice is for one joint"),
    ('joint = "panda_joint2"', r":1: choose without kind; known: motor, "),
    ('joint = "panda_joint2"\nkind = "fatigue"', r":3: no kind of component to choose named 'fatigue'"),
    ('joint = "panda_joint2"\nkind = "motor"\nmargn = 2', r":4: no motor key named 'margn'; did you mean 'margin'"),
    ('joint = "panda_joint2"\nkind = "motor"\nmargin = 0', r":4: margin = 0 must be positive"),
    ('joint = "panda_joint2"\nkind = "motor"\nby = "size"', r":4: by = 'size': expected \"mass\" or \"price\""),
    ('joint = "panda_joint2"\nkind = "motor"\nat = [0, 0, 1]', r":4: at is a point of a link; name the link"),
    ('joint = "panda_joint2"\nkind = "motor"\nlink = "panda_link1"\nat = [0, 0, 100]', r":5: at = \[0, 0, 100\]: lengths are in metres; 100 mm are 0.1"),
    ('joint = "panda_joint2"\nkind = "motor"\nlink = "panda_lnk1"', r"no link named 'panda_lnk1'; did you mean 'panda_link1'"),
    ('joint = "base"\nkind = "motor"', r":2: a motor sits on a joint that has one coordinate, and base is fixed"),
    ('joint = "panda_joint2"\nkind = "motor"\n[[choose]]\njoint = "panda_joint2"\nkind = "motor"', r":5: a second motor is to be chosen for panda_joint2"),
    (
        'joint = "panda_joint2"\nkind = "motor"',
        r"none of them has a figure that could be compared; of a: .*; gear_ratio is not given, and no gear on this joint has a ratio",
    ),
    (
        'joint = "panda_joint2"\nkind = "motor"\ngear_ratio = 100',
        r"no motor of c.csv holds: none of them has a figure that could be compared; of a: .*; rated_torque is not given; peak_torque is not given",
    ),
]


@pytest.mark.parametrize(("text", "sentence"), WRONG_REQUESTS)
def test_wrong_requests(loads, tmp_path, monkeypatch, text, sentence):
    monkeypatch.chdir(tmp_path)
    Path("c.csv").write_text("kind,name,mass,rotor_inertia\nmotor,a,1,0\n")
    Path("asked.toml").write_text(f"[[choose]]\n{text}\n")
    with pytest.raises(SizingError, match=sentence):
        ksl.size(loads, "asked.toml", choose="c.csv")


def test_nothing_to_choose(loads, tmp_path):
    with pytest.raises(SizingError, match=r"components: nothing is to be chosen from .*; write a table \[\[choose\]\]"):
        ksl.size(loads, choose=SAMPLE)
    assert "needs COMPONENTS.toml with tables [[choose]]" in command(loads, "--choose", SAMPLE).output.replace("\n  ", " ")
    assert "No such file" in command(loads, ASKED, "--choose", tmp_path / "none.csv").output.replace("\n  ", " ")
