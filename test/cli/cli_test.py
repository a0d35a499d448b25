"""The command itself, run as a user runs it."""

import csv
import errno
import functools
import io
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import ksl
from ksl.mechanism.joint_kinds import columns_of
from ksl.output import OutputError, staged
from ksl_command import run_ksl

MIMIC = """<robot name="hand"><link name="palm"/><link name="a"/><link name="b"/>
<joint name="finger1" type="prismatic"><parent link="palm"/><child link="a"/>
  <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
<joint name="finger2" type="prismatic"><parent link="palm"/><child link="b"/>
  <limit lower="0" upper="1" effort="1" velocity="1"/><mimic joint="finger1"/></joint></robot>"""

SLIDE = """<robot name="two"><link name="rail"/><link name="cart"><inertial><mass value="2"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="rail"/><child link="cart"/>
  <limit lower="-9" upper="9" effort="900" velocity="9"/></joint></robot>"""

IMPOSSIBLE = """<robot name="odd"><link name="stone"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="9" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""


def command() -> str:
    """The console script beside this Python."""
    found = shutil.which("ksl", path=str(Path(sys.executable).parent))
    assert found, "the command ksl is not installed beside this Python"
    return found


def ordinary(**more: str) -> dict[str, str]:
    """The environment without what changes how the command behaves, and with more."""
    return {k: v for k, v in os.environ.items() if k not in ("KSL_ISA", "COLUMNS", "FORCE_COLOR") and not k.startswith("PYTHON")} | more


def run(*arguments, **environment: str) -> subprocess.CompletedProcess:
    """In a copy of this process, or, with variables of the environment, by the console script."""
    if not environment:
        return run_ksl(*arguments)
    return subprocess.run([command(), *map(str, arguments)], capture_output=True, text=True, env=ordinary(**environment), timeout=120)


@pytest.fixture(scope="module")
def ur5(examples) -> tuple[Path, Path]:
    return examples / "robots" / "ur5.urdf", examples / "motions" / "ur5_pick.csv"


@pytest.fixture(scope="module")
def done(ur5, tmp_path_factory):
    """One good run of the console script: the process and the folder it wrote."""
    out = tmp_path_factory.mktemp("done") / "a" / "b"
    return run("loads", *ur5, "-o", out, "--csv", LANG="C.UTF-8"), out


@pytest.fixture
def two(tmp_path) -> tuple[Path, Path]:
    """A small robot with one joint, named slide, and a motion."""
    folder = tmp_path / "given"
    folder.mkdir()
    (folder / "two.urdf").write_text(SLIDE)
    (folder / "two.csv").write_text("time,slide\n" + "".join(f"{k / 10},{math.sin(k / 10)}\n" for k in range(20)))
    return folder / "two.urdf", folder / "two.csv"


def summary(out: Path) -> dict[str, dict[str, str]]:
    with open(out / "summary.csv", newline="", encoding="utf-8") as f:
        return {row["joint"]: row for row in csv.DictReader(line for line in f if not line.startswith("# "))}


# a good run


def test_files_are_there_and_no_others(done):
    process, out = done
    assert process.returncode == 0, process.stderr
    assert sorted(f.name for f in out.iterdir()) == ["report.html", "summary.csv", "wrenches.csv", "wrenches.parquet"]
    assert [f.name for f in out.parent.iterdir()] == ["b"], "something was left beside the results"
    assert process.stderr == ""


def test_what_is_printed(done):
    process, out = done
    text = process.stdout
    assert f"report: {out / 'report.html'}" in text and "about the joint's origin" in text
    assert "power balance: largest residual" in text and "differentiated from a quintic spline" in text
    for joint in ("shoulder_pan", "wrist_3", "base"):
        assert joint in text
    assert "\x1b" not in text, "colours in a pipe"


def test_the_table_is_what_python_gives(done, ur5, examples):
    from ksl.motions.reading import read_motion

    m = ksl.load(ur5[0])
    motion = read_motion(m, ur5[1])
    table = pq.read_table(done[1] / "wrenches.parquet")
    assert table.num_rows == len(motion.time) * len(m.joints)
    expected = m.wrench_table(motion.time, motion.q, motion.resolved_v, motion.resolved_a)
    assert table.column_names == expected.column_names and set(table["case"].to_pylist()) == {"ur5_pick"}
    for name in expected.column_names[1:]:
        assert table[name].to_pylist() == expected[name].to_pylist(), name
    assert json.loads(table.schema.metadata[b"ksl"])["robot"] == "ur5"


def test_csv_holds_the_same_numbers(done):
    import pyarrow.csv

    table, text = pq.read_table(done[1] / "wrenches.parquet"), pyarrow.csv.read_csv(done[1] / "wrenches.csv")
    assert text.column_names == table.column_names and text.num_rows == table.num_rows
    assert text["joint"].to_pylist() == table["joint"].to_pylist()
    for name in ("time", "fx", "tz", "constraint_ty", "effort"):
        assert text[name].to_pylist() == table[name].to_pylist(), name


def test_summary_is_the_peaks_of_the_table(done, ur5):
    m = ksl.load(ur5[0])
    table = pq.read_table(done[1] / "wrenches.parquet").to_pydict()
    rows, names = summary(done[1]), np.array(table["joint"])
    assert list(rows) == [j.name for j in m.joints]
    for joint in m.joints:
        own = names == joint.name
        wrench = np.stack([np.array(table[c])[own] for c in ("fx", "fy", "fz", "tx", "ty", "tz")], axis=1)
        row = rows[joint.name]
        assert row["kind"] == joint.kind
        if not joint.has_axis:
            assert float(row["force_peak"]) == pytest.approx(np.linalg.norm(wrench[:, :3], axis=1).max(), rel=1e-12)
            assert row["axial_moment_peak"] == row["effort_peak"] == ""
            continue
        axis, time = np.array(joint.axis), np.array(table["time"])[own]
        axial = wrench[:, 3:] @ axis
        assert float(row["axial_moment_peak"]) == pytest.approx(np.abs(axial).max(), rel=1e-12)
        assert float(row["axial_moment_peak_time"]) == time[np.abs(axial).argmax()]
        effort = np.array(np.array(table["effort"])[own], dtype=float)
        assert float(row["effort_peak"]) == pytest.approx(np.abs(effort).max(), rel=1e-12)
        assert float(row["effort_peak_time"]) == time[np.abs(effort).argmax()]
        across = wrench[:, 3:] - axial[:, None] * axis
        assert float(row["bending_moment_peak"]) == pytest.approx(np.linalg.norm(across, axis=1).max(), rel=1e-9)
        power = np.array([x or 0.0 for x in np.array(table["power"])[own]], dtype=float)
        total = np.sum((power[1:] + power[:-1]) / 2 * np.diff(time))
        assert float(row["work_positive"]) + float(row["work_negative"]) == pytest.approx(total, rel=1e-9, abs=1e-9)
        assert float(row["work_positive"]) >= 0 >= float(row["work_negative"])


def test_report_is_a_page_with_every_joint(done, ur5):
    text = (done[1] / "report.html").read_text(encoding="utf-8")
    assert text.lower().startswith("<!doctype html>") and text.rstrip().endswith("</html>")
    assert all(j.name in text for j in ksl.load(ur5[0]).joints)


def kinds_of_joints(folder: Path) -> list[str]:
    """All that files may hold, as the reader lists them."""
    (folder / "odd.urdf").write_text(SLIDE.replace("prismatic", "odd"))
    with pytest.raises(ksl.DescriptionError) as e:
        ksl.load(folder / "odd.urdf")
    return re.search("expected one of (.*?);", str(e.value))[1].split(", ")


@pytest.fixture(scope="module")
def every_kind(tmp_path_factory) -> tuple[ksl.Model, subprocess.CompletedProcess, str]:
    """A chain with a joint of each kind, what `ksl loads` prints of it, and its report."""
    folder = tmp_path_factory.mktemp("kinds")
    kinds = kinds_of_joints(folder)
    assert {"fixed", "floating", "helical", "spherical"} < set(kinds)
    text = '<robot name="kinds"><link name="l0"/>'
    for i, kind in enumerate(kinds):
        text += f"""<link name="l{i + 1}"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="a_{kind}" type="{kind}"><parent link="l{i}"/><child link="l{i + 1}"/><axis2 xyz="0 1 0"/><screw_thread_pitch value="0.02"/></joint>"""
    (folder / "kinds.urdf").write_text(text + "</robot>")
    m = ksl.load(folder / "kinds.urdf")
    names = [c for j in m.joints[: len(m.joint_names)] for group in columns_of(j) for c in group]
    row = ",".join("1" if name.endswith(".qw") else "0" for name in names)
    (folder / "kinds.csv").write_text("time," + ",".join(names) + "\n" + "".join(f"{k / 10},{row}\n" for k in range(8)))
    process = run("loads", folder / "kinds.urdf", folder / "kinds.csv", "-o", folder / "out")
    assert process.returncode == 0, process.stderr
    return m, process, (folder / "out/report.html").read_text(encoding="utf-8")


def test_every_joint_stands_in_one_table_of_the_report(every_kind):
    m, _, report = every_kind
    summary = report[report.index('id="summary"') : report.index('id="balance"')]
    groups = [("Turning joints", "the wrench"), ("Sliding joints", "the wrench"), ("Joints without one coordinate", "")]
    tables = re.findall(r"<table><caption>(.*?)</caption>(.*?)</table>", summary, re.DOTALL)
    assert {title.partition(": ")[0] for title, _ in tables} == {title for title, _ in groups}
    of = {}
    for title, table in tables:
        if not title.endswith(": the drive"):
            for name in re.findall(r'<th scope="row"><a [^>]*>(.*?)</a>', table):
                assert of.setdefault(name, title.partition(": ")[0]) == title.partition(": ")[0], name
    drives = [name for title, table in tables if title.endswith(": the drive") for name in re.findall(r'<th scope="row"><a [^>]*>(.*?)</a>', table)]
    assert sorted(drives) == sorted(j.name for j in m.joints if j.nv == 1)
    assert sorted(of) == sorted(j.name for j in m.joints)
    assert of["a_helical"] == of["a_revolute"] == "Turning joints"
    assert of["a_prismatic"] == "Sliding joints"
    assert of["a_spherical"] == of["a_floating"] == of["a_fixed"] == of["base"] == "Joints without one coordinate"


def test_every_joint_stands_in_one_table_of_the_terminal(every_kind):
    m, process, _ = every_kind
    tables = re.split("^(?:Drive(?!, joints that slide)|Joints without one coordinate|note)", process.stdout, flags=re.MULTILINE)[:3]
    for joint in m.joints:
        places = [re.search(rf"^ *{joint.name} ", table, re.MULTILINE) is not None for table in tables]
        assert places == ([True, True, False] if joint.nv == 1 else [False, False, True]), joint.name


def test_the_pitch_of_a_helical_joint_is_among_its_facts(every_kind):
    """0.02 m a revolution."""
    assert every_kind[2].count(f"<dt>pitch</dt><dd>{0.02 / (2 * math.pi):.4g} m/rad</dd>") == 1


def test_options_reach_the_table(ur5, tmp_path):
    p = run("loads", *ur5, "-o", tmp_path / "o", "--on", "parent", "--at", "0.1,0,-0.2", "--axes", "tool0", "--order", "ang_lin", "--gravity", "0,0,0")
    assert p.returncode == 0, p.stderr
    table = pq.read_table(tmp_path / "o" / "wrenches.parquet")
    assert table.column_names[3:6] == ["tx", "ty", "tz"]
    assert (table["on"][0].as_py(), table["at"][0].as_py(), table["axes"][0].as_py()) == ("parent", "joint + 0.1 0 -0.2", "tool0")
    assert "Moments on the parent side, about the point (0.1, 0, -0.2) m from the joint's origin, in its axes" in p.stdout
    still = [abs(x) for x in table["fz"].to_pylist()[:8]]
    assert max(still) < 1, "no gravity, at rest: nothing to carry"


def test_payload_is_felt_by_all_joints(ur5, tmp_path, done):
    p = run("loads", *ur5, "-o", tmp_path / "o", "--payload", "2,0,0,0.05", "--on-link", "tool0")
    assert p.returncode == 0, p.stderr
    with_it, without = summary(tmp_path / "o"), summary(done[1])
    assert all(
        float(with_it[j]["axial_force_peak"] or with_it[j]["force_peak"]) > float(without[j]["axial_force_peak"] or without[j]["force_peak"]) for j in with_it
    )
    several = run("loads", *ur5, "-o", tmp_path / "p", "--payload", "1,0,0,0.05", "--on-link", "tool0", "--payload", "1", "--on-link", "base_link")
    assert several.returncode == 0, several.stderr


PENDULUM = """<robot name="pendulum"><link name="ceiling"/><link name="rod"><inertial><origin xyz="1 0 0"/><mass value="1.5"/>
<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="ceiling"/><child link="rod"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" effort="20" velocity="5"/></joint></robot>"""


