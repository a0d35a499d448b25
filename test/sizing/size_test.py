"""`ksl size` and `ksl.size` as their users see them: the result object, files, printed tables, JSON, exit statuses."""

import csv
import json
import math
import subprocess
import sys
from pathlib import Path

import ksl
import numpy as np
import pyarrow.parquet as pq
import pytest
from growth import work
from ksl.base.errors import SizingError
from ksl.motions.reading import read_motion
from ksl.sizing.catalogue.example import example_file
from results_tables import results_table

ROOT = Path(__file__).resolve().parents[2]
PANDA = ROOT / "examples/components/panda.toml"


@pytest.fixture(scope="module")
def loads(tmp_path_factory, examples):
    """The Panda's pick motion as `ksl loads` writes it, and half as fast."""
    m = ksl.load(examples / "robots/panda.urdf")
    x = read_motion(m, examples / "motions/panda_pick.csv")
    folder = tmp_path_factory.mktemp("loads")
    cases = {"panda_pick": (x.time, x.q, x.v, x.a), "slow": (2 * x.time, x.q, x.v / 2, x.a / 4)}
    pq.write_table(results_table(m, cases), folder / "wrenches.parquet")
    return folder


@pytest.fixture(scope="module")
def sizing(loads):
    return ksl.size(loads, PANDA)


def command(*arguments):
    """The command in this process, which spares the imports; test_results_over_a_closed_pipe runs it as a user does."""
    from ksl.commands import app
    from typer.testing import CliRunner

    return CliRunner().invoke(app, ["size", *map(str, arguments)])


# in Python


def test_figures_are_sorted_and_complete(sizing):
    use = [f.utilisation for f in sizing.figures]
    compared = [u for u in use if u is not None]
    assert compared == sorted(compared, reverse=True) and use[len(compared) :] == [None] * (len(use) - len(compared))
    assert sizing.worst is sizing.figures[0] and sorted(map(id, sizing.in_order)) == sorted(map(id, sizing.figures))
    for f in sizing.figures:
        assert f.formula and f.source and f.joint and f.component, f
        assert f.inputs or f.figure == "speed", f
        assert f.case in ("panda_pick", "slow", ""), f
    fast = next(f for f in sizing.figures if (f.joint, f.figure) == ("panda_joint2", "peak speed"))
    assert fast.case == "panda_pick"


def test_peaks_are_those_of_the_loads(sizing, loads):
    """The torque of the gear, the limits and the simultaneous set are one number, that of the table."""
    table = pq.read_table(loads / "wrenches.parquet")
    efforts = np.array([e for e, j in zip(table["effort"].to_pylist(), table["joint"].to_pylist(), strict=True) if j == "panda_joint2"])
    peak = next(f for f in sizing.figures if (f.joint, f.figure) == ("panda_joint2", "repeated peak torque"))
    rows = {row["extreme"]: row for row in sizing.peaks if row["joint"] == "panda_joint2"}
    assert peak.value == np.abs(efforts).max() == max(rows["effort max"]["effort"], -rows["effort min"]["effort"])


def test_the_table_says_units_and_conventions(sizing):
    table = sizing.table
    assert table.num_rows == len(sizing.figures)
    columns = "joint component kind figure value unit limit utilisation formula inputs source case time note bound"
    assert table.column_names == columns.split()
    said = json.loads(table.schema.metadata[b"ksl"])
    assert said["robot"] == "panda" and said["version"] == ksl.__version__ and said["cases"] == {"panda_pick": 1.0, "slow": 1.0}
    assert [len(i["sha256"]) for i in said["inputs"]] == [64, 64] and "1 is at the limit" in said["utilisation"]


def test_repr_and_verdict(sizing):
    assert repr(sizing).startswith("Sizing of panda: all ") and sizing.worst.figure in repr(sizing) and len(repr(sizing).splitlines()) < 20
    results = Path(sizing.provenance["inputs"][0]["file"])
    tight = ksl.size(results, {"component": [{"joint": "panda_joint2", "kind": "limits", "torque": 1.0}]})
    assert "1 of 1 figures is over its limit" in tight.verdict and len(tight.exceeded) == 1
    nothing = ksl.size(results)
    assert nothing.worst is None and nothing.verdict == "panda: no components" and nothing.peaks


def test_a_notebook_shows_a_table(sizing):
    from xml.etree import ElementTree

    page = ElementTree.fromstring(f"<div>{sizing._repr_html_()}</div>")
    assert len(page.findall(".//tbody/tr")) == sum(f.utilisation is not None for f in sizing.figures)
    assert "ISO 281" in "".join(row.get("title") for row in page.findall(".//tbody/tr"))


def test_clouds_are_all_samples(sizing):
    cloud = next(c for c in sizing.clouds if c.joint == "panda_joint2")
    f = next(f for f in sizing.figures if (f.joint, f.figure) == ("panda_joint2", "peak torque"))
    assert len(cloud.rpm) == len(cloud.torque) == 2 * 1021 and np.abs(cloud.torque).max() == f.value and cloud.curve[0] == [0, 1.7]


