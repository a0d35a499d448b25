"""Joint states from ROS 1 bags, ROS 2 bags and MCAP, which the tests write by the libraries of these formats."""

import importlib.util
import os
import re
import shutil
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import ksl
from growth import Name, assert_linear, work
from ksl.base.files_read import InputFile, recorded
from ksl.motions.files.recognise import _describes_bag
from ksl.motions.reading import read_motion

ROOT = Path(__file__).parents[3]
KINDS = ["ros1", "ros2", "ros2 of mcap", "mcap"]
MS = 1_000_000
START = 1_760_000_000_000_000_000
STAMP = SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=0))


def load_example() -> SimpleNamespace:
    spec = importlib.util.spec_from_file_location("make_bag", ROOT / "examples" / "motions" / "make_bag.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


bag = load_example()


def write(folder: Path, kind: str, messages) -> Path:
    """messages: log time, stamp, names, positions, velocities, efforts."""
    states = [(log, stamp, names, *(np.asarray(x, dtype=float) for x in rest)) for log, stamp, names, *rest in messages]
    folder.mkdir(exist_ok=True)
    path = folder / f"recording_{kind.replace(' ', '_')}"
    if kind == "ros1":
        bag.write_ros1(path, states)
    elif kind == "mcap":
        bag.write_mcap(path, states)
    else:
        bag.write_ros2(path, states, "mcap" if "mcap" in kind else "sqlite3")
    return path


def leg_messages(n: int = 12, step: int = 10 * MS, delay: int = MS):
    """hip = t, slide = t², at rates that are given; the names are not in the order of the robot."""
    for k in range(n):
        t = k * step * 1e-9
        yield START + k * step + delay, START + k * step, ["slide", "hip"], [t**2, t], [2 * t, 1.0], []


@pytest.mark.parametrize("kind", KINDS)
def test_positions_and_velocities_by_name(leg, tmp_path, kind):
    path = write(tmp_path, kind, leg_messages())
    m = read_motion(leg, path)
    t = np.array([k * 10 * MS * 1e-9 for k in range(12)])
    assert np.array_equal(m.time, t)
    assert np.array_equal(m.q, np.column_stack([t, t**2])) and np.array_equal(m.v, np.column_stack([1 + 0 * t, 2 * t]))
    assert m.a == pytest.approx(np.column_stack([0 * t, 2 + 0 * t]), abs=1e-9)
    assert m.source.format == {"ros1": "ROS 1 bag", "mcap": "MCAP"}.get(kind, "ROS 2 bag") + ", topic /joint_states"
    assert m.source.notes == ["time 0 is 2025-10-09T08:53:20.000 UTC of the header stamps"]
    said = read_motion(leg, path, positions_only=True).differentiated
    assert said == ["velocities and accelerations of all joints differentiated from a quintic spline through the samples"]


def test_one_file_of_a_ros_2_bag(leg, tmp_path, refusal):
    for kind, suffix in (("ros2", "db3"), ("ros2 of mcap", "mcap")):
        folder = write(tmp_path, kind, leg_messages())
        (file,) = folder.glob(f"*.{suffix}")
        plain = shutil.copy(file, tmp_path / f"plain_{suffix}")
        assert np.array_equal(read_motion(leg, file).q, read_motion(leg, folder).q)
        assert np.array_equal(read_motion(leg, plain).q, read_motion(leg, folder).q), "without its suffix"
        (folder / "metadata.yaml").unlink()
        assert refusal(leg, folder).startswith(f": is a folder without metadata.yaml; give one of its recordings: {file}")


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [("metadata.yaml", "rosbag2_bagfile_information:", True), ("metadata.yaml", "names:", False), ("m.yaml", "rosbag2_bagfile_information:", False)],
)
def test_what_describes_a_bag(written, name, text, found):
    assert _describes_bag(str(written(text, name))) == found and not _describes_bag(str(written(text, name).parent / "none" / "metadata.yaml"))


