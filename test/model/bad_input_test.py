"""Input as a careless or hostile user gives it: sentences that name the place and the mend, and never a wrong number in silence."""

import warnings

import numpy as np
import pytest

import ksl
from linkages import FOURBAR, link

TIP = "panda_flange"


@pytest.fixture(scope="module")
def arm(examples):
    return ksl.load(examples / "robots/panda.urdf")


@pytest.fixture(scope="module")
def floating(examples):
    return ksl.load(examples / "robots/panda.urdf", floating_base=True)


def rough(m: ksl.Model, off: float) -> np.ndarray:
    q = m.neutral()
    q[6] = 1 + off
    return q


@pytest.mark.parametrize("off", [2e-6, 1e-4, -9e-3])
def test_quaternions_that_are_nearly_unit_are_used_as_normalised_with_a_warning(floating, off):
    m, q, unit, zero = floating, rough(floating, off), floating.neutral(), np.zeros(floating.nv)
    calls = {
        "mass_matrix": lambda q: m.mass_matrix(q),
        "integrate": lambda q: m.integrate(q, zero),
        "difference": lambda q: m.difference(unit, q),
        "interpolate": lambda q: m.interpolate(q, unit, 0.5),
        "section": lambda q: m.section_wrench(q, zero, zero, "panda_link3", (0, 0, 0.1), (0, 0, 1)),
        "kinematics": lambda q: m.inverse_kinematics(TIP, m.frame_pose(unit, TIP), q0=q).q,
        "frozen": lambda q: m.with_frozen_joints({"floating_base": q[:7]}).frame_pose(np.zeros(7), TIP),
    }
    for name, call in calls.items():
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            expected = call(unit)
        with pytest.warns(ksl.QuaternionWarning, match="normalised"):
            found = call(q)
        assert np.abs(found - expected).max() <= 1e-9 * max(1.0, np.abs(expected).max()), name
        assert name not in ("integrate", "kinematics") or abs(np.linalg.norm(found[3:7]) - 1) < 1e-12, name


@pytest.mark.parametrize("off", [1.1e-2, 1.0, -1.0])
def test_other_quaternions_are_refused(floating, off):
    m, q, zero = floating, rough(floating, off), np.zeros(floating.nv)
    for call in (
        lambda: m.mass_matrix(q),
        lambda: m.difference(m.neutral(), q),
        lambda: m.inverse_kinematics(TIP, np.eye(4), q0=q),
        lambda: m.with_frozen_joints({"floating_base": q[:7]}),
        lambda: m.section_wrench(q, zero, zero, "panda_link3", (0, 0, 0), (0, 0, 1)),
    ):
        with pytest.raises(ValueError, match=f"floating_base.*length {abs(1 + off):.6g}"):
            call()


ABOUT_LOOPS = {
    "mobility": lambda m, q, v: m.mobility(q).smallest,
    "independent": lambda m, q, v: m.independent(q),
    "loop_error": lambda m, q, v: m.loop_error(q),
    "loop_jacobian": lambda m, q, v: m.loop_jacobian([q, q]),
    "loop_acceleration": lambda m, q, v: m.loop_acceleration(q, v, 0 * v),
    "force_element_states": lambda m, q, v: m.force_element_states(q).length,
    "close": lambda m, q, v: m.close(q).q[7:],
    "branches": lambda m, q, v: m.branches(q, starts=1)[:, 7:],
    "consistent_velocity": lambda m, q, v: m.consistent_velocity(q, v, given=m.drives),
    "consistent_acceleration": lambda m, q, v: m.consistent_acceleration(q, 0 * v, v, given=m.drives),
    "reactions_null_basis": lambda m, q, v: np.abs(m.reactions_null_basis(q)) > 1e-9,
    "reactions_unique": lambda m, q, v: m.reactions_unique(q),
    "inverse_dynamics_derivatives": lambda m, q, v: m.inverse_dynamics_derivatives(q, 0 * v, 0 * v)[0],
    "forward_dynamics_derivatives": lambda m, q, v: m.forward_dynamics_derivatives([q, q], 0 * v, 0 * v)[0],
    "reactions_derivatives": lambda m, q, v: m.reactions_derivatives(q, 0 * v, 0 * v, joints=["floating_base"])[0],
    "forward_dynamics": lambda m, q, v: m.forward_dynamics(q, 0 * v, v, stabilise=20.0),
    "simulate": lambda m, q, v: m.simulate(q, 0 * v, [0.0, 1e-3]).a[0],
}


