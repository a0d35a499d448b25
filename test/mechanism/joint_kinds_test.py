"""The rows of joint kinds, as Python has them, against models that have every kind."""

from collections import Counter
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

import ksl
from ksl import _core
from ksl.mechanism.joint_kinds import ANY_NAME, AnyKind, Kind

ROOT = Path(__file__).resolve().parents[2]
KINDS = {kind.name: kind for kind in _core.joint_kinds}


@pytest.fixture(scope="module")
def model():
    return ksl.load(ROOT / "test/engine/every_kind.urdf")


@pytest.mark.parametrize("kind", _core.joint_kinds, ids=lambda kind: kind.name)
def test_every_number_has_a_name_and_a_unit(kind):
    assert len(kind.position) == len(kind.position_unit) == kind.nq
    assert len(kind.velocity) == len(kind.acceleration) == len(kind.effort) == len(kind.velocity_unit) == kind.nv
    quaternion = set(range(kind.quaternion, kind.quaternion + 4)) if kind.quaternion is not None else set()
    assert {i for i, unit in enumerate(kind.position_unit) if not unit} == quaternion
    assert set(kind.position_unit + kind.velocity_unit) <= {"m", "rad", ""} and "" not in kind.velocity_unit
    assert kind.angle is None or kind.position_unit[kind.angle] == "rad"


@pytest.mark.parametrize("kind", _core.joint_kinds, ids=lambda kind: kind.name)
def test_names_of_a_table_are_distinct(kind):
    names = Counter(kind.position + kind.velocity + kind.acceleration)
    assert not [name for name, times in names.items() if times > 1]
    assert len(set(kind.effort)) == kind.nv


def test_type_checkers_know_the_kinds():
    first, second = get_args(AnyKind)
    assert get_args(Kind) == tuple(KINDS) and {*get_args(first), *get_args(second)} == set(ANY_NAME)


def test_rows_say_what_models_say(model):
    assert {joint.kind for joint in model.joints} == set(KINDS)
    for joint in model.joints:
        kind = KINDS[joint.kind]
        assert (joint.nq, joint.nv, joint.quaternion) == (kind.nq, kind.nv, kind.quaternion)


def test_velocities_are_rates_where_the_row_says_so(model):
    rng = np.random.default_rng(3)
    q, v = model.neutral(), rng.normal(size=model.nv)
    moved = model.integrate(q, v)
    for joint in model.joints:
        if not joint.nq:
            continue
        kind = KINDS[joint.kind]
        of_q, of_v = slice(joint.q_index, joint.q_index + joint.nq), slice(joint.v_index, joint.v_index + joint.nv)
        is_sum = joint.nq == joint.nv and np.allclose(moved[of_q], q[of_q] + v[of_v], rtol=0, atol=1e-12)
        assert is_sum == kind.velocity_is_rate, joint.name


def test_readers_know_both_names():
    for kind in _core.joint_kinds:
        if kind.other_name and kind.name != "helical":  # which needs a pitch
            b = ksl.Builder("r").add_link("a").add_link("b", mass=1.0)
            axis = {"axis": (0, 0, 1)} if kind.has_axis else {}
            b.add_joint("j", kind.other_name, "a", "b", **axis)
            assert b.build(masses="optional").joint("j").kind == kind.name
