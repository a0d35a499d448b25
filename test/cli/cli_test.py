"""The command itself, run as a user runs it: what a good run of `ksl loads` writes and prints, and the options that reach its table."""

import json
import math
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import ksl
from ksl.mechanism.joint_kinds import columns_of
from loads_runs import SLIDE, refused, run, summary


@pytest.fixture(scope="module")
def done(ur5, tmp_path_factory):
    """One good run of the console script: the process and the folder it wrote."""
    out = tmp_path_factory.mktemp("done") / "a" / "b"
    return run("loads", *ur5, "-o", out, "--csv", LANG="C.UTF-8"), out


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


def test_given_rates_that_contradict_the_positions_are_noted(two, tmp_path):
    robot, motion = two
    rows = [(k / 100, math.sin(k / 50), math.cos(k / 50)) for k in range(200)]  # as if degrees were meant: 2 cos would be right
    motion.write_text("time,slide,slide.v\n" + "".join(f"{t},{q},{114.6 * v}\n" for t, q, v in rows))
    p = run("loads", robot, motion, "-o", tmp_path / "o")
    assert p.returncode == 0, p.stderr
    line = [l for l in p.stdout.splitlines() if l.startswith("  doubt: slide.v at")]
    assert line and "changes at" in line[0], p.stdout
    assert "slide.v at" in (tmp_path / "o" / "report.html").read_text(encoding="utf-8")


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


def test_instruction_sets_agree(ur5, tmp_path, done):
    """The lowest set that ships and the best one here: the same wrenches up to rounding."""
    p = run("loads", *ur5, "-o", tmp_path, KSL_ISA="x86-64-v2" if os.uname().machine == "x86_64" else "")
    assert p.returncode == 0, p.stderr
    low, best = (np.stack([x.to_numpy() for x in pq.read_table(out / "wrenches.parquet").columns[3:15]]) for out in (tmp_path, done[1]))
    assert np.abs(low - best).max() < 1e-12 * np.abs(best).max()
