"""A run as one object, points of single joints, chosen joints, results of another robot, tables of the terminal."""

import json
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

import ksl
from ksl.load_cases.load_case import LoadCase, Payload
from ksl.load_cases.computed_cases import KEPT_CASES
from ksl.load_cases.summary_table import ALL_CASES
from ksl.motions.motion import Motion
from ksl.output import OutputError
from ksl_command import run_ksl

MASS, LENGTH, G = 2.0, 0.5, 9.81

FLANGE = f"""<robot name="{{name}}"><link name="wall"/>
<link name="rod"/><link name="tool"><inertial><origin xyz="0.3 0 0.04"/><mass value="{MASS}"/>
<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="pin" type="revolute"><parent link="wall"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="3" effort="18" velocity="4"/></joint>
<joint name="flange" type="fixed"><parent link="rod"/><child link="tool"/><origin xyz="0.2 0 0"/></joint></robot>"""


def run(*arguments):
    return run_ksl(*arguments)


@pytest.fixture
def flange(robot):
    return robot(FLANGE.format(name="arm"))


def held(m: ksl.Model, samples: int = 3) -> list[np.ndarray]:
    zero = np.zeros((samples, m.nv))
    return [np.arange(samples) / 10, zero, zero, zero]


def test_a_flange_with_an_offset_mass_held_level(flange):
    """The flange carries m g upwards, and m g times the offset about its y axis: 0.3 m; the pin 0.5 m."""
    run = ksl.compute_loads(flange, held(flange))
    first = {row["joint"]: row for row in run.wrenches.to_pylist()[:3]}
    weight = MASS * G
    assert [first["flange"][c] for c in ("fx", "fy", "fz", "tx", "ty", "tz")] == pytest.approx([0, 0, weight, 0, -0.3 * weight, 0], abs=1e-12)
    assert first["pin"]["effort"] == pytest.approx(-0.5 * weight, rel=1e-12)
    assert run.verdict.level == "green" and run.verdict.worst.share == pytest.approx(0.5 * weight / 18)


def test_the_run_is_what_the_command_writes(examples, tmp_path):
    """Summary, wrenches and report: the same numbers."""
    given = examples / "robots/ur5.urdf", examples / "motions/ur5_pick.csv"
    assert run("loads", *given, "-o", tmp_path / "command").returncode == 0
    r = ksl.compute_loads(*given)
    files = r.write(tmp_path / "program", csv=True)
    assert files == ["report.html", "summary.csv", "wrenches.csv", "wrenches.parquet"]
    written = pq.read_table(tmp_path / "command/wrenches.parquet")
    assert r.wrenches.equals(written) and pq.read_table(tmp_path / "program/wrenches.parquet").equals(written)
    summaries = [(tmp_path / name / "summary.csv").read_text(encoding="utf-8") for name in ("command", "program")]
    rows = [[line for line in text.splitlines() if not line.startswith("#")] for text in summaries]
    assert rows[0] == rows[1] and len(rows[0]) == 1 + r.summary.num_rows
    peak = dict(zip(r.summary["joint"].to_pylist(), r.summary["effort_peak"].to_pylist()))
    of_elbow = written.filter(pc.equal(written["joint"], "elbow"))
    assert peak["elbow"] == np.abs(of_elbow["effort"].to_numpy()).max()
    said = json.loads(r.summary.schema.metadata[b"ksl"])
    assert said["robot"] == "ur5" and "N m" in said["units"] and [f["role"] for f in said["inputs"]] == ["robot", "motion"]
    r.report(tmp_path / "page.html")
    assert "Joint loads of ur5" in (tmp_path / "page.html").read_text(encoding="utf-8")
    assert repr(r).startswith("<ksl run of ur5: load case ur5_pick, green: ") and "shoulder_pan" in r._repr_html_()


def several(m: ksl.Model, count: int) -> list[LoadCase]:
    """Cases whose efforts grow with their number: the mass is accelerated."""
    t, zero = np.arange(8) / 10, np.zeros((8, 1))
    return [LoadCase(m, Motion(t, zero, zero, zero - k), name=f"case {k}", motion_file=f"{k}.csv") for k in range(count)]


