"""`ksl actuation` and ksl.compute_actuation: files, what they say, and its refusals."""

import json
import re
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import ksl
import numpy as np
import pytest
from ksl_command import run_ksl
from numpy.testing import assert_allclose

ROBOTS = Path(__file__).resolve().parents[2] / "examples" / "robots"
pytestmark = pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")  # spherical is no kind of URDF's


def walk(path):
    t = np.linspace(0, 1, 201)
    rows = np.column_stack([t, 0.3 * np.sin(2 * np.pi * t), 0.6 - 0.4 * np.cos(2 * np.pi * t)])
    np.savetxt(path, rows, delimiter=",", header="time,hip_pitch,knee", comments="")
    return rows


@pytest.fixture(scope="module")
def knee(tmp_path_factory):
    folder = tmp_path_factory.mktemp("knee")
    shutil.copy(ROBOTS / "four_bar_knee.urdf", folder / "knee.urdf")
    text = (folder / "knee.urdf").read_text()
    (folder / "other.urdf").write_text(text.replace('lower="-0.05" upper="2.2" effort="90"', 'lower="-0.05" upper="1.2" effort="5"'))
    walk(folder / "walk.csv")
    done = run_ksl(
        "actuation", folder / "knee.urdf", "--joints", "knee", "--motion", folder / "walk.csv", "--check", folder / "other.urdf", "-o", folder / "out"
    )
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


def test_what_is_printed(knee):
    _, said = knee
    assert "knee.urdf: joint knee: upper limit 2.2 is too large: the range ends at 1.441 rad, where the motors hold nothing" in said
    assert "knee.urdf: joint knee: effort limit 90 is too large: motors give it nowhere" in said
    assert "other.urdf" not in said, "its limits are within what the motors give"
    assert re.search(r"motion: knee_motor: \S+ at most, of which the static map misses", said)


def test_doubts_about_the_motion_are_said(knee, tmp_path):
    folder, said = knee
    assert "doubt" not in said and "Doubts" not in (folder / "out" / "report.html").read_text()
    rows = walk(tmp_path / "walk.csv")
    np.savetxt(tmp_path / "walk.csv", rows, delimiter=",", header="time,hip_pitch,knee", comments="", fmt="%.3f")
    done = run_ksl("actuation", folder / "knee.urdf", "--joints", "knee", "--motion", tmp_path / "walk.csv", "-o", tmp_path / "out")
    for text in (done.stdout, (tmp_path / "out" / "report.html").read_text()):
        assert re.search(r"positions of (hip_pitch|knee) are rounded to 0\.001 rad", text), done.stdout


def test_tables(knee):
    import pyarrow.csv
    import pyarrow.parquet

    folder, _ = knee
    a = ksl.load(folder / "knee.urdf").actuation(["knee"])
    maps = pyarrow.parquet.read_table(folder / "out" / "maps.parquet").to_pandas()
    q = maps[["knee"]].to_numpy()
    assert_allclose(maps["knee_motor"], a.motors_of(q)[:, 0], rtol=1e-12)
    assert_allclose(maps["knee_motor.ratio"], a.motor_jacobian(q)[:, 0, 0], rtol=1e-12)
    assert_allclose(maps["effort_alone"], 60 * np.abs(maps["knee_motor.ratio"]), rtol=1e-12)
    assert_allclose(maps["velocity_alone"] * maps["effort_alone"], 60 * 16, rtol=1e-12)  # power of the motor's limits
    motion = pyarrow.parquet.read_table(folder / "out" / "motion.parquet").to_pandas()
    closed = a.with_rotors.model
    rows = walk(folder / "walk.csv")
    Q = np.zeros((len(rows), closed.nq))
    Q[:, closed.joint("hip_pitch").q_index], Q[:, closed.joint("knee").q_index] = rows[:, 1], rows[:, 2]
    assert_allclose(motion["knee_motor"], a.motors_of(rows[:, 2:])[:, 0], rtol=1e-9)
    table = pyarrow.csv.read_csv(folder / "out" / "motion.csv", read_options=pyarrow.csv.ReadOptions(skip_rows=1))
    assert (
        table.column_names == list(motion.columns) == ["time", "knee_motor", "knee_motor.v", "knee_motor.effort", "knee_motor.static_effort", "rod_end.force"]
    )


