"""What recorders leave behind, in files of every format: the motion is that of the clean file, and a note says what was done."""

import io
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import ksl
from chains import SLIDE
from ksl.base.errors import MotionError
from ksl.motions.reading import read_motion
from ksl.motions.signal.ordered import check_restart, ordered, recordings
from ksl.motions.signal.rates import derivative, derivatives
from ksl.motions.signal.resampling import on_spline

T = np.linspace(0, 2, 201)
NAN = np.nan
CLEAN = {"time": T, "hip": np.sin(3 * T), "slide": np.cos(2 * T)}


def rows(at, **changes):
    return {n: x[at] for n, x in CLEAN.items()} | changes


def with_close(offset):
    """Sample 100 stands there twice, the first time `offset` s earlier, as if the samples had come together."""
    at = np.sort([*range(201), 100])
    time = T[at].copy()
    time[100] -= offset
    return rows(at, time=time)


def merged():
    """Two topics in one table: hip every 10 ms, slide 4 ms later every 20 ms, each beside empty cells."""
    later = T[:-1:2] + 0.004
    time, hip = np.concatenate([T, later]), np.concatenate([np.sin(3 * T), np.full(len(later), NAN)])
    order = np.argsort(time)
    return {"time": time[order], "hip": hip[order], "slide": np.concatenate([np.full(len(T), NAN), np.cos(2 * later)])[order]}


SWAPPED = np.arange(201)
SWAPPED[[50, 51]] = 51, 50
DISORDERS = {
    "velocities that are not numbers": (
        rows(slice(None)) | {"hip.v": np.full(201, NAN)},
        "velocities of hip are not used: they are zero in every sample, or not numbers",
        201,
    ),
    "velocities of zero": (
        rows(slice(None)) | {"hip.v": np.zeros(201), "slide.v": np.zeros(201)},
        "velocities of hip, slide are not used: they are zero in every sample, or not numbers",
        201,
    ),
    "missing positions": (
        rows(slice(None), hip=np.where(T == 1.0, NAN, CLEAN["hip"]), slide=np.where(T == 1.0, NAN, CLEAN["slide"])),
        "1 sample of hip, slide left out",
        200,
    ),
    "a missing position of one joint": (rows(slice(None), hip=np.where(T == 1.0, NAN, CLEAN["hip"])), "200 samples of hip are at other times", 201),
    "topics merged": (
        merged(),
        "100 samples of slide are at other times than those of the joints recorded most often: interpolated by splines onto these 198",
        198,
    ),
    "out of order": (rows(SWAPPED), "1 sample older than the one before: sorted by time", 201),
    "repeated": (rows(np.sort([*range(201), 100])), "1 sample with the time of another left out: the last one of each time is used", 201),
    "5 µs apart": (with_close(5e-6), "1 sample less than 1% of the median step before the next left out", 201),
    "a rounding error apart": (with_close(1e-15), "of another left out|before the next left out", 201),
}


def in_format(format, columns):
    if format == "csv":
        cell = lambda x: "" if np.isnan(x) else repr(float(x))
        return "\n".join([",".join(columns), *(",".join(map(cell, row)) for row in zip(*columns.values()))]) + "\n"
    out = io.BytesIO()
    if format == "npz":
        np.savez(out, **columns)
    else:
        pq.write_table(pa.table(columns), out)
    return out.getvalue()


@pytest.mark.parametrize("format", ["csv", "npz", "parquet"])
@pytest.mark.parametrize("what", DISORDERS)
def test_disorder(leg, tmp_path, what, format):
    columns, note, samples = DISORDERS[what]
    text = in_format(format, columns)
    (tmp_path / "motion").write_bytes(text if isinstance(text, bytes) else text.encode())
    m = read_motion(leg, tmp_path / "motion")
    assert any(part in n for n in m.source.notes for part in note.split("|")) and not any(n.startswith("0 ") for n in m.source.notes), m.source.notes
    assert len(m.time) == samples and not m.doubts and not m.contradictions
    # the second derivatives of the closed form: a spline through a disorder is off by far more than this
    inside = slice(8, -8)
    expected = np.column_stack([np.sin(3 * m.time), np.cos(2 * m.time)]), np.column_stack([-9 * np.sin(3 * m.time), -4 * np.cos(2 * m.time)])
    assert np.abs(m.q - expected[0]).max() < 1e-5
    assert np.abs(m.a - expected[1])[inside].max() < 0.02


