"""Messages of joint states in memory: several publishers, in any order, of joints that move steadily, so that splines between samples are exact."""

from types import SimpleNamespace

import numpy as np
import pytest

from ksl.base.errors import MotionError
from ksl.motions.files.joint_states import JointStates, JointStateTable

MS = 1_000_000
START = 1_760_000_000_000_000_000
PLACE, SPEED = {"a": 1.0, "b": -2.0, "c": 0.5, "d": 3.0}, {"a": 0.5, "b": 2.0, "c": -1.0, "d": 0.25}


def message(names, stamp, log=None, velocity=True, position=None, effort=()):
    t = (stamp - START) * 1e-9
    position = [PLACE[n] + SPEED[n] * t for n in names] if position is None else position
    header = SimpleNamespace(stamp=SimpleNamespace(sec=stamp // 10**9, nanosec=stamp % 10**9))
    return (stamp if log is None else log), SimpleNamespace(
        name=list(names), position=position, velocity=[SPEED[n] for n in names] if velocity else [], effort=list(effort), header=header
    )


def table(messages, **options):
    return JointStateTable(JointStates("file", "/joints", messages), "bag", options.get("positions_only", False))


@pytest.mark.parametrize("seed", range(12))
def test_joints_of_several_publishers(seed):
    """All are given at the times of those that are recorded most often, as long as all are."""
    rng = np.random.default_rng(seed)
    groups = [["ab", "cd"], ["abc", "d"], ["abcd"], ["ab", "bcd"]][seed % 4]
    messages, stamps = [], {name: set() for name in "abcd"}
    for names in groups:
        times = START + MS * np.sort(rng.choice(400, int(rng.integers(40, 90)), replace=False)) + MS * int(rng.integers(0, 30))
        for t in times.tolist():
            messages.append(message(names if rng.random() < 0.5 else names[::-1], t))
            for name in names:
                stamps[name].add(t)
    repeated = [messages[k] for k in rng.choice(len(messages), 3, replace=False)]
    messages += [(m[0], SimpleNamespace(**vars(m[1]) | {"position": list(m[1].position)})) for m in repeated]
    order = rng.permutation(len(messages))
    found = table([messages[k] for k in order])
    assert found.names[0] == "time" and sorted(found.names[1:]) == sorted([*"abcd", *(f"{n}.v" for n in "abcd")])
    columns = found.read(found.names)
    first, last = max(min(x) for x in stamps.values()), min(max(x) for x in stamps.values())
    most = max(stamps.values(), key=len)
    at = np.array(sorted(t for t in most if first <= t <= last))
    assert columns["time"] == pytest.approx((at - at[0]) * 1e-9, abs=1e-12)
    for name in "abcd":
        assert columns[name] == pytest.approx(PLACE[name] + SPEED[name] * (at - START) * 1e-9, abs=1e-9) and columns[f"{name}.v"] == pytest.approx(SPEED[name])
    notes = "\n".join(found.notes)
    assert "of another left out: the last one of each time is used" in notes and "of /joints older than the one before: sorted by time" in notes
    assert (f"{len(most) - len(at)} samples before or after the time that all joints" in notes) == (len(most) - len(at) > 1)
    assert f"time 0 is {np.datetime64(int(at[0]) // MS, 'ms')} UTC of the header stamps" in notes


def said(stamps, **options):
    """The notes about messages of one joint with these header stamps, ns, and times of the log one after the other."""
    found = table([message("a", t, START + k * MS, **options) for k, t in enumerate(stamps)])
    columns = found.read(found.names)
    return "\n".join(found.notes), columns


@pytest.mark.parametrize(
    ("stamps", "log"),
    [
        ([START + k * MS for k in range(8)], None), ([0, *(START + k * MS for k in range(7))], "stamps of 1 of 8 messages are zero"), ([0] * 8, "header stamps are zero"),
        ([START + k * 100 * MS for k in (0, 1, 2, 3, 4, 5, 6, 1)], None), ([START + k * 100 * MS for k in (0, 1, 2, 3, 4, 5, 6)] + [START + 99 * MS], "jump back by 0.501 s"),
        ([START + k // 2 * MS for k in range(8)], "stand still"), ([START + max(0, k - 3) * MS for k in range(8)], None), ([START] * 2, None), ([START] * 3, "stand still"),
        ([2 * k * MS for k in range(8)], None), ([0, 0, *(k * MS for k in range(1, 7))], "stamps of 2 of 8 messages are zero"), ([0, *((k + 9) * MS for k in range(7))], "stamps of 1 of 8"),
    ],
)  # fmt: skip
def test_whose_times_are_used(stamps, log):
    """Those of the log where a stamp is zero, where one is more than half a second older than the one before, and where half of them stand still."""
    notes, columns = said(stamps)
    assert ("times are those of the log, since header stamps " in notes) == (log is not None) and (log or "") in notes
    expected = sorted(set(stamps)) if log is None else [START + k * MS for k in range(len(stamps))]
    assert columns["time"] == pytest.approx((np.array(expected) - expected[0]) * 1e-9)


@pytest.mark.parametrize(("longest", "count"), [(5.0, 0), (5.01, 1), (9.0, 1), (7.0, 2)])
def test_gaps_of_recordings(longest, count):
    """Longer than five median steps; the longest is said, with its place."""
    steps = [10] * 6 + [10 * longest] + [10] * 4 + [60 if count == 2 else 10] + [10] * 3
    notes, _ = said([START + int(x * MS) for x in np.cumsum([0, *steps])])
    words = f"joint states of a have {count} gap{'s' if count > 1 else ''}, the longest of {longest / 100:.4g} s, 0.06 s after their start"
    assert (words in notes) == bool(count) and ("gap" in notes) == bool(count)
    assert ["gap" in said([START + k * MS for k in at])[0] for at in ((0, 1, 90), (0, 1, 2, 90))] == [False, True], "two steps have no usual one"


def test_gaps_of_a_publisher_beside_another():
    both = [message("a", START + k * MS, position=[0.0]) for k in range(40)] + [
        message("b", START + k * MS + 3, position=[0.1 * k]) for k in range(40) if not 10 < k < 30
    ]
    found = table(both)
    found.read(found.names)
    assert [d[:54] for d in found.doubts] == ["no samples of b between 0.009 s and 0.029 s, 20 median"], found.doubts


@pytest.mark.parametrize(("seconds", "date"), [(100_000_000, False), (100_000_001, True)])
def test_where_time_0_is(seconds, date):
    notes, _ = said([seconds * 10**9 + k * MS for k in range(8)])
    assert ("UTC of the header stamps" in notes) == date and (f"time 0 is {seconds} s of the header stamps" in notes) != date


@pytest.mark.parametrize(("moved", "used"), [(0.00099, True), (0.00101, False)])
def test_velocities_that_were_filled_in(moved, used):
    """All zero, while a position changes by more than a thousandth; not numbers; or not in every message."""
    messages = [message("ab", START + k * MS, position=[moved * (k == 3), 0.0]) for k in range(8)]
    for _, m in messages:
        m.velocity = [0.0, 0.0]
    found = table(messages)
    assert ("a.v" in found.names) == used == ("velocities of a, b are not used: they are zero in every message" not in "\n".join(found.notes))
    messages[2][1].velocity = [np.nan, 1.0]
    assert [n for n in table(messages).names if n.endswith(".v")] == ["b.v"]
    messages[2][1].velocity = []
    assert table(messages).names == ["time", "a", "b"]


def test_messages_that_are_refused():
    whole = [message("ab", START + k * MS) for k in range(8)]
    for bad, words in (
        (message("ab", START, position=[1.0]), "names 2 joints, but has 1 position"), (message("aa", START), "name the joint 'a' twice"), (message("ab", START, log=1 << 62), "after the year 2116"),
        (message("ab", START, log=-(1 << 62)), "after the year 2116"), (message("ab", 1 << 62), "after the year 2116"),
    ):  # fmt: skip
        with pytest.raises(MotionError, match=words):
            table([*whole, bad])
    table([*whole, message("ab", START, log=(1 << 62) - 1)])
    left = table([*whole, message("ab", START, position=[]), message("ab", START + 9 * MS, effort=[1.0, 2.0])])
    assert "1 message without positions left out" in left.notes and "efforts in the messages are not used" in left.notes
    with pytest.raises(MotionError, match="has 2 messages, none with positions"):
        table([message("ab", START, position=[])] * 2)
    with pytest.raises(MotionError, match=": a and b are never recorded at the same time"):
        found = table(
            [message("c", START + k * MS) for k in range(-4, 20)]
            + [message("a", START + k * MS) for k in range(8)]
            + [message("b", START + (8 + k) * MS) for k in range(8)]
        )
        found.read(found.names)
