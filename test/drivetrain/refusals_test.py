"""Joints and arguments that have no map: the sentence says why, and what to do."""

import numpy as np
import pytest

from examples import leg, model


@pytest.mark.parametrize(
    ("robot", "joints", "said"),
    [
        ("two_rod_ankle", [], r"joints=\[\]; expected the names"),
        ("two_rod_ankle", ["ankle_pitch"], r"motor_left, motor_right move ankle_roll as well as ankle_pitch; name them, too: \['ankle_pitch', 'ankle_roll'\]"),
        ("two_rod_ankle", ["ankle_pitch", "ankle_pitch"], "'ankle_pitch' is named twice"),
        ("two_rod_ankle", ["foot", "ankle_roll"], "no joint named 'foot'; it is a link"),
        ("two_rod_ankle", ["ankel_pitch", "ankle_roll"], "did you mean 'ankle_pitch'"),
        ("two_rod_ankle", ["ball_left_foot", "ankle_roll"], "'ball_left_foot' has coordinates; it closes a loop"),
        ("two_rod_ankle", ["ball_left_top", "ankle_roll"], "'ball_left_top' is spherical, and its position is a quaternion"),
        ("two_rod_ankle", ["ankle_pitch", "ankle_roll", "motor_left"], "more joints than motors: .* have 3 coordinates, and .*motor_right, are 2; name 2"),
        ("four_bar_knee", ["base"], "'base' is fixed, and nothing moves it"),
        ("three_rod_platform", ["heave", "roll"], "move pitch as well as heave, roll"),
    ],
)
def test_joints_that_have_no_map(robot, joints, said):
    with pytest.raises(ValueError, match=said):
        model(robot).actuation(joints)


def test_motors_that_are_missing():
    m = model("two_rod_ankle")
    with pytest.raises(ValueError, match="the motors, motor_left, leave a freedom of the mechanism, which has 2"):
        m.with_drives(["motor_left"]).actuation(["ankle_pitch"])
    with pytest.raises(ValueError, match="motor_left, motor_right, ankle_pitch are 3 motors of 2 freedoms"):
        m.with_drives(["motor_left", "motor_right", "ankle_pitch"]).actuation(["ankle_pitch", "ankle_roll"])
    with pytest.raises(ValueError, match="ankle_roll, motor_left have 3 coordinates, and the mechanism has 2 freedoms; name 2"):
        m.with_drives(["motor_left", "motor_right", "ankle_pitch"]).actuation(["ankle_pitch", "ankle_roll", "motor_left"], sharing="limits")
    with pytest.raises(ValueError, match="joint 'hip_pitch': no motor moves it.* it lies in no loop"):
        model("four_bar_knee").with_drives(["knee_motor"]).actuation(["hip_pitch"])


def test_arguments():
    a = leg("two_rod_ankle")
    for call, said in (
        (lambda: a.motors_of([0.1, np.nan]), "every number must be finite"),
        (lambda: a.motors_of([0.1]), r"q has shape \(1,\)"),
        (lambda: a.motors_of([0.0, 1.4], unreachable="zero"), "unreachable='zero'"),
        (lambda: a.state([0, 0], carrier=a.start), r"carrier: expected \(Q, V, A\)"),
        (lambda: a.state([0, 0], carrier=list(a.state([0, 0]))), r"carrier: expected \(Q, V, A\)"),
        (lambda: a.state([0, 0], carrier=a.state([0, 0])[:2]), r"carrier: expected \(Q, V, A\)"),
        (lambda: a.range("motor_left"), "joint='motor_left'; expected one of ankle_pitch, ankle_roll"),
        (lambda: a.reflected_inertia([0, 0], of="cranks"), "of='cranks'"),
        (lambda: a.motors_of([0, 0], start=a.start + np.eye(12)[0] * 0.1), "start is open"),
        (lambda: a.serial_model(at=[[0, 0]]), "at has shape"),
    ):
        with pytest.raises(ValueError, match=said):
            call()


def test_a_start_at_a_dead_centre():
    a = leg("four_bar_knee")
    dead = a.state([a.range("knee", limits=False).upper])[0]
    with pytest.raises(ValueError, match="motors: knee_motor don't say where"):
        a.model.actuation(["knee"], start=dead)
