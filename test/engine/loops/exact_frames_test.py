"""Mechanisms whose numbers are off by rounding, or by the digits of a file: right numbers, those of the exact one or of a closed form, or a sentence."""

import math
import warnings

import numpy as np
import pytest

import ksl
from linkages import FOURBAR, at, bricard, four_bar

SIZES = [0.0] + [factor * 10.0**k for k in range(-16, -1) for factor in (1.0, 2.7)]
"""rad, or m."""


def rotation(axis, angle):
    u = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    cross = np.cross(np.eye(3), u)
    return np.eye(3) + math.sin(angle) * -cross + (1 - math.cos(angle)) * cross @ cross


def random_rotation(rng):
    return rotation(rng.normal(size=3), rng.uniform(0, np.pi))


def built(builder, drives):
    """A model, and what is said of it."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        made = builder.build(drives=drives)
    return made, [str(line.message) for line in said]


def in_urdf(size, where):
    tilt = f' rpy="{size!r} 0 {size / 2!r}"'
    text = {
        "successor": FOURBAR.replace('<child_origin xyz="0.25 0.02 0"', '<child_origin xyz="0.25 0.02 0"' + tilt),
        "predecessor": FOURBAR.replace('<parent_origin xyz="0.32 0.03 0"', '<parent_origin xyz="0.32 0.03 0"' + tilt),
        "tree": FOURBAR.replace('<origin xyz="0.1 0.03 0"/><axis', f'<origin xyz="0.1 0.03 0"{tilt}/><axis'),
    }
    text["across"] = FOURBAR.replace('<child_origin xyz="0.25 0.02 0"', f'<child_origin xyz="0.25 {0.02 + size!r} 0"')
    text["both"] = text["successor"].replace('<parent_origin xyz="0.32 0.03 0"', '<parent_origin xyz="0.32 0.03 0"' + tilt)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        made = ksl.load_string(text[where], drives=["A"])
    return made, [str(line.message) for line in said]


def results(m, start):
    """By call: the numbers, or the sentence of a refusal."""
    found = {}

    def keep(call, compute):
        try:
            found[call] = np.asarray(compute())
        except (ValueError, ksl.ResultError) as error:
            found[call] = str(error)
        return found[call]

    closed = m.close(start, hold=["A"])
    if not closed.converged:
        return {"close": f"{closed.reason}"}
    q = found["close"] = closed.q
    keep("mobility", lambda: m.mobility(q).mobility)
    v = keep("velocity", lambda: m.consistent_velocity(q, [2.0, 0, 0], given=["A"]))
    a = keep("acceleration", lambda: m.consistent_acceleration(q, v, [1.0, 0, 0], given=["A"]))
    if isinstance(v, str) or isinstance(a, str):
        return found
    keep("inverse", lambda: m.inverse_dynamics(q, v, a))
    keep("forward", lambda: m.forward_dynamics(q, v, [0.5, 0, 0]))
    unique = keep("unique", lambda: m.reactions_unique(q).astype(float))
    keep("reactions", lambda: m.reactions(q, v, a, joints=m.joint_names) * unique)
    keep("derivatives", lambda: np.array(m.inverse_dynamics_derivatives(q, v, a)))
    keep("forward derivatives", lambda: np.array(m.forward_dynamics_derivatives(q, v, [0.5, 0, 0])[0]))
    keep("simulate", lambda: m.simulate(q, v, [0.0, 0.1]).q[-1])
    return found


def agree(found, exact, tolerance):
    for call, right in exact.items():
        got = found.get(call)
        if isinstance(got, str) or (got is None and any(isinstance(x, str) for x in found.values())):
            continue  # a sentence
        assert got is not None and got.shape == right.shape, call
        assert np.abs(got - right).max(initial=0) <= tolerance * max(1.0, np.abs(right).max(initial=0)), call


START = np.array([0.4, -0.5, -1.0])


@pytest.fixture(scope="module")
def exact_urdf():
    m = in_urdf(0.0, "successor")[0]
    found = results(m, m.neutral() + START)
    assert not any(isinstance(x, str) for x in found.values()) and found["mobility"] == 1
    return found


@pytest.mark.parametrize("where", ["successor", "predecessor", "both", "across", "tree"])
@pytest.mark.parametrize("size", SIZES)
def test_axes_that_are_not_quite_parallel(size, where, exact_urdf):
    m, said = in_urdf(size, where)
    found = results(m, START)
    if any("no closed position" in line or "let nothing move" in line for line in said):
        return
    assert size < 1e-3
    noted = any("made exact" in line or "few digits" in line for line in said)
    assert noted if size > 2e-11 else not noted if size < 5e-13 else True
    assert not any(isinstance(x, str) for x in found.values()), found
    agree(found, exact_urdf, 1e-8 + (100 * size if where == "tree" else 1e3 * size**2))  # the nearest exact frames, to second order


def patterns(m):
    names = [*m.joint_names, *m.loop_names]
    return m.reactions_null_basis(m.close(START, hold=["A"]).q, names).reshape(-1, 6 * len(names))


@pytest.mark.parametrize("where", ["successor", "both", "tree"])
@pytest.mark.parametrize("size", [size for size in SIZES if size < 5e-5])
def test_patterns_are_orthonormal_whatever_the_digits(size, where):
    """Components that are due to few digits are left out of all patterns; what is left is orthonormal and spans what those of the exact mechanism do."""
    exact, found = patterns(in_urdf(0.0, where)[0]), patterns(in_urdf(size, where)[0])
    assert len(found) == len(exact) == 3
    assert np.abs(found @ found.T - np.eye(3)).max() < 1e-12
    assert np.array_equal(np.any(found != 0, axis=0), np.any(exact != 0, axis=0))
    assert np.abs(found.T @ found - exact.T @ exact).max() < 1e-12 + 100 * size


@pytest.mark.parametrize("size", SIZES)
def test_a_builder_with_few_digits(size):
    def made(tilt):
        place = lambda x, R=None: at([x, 0, 0], R)
        b = ksl.Builder("four-bar").add_link("ground")
        for name, mass, length in (("crank", 1.0, 0.2), ("coupler", 2.0, 0.6), ("rocker", 1.5, 0.5)):
            b.add_link(name, mass=mass, center_of_mass=(length / 2, 0, 0), inertia=np.diag([0, 1, 1]) * mass * length**2 / 12)
        for name, parent, child, x in (("A", "ground", "crank", 0), ("B", "crank", "coupler", 0.2), ("D", "ground", "rocker", 0.6)):
            b.add_joint(name, "continuous", parent, child, pose=place(x), axis=(0, 1, 0))
        return built(b.add_loop("C", "revolute", "coupler", "rocker", place(0.6), place(0.5, rotation([1, 0, 1], tilt)), axis=(0, 1, 0)), ["A"])

    m, said = made(size)
    found = results(m, np.array([-1.0, 0.4, -1.5]))
    if said and not any("made exact" in line for line in said):
        assert size > 5e-5
        return
    assert not any(isinstance(x, str) for x in found.values())
    agree(found, results(four_bar(), np.array([-1.0, 0.4, -1.5])), 1e-8)


def test_states_of_few_digits():
    """A linkage that moves only by its dimensions, at a state that is a little open: its equations are then independent by as much."""
    m = bricard(drives=["hinge0"])
    q = m.close(m.neutral() + 0.2).q
    v = m.consistent_velocity(q, [1.0, 0, 0, 0, 0], given=["hinge0"])
    a = m.forward_dynamics(q, v, np.zeros(5))
    for digits in (12, 10, 8, 7):
        rounded = q + 10.0**-digits * np.array([1, 2, -1, 3, -2])
        assert m.mobility(rounded).mobility == 1
        at_rounded = m.consistent_velocity(rounded, v, given=["hinge0"])
        assert np.allclose(m.forward_dynamics(rounded, at_rounded, np.zeros(5)), a, rtol=0, atol=10.0 ** (3 - digits))


def turned_pair(first, second, gap, seed, noise=1e-16):
    """A body of 3 kg on two joints of the ground, whose places are `gap` apart on their common axis, in a random orientation with rounding in their offsets."""
    rng = np.random.default_rng(seed)
    R, p = random_rotation(rng), rng.uniform(-1, 1, 3)
    own = random_rotation(rng)
    rounded = lambda x: x + noise * rng.choice([-1.0, 0.0, 1.0], 3)
    inertia = rotation([1, 2, 3], 0.3) @ np.diag([0.5, 0.6, 0.7]) @ rotation([1, 2, 3], 0.3).T
    arm = np.array([0.3, 0.0, 0.2])
    b = ksl.Builder("pair", gravity=(0, 0, 0)).add_link("ground")
    b.add_link("leaf", mass=3.0, center_of_mass=own.T @ arm, inertia=own.T @ inertia @ own)
    axis, other = own.T @ [0, 0, 1], own.T @ [1, 0, 0]
    axes = lambda kind: {"axis": axis} if kind == "revolute" else {"axis": axis, "axis2": other} if kind == "universal" else {}
    b.add_joint("first", first, "ground", "leaf", pose=at(rounded(p), R @ own), **axes(first))
    upper = rounded(own.T @ [0, 0, gap])
    b.add_loop("second", second, "ground", "leaf", at(rounded(p + R @ [0, 0, gap]), R @ own), at(upper), **axes(second))
    about = inertia + 3.0 * (arm @ arm * np.eye(3) - np.outer(arm, arm))  # at the first joint, in the axes of the orientation
    return built(b, ["first"])[0], own.T @ about @ own, axis, other


@pytest.mark.parametrize(
    "first, second, gap", [("revolute", "spherical", 1.0), ("revolute", "spherical", 0.0), ("universal", "spherical", 0.0), ("spherical", "spherical", 0.0)]
)
def test_joints_whose_equations_are_rounding(first, second, gap):
    for seed in range(100):
        m, I, axis, other = turned_pair(first, second, gap, seed)
        freedoms = {"revolute": 1, "universal": 2, "spherical": 3}[first]
        q, still = m.neutral(), np.zeros(freedoms)
        S = {"revolute": axis[None], "universal": np.array([axis, other]), "spherical": np.eye(3)}[first]
        assert m.mobility(q).mobility == freedoms, seed
        M = S @ I @ S.T  # at rest, where q is zero
        tau = np.arange(1.0, freedoms + 1)
        assert np.allclose(m.forward_dynamics(q, still, tau), np.linalg.solve(M, tau), rtol=1e-9), seed
        assert np.allclose(m.inverse_dynamics(q, still, tau), M @ tau, rtol=1e-9), seed


def spherical_linkage(offset, bars, seed):
    """Bars between hinges whose axes meet, from the ground back to it, with their origins off the centre."""
    rng = np.random.default_rng(seed)
    axes = rng.normal(size=(bars + 1, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    off = lambda: offset * rng.choice([-1.0, 0.0, 1.0], 3)
    b = ksl.Builder("spherical").add_link("ground")
    for k in range(bars):
        b.add_link(f"bar{k}", mass=1.0, center_of_mass=0.1 * axes[k], inertia=np.eye(3) * 0.004)
        b.add_joint(f"j{k}", "continuous", f"bar{k - 1}" if k else "ground", f"bar{k}", pose=at(off()), axis=axes[k])
    b.add_loop("end", "revolute", f"bar{bars - 1}", "ground", at(off()), at(off()), axis=axes[bars])
    return built(b, ["j0"] if bars == 3 else [f"j{k}" for k in range(bars - 2)])


@pytest.mark.parametrize("bars", [3, 4, 5])
def test_spherical_linkages_whose_origins_are_off_by_rounding(bars):
    for seed in range(10):
        right = None
        for offset in (0.0, *(10.0**k for k in range(-17, -11)), 1e-9):
            m, said = spherical_linkage(offset, bars, seed)
            assert not said if offset < 1e-13 else said if offset > 1e-12 else True, (offset, said)
            q = m.close(m.neutral(), hold=["j0"]).q
            assert m.mobility(q).mobility == bars - 2
            a = m.forward_dynamics(q, np.zeros(bars), np.eye(bars)[0])
            right = a if right is None else right
            assert np.abs(a - right).max() <= (1e-9 + 1e4 * offset) * np.abs(right).max()
            assert np.allclose(m.inverse_dynamics(q, np.zeros(bars), a), np.eye(bars)[0], atol=1e-8 + 1e3 * offset)


def wrist():
    """Two trains of hinges A, B to one hand, the second of which follows the first, and welds that make their ends one: all equations are redundant."""
    b = ksl.Builder("wrist").add_link("ground")
    for name in ("a", "hand", "c", "other"):
        b.add_link(name, mass=1.0, center_of_mass=(0.05, 0.02, 0.1), inertia=np.eye(3) * 0.01)
    R = random_rotation(np.random.default_rng(5))
    b.add_joint("A", "continuous", "ground", "a", pose=at([0.3, 0.1, 0.7], R), axis=(1, 0, 0))
    b.add_joint("B", "continuous", "a", "hand", pose=at([0.1, 0.2, 0.3]), axis=(0, 0.6, 0.8))
    S, T = random_rotation(np.random.default_rng(6)), random_rotation(np.random.default_rng(7))  # other axes for the second train
    b.add_joint("C", "continuous", "ground", "c", pose=at([0.3, 0.1, 0.7], R @ S), axis=S.T @ [1, 0, 0], mimic=("A", 1.0, 0.0))
    b.add_joint("D", "continuous", "c", "other", pose=at(S.T @ [0.1, 0.2, 0.3], S.T @ T), axis=T.T @ [0, 0.6, 0.8], mimic=("B", 1.0, 0.0))
    b.add_loop("weld", "fixed", "hand", "other", at([0.2, 0.1, 0.4]), at(T.T @ [0.2, 0.1, 0.4], T.T))
    return b.build(drives=["A", "B"])


def test_accelerations_where_redundant_equations_are_rounding_of_velocities():
    m, rng = wrist(), np.random.default_rng(1)
    for _ in range(1000):
        q, v = rng.uniform(-3, 3, 2), rng.uniform(-100, 100, 2) * 10.0 ** rng.uniform(-3, 1)
        a = np.zeros(2)
        assert np.array_equal(m.consistent_velocity(q, v, given=["A", "B"]), v)
        assert np.allclose(m.consistent_acceleration(q, v, a, given=["A", "B"]), a, atol=1e-9)
        assert m.mobility(q).mobility == 2