def test_what_files_and_calls_give_a_run(flange, tmp_path):
    """A payload in a file of load cases; wrenches in a table; a point for all joints but one; a model that carries its payload already."""
    (tmp_path / "push.csv").write_text("time,tool.fz\n" + "".join(f"{k / 10},5\n" for k in range(3)))
    (tmp_path / "held.toml").write_text("[cases.a]\nhold = { pose = { pin = 0 } }\n")
    force = lambda run: {row["joint"]: row["fz"] for row in run.wrenches.to_pylist()}["flange"]
    payload = {"tool": (1.0, (0, 0, 0))}
    assert force(ksl.compute_loads(flange, cases=tmp_path / "held.toml", payloads=payload)) == pytest.approx((MASS + 1) * G, rel=1e-12)
    assert force(ksl.compute_loads(flange, held(flange), external=tmp_path / "push.csv")) == pytest.approx(MASS * G - 5, rel=1e-12)
    carried = [Payload("tool", 1.0, (0, 0, 0))]
    recorded = ksl.compute_loads(flange.with_payload("tool", 1.0), held(flange), payloads=carried)
    assert force(recorded) == pytest.approx((MASS + 1) * G, rel=1e-12) and recorded.provenance.cases[0]["payloads"][0]["mass"] == 1
    mixed, world, own = (
        ksl.compute_loads(flange, held(flange), at=at).wrenches.to_pylist() for at in ({None: "world", "flange": (0, 0, 1)}, "world", {"flange": (0, 0, 1)})
    )
    assert [row["ty"] for row in mixed[:3]] == [(own if row["joint"] == "flange" else world)[i]["ty"] for i, row in enumerate(mixed[:3])]
    for given, said in (({"external": {"tool": np.zeros(6)}}, "external = "), ({"payloads": payload}, "each load case has the model")):
        with pytest.raises(ksl.MotionError, match=said):
            ksl.compute_loads(flange, cases=several(flange, 1), **given)


def test_results_may_wait_until_they_are_asked_for(flange):
    motion = [*held(flange)[:3], np.full((3, 1), 1e308)]  # m r² times this overflows
    with pytest.raises(ksl.MotionError, match="is not finite"):
        ksl.compute_loads(flange, motion)
    run = ksl.compute_loads(flange, motion, when="asked")
    with pytest.raises(ksl.MotionError, match="is not finite"):
        run.compute()


def test_several_cases_are_one_data_set_with_the_worst_below(flange, tmp_path):
    r = ksl.compute_loads(flange, cases=several(flange, 3))
    files = r.write(tmp_path / "out")
    assert files == ["report.html", "summary.csv", "wrenches.parquet"]
    table = pq.read_table(tmp_path / "out/wrenches.parquet")
    assert table["case"].unique().to_pylist() == ["case 0", "case 1", "case 2"] and table.num_rows == 3 * 8 * 3
    worst = {row["joint"]: row for row in r.summary.to_pylist() if row["case"] == ALL_CASES}
    assert worst["pin"]["effort_peak"] == pytest.approx(MASS * (0.5 * G + (0.5**2 + 0.04**2) * 2), rel=1e-12)  # m (g x + r² q̈)
    assert worst["pin"]["effort_peak_case"] == "case 2" and worst["pin"]["position_lowest_case"] == "case 0"
    assert r.governing.case.name == "case 2" and r.verdict.headline.endswith("case case 2")
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert all(f"case {k}" in page for k in range(3))


def test_of_many_cases_the_report_has_the_worst(flange, tmp_path):
    r = ksl.compute_loads(flange, cases=several(flange, KEPT_CASES + 2))
    assert [result.loads is not None for result in r.results] == [False] * 2 + [True] * KEPT_CASES
    assert [result.case.name for result in r._shown()] == [f"case {k}" for k in range(KEPT_CASES + 1, 1, -1)], "worst first"
    r.report(tmp_path / "other.html", "case 1")
    assert "1.csv" in (tmp_path / "other.html").read_text(encoding="utf-8")
    with pytest.raises(ValueError, match="no load case named 'case 33'; did you mean"):
        r.report(tmp_path / "none.html", "case 33")


def test_a_case_that_governs_wrenches_has_curves_though_no_limit_is_near(flange, tmp_path):
    """The first case turns the arm sideways: force along the pin's axis, and no effort.  Its curves are dropped at first, and computed again."""
    sideways = replace(several(flange, 1)[0], name="sideways", model=flange.with_gravity([0, 100, 0]))
    r = ksl.compute_loads(flange, cases=[sideways, *several(flange, KEPT_CASES + 2)])
    assert [result.case.name for result in r._shown()][:2] == [f"case {KEPT_CASES + 1}", "sideways"]
    r.write(tmp_path / "out")
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert "case 0</a>" not in page and "sideways</a>" in page


