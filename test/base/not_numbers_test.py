"""What is no array of numbers is refused by every function that takes one: nothing is turned into numbers that nobody meant."""

import datetime
import fractions
from decimal import Decimal

import numpy as np
import pytest

import ksl
from ksl import consistency, ufuncs
from ksl.load_cases.wrench_table import motion_of_arrays

ARM = """<robot name="arm"><link name="a"/><link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
</link><joint name="h" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"""
NOT_NUMBERS = {
    "masked": lambda n: np.ma.masked_array(np.ones(n), [True] * n),
    "mask without a masked value": lambda n: np.ma.masked_array(np.ones(n)),
    "masked in a list": lambda n: [np.ma.masked] * n,
    "dates": lambda n: np.array(["2020-01-01"] * n, "M8[D]"),
    "durations": lambda n: np.ones(n, "m8[s]"),
    "texts": lambda n: np.array(["1.5"] * n),
    "list of texts": lambda n: ["1.5"] * n,
    "bytes": lambda n: np.array([b"1"] * n),
    "text objects": lambda n: np.array(["1.5"] * n, object),
    "nothing": lambda n: [None] * n,
    "complex": lambda n: np.ones(n, complex),
    "date objects": lambda n: [datetime.datetime(2020, 1, 1)] * n,
    "records": lambda n: np.zeros(n, [("x", "f8")]),
    "bytearray": lambda n: bytearray(n),
}
NUMBERS = {
    "integers": lambda n: [1] * n,
    "float32": lambda n: np.ones(n, "f4"),
    "Decimal": lambda n: [Decimal("1.5")] * n,
    "Fraction": lambda n: [fractions.Fraction(3, 2)] * n,
    "Python floats as objects": lambda n: np.array([1.5] * n, object),
    "other byte order": lambda n: np.ones(n, ">f8"),
}


@pytest.fixture(scope="module")
def arm():
    return ksl.load_string(ARM)


def calls(m):
    z = np.zeros(1)
    square = lambda x: np.resize(x, (4, 4)) if type(x) is np.ndarray else x
    return {
        "inverse_dynamics": (1, lambda x: m.inverse_dynamics(x, z, z)),
        "forward_dynamics": (1, lambda x: m.forward_dynamics(z, z, x)),
        "mass_matrix": (1, lambda x: m.mass_matrix(x)),
        "integrate": (1, lambda x: m.integrate(z, x)),
        "interpolate": (1, lambda x: m.interpolate(z, z, np.reshape(x, ()) if type(x) is np.ndarray else x[0])),
        "external": (6, lambda x: m.inverse_dynamics(z, z, z, external={"b": x})),
        "gravity": (3, lambda x: ksl.load_string(ARM, gravity=x)),
        "payload": (3, lambda x: m.with_payload("b", 1.0, x)),
        "mass": (1, lambda x: m.with_payload("b", x[0], (0, 0, 0))),
        "point": (3, lambda x: m.reactions(z, z, z, at=x)),
        "parameters": (10, lambda x: consistency.pseudo_inertia(x)),
        "poses": (16, lambda x: ufuncs.poses(square(x) if type(x) is np.ndarray else x)),
        "motion": (8, lambda x: motion_of_arrays(m, np.arange(8.0), np.reshape(x, (8, 1)) if type(x) is np.ndarray else [[v] for v in x])),
        "times": (8, lambda x: motion_of_arrays(m, x, np.zeros((8, 1)))),
    }


NUMBER_BY_NUMBER = ("mass", "interpolate", "motion")
"""Calls that take a single number, or lists of such: each number of a mask without a masked value, or of a bytearray, is one."""
NAMES = [
    "inverse_dynamics", "forward_dynamics", "mass_matrix", "integrate", "interpolate", "external", "gravity", "payload", "mass", "point", "parameters",
    "poses", "motion", "times",
]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "kind"),
    [(name, kind) for name in NAMES for kind in NOT_NUMBERS if not (name in NUMBER_BY_NUMBER and kind in ("mask without a masked value", "bytearray"))],
)
def test_what_is_no_number_is_refused(arm, name, kind):
    size, call = calls(arm)[name]
    with pytest.raises((ValueError, TypeError)) as caught:
        call(NOT_NUMBERS[kind](size))
    said = str(caught.value)
    assert "\n" not in said and "incompatible" not in said and len(said) < 600, said


@pytest.mark.parametrize("kind", NUMBERS)
@pytest.mark.parametrize("name", ["inverse_dynamics", "external", "gravity", "parameters", "motion"])
def test_numbers_of_any_kind_are_taken(arm, name, kind):
    size, call = calls(arm)[name]
    call(NUMBERS[kind](size))


@pytest.mark.parametrize("bad", [True, 1.5, "2", [1], -1, float("nan")], ids=repr)
def test_counts_of_threads(arm, bad):
    z = np.zeros((4, 1))
    with pytest.raises(ValueError, match="expected how many threads"):
        arm.inverse_dynamics(z, z, z, threads=bad)
    with pytest.raises(ValueError, match="expected how many threads"):
        ufuncs.set_threads(bad)


def test_false_is_no_number_of_threads():
    with pytest.raises(ValueError, match="expected how many threads"):
        ufuncs.set_threads(False)


@pytest.mark.parametrize("many", [2**31, 2**63, 2**70])
def test_more_threads_than_an_integer_holds(arm, many):
    z = np.zeros((4, 1))
    assert np.array_equal(arm.inverse_dynamics(z, z, z, threads=many), arm.inverse_dynamics(z, z, z))
    with pytest.raises(ValueError, match="1 to 4096"):
        ufuncs.set_threads(many)


@pytest.mark.parametrize("bad", [[1], 1, "b", {"b": [1]}, {1: [1] * 6}, {"b": None}, [("b", [0] * 6)]], ids=repr)
def test_external_wrenches_that_are_none(arm, bad):
    z = np.zeros(1)
    for call in (arm.inverse_dynamics, arm.forward_dynamics, arm.reactions):
        arguments = (z, z, z)
        with pytest.raises(ValueError):
            call(*arguments, external=bad)


def test_an_array_of_an_accelerator_is_refused_with_its_device(arm):
    class OfAnAccelerator:
        device = "cuda:0"

        def __array__(self, *_, **__):
            raise TypeError("can't convert cuda:0 device type tensor to numpy")

    with pytest.raises(
        ValueError,
        match=r"q is on cuda:0, which this call can't reach; m.compile.* makes calls that do, or move it to the processor's memory: .cpu\(\) in torch",
    ):
        arm.gravity_torque(OfAnAccelerator())
