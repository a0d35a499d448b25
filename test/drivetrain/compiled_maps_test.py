"""`a.compile`: the numbers of the map that follows positions, everywhere, and its words."""

import json
import pickle
import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from examples import JOINTS, leg, model
from ksl.drivetrain import compiled_maps

pytestmark = [
    pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning"),  # spherical is no kind of URDF's
    pytest.mark.skipif(not any(map(shutil.which, ("clang", "gcc", "cc"))), reason="needs a compiler of C"),
]
HERE = Path(__file__).parent


@cache
def compiled(name):
    return leg(name).compile(samples=240)


@pytest.mark.parametrize("name", JOINTS)
def test_all_calls_have_the_numbers_of_the_map(name):
    """States in the range and beyond, where code says nothing; a number of them that fills no lanes."""
    a, fast, rng = leg(name), compiled(name), np.random.default_rng(1)
    q = np.concatenate(
        [a.usable(90, seed=3), rng.uniform(-2, 2, (21, len(JOINTS[name]))) * (0.1 if name in ("three_rod_platform", "differential_wrist") else 1)]
    )
    theta, x = a.motors_of(q, unreachable="nan"), rng.normal(size=q.shape)
    assert_allclose(fast.motors_of(q, unreachable="nan"), theta, atol=1e-11)
    sound = ~np.isnan(theta[:, 0])
    assert_allclose(fast.joints_of(theta[sound]), a.joints_of(theta[sound]), atol=1e-11)
    sound[sound] = np.abs(np.linalg.det(a.motor_jacobian(q[sound]))) > 0.02  # not near hold, where errors grow
    q, x = q[sound], x[sound]
    for call in ("jacobian", "motor_jacobian"):
        assert_allclose(getattr(fast, call)(q), getattr(a, call)(q), rtol=1e-8, atol=1e-9)
    for call in ("motor_velocities", "joint_velocities", "static_motor_efforts", "static_joint_efforts"):
        assert_allclose(getattr(fast, call)(q, x), getattr(a, call)(q, x), rtol=1e-8, atol=1e-9)
        assert getattr(fast, call)(q[0], x[0]).shape == (len(JOINTS[name]),)


@pytest.mark.parametrize("name", json.loads((HERE / "legs.json").read_text()))
def test_legs_of_two_independent_computations(name):
    """Numbers of others, by code alone: what says nothing is NaN."""
    case = json.loads((HERE / "legs.json").read_text())[name]
    a = model(name, folder=HERE).actuation(case["joints"])
    code = compiled_maps.compiled_calls(a, a.usable(240), ["motors_of", "joints_of", "jacobian"], None)
    q, motors, J = (np.array([s[k] if k != "motors" else s[k]["q"] for s in case["states"]]) for k in ("q", "motors", "jacobian"))
    for call, given, wanted in (("motors_of", q, motors), ("joints_of", motors, q), ("jacobian", q, J.reshape(len(q), -1))):
        found = np.empty_like(wanted)
        inside = code[call]([given], found, 1) < 1e-12
        assert inside.sum() >= len(q) / 2
        assert_allclose(found[inside], wanted[inside], rtol=1e-10, atol=1e-11)


def test_states_of_the_range_are_computed_by_code():
    a = leg("two_rod_ankle")
    fast = a.compile("motors_of,joints_of")
    assert set(fast.code) == {"motors_of", "joints_of"}
    q = a.usable(3000, seed=9)
    for call, x in (("motors_of", q), ("joints_of", a.motors_of(q))):
        assert (fast.code[call]([x], np.empty_like(x), 1) < 1e-12).mean() > 0.999
    assert not fast.motors_of(q[:0]).size


def test_one_assembly():
    """Beyond dead centres code says nothing, also where both rods reach theirs at once."""
    a = leg("two_rod_ankle")
    fast, pitch = compiled("two_rod_ankle"), np.linspace(-2.5, 2.5, 400)
    q = np.stack([pitch, 0 * pitch], axis=1)
    found, error = np.empty_like(q), fast.code["motors_of"]([q], q.copy(), 1)
    inside = fast.code["motors_of"]([q], found, 1) < 1e-12
    assert inside.any() and not inside.all() and np.isnan(error[-1])
    assert_allclose(found[inside], a.motors_of(q[inside]), atol=1e-11)


def test_the_words_of_the_map():
    a = leg("two_rod_ankle")
    fast = compiled("two_rod_ankle")
    q = np.zeros((40, 2))
    q[31] = 0, 1.5
    for call in ("motors_of", "jacobian"):
        said = []
        for x in (a, fast):
            with pytest.raises(ValueError, match="q of state 31: ankle_pitch, ankle_roll = .* is out of reach") as error:
                getattr(x, call)(q)
            said.append(str(error.value))
        assert said[0] == said[1]
    assert np.isnan(fast.motors_of(q, unreachable="nan")[31]).all()
    with pytest.raises(ValueError, match=r"q\[3, 1\] is nan; every number must be finite"):
        fast.motors_of(np.where(np.arange(80).reshape(40, 2) == 7, np.nan, 0))
    with pytest.raises(ValueError, match="unreachable='zero'"):
        fast.motors_of(q, unreachable="zero")
    with pytest.raises(ValueError, match="calls: 'motor_of' isn't compiled; did you mean 'motors_of'.*there are motors_of, joints_of, jacobian"):
        a.compile(["motor_of"])
    for x in (a, fast):
        with pytest.raises(ValueError, match="threads=-1; expected"):
            x.motors_of([0, 0], threads=-1)
        with pytest.raises(ValueError, match=r"out is float64 \(3, 2\); expected a C-contiguous, .* float64 array of shape \(40, 2\)"):
            x.motors_of(q, out=np.zeros((3, 2)))


def test_memory_and_threads(monkeypatch):
    a = leg("two_rod_ankle")
    fast, q = compiled("two_rod_ankle"), np.resize(a.usable(500, seed=2), (5, 101, 2))
    wanted = fast.motors_of(q, threads=1)
    monkeypatch.setattr(compiled_maps, "SHARE", 64)
    assert_array_equal(fast.motors_of(q, threads=3), wanted)
    assert_array_equal(fast.motors_of(q[::2, ::-3]), wanted[::2, ::-3])
    for x in (a, fast):
        out = q.copy()
        assert x.motors_of(out, out=out) is out
        assert_allclose(out, wanted, atol=1e-11)
    q = np.concatenate([[[0.1, 1.0]], q.reshape(-1, 2)])  # the first by the map, into memory that is read
    assert_allclose(fast.motors_of(q, out=q)[0], a.motors_of([0.1, 1.0]), atol=1e-11)
    assert_allclose(fast.motor_velocities(wanted[0] * 0.1, [1.0, 2.0]), a.motor_velocities(wanted[0] * 0.1, [1.0, 2.0]), rtol=1e-9)
    assert_array_equal(fast.motors_of([0.1, 0.0], start=a.start), a.motors_of([0.1, 0.0]))
    assert not pickle.loads(pickle.dumps(fast)).code and fast.code
