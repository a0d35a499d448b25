"""Results say what made them: metadata, the head of the summary, the report."""

import csv
import hashlib
import json
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import ksl
from hinged_rods import LIMITS, ROD, joint_of
from ksl.base.files_read import InputFile, being_read, recorded
from ksl.load_cases.curves import Curves
from ksl.load_cases.load_case import LoadCase
from ksl.load_cases.provenance import Provenance, joint_description, provenance_of
from ksl.load_cases.quantities import joint_loads, summarise
from ksl.mechanism.mechanism import Joint
from ksl.motions.motion import Motion, complete
from ksl_command import run_ksl


def run(*arguments: object) -> subprocess.CompletedProcess:
    return run_ksl(*arguments)


def metadata(folder: Path) -> dict:
    return json.loads(pq.read_schema(folder / "wrenches.parquet").metadata[b"ksl"])


@pytest.fixture(scope="module")
def two(examples, tmp_path_factory):
    """The same motion without and with a payload."""
    folder = tmp_path_factory.mktemp("two")
    given = examples / "robots/ur5.urdf", examples / "motions/ur5_pick.csv"
    for name, payload in (("light", ()), ("heavy", ("--payload", "2,0,0,0.05", "--on-link", "tool0", "--gravity", "0,0,-1.62"))):
        p = run("loads", *given, "-o", folder / name, *payload)
        assert p.returncode == 0, p.stderr
    return folder, *given


def test_metadata_names_all_that_made_the_results(two):
    folder, robot, motion = two
    said = metadata(folder / "heavy")
    assert said["version"] == ksl.__version__ and said["robot"] == "ur5"
    assert {f["role"]: (f["file"], f["sha256"]) for f in said["inputs"]} == {
        role: (str(file), hashlib.sha256(file.read_bytes()).hexdigest()) for role, file in (("robot", robot), ("motion", motion))
    }
    (case,) = said["cases"]
    assert (case["name"], case["motion"], case["samples"]) == ("ur5_pick", str(motion), 1026)
    assert case["gravity"] == [0, 0, -1.62] and case["payloads"] == [{"link": "tool0", "mass": 2, "center": [0, 0, 0.05]}]
    assert "--payload 2,0,0,0.05 --on-link tool0" in said["command"] and said["options"]["gravity"] == "0,0,-1.62"
    assert said["date"].endswith("Z") and set(said["versions"]) >= {"KSL", "Python", "NumPy"}
    model = ksl.load(robot)
    assert [j["name"] for j in said["joints"]] == [j.name for j in model.joints]
    pan = said["joints"][0]
    assert (pan["kind"], pan["axis"], pan["parent"], pan["child"], pan["velocity"], pan["effort"]) == (
        "revolute",
        [0, 0, 1],
        "base_link",
        "shoulder_link",
        3.14,
        150,
    )
    assert said["units"].startswith("s, N, N m") and "constraint_" in said["conventions"]


def test_two_runs_that_differ_look_different(two):
    folder, *_ = two
    for name in ("summary.csv", "report.html"):
        light, heavy = ((folder / run / name).read_text(encoding="utf-8") for run in ("light", "heavy"))
        assert "2 kg on tool0 at (0, 0, 0.05) m" in heavy and "2 kg on tool0" not in light
        assert "(0, 0, -1.62) m/s²" in heavy and "(0, 0, -9.81) m/s²" in light
        for text in (light, heavy):
            assert hashlib.sha256(two[1].read_bytes()).hexdigest() in text and "ksl loads" in text and "Python" in text


def test_the_head_of_the_summary_is_comments_with_units(two):
    lines = (two[0] / "heavy" / "summary.csv").read_text(encoding="utf-8").splitlines()
    head = [line for line in lines if line.startswith("# ")]
    assert lines[: len(head)] == head and any(line.startswith("# units: ") and "N m" in line for line in head)
    rows = list(csv.DictReader(lines[len(head) :]))
    assert [row["joint"] for row in rows] == [j.name for j in ksl.load(two[1]).joints] and {row["case"] for row in rows} == {"ur5_pick"}


def test_what_can_t_be_read_twice_has_no_hash(tmp_path):
    with recorded() as ledger:
        for name in ("/dev/null", tmp_path / "none"):
            with being_read("motion", name, ValueError):
                pass
    assert [f.sha256 for f in ledger.files] == [None, None]


def test_limits_of_zero_are_not_given(robot):
    m = robot(
        '<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="j" type="continuous"><parent link="a"/><child link="b"/><limit effort="0" velocity="0"/></joint></robot>'
    )
    t = np.linspace(0, 1, 10)
    said = json.loads(m.wrench_table(t, np.zeros((10, 1))).schema.metadata[b"ksl"])
    assert (said["joints"][0]["effort"], said["joints"][0]["velocity"]) == (None, None)