@pytest.mark.parametrize("options", [{}, {"axes": "world", "order": "ang_lin"}, {"on": "parent"}], ids=str)
def test_points_of_single_joints(flange, options):
    common, own = (ksl.compute_loads(flange, held(flange), at=at, **options).wrenches for at in ((0.1, 0, 0.2), {"flange": (0.1, 0, 0.2)}))
    plain = ksl.compute_loads(flange, held(flange), **options).wrenches
    for name, expected, at in (("flange", common, "joint + 0.1 0 0.2"), ("pin", plain, "joint")):
        rows = [table.filter(pc.equal(table["joint"], name)).drop_columns(["at"]) for table in (own, expected)]
        assert rows[0].equals(rows[1]), name
        assert set(own.filter(pc.equal(own["joint"], name))["at"].to_pylist()) == {at}
    assert not own.equals(plain)


def test_chosen_joints(flange, tmp_path):
    (tmp_path / "m.csv").write_text("time,pin\n" + "".join(f"{k / 10},0\n" for k in range(8)))
    p = run("loads", tmp_path / "robot.urdf", tmp_path / "m.csv", "-o", tmp_path / "o", "--joints", "flange, base", "--at", "flange=0,0,0.1", "--at", "world")
    assert p.returncode == 0, p.stderr
    table = pq.read_table(tmp_path / "o/wrenches.parquet")
    assert table["joint"].unique().to_pylist() == ["flange", "base"] and table["at"].unique().to_pylist() == ["joint + 0 0 0.1", "world"]
    rows = [line.split(",")[1] for line in (tmp_path / "o/summary.csv").read_text().splitlines() if not line.startswith("#")]
    assert rows == ["joint", "flange", "base"]
    assert p.stdout.splitlines()[-1].startswith("verdict: GREEN: pin "), "the verdict is on all joints"


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--at", "flnage=0,0,0"], "--at flnage=0,0,0: no joint 'flnage'; did you mean flange?"),
        (["--at", "flange=0,0"], "--at flange=0,0: expected 3 finite numbers"),
        (["--at", "joint", "--at", "world"], "--at world: the second point for all joints; give JOINT=X,Y,Z for single joints"),
        (["--joints", "pin,x"], "--joints pin,x: no joint 'x'; the joints of arm are pin, flange, base"),
    ],
)
def test_unknown_joints_and_points(flange, tmp_path, options, sentence):
    (tmp_path / "m.csv").write_text("time,pin\n" + "".join(f"{k / 10},0\n" for k in range(8)))
    p = run("loads", tmp_path / "robot.urdf", tmp_path / "m.csv", "-o", tmp_path / "o", *options)
    assert p.returncode == 2 and sentence in p.stderr and not (tmp_path / "o").exists()


def test_results_of_another_robot_are_refused_without_force(robot, tmp_path):
    m, other = robot(FLANGE.format(name="arm")), robot(FLANGE.format(name="leg"))
    renamed = robot(FLANGE.format(name="arm").replace('"pin"', '"hinge"'))
    ksl.compute_loads(m, held(m)).write(tmp_path / "o")
    before = (tmp_path / "o/wrenches.parquet").read_bytes()
    with pytest.raises(OutputError, match="o: holds results of another robot, arm; give another folder with -o, or replace them with --force"):
        ksl.compute_loads(other, held(other)).write(tmp_path / "o")
    with pytest.raises(OutputError, match="of a robot of this name with other joints"):
        ksl.compute_loads(renamed, held(renamed)).write(tmp_path / "o")
    assert (tmp_path / "o/wrenches.parquet").read_bytes() == before
    ksl.compute_loads(other, held(other)).write(tmp_path / "o", force=True)
    (tmp_path / "o/wrenches.parquet").write_bytes(before[:100])  # cut off: nobody's results
    ksl.compute_loads(m, held(m)).write(tmp_path / "o")
    assert pq.read_table(tmp_path / "o/wrenches.parquet").num_rows == 9


def test_a_report_over_its_own_motion_is_refused(flange, tmp_path):
    motion = tmp_path / "m.csv"
    motion.write_text("time,pin\n" + "".join(f"{k / 10},0\n" for k in range(8)))
    run = ksl.compute_loads(flange, motion)
    with pytest.raises(OutputError, match="this run reads it"):
        run.report(motion)
    assert motion.read_text().startswith("time,pin")
    run.report(tmp_path / "r.html")


def test_force_on_the_command_line(robot, tmp_path):
    m = robot(FLANGE.format(name="leg"))
    ksl.compute_loads(m, held(m)).write(tmp_path / "o")
    robot(FLANGE.format(name="arm"))
    (tmp_path / "m.csv").write_text("time,pin\n" + "".join(f"{k / 10},0\n" for k in range(8)))
    given = tmp_path / "robot.urdf", tmp_path / "m.csv", "-o", tmp_path / "o"
    p = run("loads", *given)
    assert (p.returncode, p.stdout) == (2, "") and p.stderr.count("\n") == 1 and "--force" in p.stderr
    assert run("loads", *given, "--force").returncode == 0


