"""Left and right: which names belong together, and which differences are told."""

import pytest
from files import hinge, link, more

from ksl.checks.symmetry_rules import right_of


@pytest.mark.parametrize(
    "left, right",
    [
        ("forearm_left", "forearm_right"), ("leftArm", "rightArm"), ("LEFT_FOOT", "RIGHT_FOOT"), ("Left_index_L1", "Right_index_L1"), ("l_wrist", "r_wrist"), ("wrist_L", "wrist_R"),
        ("LF_HIP", "RF_HIP"), ("LH_FOOT", "RH_FOOT"), ("FL_thigh", "FR_thigh"), ("RL_calf", "RR_calf"), ("HL_UPPER_LEG", "HR_UPPER_LEG"), ("LShoulderPitch", "RShoulderPitch"),
        ("lShoulder", "rShoulder"), ("thighL", "thighR"), ("thighL_link", "thighR_link"), ("fingerL2", "fingerR2"),
    ],
)  # fmt: skip
def test_names_of_the_other_side(left, right):
    assert right in right_of(left)


@pytest.mark.parametrize("name", ["link_1", "tool0", "Link2", "lidar", "LiDAR", "base_link", "elbow", "right_hand", "panelLock", "PANEL"])
def test_names_without_a_left_side(name):
    assert not right_of(name)


def limbs(left, right, beyond=1.0):
    """Hands of these masses, with a finger on each."""
    chain = []
    for side, mass in (("left", left), ("right", right)):
        chain += [link(f"hand_{side}", mass), hinge(f"wrist_{side}", "fore", f"hand_{side}")]
        chain += [link(f"finger_{side}", beyond), hinge(f"knuckle_{side}", f"hand_{side}", f"finger_{side}")]
    return more(*chain)


def test_limbs_are_compared_as_a_whole(check):
    findings = check(limbs(2.0, 3.0))
    assert findings.rules == {"symmetry-mass": 1} and findings[0].name == "hand_left"
    assert "3 kg" in findings[0].found and "4 kg" in findings[0].found and "25%" in findings[0].found
    assert findings[0].value == pytest.approx(0.25)
    assert findings[0].found.endswith("25% less; most of it hand_left, 2 kg, and hand_right, 3 kg")
    alone = check(more(*(part for side, m in (("left", 3), ("right", 2)) for part in (link(f"hand_{side}", m), hinge(side, "fore", f"hand_{side}")))))
    assert alone[0].found.endswith("3 kg, hand_right has 2 kg: 33% less")
    assert not check(limbs(2.0, 2.1))  # 3.0 and 3.1: 3.2 %
    assert not check(limbs(2.0, 3.0), symmetry=0.26)
    assert check(limbs(2.0, 2.1), symmetry=0.03)


def test_a_tool_on_one_side_is_not_compared(check):
    assert not check(
        more(
            link("hand_left"),
            hinge("l", "fore", "hand_left"),
            link("hand_right"),
            hinge("r", "fore", "hand_right"),
            link("tool", 5),
            hinge("t", "hand_right", "tool"),
        )
    )


def test_screws_are_not_told(check):
    assert not check(limbs(0.001, 0.004, 0.02))