# what round-off alone must not change


def test_peaks_of_constant_curves_are_at_the_first_sample():
    t = np.linspace(0, 1, 200)
    wobble = 1 + 1e-12 * np.sin(50 * t)
    wrench = np.outer(wobble, [0, 0, 20, 0, 1e-14, 5]) * np.sign(t - 2)[:, None]
    row = summarise(t, joint_loads(Joint("j", "revolute", "a", "b", 1, 1, 0, 0, (0.0, 0.0, 1.0), has_axis=True, has_angle=True), wrench, 0 * t, wrench[:, 5]))
    assert {name for name, x in row.items() if name.endswith("_peak_time") and x} == set()
    assert row["axial_force_peak"] == pytest.approx(20, rel=1e-9)
    moving = summarise(t, joint_loads(Joint("j", "fixed", "a", "b", 0, 0, -1, -1, (0.0, 0.0, 0.0)), np.outer(1 + 1e-3 * np.sin(6 * t), np.ones(6)), None, None))
    assert moving["force_peak_time"] == t[np.argmax(np.sin(6 * t))]


@pytest.mark.parametrize("mass", [0.01, 2, 2000])
@pytest.mark.parametrize("dt", [1e-4, 1e-3, 1e-2])
def test_a_free_fall_takes_no_power(robot, mass, dt):
    """The drives of a body that falls have none; energy is exchanged within the body.  Neither its height nor its spin matters."""
    inertial = f'<inertial><mass value="{mass}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    m = robot(f'<robot name="s"><link name="s">{inertial}</link></robot>', floating_base=True)
    t = dt * np.arange(1000)
    for height, spin in ((0, 0), (100, 3)):
        q, v, a = np.zeros((1000, 7)), np.zeros((1000, 6)), np.zeros((1000, 6))
        q[:, 2], q[:, 5], q[:, 6] = height + t - 9.81 / 2 * t**2, np.sin(spin * t / 2), np.cos(spin * t / 2)
        v[:, 2], v[:, 5], a[:, 2] = 1 - 9.81 * t, spin, -9.81
        for motion in (Motion(t, q, v, a), complete(m, t, q, [[None, None]])):
            curves = Curves(LoadCase(m, motion))
            for block in curves.case.blocks():
                curves.add(block)
            balance = curves.power_balance()
            assert balance is not None and balance.at_rest, (height, balance.largest_power, balance.round_off)


@pytest.mark.parametrize(("count", "lines"), [(4, 4), (5, 1)])
def test_many_files_are_one_line(count, lines):
    files = [InputFile("mesh", f"{k}.stl", None if k == 0 else "00") for k in range(count)]
    case = {"name": "a", "kind": "motion", "motion": "", "format": None, "samples": 3, "step": 0.5, "start": 0.0, "end": 1.0, "gravity": [0, 0, -9.81],
            "payloads": [], "physics": [], "external": []}  # fmt: skip
    said = Provenance("r", [], [case], files).lines()
    assert [name for name, _ in said if name.startswith("mesh")] == (["mesh file"] * 4 if lines == 4 else ["mesh files"])
    assert dict(said)["physics of joints"] == dict(said)["external wrenches"] == dict(said)["payloads"] == dict(said)["options"] == "none"
    assert lines == 4 or dict(said)["mesh files"].endswith(f"from 0.stl to 4.stl, SHA-256 of their hashes {hashlib.sha256(b'00' * 4).hexdigest()}")
    assert dict(said)["motion"] == "arrays, 3 samples, median step 0.5 s, from 0 s to 1 s"
    assert [name for name, _ in Provenance("r", [], [case, case | {"name": "b"}]).lines()][:2] == ["case a", "case b"]
    assert "what" not in dict(said) and dict(Provenance("r", [], [case | {"kind": "held at rest"}]).lines())["what"] == "held at rest"


def test_a_case_as_it_is_described(robot):
    m = robot(ROD)
    for time, step in ((np.array([4.0]), 0.0), (np.array([4.0, 4.25, 5.0, 5.25]), 0.25)):
        (case,) = provenance_of([LoadCase(m, Motion(time, *np.zeros((3, len(time), 1)), resolution=np.array([-0.5])))]).cases
        assert (case["step"], case["samples"], case["start"], case["end"], case["resolution"]) == (step, len(time), 4.0, time[-1], {"pin": 0.5})


def test_limits_of_zero_are_none_in_results():
    said = joint_description(joint_of(lower=-1.0, upper=None, velocity=0.0, effort=5.0))
    assert {key: said[key] for key in LIMITS} == {"lower": -1.0, "upper": None, "velocity": None, "effort": 5.0} and said["axis"] == [0, 1, 0]
    assert joint_description(joint_of(velocity=2.0, effort=0.0))["effort"] is None and joint_description(replace(joint_of(), has_axis=False))["axis"] is None