@pytest.mark.parametrize("options", [(), ("--axes", "world"), ("--on", "parent"), ("--order", "ang_lin")], ids=" ".join)
def test_effort_and_moment_at_a_point_off_the_axis_are_two_columns(tmp_path, options):
    """A point mass at the end of a rod without mass: about the middle of the rod the moment is half of the drive's torque."""
    (tmp_path / "pendulum.urdf").write_text(PENDULUM)
    t = np.arange(200) / 100
    q, v, a = 0.5 * np.sin(2 * t), np.cos(2 * t), -2 * np.sin(2 * t)
    np.savetxt(tmp_path / "swing.csv", np.stack([t, q, v, a], axis=1), "%.17g", ",", header="time,hinge,hinge.v,hinge.a", comments="")
    p = run("loads", tmp_path / "pendulum.urdf", tmp_path / "swing.csv", "-o", tmp_path / "o", "--at", "0.5,0,0", *options)
    assert p.returncode == 0, p.stderr
    torque = 1.5 * (a - 9.81 * np.cos(q))  # m (l² q̈ − g l cos q), x forward and the axis to the left
    peak, rms = np.abs(torque).max(), np.sqrt(np.sum((torque[1:] ** 2 + torque[:-1] ** 2) / 2 * np.diff(t)) / t[-1])
    row = {k: float(x) for k, x in summary(tmp_path / "o")["hinge"].items() if k not in ("case", "joint", "kind") and x}
    assert (row["effort_peak"], row["effort_rms"]) == pytest.approx((peak, rms), rel=1e-12)
    assert (row["axial_moment_peak"], row["axial_moment_rms"]) == pytest.approx((peak / 2, rms / 2), rel=1e-12)
    effort_at, moment_at = row["effort_at_peak"], row["axial_moment_at_peak"]  # the page has peaks with their signs
    assert (effort_at, abs(moment_at)) == pytest.approx((torque[np.abs(torque).argmax()], peak / 2), rel=1e-12)
    printed = p.stdout[p.stdout.index("Forces on the ") :]
    effort, moment = printed.index(f"{peak:.4g} ", printed.index("\nDrive")), printed.index(f"{peak / 2:.4g} ")
    assert printed.index("about axis") < moment < printed.index("\nDrive") < printed.index("effort") < effort
    table = pq.read_table(tmp_path / "o" / "wrenches.parquet").to_pydict()
    assert [x for x in table["effort"] if x is not None] == pytest.approx(torque.tolist(), rel=1e-12)
    page = (tmp_path / "o" / "report.html").read_text(encoding="utf-8")
    tables = page[page.index("Turning joints: the wrench at the chosen point") : page.index('<section id="balance"')]
    drive = tables.index("Turning joints: the drive")
    assert "moment about axis, N m" in tables[:drive] and f">{moment_at:.3f}<" in tables[:drive] and f"{peak:.2f}<" not in tables[:drive]
    assert "effort, N m" in tables[drive:] and f">{effort_at:.2f}<" in tables[drive:]