@pytest.mark.parametrize("kind", ["ros2", "ros2 of mcap"])
def test_the_description_of_a_bag_means_the_bag(leg, tmp_path, monkeypatch, refusal, kind):
    """It is what the tools of ROS name."""
    folder = write(tmp_path, kind, leg_messages())
    whole, described = (read_motion(leg, path) for path in (folder, folder / "metadata.yaml"))
    assert np.array_equal(described.q, whole.q) and described.source == whole.source
    monkeypatch.chdir(folder)
    assert np.array_equal(read_motion(leg, "metadata.yaml").q, whole.q)
    with pytest.raises(ksl.MotionError, match=re.escape(f"{folder}: no topic '/other'")):
        read_motion(leg, "metadata.yaml", topic="/other")
    for path, file in ((folder, folder), (folder / "metadata.yaml", folder), ("metadata.yaml", os.getcwd())):
        with recorded() as ledger:
            read_motion(leg, path)
        digest = sha256(b"".join(f.read_bytes() for f in sorted(folder.iterdir()))).hexdigest()
        assert ledger.files == [InputFile("motion", str(file), digest)], "what is said to be read is the whole bag"
    (folder / "metadata.yaml").write_text("of: something else\n")
    assert "no column `time`" in refusal(leg, folder / "metadata.yaml")


def test_the_example_recording(examples, tmp_path):
    """Arm and gripper publish on one topic, at different rates; the arm's motion is that of the CSV file, measured by encoders."""
    robot = (examples / "robots" / "panda.urdf").read_text()
    fingers = "".join(
        f'<link name="finger{k}"><inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        f'<joint name="panda_finger_joint{k}" type="prismatic"><parent link="panda_link7"/><child link="finger{k}"/><limit lower="0" upper="0.04" effort="20" velocity="0.2"/>{mimic}</joint>'
        for k, mimic in ((1, ""), (2, '<mimic joint="panda_finger_joint1"/>'))
    )
    (tmp_path / "panda.urdf").write_text(robot.replace("</robot>", fingers + "</robot>"))
    model = ksl.load(tmp_path / "panda.urdf")
    found = [read_motion(model, write(tmp_path, kind, bag.messages())) for kind in KINDS]
    for other in found[1:]:
        assert np.array_equal(other.q, found[0].q) and np.array_equal(other.time, found[0].time)
    m = found[0]
    names, time, q = bag.read_motion()
    arm = [model.joint(n).q_index for n in names]
    at = np.array([np.interp(m.time, time, column) for column in q.T]).T
    assert np.abs(m.q[:, arm] - at).max() < 1e-4
    finger = m.q[:, model.joint("panda_finger_joint1").q_index]
    assert finger.max() < 0.0351 and finger.min() > 0.0149 and abs(finger[0] - 0.035) < 1e-6
    notes = "\n".join(m.source.notes)
    assert "123 samples of panda_finger_joint1 are at other times than those of the joints recorded most often: interpolated" in notes
    assert "efforts in the messages are not used" in notes


def test_publishers_at_the_same_times_are_not_interpolated(leg, tmp_path):
    messages = [(t + k, t, [n], [(t - START) * 1e-9], [], []) for t in range(START, START + 100 * MS, 10 * MS) for k, n in enumerate(["hip", "slide"])]
    m = read_motion(leg, write(tmp_path, "mcap", messages))
    assert np.array_equal(m.q[:, 0], m.q[:, 1]) and len(m.time) == 10 and not any("interpolated" in n for n in m.source.notes)


def test_a_joint_that_is_published_half_as_often(leg, tmp_path):
    """Its other samples are a spline's, which is exact for a cubic."""
    cubic = lambda t: t**3 - t
    messages = [(t, t, ["hip"], [(t - START) * 1e-9], [], []) for t in range(START, START + 200 * MS, 10 * MS)]
    messages += [(t + 1, t, ["slide"], [cubic((t - START) * 1e-9)], [], []) for t in range(START + 20 * MS, START + 180 * MS, 20 * MS)]
    m = read_motion(leg, write(tmp_path, "ros1", sorted(messages)))
    assert m.q[:, 1] == pytest.approx(cubic(m.q[:, 0]), abs=1e-12)
    assert m.time[0] == 0 and m.q[0, 0] == pytest.approx(0.02) and len(m.time) == 15
    assert any(n.startswith("5 samples before or after the time that all joints are recorded left out") for n in m.source.notes)