@pytest.mark.parametrize("link", ["tool", "link:tool"])
def test_payloads_and_wrenches_from_a_program(flange, link):
    r = ksl.compute_loads(flange, held(flange), payloads={link: (1.0, (0.3, 0, 0.04))}, external={"tool": (0, 0, -MASS * G, 0, 0.3 * MASS * G, 0)})
    first = {row["joint"]: row for row in r.wrenches.to_pylist()[:3]}
    assert first["pin"]["effort"] == pytest.approx(-0.5 * G * (1 + 2 * MASS))
    assert r.provenance.cases[0]["payloads"] == [{"link": "tool", "mass": 1.0, "center": [0.3, 0.0, 0.04]}]


def test_what_loads_refuses(flange):
    with pytest.raises(ksl.MotionError, match="needs a motion"):
        ksl.compute_loads(flange)
    with pytest.raises(ValueError, match="no joint named 'flnage'; did you mean 'flange'"):
        ksl.compute_loads(flange, held(flange), joints=["flnage"])
    with pytest.raises(ValueError, match="no link named 'tol'|at='tol'"):
        ksl.compute_loads(flange, held(flange), at="tol")
    with pytest.raises(ksl.MotionError, match="reading is int; expected a mapping"):
        ksl.compute_loads(flange, held(flange), reading=3)
    with pytest.raises(ksl.MotionError, match="cases: expected a file of load cases, or a list"):
        ksl.compute_loads(flange, cases=[3])


def test_one_joint_by_its_name(flange):
    """Also with the prefix that says what it is."""
    run = lambda joints, at: ksl.compute_loads(flange, held(flange), joints=joints, at=at).wrenches
    plain = run(["pin"], {"pin": (0, 0, 0.1)})
    assert plain["joint"].unique().to_pylist() == ["pin"] and plain["at"].unique().to_pylist() == ["joint + 0 0 0.1"]
    assert all(run(joints, {name: (0, 0, 0.1)}).equals(plain) for joints in ("pin", "joint:pin", ["joint:pin"]) for name in ("pin", "joint:pin"))


NARROW = 80


def test_tables_fit_80_columns(tmp_path, examples):
    """No head and no number is cut, and every table has its units."""
    robot = tmp_path / "panda.urdf"
    robot.write_text((examples / "robots/panda.urdf").read_text().replace("<limit ", '<dynamics damping="0.5" friction="0.3"/><limit '))
    p = run("loads", robot, examples / "motions/panda_pick.csv", "-o", tmp_path / "o", "--physics", "all")
    assert p.returncode == 0, p.stderr
    tables = p.stdout[: p.stdout.index("note: ")] + p.stdout[p.stdout.index("Share of limits") : p.stdout.index("verdict: ")]
    assert max(map(len, tables.splitlines())) <= NARROW and "…" not in p.stdout
    for head in ("axial", "radial", "bending", "about axis", "effort", "speed", "power", "work", "transmitted", "peak N m", "rms N", "peak rad/s", "mean W"):
        assert head in tables, head


def test_how_a_motion_is_read(flange, tmp_path):
    (tmp_path / "m.csv").write_text("time,pin\n" + "".join(f"{k / 10},90\n" for k in range(8)))
    r = ksl.compute_loads(flange, tmp_path / "m.csv", reading={"degrees": True})
    assert r.rows[0]["position_highest"] == pytest.approx(np.pi / 2) and r.provenance.options["degrees"] is True


def test_a_motion_as_a_table_is_taken_by_name(flange):
    pd = pytest.importorskip("pandas")
    time = np.linspace(0, 1, 20)
    table = pd.DataFrame({"pin": np.sin(time), "time": time})
    expected = ksl.compute_loads(flange, (time, np.sin(time)[:, None])).rows
    assert ksl.compute_loads(flange, table).rows == expected == ksl.compute_loads(flange, pa.table({"pin": np.sin(time), "time": time})).rows
    for wrong, words in (
        (table.rename(columns={"pin": "pinn"}), "no column 'pin'; did you mean 'pinn'"),
        (table.assign(temperature=0.0), "unknown column 'temperature'"),
        (5, "motion is int; expected a file, a table"),
    ):
        with pytest.raises(ksl.MotionError, match=words):
            ksl.compute_loads(flange, wrong)
    with pytest.raises(ksl.MotionError, match="reading: unknown key 'degree'; did you mean 'degrees'"):
        ksl.compute_loads(flange, table, reading={"degree": True})
    assert repr(ksl.compute_loads(flange, table).cases[0].motion).startswith("<ksl motion: 20 samples")