def test_only_some_joints(loads):
    sizing = ksl.size(loads, PANDA, joints=["panda_joint3"])
    assert {f.joint for f in sizing.figures} == {"panda_joint3"} == {row["joint"] for row in sizing.peaks}


def test_files_and_another_robot(sizing, tmp_path, loads):
    assert set(sizing.write(tmp_path)) == {p.name for p in tmp_path.iterdir()}
    table = pq.read_table(tmp_path / "sizing.parquet")
    assert table.equals(sizing.table) and pq.read_table(tmp_path / "peaks.parquet").equals(sizing.peak_table)
    lines = (tmp_path / "sizing.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("# ksl ") and any("SHA-256" in line for line in lines[:4])
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert [float(r["value"]) for r in rows] == [f.value for f in sizing.figures]
    said = json.loads((tmp_path / "sizing.json").read_text(encoding="utf-8"))
    assert said["verdict"] == sizing.verdict and len(said["figures"]) == len(sizing.figures)
    (tmp_path / "sizing.json").write_text('{"robot": "ur5", "figures": []}')
    with pytest.raises(SizingError, match="holds the sizing of ur5, and this is panda; .*--force"):
        sizing.write(tmp_path)
    sizing.write(tmp_path, force=True)
    assert json.loads((tmp_path / "sizing.json").read_text(encoding="utf-8"))["robot"] == "panda"


def test_a_workbook_has_both_tables_with_their_units(sizing, tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    assert "sizing.xlsx" in sizing.write(tmp_path, xlsx=True)
    book = openpyxl.load_workbook(tmp_path / "sizing.xlsx")
    for name, table in (("Sizing", sizing.table), ("Peaks", sizing.peak_table)):
        units = dict(zip(*([c.value for c in row] for row in book[name].iter_rows(max_row=2)), strict=True))
        assert list(units) == table.column_names and units["time"] == "s" and not units["joint"]
    assert units["bending_moment"] == "N m" and book["Peaks"].max_row == 2 + len(sizing.peaks)
    assert book["About"]["A1"].value == "made by" and "robot panda" in book["About"]["B1"].value


def test_infinite_numbers_are_words_in_json(robot):
    m = robot(
        '<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>'
    )
    t = np.linspace(0, 1, 11)
    table = results_table(m, {"spin": (t, 10 * t[:, None], np.full((11, 1), 10.0), np.zeros((11, 1)))})
    gear = {"joint": "j", "kind": "strain wave gear", "ratio": 50, "rated_torque": 10, "required_life_h": 1000}
    sizing = ksl.size(table, {"component": [gear]})
    life = next(f for f in sizing.figures if f.figure == "wave generator L10h")
    assert math.isinf(life.value) and life.utilisation == 0
    assert json.loads(json.dumps(sizing.as_dict(), allow_nan=False))["figures"]


def test_samples_are_no_work_in_python(examples):
    """NumPy takes them all at once: four times as many are the same lines and calls.  bench/growth.py has the time."""
    m = ksl.load(examples / "robots/panda.urdf")
    x = read_motion(m, examples / "motions/panda_pick.csv")

    def size(samples: int) -> int:
        t = np.linspace(x.time[0], x.time[-1], samples)
        q, v, a = (np.column_stack([np.interp(t, x.time, column) for column in y.T]) for y in (x.q, x.v, x.a))
        table = results_table(m, {"finer": (t, q, v, a)})
        return work(lambda: ksl.size(table, PANDA))

    _, few, many = map(size, (500, 1000, 4000))  # the first run imports
    assert many < 1.1 * few


# on the command line


def test_printed_sheets(loads, tmp_path):
    done = command(loads, PANDA, "-o", tmp_path / "out", "--peaks")
    assert done.exit_code == 0 and not done.stderr
    lines = done.stdout.splitlines()
    assert max(map(len, lines[:-1])) <= 80, max(lines, key=len)
    for words in (
        "panda_joint2", "gear 25-100 (strain wave gear)", "Formulas and sources", "ISO 281:2007", "indication only", "Utilisation, worst first",
        "what acts together at each peak", "written to",
    ):  # fmt: skip
        assert words in done.stdout
    assert lines[-3].startswith("panda: all") or lines[-2].startswith("panda: all")
    assert (tmp_path / "out" / "sizing.parquet").exists()


def test_brief_and_without_components(loads):
    brief = command(loads, PANDA, "--brief").stdout
    assert "Formulas" not in brief and brief.count("\n") < 140 and "rms torque" in brief
    peaks = command(loads, "--joints", "panda_joint2,base", "--at", "panda_joint2=0,0,0.1").stdout
    assert "about (0, 0, 0.1) m" in peaks and "base: what acts together" in peaks and "panda_joint3" not in peaks
    assert max(map(len, peaks.splitlines())) <= 80


def test_json_on_standard_output(loads):
    said = json.loads(command(loads, PANDA, "--json").stdout)
    assert said["worst"]["utilisation"] == max(f["utilisation"] for f in said["figures"] if f["utilisation"] is not None)


def test_exit_statuses(loads, tmp_path):
    tight = tmp_path / "tight.toml"
    tight.write_text('[[component]]\njoint = "panda_joint2"\nkind = "limits"\ntorque = 1\nbending_moment = -3\n')
    assert command(loads, tight).exit_code == 0
    failed = command(loads, tight, "--fail-on", "utilisation", "-o", tmp_path / "out")
    assert failed.exit_code == 3 and (tmp_path / "out/sizing.json").exists()  # written all the same
    assert command(loads, PANDA, "--fail-on", "utilisation").exit_code == 0
    assert command(loads, tight, "--fail-on", "left-out").exit_code == 3


@pytest.mark.parametrize(
    "arguments, words",
    [
        ([], "size needs the results of `ksl loads`, or --example"),
        (["LOADS", PANDA, "--fail-on", "limits"], "--fail-on limits: expected utilisation or left-out"),
        (["LOADS", PANDA, "--joints", "panda_joint9"], "--joints: no joint named 'panda_joint9'; did you mean"),
        (["LOADS", "--at", "panda_joint2"], "--at panda_joint2: expected JOINT=X,Y,Z"),
        (["LOADS", "--at", "panda_joint2=1,2"], "expected 3 finite numbers"),
        (["LOADS", "--at", "panda_joint9=1,2,3"], "--at: no joint named 'panda_joint9'"),
        (["nowhere"], "nowhere: no such file; give the folder"),
        ([PANDA, "LOADS"], "is no Parquet file that can be read (the results come first, then the components)"),
        (["LOADS", "nothing.toml"], "nothing.toml: can't be read"),
    ],
)
def test_bad_arguments(loads, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    done = command(*(loads if a == "LOADS" else a for a in arguments))
    assert done.exit_code == 2 and not done.stdout and done.stderr.startswith("ksl: ") and words in done.stderr, done
    assert done.stderr.count("\n") == 1


def test_files_of_components_as_people_write_them(loads, tmp_path):
    """A byte-order mark and line ends of Windows; the kind as the table's name; the folder of a sweep."""
    windows = tmp_path / "windows.toml"
    windows.write_bytes(b'\xef\xbb\xbf[[component]]\r\njoint = "panda_joint2"\r\nkind = "limits"\r\ntorque = 100\r\n')
    assert command(loads, windows).exit_code == 0
    wrong = tmp_path / "wrong.toml"
    wrong.write_text('[[motor]]\njoint = "panda_joint2"\n')
    assert 'wrong.toml: components are tables [[component]] with kind = "motor", not [[motor]]' in command(loads, wrong).stderr
    (tmp_path / "sweep").mkdir()
    (tmp_path / "sweep" / "sweep.json").write_text("{}")
    assert "this sweep has no wrenches; run it with --wrenches" in command(tmp_path / "sweep", windows).stderr


def test_a_missing_package_is_named(loads, monkeypatch):
    monkeypatch.setitem(sys.modules, "rainflow", None)
    done = command(loads, PANDA)
    assert done.exit_code == 2 and "needs the package rainflow; install it with: pip install 'ksl[size]'" in done.stderr


def test_the_example_is_printed_and_fits_the_results(loads, tmp_path):
    done = command("--example")
    assert done.exit_code == 0 and done.stdout == example_file()
    own = tmp_path / "components.toml"
    own.write_text(command(loads, "--example").stdout, encoding="utf-8")
    done = command(loads, own)
    assert done.exit_code == 0 and "panda_joint1" in done.stdout and "Left out" not in done.stdout


def test_results_over_a_closed_pipe(loads):
    run = subprocess.Popen([sys.executable, "-m", "ksl", "size", str(loads), str(PANDA)], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    run.stdout.close()
    assert run.wait() == 1 and run.stderr.read() == b""
    run.stderr.close()


def test_why_loads_are_doubted_is_said(tmp_path):
    """As `ksl loads` says it, by case: of a joint that lies on its stop, whose effort is no motor's, and of a payload in grams."""
    b = ksl.Builder("arm").add_link("base").add_link("arm", mass=2.0, center_of_mass=(0.5, 0, 0), inertia=np.eye(3))
    m = b.add_joint("pin", "revolute", "base", "arm", axis=(0, 1, 0), limits=(-1.0, 0.5), effort=100.0, velocity=9.0).build()
    case = "[cases.{}]\nsimulate = {{ until = 1.0, restitution = 0.0 }}\n"
    file = tmp_path / "cases.toml"
    file.write_text(case.format("falls") + case.format("grams") + 'payloads = [{ link = "arm", mass = 2000.0 }]')
    run = ksl.compute_loads(m, cases=file)
    notes = ksl.size(run, {"component": [{"kind": "motor", "joint": "pin", "gear_ratio": 10, "rotor_inertia": 1e-5, "rated_torque": 0.5}]}).notes
    assert set(notes) == set(run.verdict.reasons) and sum("drive and stop" in note for note in notes) and sum("grams" in note for note in notes)