def test_stamps_out_of_order_and_repeated(leg, tmp_path):
    good = list(leg_messages())
    shuffled = good[:3] + [good[4], good[3]] + good[5:8] + [good[7]] + good[8:]
    logged = [(START + k, *m[1:]) for k, m in enumerate(shuffled)]
    m = read_motion(leg, write(tmp_path, "ros2", logged))
    assert np.array_equal(m.q, read_motion(leg, write(tmp_path, "mcap", good)).q)
    assert "1 message of /joint_states older than the one before: sorted by time" in m.source.notes
    assert "1 sample with the time of another left out: the last one of each time is used" in m.source.notes


@pytest.mark.parametrize("stamp, why", [(0, "header stamps are zero"), (START, "header stamps of slide, hip stand still")])
def test_times_of_the_log_where_stamps_are_of_no_use(leg, tmp_path, stamp, why):
    m = read_motion(leg, write(tmp_path, "ros1", [(log, stamp, *rest) for log, _, *rest in leg_messages()]))
    assert np.allclose(m.time, np.arange(12) * 0.01, rtol=0, atol=1e-12)
    assert f"times are those of the log, since {why}" in m.source.notes
    assert m.source.notes[-1].endswith("of the log")


def test_a_simulation_that_was_started_again(leg, tmp_path):
    """Its stamps begin again: sorted, two motions would be mixed."""
    messages = list(leg_messages(100))
    again = [(log + 1000 * MS, s, names, [x + 5 for x in q], v, e) for log, s, names, q, v, e in messages]
    m = read_motion(leg, write(tmp_path, "ros1", messages + again))
    assert len(m.time) == 200 and m.q[99, 0] < 1 and m.q[100, 0] == 5
    assert "times are those of the log, since header stamps of slide, hip jump back by 0.99 s" in m.source.notes


def test_velocities_that_were_not_measured_are_not_used(leg, tmp_path):
    for kind, fill in (("mcap", 0.0), ("ros1", np.nan)):
        m = read_motion(leg, write(tmp_path, kind, [(log, s, names, q, [fill] * 2, []) for log, s, names, q, _, _ in leg_messages(60)]))
        assert m.v[:, 0] == pytest.approx(np.ones(60), abs=1e-6)
        assert "velocities of slide, hip are not used: they are zero in every message, or not numbers" in m.source.notes


def test_velocities_of_one_joint_that_were_not_measured_are_not_used(leg, tmp_path):
    """In recordings and in tables; where some messages lack them, that is said."""
    plain = list(leg_messages(60))
    one = [(log, s, names, q, [v * (n == "slide") for n, v in zip(names, rates)], []) for log, s, names, q, rates, _ in plain]
    some = [(log, s, names, q, rates if k else [], []) for k, (log, s, names, q, rates, _) in enumerate(plain)]
    whole = read_motion(leg, write(tmp_path, "mcap", plain))
    columns = np.column_stack([whole.time, whole.q, whole.v * [0, 1]])
    np.savetxt(tmp_path / "m.csv", columns, delimiter=",", header="time,hip,slide,hip.v,slide.v", comments="")
    for motion, row in ((write(tmp_path, "mcap", one), "message"), (tmp_path / "m.csv", "sample")):
        m = read_motion(leg, motion)
        np.testing.assert_allclose(m.v, whole.v, atol=1e-6)
        assert f"velocities of hip are not used: they are zero in every {row}, or not numbers" in m.source.notes
    assert "velocities of slide, hip are not used: not all messages have them" in read_motion(leg, write(tmp_path, "mcap", some)).source.notes