def test_external_wrenches(ur5, tmp_path, done):
    time = [line.split(",")[0] for line in ur5[1].read_text().splitlines()[1:]]
    file = tmp_path / "push.csv"
    file.write_text("time,tool0.fz\n" + "".join(f"{t},100\n" for t in time))
    p = run("loads", *ur5, "-o", tmp_path / "o", "--external", file)
    assert p.returncode == 0, p.stderr
    flange = [j for j in summary(done[1]) if ksl.load(ur5[0]).joint(j).child == "tool0"]
    assert float(summary(tmp_path / "o")[flange[0]]["force_peak"]) == pytest.approx(100, rel=1e-9)
    file.write_text("time,hand.fz\n0,1\n")
    refused(tmp_path, run("loads", *ur5, "-o", tmp_path / "q", "--external", file), "push.csv")


def test_floating_base(tmp_path):
    (tmp_path / "stone.urdf").write_text(IMPOSSIBLE.replace('izz="9"', 'izz="1"'))
    rows = "".join(f"{k / 10},{k},0,{-k},0,0,0,1\n" for k in range(8))
    (tmp_path / "fly.csv").write_text("time," + ",".join(f"floating_base.{c}" for c in ("x", "y", "z", "qx", "qy", "qz", "qw")) + "\n" + rows)
    p = run("loads", tmp_path / "stone.urdf", tmp_path / "fly.csv", "-o", tmp_path / "o", "--floating-base")
    assert p.returncode == 0, p.stderr
    assert float(summary(tmp_path / "o")["floating_base"]["force_peak"]) == pytest.approx(9.81)
    assert "power balance" in p.stdout


def test_a_second_run_replaces_the_first(ur5, tmp_path):
    out = tmp_path / "o"
    assert run("loads", *ur5, "-o", out).returncode == 0
    first = (out / "wrenches.parquet").read_bytes()
    (out / "mine.txt").write_text("keep")
    assert run("loads", *ur5, "-o", out, "--payload", "1", "--on-link", "tool0").returncode == 0
    assert (out / "wrenches.parquet").read_bytes() != first and (out / "mine.txt").read_text() == "keep"


def test_a_second_run_leaves_no_results_of_the_first(two, tmp_path):
    out = tmp_path / "o"
    assert run("loads", *two, "-o", out, "--csv").returncode == 0
    assert (out / "wrenches.csv").exists()
    assert run("loads", *two, "-o", out).returncode == 0
    assert sorted(f.name for f in out.iterdir()) == ["report.html", "summary.csv", "wrenches.parquet"]