def test_clean_samples_stay_as_they_are(leg, tmp_path):
    (tmp_path / "motion").write_bytes(in_format("npz", CLEAN))
    m = read_motion(leg, tmp_path / "motion")
    assert np.array_equal(m.time, T) and np.array_equal(m.q[:, 0], CLEAN["hip"]) and m.source.notes == []


@pytest.mark.parametrize("samples", [3, 21, 201])
@pytest.mark.parametrize("start", [0.0, 1.7e9])
@pytest.mark.parametrize("times", [2, 5])
def test_several_recordings_in_one_file_are_not_sorted_into_each_other(leg, tmp_path, samples, start, times):
    """As the episodes of a data set: also those that are shorter than samples may be late."""
    columns = {n: np.tile(x[:samples], times) for n, x in CLEAN.items()}
    columns["time"] += start
    said = rf"sample {samples + 1}: time .* {times} recordings follow one another, the first in {samples} samples: give the one"
    (tmp_path / "motion").write_bytes(in_format("parquet", columns))
    with pytest.raises(ksl.MotionError, match=said):
        read_motion(leg, tmp_path / "motion")
    (tmp_path / "efforts").write_bytes(in_format("parquet", {"time": columns["time"], "hip.effort": columns["hip"]}))
    with pytest.raises(ksl.MotionError, match=said):
        ksl.read_efforts(leg, tmp_path / "efforts")


@pytest.mark.parametrize(
    ("steps", "starts"),
    [
        ([], [0]), ([1, 1, 1, 1, 1], [0]), ([1, 1, -2, 1, 1], [0, 3]), ([1, 1, -3, 1, 1], [0, 3]), ([1, 1, -1, 1, 1], [0, 3]), ([1, 1, -3.1, 1, 1], [0]), ([1, 1, -0.9, 1, 1], [0]),
        ([1, 1, 1, -1, 1, 1], [0]), ([1, 1, -2, 1, 1, -2, 1, 1], [0, 3, 6]), ([1, 1, -2, 1], [0]), ([-1, -1, -1], [0]), ([1, 1, 1, -2, 1, 1], [0, 4]),
    ],
)  # fmt: skip
@pytest.mark.parametrize("first", [0.0, 100.0])
def test_where_recordings_begin(steps, starts, first):
    """Of three samples at least, within one step of the first time of all, and behind what came before by less than two steps."""
    assert recordings(np.cumsum([first, *steps])).tolist() == starts


def test_what_is_in_order_is_as_it_was(leg):
    time, values, rows = np.arange(4.0), {"hip": np.ones(4), "slide": np.zeros(4)}, np.arange(4)
    for n in (0, 1, 4):
        given = time[:n], {name: x[:n] for name, x in values.items()}, rows[:n]
        found = ordered("m", leg.joints[:2], *given)
        assert (found.time is given[0], found.rows is given[2], found.notes) == (True, True, [])
        assert all(found.values[name] is x for name, x in given[1].items())


@pytest.mark.parametrize("first", ["hip", "slide"])
def test_joints_that_are_recorded_one_after_the_other(leg, tmp_path, first):
    columns = rows(slice(None))
    for name in ("hip", "slide"):
        columns[name] = np.where((T < 1) == (name == first), columns[name], NAN)
    (tmp_path / "motion").write_bytes(in_format("npz", columns))
    other = "slide" if first == "hip" else "hip"
    with pytest.raises(ksl.MotionError, match=f"{first} and {other} are never recorded at the same time"):
        read_motion(leg, tmp_path / "motion")


@pytest.mark.parametrize("late", [[0], [2], [0, 1], [5, 6, 7]])
def test_late_samples_are_no_recordings(leg, tmp_path, late):
    """Of one recording, wherever they come: those of its beginning, too."""
    order = np.r_[np.setdiff1d(np.arange(30), late), late, np.arange(30, 201)]
    (tmp_path / "motion").write_bytes(in_format("npz", rows(order)))
    m = read_motion(leg, tmp_path / "motion")
    assert np.array_equal(m.time, T) and any("sorted by time" in n for n in m.source.notes)


