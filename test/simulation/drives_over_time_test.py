"""What drives a simulation, number by number: which coordinate gets which, and what can't be."""

import numpy as np
import pytest

import ksl
from ksl.simulation import drives_over_time
from ksl.simulation.drives_over_time import FINITE, DriveNumbers, coordinates, over_time
from ksl.simulation import PD, ComputedTorque, GravityCompensation, Reference

TIMES = np.array([0.0, 0.5, 2.0])


def machine():
    """A floating body with a hinge (coordinate 6), a ball (7 to 9) and a slide (10)."""
    b = ksl.Builder("machine").add_link("body", 1.0, inertia=np.eye(3))
    for name, kind, parent in (("hinge", "revolute", "body"), ("ball", "spherical", "hinge_link"), ("slide", "prismatic", "ball_link")):
        b.add_link(f"{name}_link", 1.0, inertia=np.eye(3)).add_joint(name, kind, parent, f"{name}_link", **({} if kind == "spherical" else {"axis": (0, 0, 1)}))
    return b.build(floating_base=True)


@pytest.fixture(scope="module")
def model():
    return machine()


def numbers_of(model, efforts, leading=(), in_lanes=False):
    return DriveNumbers(model, efforts, TIMES, leading, in_lanes).numbers


def index(model, name):
    return model.joint(name).v_index


def test_a_number_goes_to_the_coordinates_that_it_is_of(model):
    among = [index(model, "hinge"), *range(index(model, "ball"), index(model, "ball") + 3)]
    one = coordinates(model, 3.0, "x", among, FINITE, -1.0)
    assert [one[k] for k in among] == [3.0] * 4 and sorted(set(one[[k for k in range(model.nv) if k not in among]])) == [-1.0]
    named = coordinates(model, {"ball": 2.0}, "x", among, FINITE, 9.0)
    assert [k for k in range(model.nv) if named[k] == 2.0] == among[1:] and named[among[0]] == 9.0
    each = coordinates(model, np.arange(model.nv, dtype=float), "x", among, FINITE)
    assert [each[k] for k in range(model.nv)] == [k if k in among else 0.0 for k in range(model.nv)]
    with pytest.raises(ValueError, match="x: joint 'slide' has no coordinate that can have one"):
        coordinates(model, {"slide": 1.0}, "x", among, FINITE)
    with pytest.raises(ValueError, match=rf"x has shape \(2,\); expected one number, {{joint: number}} or \({model.nv},\)"):
        coordinates(model, [1.0, 2.0], "x", among, FINITE)


@pytest.mark.parametrize(
    ("allowed", "good", "bad"),
    [
        ("FINITE", [-1e308, 1e308], [np.inf, -np.inf, np.nan]),
        ("NOT_NEGATIVE", [0.0, 1e308], [-1e-300, np.inf]),
        ("LIMIT", [0.0, np.inf], [-1e-300, np.nan]),
        ("SHARE", [0.0, 1.0], [-1e-9, 1 + 1e-9]),
    ],
)
def test_numbers_that_can_be(model, allowed, good, bad):
    allowed = getattr(drives_over_time, allowed)
    for x in good:
        assert coordinates(model, x, "x", [6], allowed)[6] == x and coordinates(model, {"hinge": x}, "x", [6], allowed)[6] == x
    for x in bad:
        for given, what in ((x, "x is"), ({"hinge": x}, "x of 'hinge' is")):
            with pytest.raises(ValueError, match=f"{what} .*expected {allowed.words}"):
                coordinates(model, given, "x", [6], allowed)
    whole = np.full(model.nv, bad[0])  # what has no drive isn't judged
    whole[6] = good[0]
    assert coordinates(model, whole, "x", [6], allowed)[6] == good[0]


def test_rows_over_time():
    time, rows = over_time([1.0, 2.0], TIMES, (), 2, "x")
    assert time.tolist() == [0.0] and rows.tolist() == [[[1.0, 2.0]]]
    each = np.arange(6.0).reshape(3, 2)
    time, rows = over_time(each, TIMES, (4,), 2, "x")
    assert time is TIMES and rows.shape == (1, 3, 2) and (rows[0] == each).all()
    runs = np.arange(12.0).reshape(2, 3, 2)
    assert (over_time(runs, TIMES, (2,), 2, "x")[1] == runs).all()
    for wrong, leading, expected in (
        (np.zeros((2, 2)), (), r"expected \(2,\) constant, or \(3, 2\) at the times$"),
        (runs, (3,), r"or \(3, 3, 2\) for each run"),
        (np.zeros((3, 3)), (), "shape"),
    ):
        with pytest.raises(ValueError, match=expected):
            over_time(wrong, TIMES, leading, 2, "x")
    with pytest.raises(ValueError, match="x holds numbers that are not finite"):
        over_time([1.0, np.nan], TIMES, (), 2, "x")


def test_drives_are_those_of_the_model_but_floating_joints(model):
    assert numbers_of(model, PD(model.neutral(), 1.0, 0.0))["driven"] == list(range(6, model.nv))