def test_given_rates_that_contradict_the_positions_are_noted(two, tmp_path):
    robot, motion = two
    rows = [(k / 100, math.sin(k / 50), math.cos(k / 50)) for k in range(200)]  # as if degrees were meant: 2 cos would be right
    motion.write_text("time,slide,slide.v\n" + "".join(f"{t},{q},{114.6 * v}\n" for t, q, v in rows))
    p = run("loads", robot, motion, "-o", tmp_path / "o")
    assert p.returncode == 0, p.stderr
    line = [l for l in p.stdout.splitlines() if l.startswith("  doubt: slide.v at")]
    assert line and "changes at" in line[0], p.stdout
    assert "slide.v at" in (tmp_path / "o" / "report.html").read_text(encoding="utf-8")


# what is refused


def refused(tmp_path: Path, process: subprocess.CompletedProcess, *words: str) -> None:
    """Exit 2, one line on stderr that begins with the command and has the words, nothing on stdout, no folder left."""
    assert process.returncode == 2, (process.returncode, process.stdout, process.stderr)
    assert process.stderr.startswith("ksl: ") and process.stderr.count("\n") == 1, process.stderr
    assert all(w in process.stderr for w in words), process.stderr
    assert process.stdout == ""
    assert not [f for f in tmp_path.iterdir() if f.is_dir() and f.name.startswith((".", "q"))], "something was left behind"


BAD_OPTIONS = {
    "side": (["--on", "both"], ["--on both: expected", "'child', 'parent'"]),
    "order": (["--order", "lin"], ["--order lin: expected", "'lin_ang', 'ang_lin'"]),
    "point": (["--at", "hand"], ["--at hand: expected", "tool0"]),
    "offset": (["--at", "1,2"], ["--at 1,2", "3 finite numbers"]),
    "axes": (["--axes", "hand"], ["--axes hand: expected", "tool0"]),
    "gravity": (["--gravity", "9.81"], ["--gravity 9.81", "3 finite numbers"]),
    "gravity of words": (["--gravity", "0,0,down"], ["--gravity 0,0,down"]),
    "gravity without end": (["--gravity", "0,0,inf"], ["--gravity 0,0,inf", "3 finite numbers"]),
    "payload without link": (["--payload", "2"], ["--on-link"]),
    "payload of two numbers": (["--payload", "2,1", "--on-link", "tool0"], ["--payload 2,1", "1 or 4 finite numbers"]),
    "two payloads on a link": (["--payload", "2", "--on-link", "tool0"] * 2, ["--on-link tool0", "more than once"]),
    "payload on no link": (["--payload", "2", "--on-link", "hand"], ["--on-link hand: no such link; the links of ur5 are", "tool0"]),
    "payload on a misspelt link": (["--payload", "2", "--on-link", "tol0"], ["--on-link tol0: no such link; did you mean tool0?"]),
    "negative payload": (["--payload=-2", "--on-link", "tool0"], ["tool0", "not negative"]),
    "mimic": (["--mimic", "yes"], ["--mimic yes: expected", "'independent'"]),
    "no external file": (["--external", "absent.csv"], ["absent.csv", "can't be read"]),
}


@pytest.mark.parametrize("what", BAD_OPTIONS)
def test_options_that_are_refused(ur5, tmp_path, what):
    options, words = BAD_OPTIONS[what]
    refused(tmp_path, run("loads", *ur5, "-o", tmp_path / "q", *options), *words)


def test_files_that_are_refused(ur5, tmp_path):
    robot, motion = ur5
    out = ("-o", tmp_path / "q")
    refused(tmp_path, run("loads", tmp_path / "absent.urdf", motion, *out), "absent.urdf")
    refused(tmp_path, run("loads", robot, tmp_path / "absent.csv", *out), "absent.csv", "can't be read")
    refused(tmp_path, run("loads", motion, motion, *out), "ur5_pick.csv")
    refused(tmp_path, run("loads", robot, robot, *out), "ur5.urdf")
    lines = motion.read_text().splitlines()
    lines[100] = lines[100].replace("-", "x", 1)
    (tmp_path / "bad.csv").write_text("\n".join(lines))
    refused(tmp_path, run("loads", robot, tmp_path / "bad.csv", *out), "bad.csv:101: column")
    refused(tmp_path, run("loads", robot, motion, *out, "--floating-base"), "floating_base.x")


def test_a_failure_leaves_earlier_results_alone(ur5, tmp_path):
    out = tmp_path / "kept"
    assert run("loads", *ur5, "-o", out).returncode == 0
    before = {f.name: f.read_bytes() for f in out.iterdir()}
    refused(tmp_path, run("loads", *ur5, "-o", out, "--axes", "hand"))
    refused(tmp_path, run("loads", ur5[0], ur5[0], "-o", out))
    assert {f.name: f.read_bytes() for f in out.iterdir()} == before


def test_an_output_that_can_t_be_a_folder(ur5, tmp_path):
    (tmp_path / "file").write_text("mine")
    refused(tmp_path, run("loads", *ur5, "-o", tmp_path / "file"), "file")
    refused(tmp_path, run("loads", *ur5, "-o", tmp_path / "file" / "below"), "file")
    assert (tmp_path / "file").read_text() == "mine" and [f.name for f in tmp_path.iterdir()] == ["file"]


def test_an_output_without_a_name_is_not_the_current_folder(ur5, tmp_path):
    for command in (["loads", *ur5], ["size", tmp_path, tmp_path], ["hold", ur5[0]], ["sweep", *ur5], ["motion", ur5[0], "--kind", "chirp"]):
        refused(tmp_path, run(*command, "-o", ""), "--output: the name is empty; give one, or . for the current folder")
    refused(tmp_path, run("motion", ur5[0], "--kind", "chirp", "-o", "x.csv/"), "--output x.csv/: is the name of a folder; give that of a file")


