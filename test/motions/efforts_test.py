"""Measured efforts: logs of drives of CiA 402, in ‰ of a rated value, against the efforts that they were made of."""

import numpy as np
import pytest

import ksl

COUNTS, GEAR, RATED = 1_048_576, 101, {"shoulder_pan": 1.3, "elbow": 0.65}
"""Of an encoder, a gear, and N m of the motors."""
NAMES = {"Axis 1": "shoulder_pan", "Axis 3": "elbow"}


@pytest.fixture
def ur5(examples):
    return ksl.load(examples / "robots/ur5.urdf")


@pytest.fixture
def moved(ur5, examples):
    motion = ksl.read_motion(ur5, examples / "motions/ur5_pick.csv")
    return motion, ur5.inverse_dynamics(motion.q, motion.v, motion.a)


def log(m, moved):
    """As a drive's scope saves it: whole numbers, ms, a German list separator."""
    motion, tau = moved
    columns = {"Time [ms]": np.round(1000 * motion.time, 3)}
    for axis, joint in NAMES.items():
        j = m.joint_names.index(joint)
        columns[f"{axis} 0x6064"] = np.round(motion.q[:, j] / (2 * np.pi) * COUNTS * GEAR).astype(int)
        columns[f"{axis} 0x6077"] = np.round(1000 * tau[:, j] / GEAR / RATED[joint]).astype(int)
    return ";".join(columns) + "\n" + "".join(";".join(map(str, row)) + "\n" for row in zip(*(x.tolist() for x in columns.values())))


MAP = (
    "[columns]\n"
    + "".join(
        f'"{axis} 0x6064" = {{ to = "{joint}", unit = "rev", scale = {1 / (COUNTS * GEAR)!r} }}\n"{axis} 0x6077" = {{ to = "{joint}.effort", unit = "permille", scale = {GEAR} }}\n'
        for axis, joint in NAMES.items()
    )
    + "[constants]\nshoulder_lift = 0\nwrist_1 = 0\nwrist_2 = 0\nwrist_3 = 0\n[rated]\n"
    + "".join(f"{joint} = {x}\n" for joint, x in RATED.items())
)


def test_a_log_of_drives_gives_motion_and_efforts_by_one_map(ur5, moved, written):
    file, rules = written(log(ur5, moved)), written(MAP, "axes.toml")
    efforts = ksl.read_efforts(ur5, file, map=rules)
    np.testing.assert_allclose(efforts.time, moved[0].time, atol=1e-6)
    for joint in ur5.joint_names:
        j = ur5.joint_names.index(joint)
        if joint in RATED:  # whole per mille
            assert np.abs(efforts.tau[:, j] - moved[1][:, j]).max() <= 0.501e-3 * RATED[joint] * GEAR
        else:
            assert np.isnan(efforts.tau[:, j]).all()
    assert "'Axis 1 0x6077' is shoulder_pan.effort (× 101 in permille): ‰ of 1.3 N m" in efforts.notes
    motion = ksl.read_motion(ur5, file, map=rules, positions_only=True)
    j = [ur5.joint_names.index(joint) for joint in RATED]
    np.testing.assert_allclose(motion.q[:, j], moved[0].q[:, j], atol=2 * np.pi / COUNTS / GEAR)
    assert any("not used" in note and "Axis 1 0x6077" in note for note in motion.source.notes)


@pytest.mark.parametrize(
    "joint, unit, factor",
    [("hip", prefix + unit, factor) for unit in ("Nm", "N m") for prefix, factor in (("", 1.0), ("m", 1e-3), ("k", 1e3))]
    + [("hip", "", 1.0), ("hip", "N·m", 1.0), ("hip", "N*m", 1.0), ("slide", "", 1.0), ("slide", "N", 1.0), ("slide", "mN", 1e-3), ("slide", "kN", 1e3)],
)
def test_efforts_with_their_units(leg, written, joint, unit, factor):
    rows = "".join(f"{k / 10},{k},{2 * k},x\n" for k in range(8))
    efforts = ksl.read_efforts(
        leg, written(f"t,{joint}.effort,current,note\n" + rows), map={f"{joint}.effort": {"to": f"{joint}.effort", "unit": unit, "offset": 3}} if unit else None
    )
    j = leg.joint_names.index(joint)
    np.testing.assert_allclose(efforts.tau[:, j], factor * (np.arange(8.0) + 3 * bool(unit)), rtol=1e-15)
    assert np.isnan(efforts.tau[:, 1 - j]).all() and bool(efforts.notes[1:]) == (factor != 1.0)


@pytest.mark.parametrize(
    "text, rules, said",
    [
        ("time,i\n0,1\n1,2\n", None, "holds no efforts; name columns JOINT.effort, or say by a map"),
        (
            "time,i\n0,1\n1,2\n",
            {"i": {"to": "hip.effort", "unit": "permille"}},
            "column 'i' is in ‰ of a rated value, which isn't given; add it to the map: [rated] with hip = …, N m",
        ),
        ("time,i\n0,1\n1,2\n", {"columns": {"i": "hip.effort"}, "rated": {"hip": 2.0}}, "[rated] names 'hip', whose column 'i' is no ‰"),
        ("time,i\n0,1\n1,2\n", {"columns": {"i": "hip.effort"}, "rated": {"hop": 2.0}}, "[rated] names 'hop', and no column is 'hop.effort'"),
        ("time,i\n0,1\n1,2\n", {"columns": {"i": "hip.effort"}, "rated": {"hip": -2.0}}, "rated.hip is -2.0; expected the effort that is 1000 ‰"),
        ("time,i\n0,1\n1,2\n", {"columns": {"i": "hip.effort"}, "rated": {"hip": 0}}, "rated.hip is 0; expected the effort that is 1000 ‰"),
        (
            "time,i\n0,1\n1,2\n",
            {"i": {"to": "slide.effort", "unit": "Nm"}},
            "column 'i' is in 'Nm', which is no unit of an effort; expected N, mN, kN or permille",
        ),
        ("time,i\n0,1\n1,2\n", {"i": "hop.effort"}, "column 'i' is to be 'hop.effort', the effort of no joint with one coordinate; did you mean 'hip.effort'?"),
        ("time,i\n0,1\n1,2\n", {"j": "hip.effort"}, "column 'j' is not in"),
        ("time,hip.effort\n0,1\n0,2\n", None, "time 0 after 0; times must increase"),
        ("time,hip.effort\n0,1\n1,nan\n", None, "hip.effort"),
    ],
)
def test_what_is_refused(leg, written, text, rules, said):
    with pytest.raises(ksl.MotionError) as e:
        ksl.read_efforts(leg, written(text), map=rules)
    assert said in str(e.value) and "\n" not in str(e.value)
