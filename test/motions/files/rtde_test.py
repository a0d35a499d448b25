"""Recordings of Universal Robots by RTDE, in the form of UR's recorder: blanks or commas, vectors with numbers at their ends."""

import numpy as np
import pytest

import ksl

NAMES = [f"{name}_joint" for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")]


def recording(separator=" ", actual=True, target=True, rates=True, n=60):
    """Header and rows; measured positions are 0.001 rad beside the commanded ones."""
    t = 1234.5 + 0.008 * np.arange(n)
    q = np.sin(t[:, None] * np.linspace(0.5, 1, 6))
    v, a = np.linspace(0.5, 1, 6) * np.cos(t[:, None] * np.linspace(0.5, 1, 6)), -(np.linspace(0.5, 1, 6) ** 2) * q
    columns = {"timestamp": t[:, None]}
    if target:
        columns |= {"target_q": q, **({"target_qd": v, "target_qdd": a} if rates else {}), "target_moment": 9 * q}
    if actual:
        columns |= {"actual_q": q + 1e-3, **({"actual_qd": v} if rates else {}), "actual_current": q}
    columns |= {"robot_mode": np.full((n, 1), 7), "output_int_register_0": np.zeros((n, 1))}
    names = [name if x.shape[1] == 1 else f"{name}_{i}" for name, x in columns.items() for i in range(x.shape[1])]
    rows = [separator.join(repr(float(x)) for x in row) for row in np.hstack(list(columns.values()))]
    return "\n".join([separator.join(names), *rows]) + "\n", q, v


@pytest.fixture
def ur5(examples):
    return ksl.load(examples / "robots/ur5.urdf")


@pytest.mark.parametrize("separator", [" ", ","])
def test_measured_positions_and_velocities(ur5, written, separator):
    text, q, v = recording(separator)
    motion = ksl.read_motion(ur5, written(text))
    order = [NAMES.index(f"{name}_joint") for name in ur5.joint_names]
    np.testing.assert_array_equal(motion.q, (q + 1e-3)[:, order])
    np.testing.assert_array_equal(motion.v, v[:, order])
    np.testing.assert_array_equal(motion.time, 1234.5 + 0.008 * np.arange(60))
    notes = "\n".join(motion.source.notes)
    assert (
        "actual_q, actual_qd of RTDE, measured, are those of shoulder_pan, " in notes
        and "not used: target_q, target_qd, target_qdd, target_moment, actual_current, robot_mode" in notes
    )
    assert motion.source.format.endswith("of RTDE")
    assert not np.array_equal(ksl.read_motion(ur5, written(text), positions_only=True).v, v[:, order])


def test_commanded_ones_where_nothing_is_measured(ur5, written):
    text, q, v = recording(actual=False)
    motion = ksl.read_motion(ur5, written(text))
    order = [NAMES.index(f"{name}_joint") for name in ur5.joint_names]
    np.testing.assert_array_equal(motion.q, q[:, order])
    assert "target_q, target_qd, target_qdd of RTDE, commanded" in "\n".join(motion.source.notes)


@pytest.mark.parametrize("positions_only", [False, True])
@pytest.mark.parametrize("rates", [False, True])
@pytest.mark.parametrize("which", ["actual", "target", "both"])
def test_which_columns_are_used(ur5, written, which, rates, positions_only):
    """Measured ones where both are there; accelerations are commanded alone."""
    text, q, v = recording(",", which != "target", which != "actual", rates)
    motion = ksl.read_motion(ur5, written(text), positions_only=positions_only)
    name = "target" if which == "target" else "actual"
    used = (
        [f"{name}_q"]
        + ([f"{name}_qd"] if rates and not positions_only else [])
        + (["target_qdd"] if rates and not positions_only and which == "target" else [])
    )
    assert motion.source.notes[0].startswith(f"{', '.join(used)} of RTDE, {'commanded' if which == 'target' else 'measured'}, are those of ")
    order = [NAMES.index(f"{joint}_joint") for joint in ur5.joint_names]
    assert np.array_equal(motion.q, (q + (1e-3 if name == "actual" else 0))[:, order]) and np.array_equal(motion.v, v[:, order]) == (len(used) > 1)


def test_names_with_a_prefix_and_other_names(written, robot):
    def arm(names, more=""):
        links = '<link name="l0"/>' + "".join(
            f'<link name="l{k + 1}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="{name}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/><axis xyz="0 0 1"/></joint>'
            for k, name in enumerate(names)
        )
        return robot(f'<robot name="arm">{links}{more}</robot>')

    text, q, _ = recording()
    for names in ([f"left_{name}" for name in NAMES], [f"axis{i}" for i in range(6)]):
        np.testing.assert_array_equal(ksl.read_motion(arm(names), written(text)).q, q + 1e-3)
    with pytest.raises(ksl.MotionError, match=r"is a recording of RTDE with 6 joints, and arm has 7: .*Say which is which by a map \(--map FILE\)"):
        ksl.read_motion(arm([f"axis{i}" for i in range(7)]), written(text))
    seven = arm([f"axis{i}" for i in range(7)])
    mapped = {f"actual_q_{i}": f"axis{i}" for i in range(6)}
    motion = ksl.read_motion(seven, written(text), map={"columns": mapped, "constants": {"axis6": 0.5}}, ignore_extra=True)
    np.testing.assert_array_equal(motion.q[:, :6], q + 1e-3)
    assert (motion.q[:, 6] == 0.5).all()


def test_a_text_among_the_numbers(ur5, written, refusal):
    text, *_ = recording(",")
    lines = text.splitlines()
    lines[5] = lines[5].replace(lines[5].split(",")[1 + 24], "oops", 1)
    assert ":6" in refusal(ur5, written("\n".join(lines) + "\n"))


def test_the_map_for_logs_of_drives_on_the_page(robot, written):
    """Counts of object 0x6064, with the gear in the scale; torques in ‰ are left out."""
    import re
    from pathlib import Path

    page = (Path(__file__).parents[3] / "docs/motions.md").read_text(encoding="utf-8")
    (table,) = [block for block in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if "0x6064" in block]
    link = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    arm = robot(
        f'<robot name="a"><link name="b"/><link name="c">{link}<joint name="elbow" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/></joint></robot>'
    )
    counts = np.arange(0, 20) * 100_000
    log = written("Time [ms],0x6064,0x6077\n" + "".join(f"{10 * k},{n},{k - 5}\n" for k, n in enumerate(counts)))
    motion = ksl.read_motion(arm, log, map=written(table, "map.toml"))
    np.testing.assert_allclose(motion.q[:, 0], counts / 1048576 / 101 * 2 * np.pi, rtol=1e-4)
    np.testing.assert_allclose(motion.time, 0.01 * np.arange(20), atol=1e-12)