def test_empty_words_are_not_left_out(ur5, tmp_path):
    refused(tmp_path, run("size", ""), "the name of the results is empty; give their folder, or . for the current one")
    refused(tmp_path, run("loads", *ur5, "-o", tmp_path / "o", "--fail-on", ""), "--fail-on with an empty word: expected limits")


def test_a_folder_where_a_result_belongs_is_found_before_computing(two, tmp_path):
    out = tmp_path / "out"
    (out / "report.html").mkdir(parents=True)
    refused(tmp_path, run("loads", *two, "-o", out), f"{out / 'report.html'}: a folder where a result file belongs", "-o")
    assert [f.name for f in out.iterdir()] == ["report.html"]


def test_an_output_that_can_t_be_made_or_written(two, tmp_path):
    refused(tmp_path, run("loads", *two, "-o", "/proc/ksl"), "/proc/ksl: results can't be written there", "with -o")
    if os.getuid():
        (tmp_path / "closed").mkdir(mode=0o555)
        refused(tmp_path, run("loads", *two, "-o", tmp_path / "closed"), "closed: results can't be written there", "Permission denied", "with -o")


def test_results_are_staged_inside_the_folder(tmp_path):
    """Beside it there may be no right to write, or another file system."""
    out = tmp_path / "a" / "b"
    with staged(out, ["x", "y"]) as stage:
        assert stage.parent.parent == out and stage.parent.name.startswith(".") and [f.name for f in out.parent.iterdir()] == ["b"]
        (stage / "x").write_text("new")
    assert {f.name: f.read_text() for f in out.iterdir()} == {"x": "new"}


@pytest.mark.parametrize("there", [(), ("a",), ("a", "b")])
def test_a_failure_removes_the_folders_that_it_made(tmp_path, there):
    tmp_path.joinpath(*there).mkdir(parents=True, exist_ok=True)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(KeyError), staged(tmp_path / "a" / "b") as stage:
        (stage / "x").write_text("half")
        raise KeyError
    assert sorted(tmp_path.rglob("*")) == before