@pytest.mark.parametrize("name", ABOUT_LOOPS)
@pytest.mark.filterwarnings("ignore:given")
def test_quaternions_are_judged_by_calls_about_loops_as_by_dynamics(name):
    """They were normalised without a word, where dynamics refused them."""
    m = ksl.load_string(FOURBAR.replace('<link name="frame"/>', link("frame", 2.0, 0.1)), floating_base=True, drives=["A", "floating_base"])
    q = m.neutral()
    q[7] = -0.3
    q, v = m.close(q, hold=["A", "floating_base"]).q, np.linspace(-1, 1, m.nv)
    call, rough = ABOUT_LOOPS[name], q.copy()
    rough[6] = 1 + 1e-4
    with warnings.catch_warnings():
        warnings.simplefilter("error", ksl.QuaternionWarning)
        expected = call(m, q, v)
    with pytest.warns(ksl.QuaternionWarning, match=f"{name}: a quaternion of state 0 .of floating_base. differs from unit length .*normalised") as said:
        found = call(m, rough, v)
    assert len({w.filename for w in said if w.category is ksl.QuaternionWarning}) == 1 and said[0].filename == __file__
    assert np.abs(found * 1.0 - expected).max(initial=0) <= 1e-9 * max(1.0, np.abs(expected).max(initial=0))
    rough[6] = 1.02
    with pytest.raises(ValueError, match="floating_base: quaternion of state 0 has length 1.02; expected a unit quaternion"):
        call(m, rough, v)


def test_rounding_is_not_warned_of(floating):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        floating.mass_matrix(rough(floating, 5e-7))


def test_names_that_are_near_are_suggested(arm, examples):
    q = np.zeros(7)
    for call, near in (
        (lambda: arm.frame_pose(q, "panda_flang"), "did you mean 'panda_flange'"),
        (lambda: arm.bias(q, q, external={"panda_lnk3": np.zeros(6)}), "did you mean 'panda_link3'"),
        (lambda: arm.reactions(q, q, q, joints=["panda_jont2"]), "did you mean 'panda_joint2'"),
        (lambda: arm.reactions(q, q, q, axes="wrld"), "did you mean 'world'"),
        (lambda: arm.joint("panda_joint_2"), "did you mean 'panda_joint2'"),
        (lambda: arm.subtree("panda_lnk3"), 'did you mean "panda_link3"'),
        (lambda: ksl.load(examples / "robots/panda.urdf", payloads={"panda_flang": (1, (0, 0, 0))}), 'did you mean "panda_flange"'),
    ):
        with pytest.raises(ValueError, match=near):
            call()
    with pytest.raises(ValueError, match="no link or joint named 'gripper'; known: panda_link0"):
        arm.frame_pose(q, "gripper")


@pytest.mark.parametrize(
    ("keywords", "sentence"),
    [
        ({"tolerance": "fine"}, "tolerance='fine'; expected a positive number, or two"),
        ({"tolerance": (1e-6, 1e-6, 1e-6)}, "tolerance=.*expected a positive number, or two"),
        ({"tolerance": np.nan}, "tolerance=nan"),
        ({"iterations": 1.5}, "iterations=1.5; expected a positive whole number"),
        ({"starts": 0}, "starts=0; expected a positive whole number"),
        ({"seed": 0.5}, "seed=0.5; expected a whole number"),
        ({"limits": "no"}, "limits='no'; expected True or False"),
        ({"weights": {"panda_flang": 2.0}}, "weights: no frame named 'panda_flang'; did you mean 'panda_flange'"),
        ({"target": 2 * np.eye(4)}, "target 0 is not a pose"),
        ({"target": np.diag([1.0, 1, -1, 1])}, "target 0 is not a pose"),
        ({"target": np.full((4, 4), np.nan)}, "target 0 is not a pose"),
        ({"names": None}, "names=None; expected a link or joint"),
    ],
)
def test_inverse_kinematics_says_what_is_wrong(arm, keywords, sentence):
    with pytest.raises(ValueError, match=sentence):
        arm.inverse_kinematics(**({"names": TIP, "target": np.eye(4)} | keywords))


def test_payloads_that_are_no_mapping(examples):
    with pytest.raises(ValueError, match="payloads is list; expected a mapping"):
        ksl.load(examples / "robots/panda.urdf", payloads=[(TIP, 1.0, (0, 0, 0))])


def test_arguments_of_other_types_are_named(arm, examples):
    q = np.zeros(arm.nv)
    cut = (q, q, q, "panda_link3", (0, 0, 0), (0, 0, 1))
    for call, sentence in (
        (lambda: ksl.load(examples / "robots/panda.urdf", floating_base="yes"), "floating_base='yes'; expected True or False"),
        (lambda: arm.with_frozen_joints(["panda_joint1"]), "joints is list; expected a mapping"),
        (lambda: arm.with_parameters([1]), "parameters is list; expected a mapping"),
        (lambda: arm.merged("ur5", TIP), "other is str; expected a model"),
        (lambda: arm.random(0, size=2.5), "size=2.5; expected a number of positions"),
        (lambda: arm.random(0, size=-1), "size=-1; expected a number of positions"),
        (lambda: arm.section_wrench(*cut, share=None), "share=None; expected a fraction"),
        (lambda: arm.section_wrench(*cut, share=(1.0, (0, 0, 0), 3)), r"share=.1.0, .*expected mass, first moment"),
        (lambda: arm.section_wrench(*cut, beyond=3), "beyond=3; expected a list of joints of panda_link3"),
    ):
        with pytest.raises(ValueError, match=sentence):
            call()
    part = (1.0, (0.0, 0.0, 0.1), 0.1 * np.eye(3))
    assert (arm.section_wrench(*cut, share=list(part)) == arm.section_wrench(*cut, share=part)).all()
