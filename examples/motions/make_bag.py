#!/usr/bin/env python3
"""Make a recording of a robot as ROS would: joint states of the Panda's arm and of its gripper, from panda_pick.csv.

    python3 make_bag.py [FOLDER] [--bits N]

writes panda_pick.bag (ROS 1), panda_pick (the folder of a ROS 2 bag) and panda_pick.mcap into FOLDER, or next to this file.
It needs numpy and the packages rosbags and mcap-ros2-support: pip install 'ksl[bags]'.

Two nodes publish on the topic /joint_states: the arm at 250 Hz with positions, velocities and efforts, and the gripper at
30 Hz with the position of its finger. As in a real recording, the arm names its joints in an order of its own, positions are
those of an encoder with 2^20 steps a turn (--bits: 2^N), header stamps jitter by some 20 µs, and the log has the messages a little later.
"""

import argparse
import os
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
BITS = 20  # of the encoder
START = 1_760_000_000_000_000_000  # ns since 1970
TOPIC = "/joint_states"
TYPE = "sensor_msgs/msg/JointState"
DEFINITION = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def read_motion():
    """Names, times and positions of panda_pick.csv."""
    path = os.path.join(HERE, "panda_pick.csv")
    with open(path, encoding="ascii") as text:
        names = text.readline().strip().split(",")[1:]
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    return names, table[:, 0], table[:, 1:]


def smooth_step(u):
    """From 0 to 1, with velocity and acceleration zero at both ends."""
    u = min(max(u, 0.0), 1.0)
    return u**3 * (10 - 15 * u + 6 * u**2)


def messages(finger="panda_finger_joint1", bits=BITS):
    """All messages in the order of the log: time of the log (ns), header stamp (ns), names, positions, velocities, efforts."""
    rng = np.random.default_rng(1)
    names, time, q = read_motion()
    found = []
    stamps = START + np.round((time + rng.uniform(-2e-5, 2e-5, len(time))) * 1e9).astype(np.int64)
    step = 2 * np.pi / 2**bits
    measured = np.round(q / step) * step
    velocity = np.gradient(q, time, axis=0)
    order = [names.index(n) for n in sorted(names, reverse=True)]
    for stamp, row, rate in zip(stamps.tolist(), measured, velocity):
        found.append((stamp + 300_000, stamp, [names[i] for i in order], row[order], rate[order], np.zeros(len(order))))
    for t in np.arange(0.0, time[-1], 1 / 30):
        stamp = START + round(t * 1e9)
        width = 0.035 - 0.02 * smooth_step((t - 0.95) / 0.6) + 0.02 * smooth_step((t - 2.7) / 0.6)
        found.append((stamp + 900_000, stamp, [finger], np.array([width]), np.empty(0), np.empty(0)))
    return sorted(found, key=lambda m: m[0])


def write_ros1(path, states):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    with Writer(path) as bag:
        connection = bag.add_connection(TOPIC, TYPE, typestore=store)
        for k, (log, stamp, names, position, velocity, effort) in enumerate(states):
            time = types["builtin_interfaces/msg/Time"](*divmod(stamp, 10**9))
            header = types["std_msgs/msg/Header"](seq=k, stamp=time, frame_id="")
            message = types[TYPE](header, names, position, velocity, effort)
            bag.write(connection, log, store.serialize_ros1(message, TYPE))


def write_ros2(folder, states, storage="sqlite3"):
    """A ROS 2 bag; storage: sqlite3 or mcap."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    with Writer(folder, version=8, storage_plugin=StoragePlugin[storage.upper()]) as bag:
        connection = bag.add_connection(TOPIC, TYPE, typestore=store)
        for log, stamp, names, position, velocity, effort in states:
            time = types["builtin_interfaces/msg/Time"](*divmod(stamp, 10**9))
            header = types["std_msgs/msg/Header"](stamp=time, frame_id="")
            message = types[TYPE](header, names, position, velocity, effort)
            bag.write(connection, log, store.serialize_cdr(message, TYPE))


def write_mcap(path, states):
    from mcap_ros2.writer import Writer

    with open(path, "wb") as out, Writer(out) as bag:
        schema = bag.register_msgdef(TYPE, DEFINITION)
        for log, stamp, names, position, velocity, effort in states:
            time = dict(zip(("sec", "nanosec"), divmod(stamp, 10**9)))
            message = SimpleNamespace(
                header=SimpleNamespace(stamp=SimpleNamespace(**time), frame_id=""),
                name=names,
                position=position.tolist(),
                velocity=velocity.tolist(),
                effort=effort.tolist(),
            )
            bag.write_message(TOPIC, schema, message, log_time=log, publish_time=log)


def main():
    parser = argparse.ArgumentParser(description="Make a recording of a robot as ROS would.")
    parser.add_argument("folder", nargs="?", default=HERE, type=Path)
    parser.add_argument("--bits", type=int, default=BITS, help="of the encoders: 2^BITS steps a turn")
    given = parser.parse_args()
    folder = given.folder
    folder.mkdir(parents=True, exist_ok=True)
    if (folder / "panda_pick" / "metadata.yaml").exists():  # writers don't overwrite
        shutil.rmtree(folder / "panda_pick")
    (folder / "panda_pick.bag").unlink(missing_ok=True)
    states = messages(bits=given.bits)
    write_ros1(folder / "panda_pick.bag", states)
    write_ros2(folder / "panda_pick", states)
    write_mcap(folder / "panda_pick.mcap", states)
    print(f"panda_pick.bag, panda_pick and panda_pick.mcap in {folder}: {len(states)} messages on {TOPIC}")


if __name__ == "__main__":
    main()