def test_a_controller_in_numbers(model):
    q = np.tile(model.neutral(), (3, 1))
    v, a = np.arange(3.0 * model.nv).reshape(3, -1), -np.arange(3.0 * model.nv).reshape(3, -1)
    found = numbers_of(model, PD(Reference(TIMES, q, v, a), {"hinge": 5.0}, 2.0, gravity=True, limit={"slide": 7.0}, feed_forward=np.arange(float(model.nv))))
    assert found["stiffness"][6] == 5.0 and found["stiffness"].sum() == 5.0 and found["damping"].sum() == 2.0 * (model.nv - 6)
    assert found["limit"][index(model, "slide")] == 7.0 and np.isinf(found["limit"]).sum() == model.nv - 1
    assert found["gravity"] is True and found["computed_torque"] is False and found["function"] is None
    for name, rows in (("position", q), ("velocity", v), ("acceleration", a)):
        assert found[name][0].tolist() == TIMES.tolist() and (found[name][1][0] == rows).all(), name
    assert found["given"][1][0, 0].tolist() == list(range(model.nv))
    torque = numbers_of(model, ComputedTorque(model.neutral(), 1.0, 2.0))
    assert torque["computed_torque"] is True and torque["gravity"] is False and torque["limit"] is None and torque["velocity"] is None
    weight = numbers_of(model, GravityCompensation(3.0))
    assert weight["gravity"] is True and weight["stiffness"] is None and weight["position"][1].shape == (1, 1, model.nq) and weight["damping"][6] == 3.0
    timed = numbers_of(model, PD(model.neutral(), 1.0, 0.0, feed_forward=(TIMES[:2], v[:2])))
    assert timed["given"][0].tolist() == TIMES[:2].tolist() and (timed["given"][1][0] == v[:2]).all()


@pytest.mark.parametrize(
    ("reference", "said"),
    [
        (lambda m: np.zeros(m.nq + 1), "reference has shape"),
        (lambda m: Reference([0.0, 0.0], np.tile(m.neutral(), (2, 1))), "reference.times must be finite and increase"),
        (lambda m: Reference([0.0, np.nan], np.tile(m.neutral(), (2, 1))), "reference.times must be finite and increase"),
        (lambda m: Reference([0.0, 1.0], np.tile(m.neutral(), (3, 1))), r"reference.q has shape .*a row for each time"),
        (lambda m: Reference([0.0, 1.0], np.full((2, m.nq), np.inf)), "reference.q holds numbers that are not finite"),
        (lambda m: Reference([0.0, 1.0], np.tile(m.neutral(), (2, 1)), np.zeros((2, m.nv + 1))), "reference.v has shape"),
    ],
)
def test_references_that_can_not_be(model, reference, said):
    with pytest.raises(ValueError, match=said):
        numbers_of(model, PD(reference(model), 1.0, 0.0))


def test_one_reference_for_each_run(model):
    q = np.array([model.neutral(), model.neutral()])
    q[1, model.joint("hinge").q_index] = 0.25
    found = numbers_of(model, PD(q, 1.0, 0.0), leading=(2,))["position"]
    assert found[0].tolist() == [0.0] and (found[1][:, 0] == q).all()


def test_functions_of_the_user(model):
    said = []

    def efforts(t, q, v):
        said.append((t, q.shape, v.shape))
        return None if t > 1 else np.full(v.shape[-1], np.inf if t == 0.5 else t)

    drives = DriveNumbers(model, efforts, TIMES, (2,), in_lanes=True)
    call, q, v = drives.numbers["function"], np.zeros((2, model.nq)), np.zeros((2, model.nv))
    assert call(0, 0.25, q, v).tolist() == np.full((2, model.nv), 0.25).tolist() and call(0, 1.5, q, v) is None
    assert said[0] == (0.25, (2, model.nq), (2, model.nv))
    assert drives.first_not_finite(0.0) == "" and np.isinf(call(0, 0.5, q, v)).all()
    assert drives.first_not_finite(0.5) == "efforts returned inf at t = 0.5 s" and drives.first_not_finite(0.6) == ""
    alone = DriveNumbers(model, efforts, TIMES, (2,), in_lanes=False).numbers["function"]
    alone(1, 0.25, q[:1].reshape(1, -1), v[:1].reshape(1, -1))
    assert said[-1] == (0.25, (model.nq,), (model.nv,))
    with pytest.raises(ValueError, match="efforts returned nan at t = 0 s, where the run begins; expected finite numbers"):
        DriveNumbers(model, lambda t, q, v: np.full(model.nv, np.nan), TIMES, (), False).numbers["function"](0, 0.0, q[:1], v[:1])
    with pytest.raises(ValueError, match=rf"efforts returned shape \(2,\) at t = 1 s; expected \(2, {model.nv}\)"):
        DriveNumbers(model, lambda t, q, v: [1.0, 2.0], TIMES, (2,), True).numbers["function"](0, 1.0, q, v)