def test_efforts_and_forces_along_the_motion(knee):
    """Those of the closed mechanism's own inverse dynamics, whose hip moves, and its reactions in the plane of the linkage."""
    folder, _ = knee
    m = ksl.load(folder / "knee.urdf", physics=["rotor", "armature"])
    run = ksl.compute_actuation(folder / "knee.urdf", ["knee"], folder / "walk.csv")
    serial = ksl.read_motion(run.serial, folder / "walk.csv")
    a, hip, knee_ = m.actuation(["knee"]), run.serial.joint("hip_pitch").v_index, run.serial.joint("knee").v_index
    carrier = [np.zeros((len(serial.time), m.nv)) for _ in range(3)]
    for to, x in zip(carrier, (serial.q, serial.v, serial.a)):
        to[:, m.joint("hip_pitch").v_index] = x[:, hip]
    Q, V, A = a.state(*(x[:, [knee_]] for x in (serial.q, serial.v, serial.a)), carrier=tuple(carrier))
    assert_allclose(run.motion.efforts[:, 0], m.inverse_dynamics(Q, V, A)[:, m.joint("knee_motor").v_index], rtol=1e-8, atol=1e-9)
    force = np.array([m.reactions(*state, joints=["rod_end"])[0, [0, 2]] for state in zip(Q, V, A)])
    assert_allclose(run.motion.forces[:, 0], np.linalg.norm(force, axis=1), rtol=1e-7)


def test_the_page_and_the_models(knee):
    folder, _ = knee
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)[1])
    assert len(data["charts"]) == 6 + 2 and page.count('class="chart"') == 8
    assert "the range ends at 1.441 rad" in page and "http-equiv" in page
    serial = ksl.load(folder / "out" / "serial.urdf", physics="armature")
    assert serial.joint_names == ["hip_pitch", "knee"] and serial.joint("knee").armature > 0.005
    joints = {joint.get("name"): joint for joint in ET.parse(folder / "out" / "serial.xml").iter("joint")}
    assert float(joints["knee"].get("armature")) == serial.joint("knee").armature
    assert len(ET.parse(folder / "out" / "closed.xml").findall(".//equality/connect")) == 2


def test_a_start_where_the_neutral_position_is_beyond_a_limit(knee, tmp_path):
    folder, _ = knee
    text = (folder / "knee.urdf").read_text()
    (tmp_path / "bent.urdf").write_text(text.replace('lower="-0.05" upper="2.2"', 'lower="0.3" upper="1.2"'))
    done = run_ksl("actuation", tmp_path / "bent.urdf", "--joints", "knee", "--start", "knee=40deg", "--json", "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert {row["judgement"] for row in json.loads(done.stdout) if row["what"] in ("lower", "upper")} == {"true"}
    run, m = ksl.compute_actuation(tmp_path / "bent.urdf", ["knee"], start={"knee": 0.7}), ksl.load(tmp_path / "bent.urdf")
    assert abs(run.at[0] - 0.7) < 1e-12 and m.close(run.actuation.start).error < 1e-12


def test_refusals(knee, tmp_path):
    folder, _ = knee
    for arguments, said in (
        (["--joints", "knee_motr"], "did you mean 'knee_motor'"),
        (["--joints", "knee", "--at", "0.1,0.2"], "--at"),
        (["--joints", "knee", "--limits", "worst"], "--limits worst: expected one of 'safe', 'mean'"),
        (["--joints", "knee", "--at", "1.6"], "motors pull the other way there than at the start"),
        (["--joints", "knee", "--start", "elbow=1"], "start: pose: no joint or column 'elbow'"),
        (["--joints", "knee", "--start", "knee=1", "--start", "knee=2"], "--start: a joint is given twice"),
        (["--joints", "knee", "--check", str(ROBOTS / "ur5.urdf")], "has none of the joints knee"),
    ):
        done = run_ksl("actuation", folder / "knee.urdf", *arguments, "-o", tmp_path / "out")
        assert done.returncode == 2 and said in done.stderr and not (tmp_path / "out").exists(), (arguments, done.stderr)
    (tmp_path / "maps.csv").write_text("mine")
    done = run_ksl("actuation", folder / "knee.urdf", "--joints", "knee", "-o", tmp_path)
    assert done.returncode == 2 and "holds maps.csv, and no maps.parquet of KSL" in done.stderr