def test_gaps_are_said(leg, tmp_path):
    messages = [m for k, m in enumerate(leg_messages(60)) if not 20 <= k < 40]
    (note,) = [n for n in read_motion(leg, write(tmp_path, "mcap", messages)).source.notes if "gap" in n]
    assert note.startswith("joint states of slide, hip have 1 gap, the longest of 0.21 s, 0.19 s after their start")


def test_positions_that_are_no_numbers_are_left_out(leg, tmp_path):
    messages = list(leg_messages())
    messages[0] = (*messages[0][:3], [np.nan, 0.0], *messages[0][4:])
    m = read_motion(leg, write(tmp_path, "mcap", messages))
    assert len(m.time) == 11 and "1 sample of slide, hip left out, since positions are not numbers" in m.source.notes
    messages[3] = (*messages[3][:3], [0.0, -np.inf], *messages[3][4:])
    with pytest.raises(ksl.MotionError, match="the position of hip is infinite .* s after its start; every sample needs a finite number"):
        read_motion(leg, write(tmp_path, "mcap", messages))


def with_topics(folder: Path, *names: str, other: str | None = None) -> Path:
    """A ROS 1 bag with joint states on several topics, or with another type alone."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    with Writer(folder / "topics.bag") as out:
        if other:
            out.add_connection("/other", other, typestore=store)
        for name in names:
            connection = out.add_connection(name, bag.TYPE, typestore=store)
            for k, (log, stamp, joints, q, v, _) in enumerate(leg_messages()):
                header = types["std_msgs/msg/Header"](k, types["builtin_interfaces/msg/Time"](*divmod(stamp, 10**9)), "")
                state = types[bag.TYPE](header, joints, np.array(q) + (name == "/b"), np.array(v), np.empty(0))
                out.write(connection, log, store.serialize_ros1(state, bag.TYPE))
    return folder / "topics.bag"


def test_topics(leg, tmp_path, refusal):
    path = with_topics(tmp_path, "/a", "/b", other="nav_msgs/msg/Odometry")
    assert refusal(leg, path) == ": several topics hold joint states: /a (12 messages), /b (12 messages); say which one by --topic NAME (topic=)"
    assert read_motion(leg, path, topic="/b").q[0, 0] == 1 and read_motion(leg, path, topic="a").q[0, 0] == 0
    assert refusal(leg, path, topic="/oter").startswith(": no topic '/oter'; did you mean '/other'? its topics: /other (nav_msgs/Odometry), /a")
    assert refusal(leg, path, topic="/other") == ": topic /other holds nav_msgs/Odometry; joint states are in /a, /b"


def test_an_mcap_file_of_another_encoding(leg, tmp_path, refusal):
    path = write(tmp_path, "mcap", leg_messages())
    path.write_bytes(path.read_bytes().replace(b"\x03\0\0\0cdr", b"\x03\0\0\0xml"))
    assert refusal(leg, path) == ": joint states of /joint_states are encoded as xml, ros2msg; expected messages of ROS 2 (cdr, ros2msg)"


def test_bags_without_joint_states(leg, tmp_path, refusal):
    path = with_topics(tmp_path, other="nav_msgs/msg/Odometry")
    assert refusal(leg, path).startswith(": holds no messages of the type sensor_msgs/JointState; its topics: /other (nav_msgs/Odometry). Poses from")
    empty = [(log, s, names, [], v, []) for log, s, names, _, v, _ in leg_messages(3)]
    assert (
        refusal(leg, write(tmp_path, "mcap", empty)) == ": topic /joint_states has 3 messages, none with positions; give a recording of the joints' positions"
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("kept", [0.5, 0.97])
def test_truncated_files(leg, tmp_path, refusal, kind, kept):
    path = write(tmp_path, kind, leg_messages(400))
    file = next(f for f in path.iterdir() if f.suffix in (".db3", ".mcap")) if path.is_dir() else path
    content = file.read_bytes()
    file.write_bytes(content[: int(len(content) * kept)])
    assert "truncated or damaged" in refusal(leg, path) or "can't be read" in refusal(leg, path)


def test_joints_that_are_missing_or_unknown(leg, flying, robot, tmp_path, refusal):
    path = write(tmp_path, "mcap", leg_messages())
    one = write(tmp_path, "ros1", [(log, s, ["hip"], q[1:], [], []) for log, s, _, q, _, _ in leg_messages()])
    assert refusal(leg, one).startswith(": no joint states of slide; recorded are hip. Say by a map (--map FILE) which of them it is, or where it rests")
    assert "write the motion as CSV, with the columns floating_base.x" in refusal(flying, path, ignore_extra=True)
    wheel = write(tmp_path, "ros2", [(log, s, [*names, "wheel"], [*q, 5.0], [], []) for log, s, names, q, _, _ in leg_messages()])
    assert refusal(leg, wheel).startswith(": unknown joint 'wheel'; the moving joints of leg are hip, slide (--ignore-extra leaves out")
    assert "columns that are not used: 'wheel'" in read_motion(leg, wheel, ignore_extra=True).source.notes


def test_never_at_the_same_time(leg, tmp_path, refusal):
    early = [(t, t, ["hip"], [0.0], [], []) for t in range(START, START + 10 * MS, MS)]
    late = [(t, t, ["slide"], [0.0], [], []) for t in range(START + 10 * MS, START + 20 * MS, MS)]
    assert refusal(leg, write(tmp_path, "mcap", early + late)) == ": hip and slide are never recorded at the same time; record them together"


def test_the_folder_of_a_bag_has_a_hash(tmp_path):
    from ksl.base.files_read import sha256_of, state_of

    one, other = (sha256_of(state_of(write(tmp_path / name, "ros2", leg_messages(n)))) for name, n in (("a", 3), ("b", 4)))
    assert one and other and one != other


def test_missing_packages_are_named(leg, tmp_path, refusal, monkeypatch):
    real = importlib.util.find_spec
    paths = [write(tmp_path, kind, leg_messages()) for kind in KINDS]
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *more: None if name in ("rosbags", "mcap_ros2") else real(name, *more))
    for path, package in zip(paths, ["rosbags", "rosbags", "rosbags", "mcap-ros2-support"]):
        assert refusal(leg, path) == f": is a recording of ROS, which needs the package {package}; install it: pip install 'ksl[bags]'"


def test_rates_are_no_hint_for_the_joint_of_another_robot(tmp_path):
    """The arm's positions are all there: `panda_joint1.a` is not what the gripper's joint was meant to be.  Where a point is missing it is."""
    arm = ksl.load(ROOT / "examples" / "robots" / "panda.urdf")
    table = (ROOT / "examples" / "motions" / "panda_pick.csv").read_text().splitlines()
    for name, hint in (("panda_finger_joint1", "the moving joints of panda are"), ("panda_joint1v", "did you mean 'panda_joint1.v'")):
        (tmp_path / "motion.csv").write_text("\n".join([f"{table[0]},{name}", *(f"{row},0" for row in table[1:])]))
        with pytest.raises(ksl.MotionError, match=re.escape(hint)):
            ksl.read_motion(arm, tmp_path / "motion.csv")


def test_recordings_have_limits(leg, tmp_path, refusal, monkeypatch):
    from ksl.base import limits

    path = write(tmp_path, "mcap", leg_messages(300))
    monkeypatch.setattr(limits, "MOTION_NUMBERS", 40)
    assert "more than 40 numbers" in refusal(leg, path)
    many = write(tmp_path, "ros1", [(log, s, names, q, [0.0] * 50, []) for log, s, names, q, _, _ in leg_messages(1)])
    assert "more than 40 numbers" in refusal(leg, many), "velocities without joints"
    monkeypatch.undo()
    monkeypatch.setattr(limits, "MOTION_BYTES", path.stat().st_size)
    assert "unpacked it is larger than" in refusal(leg, path)
    monkeypatch.undo()
    monkeypatch.setattr(limits, "COLUMNS", 5)
    assert read_motion(leg, path).q.shape == (300, 2), "time, and two joints with their rates"
    monkeypatch.setattr(limits, "COLUMNS", 4)
    assert refusal(leg, path) == ": 5 columns of joints in /joint_states; at most 4 are read"


@pytest.mark.parametrize(("backwards", "twice"), [(False, False), (True, False), (False, True)])
def test_work_is_linear_in_the_number_of_joints_of_a_message(backwards, twice):
    """One message of 20,000 joints took 2 s, and twice as long where one of them stands in it twice."""
    from ksl.motions.files.joint_states import JointStates, JointStateTable

    def read(joints: list[str]) -> None:
        names = [*(reversed(joints) if backwards else joints), *([joints[-1]] if twice else [])]
        lists = [joints, names] if backwards else [names]
        messages = [(k, SimpleNamespace(name=n, position=[0.0] * len(n), velocity=[], effort=[], header=STAMP)) for k, n in enumerate(lists)]
        states = JointStates("file", "/joint_states", messages)
        if twice:
            with pytest.raises(ksl.MotionError, match=f"name the joint '{joints[-1]}' twice"):
                JointStateTable(states, "MCAP", False)
        else:
            assert list(JointStateTable(states, "MCAP", False).names) == ["time", *joints]

    assert_linear(lambda n: work(lambda: read([Name(f"j{k}") for k in range(n)])), 100)


def write_forged_mcap(folder: Path, monkeypatch, compression: str, index: bool, chunk_says: int) -> Path:
    """An MCAP file whose index says that chunks have 1 byte each, and the chunks that they have `chunk_says`."""
    import struct

    import mcap.writer
    import mcap_ros2.writer

    how = {"compression": mcap.writer.CompressionType[compression]}
    if not index:
        how["index_types"] = mcap.writer.IndexType.NONE
    monkeypatch.setattr(mcap_ros2.writer, "McapWriter", lambda **options: mcap.writer.Writer(**{**options, **how}))
    path = write(folder, "mcap", leg_messages(300))
    data, place = bytearray(path.read_bytes()), 8
    while place + 9 < len(data):
        kind, length = struct.unpack_from("<BQ", data, place)
        if kind == 6:
            struct.pack_into("<Q", data, place + 9 + 16, chunk_says)
        if kind == 8:
            struct.pack_into("<Q", data, place + 9 + length - 8, 1)
        place += 9 + length
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("index", [True, False], ids=["index", "no index"])
@pytest.mark.parametrize("compression", ["ZSTD", "LZ4"])
def test_chunks_that_are_larger_than_the_index_says(leg, tmp_path, refusal, monkeypatch, compression, index):
    from ksl.base import limits

    path = write_forged_mcap(tmp_path / "a", monkeypatch, compression, index, 3 << 30)
    assert refusal(leg, path) == ": unpacked it is larger than 2.05e+03 MB, the most that is read; cut it with `mcap filter`"
    path = write_forged_mcap(tmp_path / "b", monkeypatch, compression, index, 1)
    assert len(read_motion(leg, path).time) == 300
    monkeypatch.setattr(limits, "MOTION_BYTES", path.stat().st_size)
    assert "unpacked it is larger than" in refusal(leg, path)


def test_a_chunk_in_the_summary(leg, tmp_path, refusal, monkeypatch):
    """The summary begins where the records do: reading it would unpack all of them."""
    path = write_forged_mcap(tmp_path, monkeypatch, "ZSTD", True, 3 << 30)
    data = bytearray(path.read_bytes())
    data[-28:-20] = (8).to_bytes(8, "little")
    path.write_bytes(data)
    assert "unpacked it is larger than" in refusal(leg, path)


def test_a_pipe_in_the_folder_of_a_bag(leg, tmp_path, refusal):
    import os

    (tmp_path / "bag").mkdir()
    os.mkfifo(tmp_path / "bag" / "metadata.yaml")
    assert "is a pipe" in refusal(leg, tmp_path / "bag")
