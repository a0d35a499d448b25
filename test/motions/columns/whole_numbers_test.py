"""Whole numbers of fixed width: what controllers log of a motion, against the motion itself."""

import numpy as np
import pytest

import ksl
from ksl.motions.columns.whole_numbers import continued_positions, continued_times, with_sign

T = np.arange(400)


def joint(lower=-3.0, upper=3.0, kind="revolute"):
    limit = f'<limit lower="{lower}" upper="{upper}" effort="9" velocity="9"/>' if kind == "revolute" else ""
    return (
        f'<robot name="arm"><link name="a"/><link name="b"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        f'<joint name="j" type="{kind}"><parent link="a"/><child link="b"/>{limit}</joint></robot>'
    )


def as_logged(x, bits, signed):
    """Two's complement of so many bits, or counts modulo 2^bits: what a register holds."""
    x = np.round(x).astype(np.int64) % 2**bits
    return np.where(x >= 2 ** (bits - 1), x - 2**bits, x) if signed else x


@pytest.mark.parametrize("signed", [False, True])
@pytest.mark.parametrize("bits", [10, 12, 14, 16, 20, 24, 32])
@pytest.mark.parametrize("start", [0.0, 0.49, -0.5])
def test_counters_that_wrap_go_on(bits, signed, start):
    """A motion over several turns of the counter, from any count, up to the turn that a counter doesn't tell."""
    counts = 2.0**bits * (start + 1.4 * np.sin(0.02 * T))
    read, note, doubt = continued_positions("c", as_logged(counts, bits, signed).astype(float), None)
    off = (np.round(counts) - read) / 2.0**bits
    assert np.ptp(off) == 0 and off[0] == round(off[0]) and f"wraps at 2^{bits}" in note and not doubt


@pytest.mark.parametrize("bits", [16, 32])
def test_signed_numbers_that_cross_zero_are_themselves(bits):
    x = np.round(2.0 ** (bits - 6) * np.sin(0.02 * T))
    logged = as_logged(x, bits, signed=False).astype(float)
    np.testing.assert_array_equal(continued_positions("c", logged, None).numbers, x)
    read = with_sign("c", logged)
    np.testing.assert_array_equal(read.numbers, x)
    assert f"signed numbers of {bits} bits that were logged without sign" in read.note


@pytest.mark.parametrize(
    "x",
    [
        np.sin(0.02 * T), 1e5 * np.sin(0.02 * T), np.round(5 * np.sin(0.02 * T)), np.round(40000 + 10000 * np.sin(0.02 * T)), T * 1e6, T % 7 * 1.0, np.round(360 * np.sin(0.02 * T)),
        np.round(np.random.default_rng(0).uniform(0, 65535, 400)), np.where(T < 200, 0.0, 60000.0), np.full(400, 65000.5), np.array([]), np.array([np.nan, 65535, 0.0]), T / 7 % (2 * np.pi),
        np.round(T % 360 * 1.0),
    ],
)  # fmt: skip
def test_other_numbers_stay(x):
    for read in (continued_positions("c", x, None), continued_times("c", x), with_sign("c", x)):
        assert read.numbers is x and not read.note and not read.doubt


@pytest.mark.parametrize("bits", [16, 32])
def test_negative_numbers_alone(bits):
    """Without limits a sentence asks; the limits of a joint, and ‰, tell."""
    x = as_logged(-300 - 200 * np.sin(0.02 * T), bits, signed=False).astype(float)
    for read in (continued_positions("c", x, None), with_sign("c", x)):
        assert read.numbers is x and "negative numbers that were logged without sign" in read.doubt and str(2**bits) in read.doubt
    for read in (continued_positions("c", x, lambda x: bool(np.abs(x).max() < 1e3)), with_sign("c", x, always=True)):
        np.testing.assert_array_equal(read.numbers, x - 2.0**bits)
        assert "logged without sign" in read.note and not read.doubt


@pytest.mark.parametrize("kind", ["revolute", "continuous"])
@pytest.mark.parametrize("bits, start", [(32, 0.0), (14, 0.0), (16, -2.0), (20, 2.0)])
def test_a_log_of_an_encoder_gives_the_motion(robot, written, kind, bits, start):
    """Of 2^bits counts a turn at the joint, or the 32 bits of object 0x6064 of a drive with a gear."""
    m, turn = robot(joint(kind=kind)), 2**20 * 101 if bits == 32 else 2**bits
    q = start + np.sin(0.02 * T)
    logged = as_logged(q / (2 * np.pi) * turn, bits, signed=False)
    file = written("time,c\n" + "".join(f"{t / 100},{c}\n" for t, c in zip(T, logged)))
    motion = ksl.read_motion(m, file, map={"c": {"to": "j", "unit": "rev", "scale": 1 / turn}})
    off = (motion.q[:, 0] - q) / (2 * np.pi)
    assert np.abs(off - off[0]).max() < 1 / turn and (kind == "continuous" or abs(off[0]) < 1 / turn)
    as_read = 2 * np.pi / turn * logged
    assert np.allclose(motion.q[:, 0], as_read, rtol=0, atol=1e-6) or any("2^" in note or "without sign" in note for note in motion.source.notes)
    assert not any("without sign" in doubt or "jump" in doubt for doubt in motion.doubts)


@pytest.mark.parametrize("bits, unit, step", [(32, "ms", 4), (32, "us", 4000), (16, "ms", 4)])
@pytest.mark.parametrize("signed", [False, True])
def test_clocks_that_wrap(robot, written, bits, unit, step, signed):
    m, q = robot(joint()), np.sin(0.02 * T)
    first = 2**bits - 200 * step - 1 if not signed else 2 ** (bits - 1) - 200 * step - 1
    clock = as_logged(first + step * T, bits, signed)
    motion = ksl.read_motion(m, written(f"time [{unit}],j\n" + "".join(f"{c},{x!r}\n" for c, x in zip(clock.tolist(), q.tolist()))))
    np.testing.assert_allclose(motion.time - motion.time[0], 0.004 * T, atol=1e-6)
    assert any(f"wrap at 2^{bits}" in note for note in motion.source.notes)


def test_efforts_of_a_drive_logged_without_sign(robot, written):
    """0x6077, a whole number of 16 bits in ‰: 65,535 was 65 times the rated torque."""
    m, tau = robot(joint()), np.round(300 * np.sin(0.02 * T))
    rows = "".join(f"{t},{c}\n" for t, c in zip(T, as_logged(tau, 16, signed=False)))
    by = {"columns": {"c": {"to": "j.effort", "unit": "permille", "scale": 101}}, "rated": {"j": 0.65}}
    efforts = ksl.read_efforts(m, written("time,c\n" + rows), map=by)
    np.testing.assert_allclose(efforts.tau[:, 0], 0.65e-3 * 101 * tau, rtol=1e-14, atol=1e-12)
    assert any("65535 is taken as -1" in note or "without sign" in note for note in efforts.notes) and not efforts.doubts
    alone = "".join(f"{t},{65000 + t}\n" for t in T[:100])
    assert (ksl.read_efforts(m, written("time,c\n" + alone), map=by).tau < 0).all()
    assert "logged without sign?" in ksl.read_efforts(m, written("time,c\n" + alone), map={"c": "j.effort"}).doubts[0]
