"""wrenches.mcap: wrenches, joint states and poses of links as messages of ROS 2, which Foxglove, PlotJuggler and RViz show.

Every joint has a topic /wrench/NAME with geometry_msgs/WrenchStamped: what acts on the child, about the joint's origin, in the frame of the child's link,
which is that of the joint.  /joint_states has joints with one coordinate, /tf the links in the frame `world` (`world_` where a link has that name).  Load cases follow each other, a second apart;
/case names the one that begins.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ksl.base.rotations import quaternion_of
from ksl.load_cases.load_case import Block, LoadCase, Placement
from ksl.load_cases.provenance import Provenance
from ksl.load_cases.reaction_joints import LoopJoint, frame_on_successor, has_drive
from ksl.load_cases.undetermined import Undetermined
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.states import Array
from ksl.output import OutputError

if TYPE_CHECKING:
    from mcap.writer import Writer

FILE = "wrenches.mcap"
PAUSE = 1.0
"""Seconds between load cases."""
_HEADER = "std_msgs/Header header\n"
_OF_HEADER = (
    "=" * 80
    + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    + "=" * 80
    + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
_VECTOR = "=" * 80 + "\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
DEFINITIONS = {
    "geometry_msgs/msg/WrenchStamped": _HEADER + "geometry_msgs/Wrench wrench\n" + _OF_HEADER
    + "=" * 80 + "\nMSG: geometry_msgs/Wrench\ngeometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n" + _VECTOR,
    "sensor_msgs/msg/JointState": _HEADER + "string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n" + _OF_HEADER,
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms\n" + "=" * 80 + "\nMSG: geometry_msgs/TransformStamped\n" + _HEADER
    + "string child_frame_id\ngeometry_msgs/Transform transform\n" + _OF_HEADER + "=" * 80 + "\nMSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\n"
    "geometry_msgs/Quaternion rotation\n" + _VECTOR + "=" * 80 + "\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
    "std_msgs/msg/String": "string data\n",
}  # fmt: skip
"""Types of messages, as ROS 2 writes them into recordings."""


def check_package() -> None:
    """Raises OutputError without the package that writes such files: before an hour of work rather than after it."""
    if find_spec("mcap") is None:
        raise OutputError(f"{FILE}: is written by the package mcap; install it: pip install 'ksl[bags]'")


def write_mcap(path: Path, cases: Sequence[LoadCase], provenance: Provenance) -> None:
    """Writes the messages of all samples.  Computes the wrenches again, on the child at the joint's origin, whatever the placement of the results.  O(samples · joints)."""
    from mcap.writer import Writer

    with open(path, "wb") as file:
        writer: Any = Writer(file)  # parts of it have no annotations
        writer.start(profile="ros2", library=f"ksl {provenance.versions.get('KSL', '')}")
        schemas = {name: writer.register_schema(name, "ros2msg", text.encode()) for name, text in DEFINITIONS.items()}
        writer.add_metadata("ksl", {name: text for name, text in provenance.lines() if name} | {"robot": provenance.robot})
        topics = _Topics(writer, schemas)
        start = 0.0
        for case in cases:
            start = _write_case(topics, case, start, single=len(cases) == 1) + PAUSE
        writer.finish()


class _Topics:
    """Channels by their topics."""

    def __init__(self, writer: Writer, schemas: dict[str, int]) -> None:
        self._writer, self._schemas = writer, schemas
        self._channels: dict[str, int] = {}

    def put(self, topic: str, kind: str, time: int, data: bytes) -> None:
        if topic not in self._channels:
            self._channels[topic] = self._writer.register_channel(topic, "cdr", self._schemas[kind])
        self._writer.add_message(self._channels[topic], time, data, time)


def _write_case(topics: _Topics, case: LoadCase, start: float, single: bool) -> float:
    """Writes a load case that begins at `start`, s; one alone has its own times, unless they are negative.  Returns the last time."""
    first = float(case.motion.time[0])
    shift = 0.0 if single and first >= 0 else start - first
    wanted = [(k, j) for k, j in enumerate(case.joints) if case.placement.wanted(j.name)]
    names = _topics_of([j.name for _, j in wanted])
    topics.put("/case", "std_msgs/msg/String", round((first + shift) * 1e9), Cdr().text(case.name).bytes())
    last = first
    for block in replace(case, placement=Placement(), known_undetermined=Undetermined()).blocks():
        world, frames = _world(case), list(frames_of(case, block))
        states = states_of(case, block)
        for i, t in enumerate(block.time):
            ns = round((float(t) + shift) * 1e9)
            for (k, joint), name in zip(wanted, names, strict=True):
                topics.put(
                    f"/wrench/{name}",
                    "geometry_msgs/msg/WrenchStamped",
                    ns,
                    Cdr().stamp(ns).text(frame_of(joint, case.model)).doubles(block.total[i, k]).bytes(),
                )
            topics.put("/joint_states", "sensor_msgs/msg/JointState", ns, _joint_state(ns, states, i))
            topics.put("/tf", "tf2_msgs/msg/TFMessage", ns, _transforms(ns, world, frames, i))
            last = float(t)
    return last + shift


