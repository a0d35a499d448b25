"""Times that were rounded: accelerations are those of the motion, which is a formula, and not of the rounding."""

import numpy as np
import pytest

import ksl
from ksl.motions.reading import read_external, read_motion
from ksl.motions.columns.even_times import MANY, even_again, spacing_of

EPOCH = 1772366400
N = np.arange(1201)


def rounded(t, digits):
    return np.array([float(f"{x:.{digits}g}") for x in t])


@pytest.mark.parametrize(
    ("hz", "as_stored", "said"),
    [
        (300, lambda t: np.round(t, 3), "rounded to 0.001 s"), (120, lambda t: np.floor(t * 1000) / 1000, "rounded to 0.001 s"), (59.94, lambda t: np.round(t, 3), "rounded to 0.001 s"),
        (1024, lambda t: np.round(t, 4), "rounded to 0.0001 s"), (1000, lambda t: t.astype(np.float32).astype(float), "rounded to 1.2e-07 s"), (300, lambda t: rounded(t, 5), "rounded to 0.0001 s"),
        (1000, lambda t: EPOCH + t, "rounded to 2.4e-07 s"), (1000, lambda t: EPOCH * 1e9 + np.round(t * 1e9), "rounded to 2.6e-07 s"),
        (1000, lambda t: t, ""), (400, lambda t: np.round(t, 4), ""),
    ],
)  # fmt: skip
def test_accelerations_are_those_of_the_motion(leg, tmp_path, hz, as_stored, said):
    t = N / hz
    file = tmp_path / "m.npz"
    np.savez(file, time=as_stored(t), hip=np.sin(3 * t), slide=0 * t)
    motion = read_motion(leg, file)
    assert np.abs(motion.a[:, 0] + 9 * np.sin(3 * t)).max() < 1e-3 and not motion.doubts
    assert said in (notes := "\n".join(motion.source.notes)) and ("their steps are even within that" in notes) == bool(said), notes


def test_what_keeps_its_times():
    """Few samples, steps that differ by more than digits say, and two recordings of which one is later than the other."""
    random = np.random.default_rng(0)
    for t in (
        np.cumsum(np.resize([2.0, 3.0], MANY - 1)), np.round(N / 300 + random.uniform(-1e-3, 1e-3, len(N)), 3), np.sort(np.append(N * 0.01, N * 0.01 + 0.004)), N * 0.001,
        np.cumsum(random.uniform(0.005, 0.015, 100)), np.append(N * 0.001, np.nan),
    ):  # fmt: skip
        assert even_again(t, np.spacing(t)) == (t, "") or np.array_equal(even_again(t, np.spacing(t))[0], t, equal_nan=True)


def test_lost_and_repeated_samples_keep_their_places():
    t = np.delete(N / 300, [50, 51, 700])
    given = np.round(np.append(t, t[100]), 3)[::-1]
    found, said = even_again(given, spacing_of(given))
    assert np.abs(found[:0:-1] - t).max() < 1e-5 and found[0] == found[len(t) - 100] and "0.0033333" in said


def test_wrenches_at_the_times_of_the_motion(leg, tmp_path):
    motion, wrenches = tmp_path / "m.csv", tmp_path / "w.csv"
    for file, names in ((motion, "time,hip,slide"), (wrenches, f"time,{leg.link_names[-1]}.fx,{leg.link_names[-1]}.fz")):
        np.savetxt(file, np.c_[np.round(N / 300, 3), np.sin(N / 100), 0 * N], delimiter=",", header=names, comments="")
    found = read_external(leg, wrenches, ksl.read_motion(leg, motion).time)
    assert np.array_equal(found[leg.link_names[-1]][:, 0], np.sin(N / 100))