def test_faults_of_the_system_are_one_sentence_with_the_folder(tmp_path):
    with pytest.raises(OutputError, match=r"o: results can't be written there \(No space left on device\); free some space"), staged(tmp_path / "o"):
        raise OSError(errno.ENOSPC, "full")
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_run_that_is_ended_leaves_nothing(tmp_path, two, name):
    robot, motion = two
    motion.write_text("time,slide\n" + "".join(f"{k / 1000},{math.sin(k / 1000)}\n" for k in range(400_000)))
    heard = functools.partial(signal.signal, getattr(signal, name), signal.SIG_DFL)  # tests that nohup or a shell has started in the background ignore some
    process = subprocess.Popen(
        [command(), "loads", robot, motion, "-o", tmp_path / "q", "--csv"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=heard
    )  # noqa: PLW1509 - it calls signal.signal and no more
    deadline = time.monotonic() + 60
    while process.poll() is None and time.monotonic() < deadline and not list(tmp_path.glob("q/.*/new/wrenches.csv")):
        time.sleep(0.002)
    process.send_signal(getattr(signal, name))
    process.communicate(timeout=60)
    assert process.returncode == 128 + getattr(signal, name), "ended before the signal, or by it and not by its own doing"
    assert not (tmp_path / "q").exists()


@pytest.mark.parametrize("name", ["-", "/dev/stdin"])
def test_a_motion_from_a_pipe(two, tmp_path, name):
    read, write = os.pipe()
    os.write(write, two[1].read_bytes())
    os.close(write)
    p = subprocess.run([command(), "loads", two[0], name, "-o", tmp_path / "q"], stdin=read, capture_output=True, text=True, timeout=60)
    os.close(read)
    assert p.returncode == 0, p.stderr
    assert run("loads", *two, "-o", tmp_path / "file").returncode == 0
    piped, read = (pq.read_table(tmp_path / folder / "wrenches.parquet").drop_columns("case") for folder in ("q", "file"))
    assert piped.equals(read), "but for the name of the case, which is the file's"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("environment", [{}, {"PYTHONUNBUFFERED": "1"}], ids=["buffered", "unbuffered"])
def test_a_standard_output_that_is_full(two, tmp_path, environment):
    sentence = "ksl: standard output can't be written (No space left on device)"

    def printed_into_a_full_disk(*arguments) -> str:
        with open("/dev/full", "w") as full:
            p = subprocess.run([command(), *arguments], stdout=full, stderr=subprocess.PIPE, text=True, env=ordinary(**environment), timeout=60)
        assert p.returncode == 2, (p.returncode, p.stderr)
        return p.stderr

    assert printed_into_a_full_disk("loads", *two, "-o", tmp_path / "o") == f"{sentence}; results are in {tmp_path / 'o'}\n"
    assert (tmp_path / "o" / "report.html").exists()
    for arguments in (["--version"], ["--help"], *([] if environment else [["info", two[0]], ["info", "--cpu"], ["loads", "--help"]])):
        assert printed_into_a_full_disk(*arguments) == f"{sentence}\n", arguments


READERS = {
    "two.urdf": ("check URDF", "info URDF", "loads URDF motion.csv -o p", "loads URDF --cases cases.toml -o p", "hold URDF --pose pose.toml",
                 "simulate URDF motion.csv -o p", "sweep URDF sweep.toml -o p", "view URDF o --export p.html", "view URDF motion.csv --export p.html", "compare URDF"),
    "two.usda": ("info two.usda",),
    "motion.csv": ("loads URDF motion.csv -o p", "simulate URDF motion.csv -o p", "view URDF motion.csv --export p.html"),
    "loops.toml": ("info URDF --loops loops.toml",),
    "pose.toml": ("hold URDF --pose pose.toml",),
    "cases.toml": ("loads URDF --cases cases.toml -o p",),
    "sweep.toml": ("sweep URDF sweep.toml -o p",),
    "parts.toml": ("size o parts.toml",),
    "wrenches.parquet": ("size o", "size o parts.toml"),
}  # fmt: skip
"""Files, and the commands that read them."""


@pytest.mark.parametrize("failing", READERS)
def test_a_file_that_fails_is_not_called_standard_output(two, tmp_path, monkeypatch, failing):
    """The system names no file where one that is open can't be read.  Every command that reads it says that a file can't, and not that it can't print."""

    class Failing(io.RawIOBase):
        def readable(self):
            return True

        def readinto(self, _):
            raise OSError(errno.EIO, "Input/output error")

    def hooked(call):
        def opened(file, *how, **more):
            name = os.readlink(f"/proc/self/fd/{file}") if isinstance(file, int) else os.fsdecode(file)
            return io.BufferedReader(Failing()) if name.endswith(failing) and not set("wxa+") & set((*how, "r")[0]) else call(file, *how, **more)

        return opened

    robot, motion = (tmp_path / name for name in ("two.urdf", "motion.csv"))
    robot.write_text(SLIDE)
    motion.write_bytes(two[1].read_bytes())
    if any(" o" in command.replace("-o", "") for command in READERS[failing]):
        assert run("loads", robot, motion, "-o", tmp_path / "o").returncode == 0
    for name in ("two.usda", "loops.toml", "pose.toml", "cases.toml", "parts.toml"):
        (tmp_path / name).write_text("#usda 1.0" if name.endswith("usda") else "a = 1")
    (tmp_path / "sweep.toml").write_text('[base]\nmotion = "motion.csv"\n[[vary]]\nkind = "speed"\nvalues = [1]\n')
    monkeypatch.setattr("builtins.open", hooked(open))
    monkeypatch.setattr("io.open", hooked(io.open))
    monkeypatch.setattr(os, "fdopen", hooked(os.fdopen))
    for command in READERS[failing]:
        p = run_ksl(*command.replace("URDF", "two.urdf").split(), cwd=tmp_path)
        assert "standard output" not in p.stderr and "a fault in KSL" not in p.stderr, (command, p.stderr)
        assert p.returncode == 2 and (f"{failing}: can't be read" in p.stderr or "one of the files can't be read" in p.stderr), (command, p.stderr)


@pytest.mark.parametrize("arguments", [["--version"], ["info"], ["loads", "-o"]], ids=lambda a: a[0])
def test_a_reader_that_has_gone(two, tmp_path, arguments):
    """Ends without a word and not with success, as any command does."""
    given = {"info": two[:1], "loads": [tmp_path / "o", *two]}.get(arguments[0], [])
    read, write = os.pipe()
    os.close(read)
    p = subprocess.run([command(), *arguments, *given], stdout=write, stderr=subprocess.PIPE, text=True, env=ordinary(), timeout=60)
    os.close(write)
    assert (p.returncode, p.stderr) == (1, "")


HUGE = {
    "wrenches": (
        [f"{k},{1e300 * math.sin(k)},{1e300},{1e308}" for k in range(4)],
        "sample 1 (time 0): inverse_dynamics_with_reactions: state 0: tau[0] is inf",
    ),
    "powers": ([f"{k},{k},{1e200},{1e200}" for k in range(4)], "sample 1 (time 0): power of slide is not finite"),
    "means": ([f"{k},{k},{1e-200},{1e160}" for k in range(4)], "summary: axial_force_rms of slide is not finite"),
}


@pytest.mark.parametrize("what", HUGE)
def test_results_that_are_not_finite_are_refused(two, tmp_path, what):
    robot, motion = two
    rows, sentence = HUGE[what]
    motion.write_text("\n".join(["time,slide,slide.v,slide.a", *rows]))
    refused(tmp_path, run("loads", robot, motion, "-o", tmp_path / "q"), f"two.csv: {sentence}", "check the", "units")


def test_words_that_the_terminal_lacks(two, tmp_path):
    for arguments in (("info", two[0]), ("loads", *two, "-o", tmp_path / "o"), ("loads", "--help")):
        p = run(*arguments, PYTHONIOENCODING="ascii")
        assert p.returncode == 0 and "UnicodeEncodeError" not in p.stderr, p.stderr
    assert run("loads", two[0], tmp_path / "naïve.csv", "-o", tmp_path / "o", PYTHONIOENCODING="ascii").returncode == 2


def test_what_programs_read_is_utf8_whatever_the_terminal_has(two, tmp_path):
    """On Windows pipes and files have another encoding, and `ksl size --example > components.toml` is read again."""
    robot = tmp_path / "named.urdf"
    robot.write_text(two[0].read_text().replace('"slide"', '"Größe→slide"'), encoding="utf-8")
    for arguments in (("check", robot, "--json"), ("size", "--example")):
        p = subprocess.run(
            [sys.executable, "-m", "ksl", *map(str, arguments)], capture_output=True, env=os.environ | {"PYTHONIOENCODING": "cp1252"}, timeout=120
        )
        assert p.stdout.decode("utf-8") == run(*arguments).stdout and not p.stdout.isascii(), p.stderr


def test_the_command_line_in_the_shells_own_quotes(monkeypatch):
    from ksl.commands.app import command_line

    monkeypatch.setattr(sys, "argv", ["ksl", "info", "a b\\c.urdf"])
    assert command_line() == "ksl info 'a b\\c.urdf'"
    monkeypatch.setattr(os, "name", "nt")
    assert command_line() == 'ksl info "a b\\c.urdf"'


def test_mimic_joints(tmp_path):
    (tmp_path / "hand.urdf").write_text(MIMIC)
    p = run("info", tmp_path / "hand.urdf")
    assert p.returncode == 0 and "moving joints 1, mimic joints 1" in p.stdout and "1 × finger1" in p.stdout, p.stderr
    (tmp_path / "lost.urdf").write_text(MIMIC.replace('mimic joint="finger1"', 'mimic joint="thumb"'))
    refused(tmp_path, run("info", tmp_path / "lost.urdf"), "finger2", "thumb", "--mimic independent")
    p = run("info", tmp_path / "hand.urdf", "--mimic", "independent")
    assert p.returncode == 0 and "moving joints 2" in p.stdout, p.stderr


def test_impossible_inertia_is_a_warning_or_with_strict_an_error(tmp_path):
    (tmp_path / "odd.urdf").write_text(IMPOSSIBLE)
    p = run("info", tmp_path / "odd.urdf")
    assert p.returncode == 0 and p.stderr.startswith("ksl: warning: link stone") and "stone" in p.stdout
    refused(tmp_path, run("info", tmp_path / "odd.urdf", "--strict"), "link stone")


def test_a_robot_without_masses(two, tmp_path):
    """Zeros and a power balance without a fault would look like an answer."""
    robot, motion = two
    shape = '<visual><geometry><box size="1 1 1"/></geometry></visual>'
    inertial = SLIDE[SLIDE.index("<inertial>") : SLIDE.index("</inertial>") + len("</inertial>")]
    robot.write_text(SLIDE.replace(inertial, shape))
    refused(tmp_path, run("loads", robot, motion, "-o", tmp_path / "q"), "two.urdf: none of the links that move (cart) has a mass")
    p = run("info", robot)
    assert p.returncode == 0 and p.stderr.startswith("ksl: warning: none of the links that move (cart) has a mass") and "cart" in p.stdout
    refused(tmp_path, run("info", robot, "--strict"), "none of the links that move (cart) has a mass")
    paid = run("loads", robot, motion, "-o", tmp_path / "o", "--payload", "2", "--on-link", "cart")
    assert paid.returncode == 0 and paid.stderr == ""
    refused(tmp_path, run("loads", robot, motion, "-o", tmp_path / "q", "--payload", "2", "--on-link", "hand"), "none of the links")


def test_one_link_without_mass_is_a_warning_or_with_strict_an_error(two, tmp_path):
    robot, motion = two
    tool = '<link name="tool"><collision><geometry><box size="1 1 1"/></geometry></collision></link>'
    weld = '<joint name="weld" type="fixed"><parent link="cart"/><child link="tool"/></joint>'
    robot.write_text(SLIDE.replace("</robot>", f"{tool}{weld}</robot>"))
    sentence = "link tool (line 4): moves and has geometry, but no mass: its weight and inertia are missing"
    p = run("loads", robot, motion, "-o", tmp_path / "o")
    assert (p.returncode, p.stderr) == (0, f"ksl: warning: {sentence}\n") and f"  not green: {sentence}" in p.stdout
    assert "moves and has geometry, but no mass" in (tmp_path / "o" / "report.html").read_text(encoding="utf-8")
    refused(tmp_path, run("loads", robot, motion, "-o", tmp_path / "q", "--strict"), sentence, "add <inertial> to these links")


def test_an_instruction_set_that_does_not_exist(ur5, tmp_path):
    refused(tmp_path, run("loads", *ur5, "-o", tmp_path / "q", KSL_ISA="nonsense"), "KSL_ISA=nonsense", "known: ")
    refused(tmp_path, run("info", "--cpu", KSL_ISA="nonsense"), "KSL_ISA=nonsense", "unset it")


# info


def test_info(ur5):
    p = run("info", ur5[0])
    assert p.returncode == 0, p.stderr
    m = ksl.load(ur5[0])
    for words in (
        "ur5",
        "degrees of freedom 6 (nq 6)",
        "moving joints 6",
        "fixed joints 2",
        "links 8",
        "gravity (0, 0, -9.81)",
        f"{sum(l.mass for l in m.links):.6g} kg",
    ):
        assert words in p.stdout, words
    for name in [*(j.name for j in m.joints), *m.link_names, "ground"]:
        assert name in p.stdout, name
    assert "3.14" in p.stdout and "150" in p.stdout, "limits"


def test_info_says_what_is_not_used(tmp_path):
    (tmp_path / "r.urdf").write_text('<robot name="r"><link name="l"><visual><geometry><box size="1 1 1"/></geometry></visual></link><gazebo/></robot>')
    p = run("info", tmp_path / "r.urdf")
    assert p.returncode == 0 and "not used" in p.stdout and "visual" in p.stdout and "gazebo" in p.stdout


def test_physics_of_joints(two, tmp_path):
    robot, motion = two
    robot.write_text(SLIDE.replace("</joint>", "<dynamics damping='0.5' friction='2'/></joint>"))
    p = run("loads", robot, motion, "-o", tmp_path / "out", "--physics", "damping, friction", "--friction-width", "0.1")
    assert p.returncode == 0 and "What the effort consists of" in p.stdout and "drive + external − dissipation" in p.stdout, p.stderr
    assert "not applied" not in p.stdout
    row = summary(tmp_path / "out")["slide"]
    assert math.isclose(float(row["damping_peak"]), 0.5 * float(row["speed_peak"]), rel_tol=1e-12)
    assert "physics of joints: none" in run("info", robot).stdout
    both = ("<link name='fork'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
            "<joint name='turn' type='continuous'><parent link='cart'/><child link='fork'/><dynamics damping='0.1'/></joint></robot>")  # fmt: skip
    robot.write_text(robot.read_text().replace("</robot>", both))
    motion.write_text("time,slide,turn\n" + "".join(f"{k / 10},{math.sin(k / 10)},{math.cos(k / 10)}\n" for k in range(20)))
    p = run("loads", robot, motion, "-o", tmp_path / "both", "--physics", "all")
    assert p.returncode == 0 and p.stdout.count("What the effort consists of, joints that") == 2 and "…" not in p.stdout, p.stdout
    p = run("loads", robot, motion, "-o", tmp_path / "none", "--physics", "dampin")
    assert p.returncode == 2 and 'did you mean "damping"?' in p.stderr and not (tmp_path / "none").exists()


def test_info_of_sdf_and_mjcf(tmp_path):
    body = "<link name='l'><inertial><mass>3</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>"
    models = "".join(f"<model name='{name}'>{body}</model>" for name in ("one", "two"))
    (tmp_path / "two.sdf").write_text(f"<sdf version='1.9'><world name='w'><gravity>0 0 -2</gravity>{models}</world></sdf>")
    p = run("info", tmp_path / "two.sdf")
    assert p.returncode == 2 and "--model NAME" in p.stderr
    p = run("info", tmp_path / "two.sdf", "--model", "two")
    assert p.returncode == 0 and "gravity (0, 0, -2)" in p.stdout and "floating_base, floating" in p.stdout
    (tmp_path / "pole.xml").write_text("<mujoco><worldbody><body name='p'><joint name='hinge'/><geom size='0.1'/></body></worldbody></mujoco>")
    p = run("info", tmp_path / "pole.xml")
    assert p.returncode == 0 and "hinge, revolute" in p.stdout and "geom (1)" in p.stdout, p.stderr


@pytest.mark.parametrize("isa", ["", "x86-64-v2"])
def test_info_of_the_processor(isa):
    if isa and os.uname().machine != "x86_64":
        isa = "neon" if os.uname().machine == "aarch64" else "generic"
    p = run("info", "--cpu", KSL_ISA=isa)
    assert p.returncode == 0 and p.stdout.startswith("kernels: ") and (not isa or p.stdout == f"kernels: {isa}\n")


def test_instruction_sets_agree(ur5, tmp_path, done):
    """The lowest set that ships and the best one here: the same wrenches up to rounding."""
    p = run("loads", *ur5, "-o", tmp_path, KSL_ISA="x86-64-v2" if os.uname().machine == "x86_64" else "")
    assert p.returncode == 0, p.stderr
    low, best = (np.stack([x.to_numpy() for x in pq.read_table(out / "wrenches.parquet").columns[3:15]]) for out in (tmp_path, done[1]))
    assert np.abs(low - best).max() < 1e-12 * np.abs(best).max()


def test_help_and_version():
    assert run("--version").stdout == f"ksl {ksl.__version__}\n"
    p = run("loads", "--help")
    assert p.returncode == 0
    for columns in ("floating_base.x .y .z .qx .qy .qz .qw", "NAME.qx .qy .qz .qw", "NAME.wx .wy .wz", "NAME.bx .by .bz"):
        assert columns in " ".join(p.stdout.split()), columns
    for option in (
        "--output",
        "--csv",
        "--on",
        "--at",
        "--axes",
        "--order",
        "--payload",
        "--on-link",
        "--external",
        "--floating-base",
        "--mimic",
        "--strict",
        "--gravity",
    ):
        assert option in p.stdout, option
    p = run("lods")
    assert p.returncode == 2 and "lods" in p.stderr


@pytest.fixture(scope="module")
def terminal(tmp_path_factory):
    """What commands print to a terminal of 80 columns, line by line, without colours."""
    folder = tmp_path_factory.mktemp("terminal")
    (folder / "deep.urdf").write_text(chain_with_long_names(30))
    (folder / "sweep.toml").write_text('[base]\nmotion = "m.csv"\n[[vary]]\nkind = "speed"\nvalues = [0.5, 1]\n')

    def printed(*arguments: object) -> list[str]:
        p = run_ksl(*arguments, cwd=folder, TTY_COMPATIBLE="1", NO_COLOR="1", COLUMNS="80", TERM="xterm")
        assert p.returncode in (0, 1), p.stderr
        assert "\\x1b" not in p.stdout + p.stderr, "what moves a bar is for the terminal, and not text"
        seen = re.sub("\x1b\\[[0-9;?]*[A-Za-z]", "", p.stdout + p.stderr).split("\n")
        return [line.rpartition("\r")[2] for line in seen]  # a bar begins each of its pictures at the left

    return printed


def chain_with_long_names(n: int) -> str:
    """A chain whose tree would be wider than any terminal, with contents that are not used."""
    links = "".join(f'<link name="link_{k:02}_of_some_length"/>' for k in range(n))
    joints = "".join(
        f'<joint name="joint_{k:02}_of_some_length" type="continuous"><parent link="link_{k:02}_of_some_length"/>'
        f'<child link="link_{k + 1:02}_of_some_length"/><gazebo_{k:02} with="contents that nobody uses"/></joint>'
        for k in range(n - 1)
    )
    return f'<robot name="deep">{links}{joints}</robot>'


def test_a_terminal_of_80_columns_is_wide_enough(terminal, ur5, tmp_path):
    """Of each command: nothing is cut, and lines break between words."""
    commands = (
        ("info", ur5[0]), ("info", "deep.urdf"), ("loads", *ur5, "-o", "o", "--payload", "900,0,0,60", "--on-link", "tool0"), ("hold", ur5[0]),
        ("check", ur5[0]), ("motion", ur5[0], "--kind", "minjerk", "-o", "m.csv"), ("size", "o"), ("--help",), ("loads", "--help"),
        ("simulate", ur5[0], "--until", "0.02", "-o", "s"), ("sweep", ur5[0], "sweep.toml", "-o", "w"), ("motion", ur5[0], "--kind", "excite", "--iterations", "1", "-o", "e.csv"),
    )  # fmt: skip
    for command in commands:
        lines = terminal(*command)
        wide = [line for line in lines if len(line) > 80 and len(line.split()) > 1]
        assert not wide, (command[0], wide[:3])
        if command[0] == "loads" and "--help" not in command:
            assert any("are these millimetres?" in " ".join(lines[k : k + 3]).replace("  ", " ") for k in range(len(lines)))


def test_the_verdict_is_seen_at_last(terminal, ur5):
    """On 24 lines: the verdict is the last sentence, and its reasons and the shares of the limits stand above it."""
    for command in (("loads", *ur5, "-o", "v"), ("hold", ur5[0])):
        last = terminal(*command)[-24:]
        assert any(line.startswith("verdict: ") for line in last[-3:]), last
    assert any(line.startswith("Share of limits used") for line in terminal("loads", *ur5, "-o", "v")[-24:])


def test_help_has_whole_sentences_and_groups(terminal):
    whole = " ".join(" ".join(terminal("--help")).split())
    assert "..." not in whole.replace("[ARGS]...", "") and "in a page on this machine or in a file." in whole
    from ksl.commands.app import GROUPS

    for name in ("loads", "hold", "view"):
        lines = terminal(name, "--help")
        heads = [line.removesuffix(":") for line in lines if re.fullmatch(r"[A-Z][a-z ]+:", line)]
        assert heads[0] == "Arguments" and set(heads[1:-1]) <= set(GROUPS) and heads[-1] == "Other options"
        others = [line for line in lines[lines.index("Other options:") :] if re.match("  (-., )?--", line)]
        assert len(others) == 1 and "--help" in others[0], "a new option needs a group"


def test_nothing_asked_of_info(tmp_path):
    refused(tmp_path, run("info"), "robot file")
