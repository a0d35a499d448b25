"""Closed positions from starts far away, and where numbers are too large for any."""

import re
from pathlib import Path

import numpy as np
import pytest

from closed_mechanisms import random_case
from linkages import SLIDERCRANK, four_bar
from random_tree import load_text

ROOT = Path(__file__).resolve().parents[2]
LENGTH = 1.9  # of the four-bar, m: a search ends within 1e-12 of it, and where angles have turned often within 1e-9


def far_starts(m, n, seed=0):
    return m.random(seed, size=n)


@pytest.mark.parametrize("hold", [["A"], []], ids=["crank held", "nothing held"])
def test_a_minimum_of_the_error_is_no_reason(hold):
    """The crank turns all round, so that there is a closed position from everywhere; searches from one start find it from three of four."""
    m = four_bar()
    q = far_starts(m, 5000)
    found, alone = m.close(q, hold=hold), m.close(q, hold=hold, starts=1)
    assert found.converged.all() and np.abs(m.loop_error(found.q)).max() < 1.1e-12 * LENGTH  # angles of some rad round by a few 1e-15
    assert not hold or np.array_equal(found.q[:, 0], q[:, 0])
    assert 0.5 < alone.converged.mean() < 0.99 and set(alone.reason) <= {"closed", "not found", "singular"}
    assert np.array_equal(found.q[alone.converged], alone.q[alone.converged])
    k = int(np.argmin(alone.converged))
    assert np.array_equal(m.close(q[k], hold=hold).q, found.q[k])


@pytest.mark.parametrize("kind", ["revolute", "universal", "spherical", "cylindrical"])
def test_random_mechanisms_are_closed_from_everywhere(kind):
    c = random_case(kind, 1)
    found = c.model.close(far_starts(c.model, 200))
    assert found.converged.all() and np.abs(c.model.loop_error(found.q)).max() < 1e-11


@pytest.mark.parametrize("size", [1e6, 1e8, 1e10, 1e14, 1e20, 1e300])
@pytest.mark.parametrize("hold", [["A"], []], ids=["crank held", "nothing held"])
def test_closed_is_metres_and_radians_whatever_the_size_of_numbers(size, hold):
    m = four_bar()
    found = m.close(size * far_starts(m, 20), hold=hold)
    assert np.abs(m.loop_error(found.q))[found.converged].max(initial=0.0) <= 1e-9 * LENGTH
    assert m.mobility(m.close(m.neutral()).q).length == pytest.approx(LENGTH)
    assert found.converged.all() if size == 1e6 else size < 1e9 or not found.converged.any()
    assert (found.error[~found.converged] > 1e-10).all()


def test_what_has_no_closed_position_is_not_found():
    m = load_text(SLIDERCRANK)
    found = m.close(m.neutral() + [0, 0, 0.9], hold=["S"])
    assert not found.converged and found.reason in ("not found", "singular") and found.error > 0.1
    assert m.close(m.neutral(), hold=["A", "B", "S"]).reason == "nothing free"
    for starts in (0, True, 1.5):
        with pytest.raises(ValueError, match="expected a number of starts, 1 or more"):
            m.close(m.neutral(), starts=starts)


def test_a_search_that_fails_gives_the_best_of_its_starts():
    """Of q, and of the error that belongs to it: more starts never make it worse, and some make it better."""
    for kind, seed in (("revolute", 1), ("universal", 0), ("spherical", 1), ("cylindrical", 1)):
        m = random_case(kind, seed).model
        hold = [joint.name for joint in m.joints if joint.nv][:3]
        q = far_starts(m, 60, 1)
        tried = [m.close(q, hold=hold, starts=starts) for starts in (1, 2, 4, 8, 32)]
        fails = ~tried[-1].converged
        errors = np.array([found.error[fails] for found in tried])
        assert fails.any() and (np.diff(errors, axis=0) <= 0).all() and (errors[-1] < 0.9 * errors[0]).mean() > 0.5
        k = int(np.argmax(fails))
        for starts, found in zip((1, 2, 4, 8, 32), tried, strict=True):
            alone = m.close(q[k], hold=hold, starts=starts)
            assert np.array_equal(alone.q, found.q[k]) and alone.error == found.error[k]
            assert (found.error[fails] <= np.abs(m.loop_error(found.q[fails])).max(-1) * max(1.0, m.mobility(found.q[k]).length) * (1 + 1e-12)).all()
            assert (found.error[fails] >= np.abs(m.loop_error(found.q[fails])).max(-1) * min(1.0, m.mobility(found.q[k]).length) * (1 - 1e-12)).all()


def test_no_text_takes_a_search_that_failed_for_a_proof():
    """What was found is said: that no closed position was, and not that there is none."""
    texts = [
        file
        for folder in ("python/ksl", "src", "include", "docs")
        for file in (ROOT / folder).rglob("*")
        if file.suffix in (".py", ".cpp", ".hpp", ".h", ".md")
    ]
    texts = [file for file in texts if "decisions" not in file.parts]
    claims = re.compile(r"(can't|cannot|can not|could not)\s+be\s+closed")
    assert len(texts) > 500 and not [str(file) for file in texts if claims.search(file.read_text(encoding="utf-8"))]