def test_a_clock_that_was_set_back_is_no_recording(leg, tmp_path):
    (tmp_path / "motion").write_bytes(in_format("npz", rows(slice(None), time=np.where(T > 1.2, T - 0.7, T))))
    with pytest.raises(ksl.MotionError, match="times must increase: sort the samples and remove repeated ones"):
        read_motion(leg, tmp_path / "motion")


@pytest.mark.parametrize("names", [("sec", "nanosec"), ("header.stamp.sec", "header.stamp.nanosec"), ("secs", "nsecs"), ("stamp_sec", "stamp_nanosec")])
@pytest.mark.parametrize("start", [0, 1_700_000_000])
def test_stamps_in_two_columns(leg, tmp_path, names, start):
    ticks = np.round(T * 1e9).astype(np.int64)
    columns = {names[0]: ticks // 10**9 + start, names[1]: ticks % 10**9, "hip": CLEAN["hip"], "slide": CLEAN["slide"]}
    (tmp_path / "motion").write_text("\n".join([",".join(columns), *(",".join(map(str, row)) for row in zip(*columns.values()))]) + "\n")
    m = read_motion(leg, tmp_path / "motion")
    assert np.abs(m.time - T).max() < 1e-9
    assert f"columns {names[0]!r} and {names[1]!r} are taken as seconds and nanoseconds of the time" in m.source.notes
    assert any("2023-11-14T22:13:20" in n for n in m.source.notes) == bool(start)


def rostopic(velocity="0.5"):
    head = "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.name0,field.name1,field.position0,field.position1,field.velocity0,field.velocity1"
    stamp = 1_700_000_000_000_000_000
    lines = [
        f"{stamp + int(t * 1e9) + 7},{k},{stamp + round(t * 1e9)},base,slide,hip,{np.cos(2 * t)!r},{np.sin(3 * t)!r},{velocity},nan" for k, t in enumerate(T)
    ]
    return "\n".join([head, *lines]) + "\n"


def test_what_rostopic_prints(leg, tmp_path):
    (tmp_path / "motion.csv").write_text(rostopic().replace("np.float64(", "").replace(")", ""))
    m = read_motion(leg, tmp_path / "motion.csv", positions_only=True)
    assert np.abs(m.time - T).max() < 1e-9 and np.abs(m.q - np.column_stack([np.sin(3 * T), np.cos(2 * T)])).max() == 0
    assert "rostopic" in m.source.format and any("header stamps" in n for n in m.source.notes)
    given = read_motion(leg, tmp_path / "motion.csv")
    assert any(n.startswith("velocities of hip are not used") for n in given.source.notes)


def test_lists_of_parquet_take_a_map(leg, tmp_path):
    state = np.column_stack([CLEAN["slide"], CLEAN["hip"]])
    for kind in (pa.list_(pa.float32()), pa.list_(pa.float64(), 2)):
        table = pa.table({"timestamp": T, "observation.state": pa.array(list(state), kind), "task": pa.array([["pick"]] * 201)})
        pq.write_table(table, tmp_path / "motion.parquet")
        by = {"observation.state[1]": "hip", "observation.state[0]": "slide"}
        m = read_motion(leg, tmp_path / "motion.parquet", map=by, ignore_extra=True)
        assert np.abs(m.q - state[:, ::-1]).max() < 1e-6
        with pytest.raises(ksl.MotionError, match=r"column 'task', which holds lists \('list"):
            read_motion(leg, tmp_path / "motion.parquet", map=by)
        with pytest.raises(ksl.MotionError, match=r"unknown column 'observation.state\[0\]'"):
            read_motion(leg, tmp_path / "motion.parquet")
    others = {"groups of columns": pa.array([{"hip": 1.0}] * 201), "truth values": pa.array([True] * 201), "text": pa.array(["a"] * 201)}
    for words, column in others.items():
        pq.write_table(pa.table({"time": T, "hip": T, "slide": T, "more": column}), tmp_path / "motion.parquet")
        with pytest.raises(ksl.MotionError, match=rf"column 'more', which holds {words} \("):
            read_motion(leg, tmp_path / "motion.parquet")
    by = {"timestamp": "time", "s[0]": "hip", "s[2]": "slide"}
    for odd, words in (([1.0, 2.0], "a list of 2 numbers"), ([], "a list of 0 numbers"), (None, "no list")):
        ragged = pa.table({"timestamp": T, "s": pa.array([[1.0, 2.0, 3.0]] * 180 + [odd] + [[1.0, 2.0, 3.0]] * 20, pa.list_(pa.float64()))})
        pq.write_table(ragged, tmp_path / "motion.parquet")
        with pytest.raises(ksl.MotionError, match=f"sample 181: column 's' holds {words}; expected 3 in each row"):
            read_motion(leg, tmp_path / "motion.parquet", map=by, ignore_extra=True)
    with pytest.raises(
        ksl.MotionError, match="column 'time' is not in .*motion.parquet, but 'timestamp' is; a map says what a column is.*: 'timestamp' = 'time'"
    ):
        read_motion(leg, tmp_path / "motion.parquet", map={"time": "timestamp", "hip": "s[0]", "slide": "s[2]"})


def test_numbers_that_overflow_between_samples(leg, tmp_path):
    """Positions beside given velocities are not differentiated, where such numbers are refused."""
    hip = ["0", "-1e308", "-1", "", "0", "0", "0", ""]
    rows = [f"{k / 100},{x},{int(k > 0)},0,0" for k, x in enumerate(hip)]
    (tmp_path / "motion.csv").write_text("\n".join(["time,hip,slide,hip.v,slide.v", *rows]) + "\n")
    with pytest.raises(ksl.MotionError, match="a position, interpolated, is not finite; "):
        read_motion(leg, tmp_path / "motion.csv")


def test_times_too_close_for_a_spline_are_said_with_their_joints():
    """Two samples at times that differ by less than rounding of the others: found by a fuzzer, which got an error of SciPy."""
    close = np.array([0.0, 1e-300, 2e-300, 1.0, 2.0, 3.0, 4.0])
    with pytest.raises(ksl.MotionError, match="times are so close to each other"):
        on_spline(close, np.zeros((7, 1)), np.array([0.5]))
    with pytest.raises(ksl.MotionError, match="times are so close to each other"):
        on_spline(np.array([0.0, 1.0, 1.0, 2.0]), np.zeros((4, 1)), np.array([0.5]))
    for call in (lambda: derivative(close, np.zeros(7)), lambda: derivatives(close, np.zeros((7, 1)), 2)):
        with pytest.raises(ksl.MotionError, match="check their unit"):
            call()


@pytest.mark.parametrize(
    ("times", "at"),
    [
        ([0, 1, 0.5, 2], None),
        ([0, 1, 0.4999, 2], 2),
        ([0, 1, 1, 1], 2),
        ([0, 1, 2, 2, 2.5], None),
        ([0, 0, 0, 1], 1),
        ([0, 0, 1, 1], 1),
        ([0, 0, 1, 1, 2], None),
        ([3.0], None),
    ],
)
def test_times_that_go_back_or_stand_still(times, at):
    assert check_restart(np.array(times, dtype=float)) == at


@pytest.mark.parametrize(("share", "left"), [(0.0099, 9), (0.0101, 10)])
def test_samples_closer_than_a_hundredth_of_the_step_are_one(share, left):
    time = np.array([0.0, 1, 2, 3, 3 + share, 4, 5, 6, 7, 8])
    found = ordered("f", [SLIDE], time, {"slide": np.arange(10.0)}, np.arange(10))
    assert len(found.time) == left and bool(found.notes) == (left == 9)
    assert found.rows.tolist() == [k for k in range(10) if k != 3 or left == 10], "the last of them is used"


def test_which_joints_are_never_recorded_together():
    """The one that ends first, and the one that begins last: not `often`, which begins early and goes on."""
    joints = [replace(SLIDE, name=name, q_index=k, v_index=k) for k, name in enumerate(("early", "often", "late"))]
    time = np.arange(20.0)
    there = {"early": (time > 1) & (time < 9), "often": time != 3, "late": time > 10}
    with pytest.raises(MotionError, match="f: early and late are never recorded at the same time; record them together"):
        ordered("f", joints, time, {name: np.where(there[name], 1.0, np.nan) for name in there}, np.arange(20))


@pytest.mark.parametrize(("moved", "used"), [(0.00099, True), (0.00101, False)])
def test_velocities_that_are_all_zero_were_not_measured(moved, used):
    values = {"slide": np.array([0.0, moved, 0]), "slide.v": np.zeros(3)}
    assert ("slide.v" in ordered("f", [SLIDE], np.arange(3.0), values, np.arange(3)).values) == used
