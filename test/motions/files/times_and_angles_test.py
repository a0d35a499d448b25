"""What numbers of a file mean: times that are dates, angles that no joint has, and times that are those of the motion."""

import numpy as np
import pytest

from chains import limit, robot_of
from ksl.base.errors import MotionError
from ksl.motions.reading import read_external, read_motion

K = np.arange(9.0)


def samples(first: float, scale: float, angle: float = 0.1) -> str:
    return "time,hip,slide\n" + "".join(f"{first + scale * k!r},{angle if k == 4 else 0.1},0\n" for k in range(9))


@pytest.mark.parametrize("named", ["", "own", "other"])
@pytest.mark.parametrize(("unit", "size"), [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)])
def test_times_from_2000_to_2100_are_dates(leg, written, unit, size, named):
    """9.4e8 s to 4.2e9 s since 1970, in the unit in which they are that, unless their column says another one."""
    said = {"": "", "own": unit, "other": "ms" if unit == "ns" else "ns"}[named]
    for seconds, is_date in ((9.39e8, False), (9.41e8, True), (4.19e9, True), (4.21e9, False)):
        text = samples(round(seconds / size), 512 / size).replace("time", f"time [{said}]" if said else "time", 1)
        motion = read_motion(leg, written(text))
        date = f"times are {unit} since 1970; time 0 is {np.datetime64(int(seconds), 's')}.000 UTC"
        if is_date and named != "other":
            assert motion.source.notes == [*([f"column 'time [{said}]' is taken as the time"] if said else []), date]
            assert motion.time == pytest.approx(512 * K)
        else:
            assert not any("1970" in note for note in motion.source.notes)
            assert np.diff(motion.time) == pytest.approx(512 / (size if not said else 1 if named == "own" else size * {"ns": 1e9, "ms": 1e3}[said]))


@pytest.mark.parametrize(("first", "is_date"), [(0, False), (9.39e8, False), (9.41e8, True), (4.19e9, True), (4.21e9, False)])
def test_dates_of_seconds_and_nanoseconds(leg, written, first, is_date):
    """As they are, where they are none."""
    motion = read_motion(leg, written("sec,nanosec,hip,slide\n" + "".join(f"{round(first) + k},{250 * 10**6},0.1,0\n" for k in range(9))))
    assert motion.time == pytest.approx((0 if is_date else first) + 0.25 + K, abs=1e-12)
    assert any("times are s since 1970" in note for note in motion.source.notes) == is_date


@pytest.mark.parametrize(("angle", "refused"), [(999.9, False), (1000.1, True)])
def test_angles_that_no_joint_has(leg, robot, written, angle, refused):
    """A thousand rad, or a hundred times the limit, whichever is more."""
    far = robot_of(robot, ("hip", "revolute", limit(-20, 3)), ("slide", "prismatic", limit(-9, 9)))
    for model, x in ((leg, angle), (far, 2 * angle), (far, -2 * angle)):
        path = written(samples(0.0, 0.1, x))
        if not refused:
            assert read_motion(model, path).q[4, 0] == x
            continue
        with pytest.raises(
            MotionError, match=rf"motion.csv:6: joint hip is at {x:.6g} rad, where its limit is {9 if model is leg else 20} rad; did you mean --degrees"
        ):
            read_motion(model, path)
    free = robot_of(robot, ("hip", "continuous", ""), ("slide", "prismatic", limit(-9, 9)))
    assert read_motion(free, written(samples(0.0, 0.1, 1e5).replace(",0\n", ",5000\n"))).q[4].tolist() == [1e5, 5000.0], "of neither is anything known"


def test_a_window_takes_samples_that_are_a_billionth_off(leg, written):
    path = written(samples(0.0, 0.125))
    part = lambda start, stop: read_motion(leg, path, start=start, stop=stop).time.tolist()
    assert part(0.125 + 0.9e-9, 1.0) == [0.125 * k for k in range(1, 9)] and part(0.125 + 1.1e-9, 1.0) == [0.125 * k for k in range(2, 9)]
    for ends, said in (({"start": 0.125}, True), ({"start": 0.0}, False), ({"stop": 9.0}, True)):
        assert any("used is the part from " in note for note in read_motion(leg, path, **ends).source.notes) == said
    assert part(0.0, 0.875 - 0.9e-9) == [0.125 * k for k in range(8)] and part(0.0, 0.875 - 1.1e-9) == [0.125 * k for k in range(7)]


@pytest.mark.parametrize("step", [1.0, 0.05])
@pytest.mark.parametrize(("off", "ok"), [(0.95, True), (1.05, False)])
def test_times_of_external_wrenches_are_those_of_the_motion(leg, written, off, ok, step):
    """To a billionth of 1 s, or of the largest time."""
    time = step * (2.0 + np.arange(9))
    off *= 1e-9 * max(1.0, float(time[-1]))
    path = written("time,c.fy\n" + "".join(f"{t + (off if k == 3 else 0)!r},{k}\n" for k, t in enumerate(time.tolist())))
    if ok:
        (wrench,) = read_external(leg, path, time).values()
        assert wrench[:, 1].tolist() == list(range(9)) and not wrench[:, [0, 2, 3, 4, 5]].any()
        return
    with pytest.raises(MotionError, match="its times are not those of the motion"):
        read_external(leg, path, time)
