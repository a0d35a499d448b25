"""Files of free bodies, from results that `ksl loads` has written: they are those of the run, and what doesn't fit is refused."""

import csv
import json
import shutil

import numpy as np
import pytest

import ksl
from ksl.output import OutputError
from ksl.parts.free_body import COMPONENTS
from ksl_command import run_ksl


@pytest.fixture(scope="module")
def folder(tmp_path_factory, examples):
    """A robot with a payload, and its results."""
    folder = tmp_path_factory.mktemp("parts")
    shutil.copy(examples / "robots" / "panda.urdf", folder)
    shutil.copy(examples / "motions" / "panda_pick.csv", folder)
    done = run_ksl(
        "loads",
        "panda.urdf",
        "panda_pick.csv",
        "--payload",
        "2,0,0,0.1",
        "--on-link",
        "panda_flange",
        "--on",
        "parent",
        "--at",
        "0,0,0.05",
        "-o",
        "results",
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr
    return folder


def rows_of(file):
    with open(file, newline="", encoding="utf-8") as f:
        return list(csv.DictReader(line for line in f if not line.startswith("#")))


def test_results_and_the_run_have_the_same_free_bodies(folder):
    """Whatever point and side the results are expressed at."""
    run = ksl.compute_loads(folder / "panda.urdf", folder / "panda_pick.csv", payloads={"panda_flange": (2.0, (0, 0, 0.1))})
    mine, theirs = (ksl.free_bodies(x, times=[1.0, 2.0]) for x in (folder / "results", run))
    assert [(c.time, c.case, sorted(c.bodies)) for c in mine] == [(c.time, c.case, sorted(c.bodies)) for c in theirs]
    for a, b in zip(mine, theirs, strict=True):
        for link, body in a.bodies.items():
            for w, other in zip(body.wrenches, b.bodies[link].wrenches, strict=True):
                assert (w.kind, w.name) == (other.kind, other.name)
                np.testing.assert_allclose(w.wrench, other.wrench, rtol=1e-9, atol=1e-9)
    assert ("payload", "panda_flange") in [(w.kind, w.name) for w in mine[0].bodies["panda_link7"].wrenches]


def test_tables_are_in_balance_and_say_units(folder, tmp_path):
    done = run_ksl("free-bodies", "results", "-o", tmp_path / "out", "--peaks", "panda_joint4,panda_joint7", "--xlsx", "--apart", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1].endswith("free_bodies.csv, motions.csv, free_bodies.json, free_bodies.xlsx")
    sums: dict = {}
    for row in rows_of(tmp_path / "out" / "free_bodies.csv"):
        f = np.array([float(row[c]) for c in COMPONENTS])
        point = [float(row[c]) for c in "xyz"]
        sums[row["case"], row["link"]] = sums.get((row["case"], row["link"]), 0) + np.r_[f[:3], f[3:] + np.cross(point, f[:3])]
    said = json.loads((tmp_path / "out" / "free_bodies.json").read_text())
    assert len(sums) == len(said["cases"]) * 9 and max(np.abs(x).max() for x in sums.values()) < 1e-11
    motions = rows_of(tmp_path / "out" / "motions.csv")
    assert len(motions) == len(sums) and {row["complete"] for row in motions} == {"yes"} and "panda_joint4" in motions[0]["why"] + motions[-1]["why"]
    link = said["cases"][0]["bodies"]["panda_link3"]
    row = next(r for r in motions if r["link"] == "panda_link3")
    assert [float(row[f"alpha{i}"]) for i in "xyz"] == link["angular_acceleration"] and float(row["mass"]) == link["mass"]
    head = (tmp_path / "out" / "free_bodies.csv").read_text()
    assert "# robot: panda" in head and "units: time s, x y z m, fx fy fz N, tx ty tz N m" in head
    from openpyxl import load_workbook

    sheet = load_workbook(tmp_path / "out" / "free_bodies.xlsx")["Free bodies"]
    assert (
        [c.value for c in sheet[1]][-8:-1] == ["z", *COMPONENTS]
        and [c.value for c in sheet[2]][-7:-1] == ["N"] * 3 + ["N m"] * 3
        and sheet.max_row == 2 + len(rows_of(tmp_path / "out" / "free_bodies.csv"))
    )


def test_a_frame_of_a_part_and_stress_factors_by_command(folder, tmp_path):
    wrenches = "[panda_link3]\npanda_joint3 = [[0, 0, 0, 2e5, 0, 0], [0, 0, 0, 0, 3e5, 0]]\n"
    (tmp_path / "stress.toml").write_text(f"{wrenches}[[panda_link5.section]]\npoint = [0, 0, -0.1]\nnormal = [0, 0, 1]\nfactors = [[0, 0, 0, 1e6, 0, 0]]\n")
    done = run_ksl(
        "free-bodies",
        "results",
        "-o",
        tmp_path / "out",
        "--stress",
        tmp_path / "stress.toml",
        "--most",
        "4",
        "--frame",
        "panda_link3=0,0,0.1,0,0,1.5707963267948966",
        "--json",
        cwd=folder,
    )
    said = json.loads(done.stdout)
    body = said["cases"][0]["bodies"]["panda_link3"]
    plain = ksl.free_bodies(folder / "results", times=[said["cases"][0]["time"]])[0].bodies["panda_link3"]
    x, y, z = plain.wrenches[0].wrench[:3]
    np.testing.assert_allclose(body["wrenches"][0]["wrench"][:3], [y, -x, z], atol=1e-9)
    np.testing.assert_allclose(body["wrenches"][0]["point"], [0, 0, -0.1], atol=1e-15)
    assert (
        body["frame"] == "part"
        and len(said["cases"]) == 5
        and said["shares"]["stresses of panda_link3"] > 0.9
        and said["shares"]["the section of panda_link5"] == 1
    )


def test_decks_of_earlier_runs_are_removed_and_files_of_others_are_not(folder, tmp_path):
    cases = ksl.free_bodies(folder / "results", times=[1.0])
    out = tmp_path / "out"
    assert cases.write(out, "nastran")[-1] == "panda_link7_nastran.bdf"
    cases.write(out)
    assert sorted(f.name for f in out.iterdir()) == ["free_bodies.csv", "free_bodies.json", "motions.csv"]
    (tmp_path / "free_bodies.csv").write_text("mine")
    with pytest.raises(OutputError, match="holds free_bodies.csv, and no free_bodies.json of KSL"):
        cases.write(tmp_path)
    (out / "free_bodies.json").write_text('{"made_of": {"robot": "ur5"}}')
    with pytest.raises(ksl.PartError, match="holds free bodies of ur5, and these are of panda"):
        cases.write(out)
    assert cases.write(out, force=True)
    for at in ("out/notes.txt", "mine_nastran.bdf", "out/old_nastran.bdf"):
        (tmp_path / at).write_text("mine")
    (out / "free_bodies.json").write_text(json.dumps({"made_of": {"robot": "panda"}, "files": [3, "notes.txt", "../mine_nastran.bdf", "old_nastran.bdf"]}))
    cases.write(out)
    assert [(tmp_path / at).exists() for at in ("out/notes.txt", "mine_nastran.bdf", "out/old_nastran.bdf")] == [True, True, False]


def test_results_that_have_changed_are_refused(folder, tmp_path):
    other = (folder / "panda.urdf").read_text()
    heavy = tmp_path / "heavy.urdf"
    heavy.write_text(other.replace('<mass value="', '<mass value="1', 1))
    with pytest.raises(
        ksl.MotionError, match=r"forces of the results differ by up to .* N at .* from what the robot file gives: .* have changed since; run `ksl loads` again"
    ):
        ksl.free_bodies(folder / "results", robot=heavy)
    with pytest.raises(ksl.MotionError, match=r"no robot file: .*absent.urdf; give it: robot= \(--robot\)"):
        ksl.free_bodies(folder / "results", robot=tmp_path / "absent.urdf")
    made = ksl.compute_loads(ksl.load_string(other), folder / "panda_pick.csv")
    made.write(tmp_path / "by_program")
    with pytest.raises(ksl.MotionError, match=r"the results name no robot file, since a program made the robot; give it"):
        ksl.free_bodies(tmp_path / "by_program")
    assert len(ksl.free_bodies(tmp_path / "by_program", times=[0.5], robot=folder / "panda.urdf")) == 1


def test_a_folder_without_results_and_what_is_none(tmp_path):
    with pytest.raises(ksl.MotionError, match=r"no wrenches.parquet there; give the folder that `ksl loads` has written"):
        ksl.free_bodies(tmp_path)
    with pytest.raises(ValueError, match="results is int; expected a run of ksl.compute_loads"):
        ksl.free_bodies(3)


def test_wrenches_that_a_file_of_load_cases_gives_are_read_again(folder, tmp_path):
    """They change with time: the results hold their links alone."""
    steps = "[0, 0, 0, 0, 0, 0, 0], [1, 0, 0, 80, 0, 0, 0], [2.5, 0, 0, 0, 0, 0, 0]"
    motion, robot = (json.dumps(str(folder / name)) for name in ("panda_pick.csv", "panda.urdf"))
    (tmp_path / "cases.toml").write_text(
        f'[defaults]\nmotion = {motion}\n[cases.free]\n[cases.pressed]\nexternal = [{{ link = "panda_flange", axes = "world", steps = [{steps}] }}]\n'
    )
    done = run_ksl("loads", json.loads(robot), "--cases", "cases.toml", "-o", "results", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    free, pressed = ksl.free_bodies(tmp_path / "results", times=[2.0], links=["panda_flange"])
    assert (free.case, pressed.case) == ("free", "pressed")
    external = [w for w in pressed.bodies["panda_link7"].wrenches if w.kind == "external"]
    assert [w.name for w in external] == ["panda_flange"] and np.linalg.norm(external[0].wrench[:3]) == pytest.approx(80)
    assert not [w for w in free.bodies["panda_link7"].wrenches if w.kind == "external"]
    assert len(ksl.free_bodies(tmp_path / "results", times=[2.0], cases=["free"])) == 1


def test_results_without_rates_are_refused(folder, tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pq.read_table(folder / "results" / "wrenches.parquet")
    missing = pa.nulls(len(table), pa.float64())
    pq.write_table(table.set_column(table.column_names.index("acceleration"), "acceleration", missing), tmp_path / "wrenches.parquet")
    with pytest.raises(ksl.MotionError, match="column 'acceleration' is missing or not finite of panda_joint1 at sample 1; run `ksl loads` again"):
        ksl.free_bodies(tmp_path / "wrenches.parquet")


OPTIONS = {
    "two instants": (["--times", "1", "--hull"], "--times and --hull: each says which instants"),
    "--most alone": (["--most", "3"], "--most 3: is for --section, --stress or --hull"),
    "a section": (["--section", "panda_link3=0,0"], "--section panda_link3=0,0: expected 6 finite numbers"),
    "no link": (["--section", "0,0,0,0,0,1"], "--section 0,0,0,0,0,1: expected LINK=X,Y,Z,NX,NY,NZ"),
    "a mesh": (["--deck", "calculix", "--mesh", "part.inp"], "--mesh part.inp: expected NAME=PART.inp"),
    "links": (["--links", "panda_link33"], "--links: panda: no link named 'panda_link33'"),
    "coupling": (["--deck", "calculix", "--coupling", "glue"], "coupling"),
}


@pytest.mark.parametrize(("options", "said"), OPTIONS.values(), ids=OPTIONS)
def test_options_that_make_no_sense(folder, tmp_path, options, said):
    done = run_ksl("free-bodies", "results", "-o", tmp_path / "out", *options, cwd=folder)
    assert done.returncode == 2 and said in " ".join(done.stderr.split()), done.stderr