def _topics_of(joints: Sequence[str]) -> list[str]:
    """Names that topics may have; numbered where two are alike."""
    found: list[str] = []
    for joint in joints:
        plain = re.sub(r"\W", "_", joint, flags=re.ASCII) or "_"
        found.append(plain if plain not in found else next(name for k in range(2, len(joints) + 2) if (name := f"{plain}_{k}") not in found))
    return found


def frame_of(joint: Joint, model: Mechanism) -> str:
    """The frame of a joint on its child's side: that of the child's link; joints that close loops have one of their own, whose name no link has."""
    if not isinstance(joint, LoopJoint):
        return joint.child
    name = joint.name
    while name in model.link_names or (name != joint.name and name in model.loop_names):
        name += "_joint"
    return name


def frames_of(case: LoadCase, block: Block) -> Iterator[tuple[str, Array, Array]]:
    """Name, positions (n, 3) and quaternions (n, 4), x y z w, of all frames in the world."""
    model = case.model
    poses = dict(zip(model.link_names, np.moveaxis(model.frame_poses(block.q, [f"link:{name}" for name in model.link_names]), 1, 0)))
    for joint in case.joints:
        if isinstance(joint, LoopJoint) and joint.loop is not None:
            poses[frame_of(joint, model)] = poses[joint.child] @ frame_on_successor(joint.loop)
    for name, pose in poses.items():
        yield name, pose[:, :3, 3], _without_jumps(np.array([quaternion_of(R) for R in pose[:, :3, :3]]))


def _without_jumps(quaternions: Array) -> Array:
    """Rotations (n, 4) as they are given, each quaternion on the side of the one before it: q and −q are one rotation, and two curves."""
    turned = np.einsum("ij,ij->i", quaternions[1:], quaternions[:-1]) < 0
    return np.asarray(quaternions * np.where(np.cumsum(np.append(False, turned)) % 2, -1.0, 1.0)[:, None])


def states_of(case: LoadCase, block: Block) -> list[tuple[str, Array, Array, Array]]:
    """Name, position, speed and effort of joints with one coordinate; no effort (NaN) where there is no drive."""
    none = np.full(len(block.time), np.nan)
    moving = [j for j in case.joints if j.one_coordinate]
    return [(j.name, *block.motions.of(j)[:2], block.tau[:, j.v_index] if has_drive(case.model, j) else none) for j in moving]


def _joint_state(ns: int, states: Sequence[tuple[str, Array, Array, Array]], i: int) -> bytes:
    cdr = Cdr().stamp(ns).text("").texts([name for name, *_ in states])
    for column in (1, 2, 3):
        cdr.sequence([float(state[column][i]) for state in states])
    return cdr.bytes()


def _world(case: LoadCase) -> str:
    """The name of the frame that all others are in: no link's."""
    name = "world"
    while name in case.model.link_names:
        name += "_"
    return name


def _transforms(ns: int, world: str, frames: Sequence[tuple[str, Array, Array]], i: int) -> bytes:
    cdr = Cdr().count(len(frames))
    for name, positions, quaternions in frames:
        cdr.stamp(ns).text(world).text(name).doubles(positions[i]).doubles(quaternions[i])
    return cdr.bytes()


class Cdr:
    """A message as CDR, little-endian: what ROS 2 writes.  Numbers are aligned to their size, from behind the first four bytes on."""

    def __init__(self) -> None:
        self._data = bytearray()

    def _align(self, size: int) -> None:
        self._data += bytes(-len(self._data) % size)

    def count(self, n: int) -> Cdr:
        self._align(4)
        self._data += struct.pack("<I", n)
        return self

    def stamp(self, ns: int) -> Cdr:
        self._align(4)
        self._data += struct.pack("<iI", *divmod(ns, 1_000_000_000))
        return self

    def text(self, text: str) -> Cdr:
        data = text.encode("utf-8", "replace") + b"\0"
        self.count(len(data))
        self._data += data
        return self

    def texts(self, texts: Sequence[str]) -> Cdr:
        self.count(len(texts))
        for text in texts:
            self.text(text)
        return self

    def doubles(self, x: Iterable[float] | Array) -> Cdr:
        numbers: Any = np.asarray(x, dtype="<f8")
        self._align(8)
        self._data += numbers.tobytes()
        return self

    def sequence(self, x: Sequence[float]) -> Cdr:
        self.count(len(x))
        return self.doubles(x) if x else self

    def bytes(self) -> bytes:
        return b"\0\1\0\0" + bytes(self._data)
