"""What closes loops in MJCF, and which joints have motors: equality constraints of a compiled `mujoco.MjModel`, and its actuators as drives.

`connect` is a spherical joint, `weld` a fixed one; two of `connect` between the same bodies are a revolute joint about the line through their
points.  MuJoCo's constraints are soft; here loops are closed exactly.  `joint` couples two joints, and so does `tendon` where fixed
tendons have two joints together: one follows the other.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ksl.base.errors import DescriptionError
from ksl.robot_files.mjcf_actuators import actuated, actuator_count, tendon_terms
from ksl.robot_files.mjcf_frames import Array, moved, pose

CONNECT, WELD, JOINT, TENDON = range(4)
"""Values of mjtEq, which MuJoCo publishes."""
KINDS_OF_EQUALITY = ("connect", "weld", "joint", "tendon", "flex", "flexvert", "flexstrain")
SITE = 6
"""The value of mjtObj for sites."""
EQUALITY_DISABLED = 1 << 1
"""The bit of mjtDisableBit that turns equality constraints off."""
CLOSE = 1e-6
"""Distances of points that differ less, relative to their length, are the same."""

Coupling = tuple[str, float, float]
"""The leader of a joint, multiplier, offset."""


@dataclass
class Closure:
    """A joint that closes a loop; its frame has the axes of the successor."""

    names: list[str]
    said: list[str]
    """What messages call them: the names, or places in the file."""
    kind: str
    bodies: tuple[int, int]
    predecessor_pose: Array
    successor_pose: Array
    axis: Array | None = None


def name_of(mj: Any, i: int) -> str:
    """The name, or for constraints without one the place among those of its kind, in the order of the file; lines are lost when MuJoCo compiles."""
    if name := mj.equality(i).name:
        return str(name)
    kind = int(mj.eq_type[i])
    if kind >= len(KINDS_OF_EQUALITY):
        return f"{i + 1}"
    alike = np.flatnonzero(mj.eq_type[: i + 1] == kind)
    return f"<{KINDS_OF_EQUALITY[kind]}> {len(alike)}"


def is_active(mj: Any, i: int) -> bool:
    return bool(mj.eq_active0[i]) and not mj.opt.disableflags & EQUALITY_DISABLED


def coupled_joints(mj: Any, i: int) -> list[int]:
    """The joints that equality constraint i couples, if it is one of joints or of fixed tendons."""
    ids = [int(k) for k in (mj.eq_obj1id[i], mj.eq_obj2id[i]) if k >= 0]
    if mj.eq_type[i] == TENDON:
        return [j for tendon in ids for j in (tendon_terms(mj, tendon) or {})]
    return ids if mj.eq_type[i] == JOINT else []


def couplings(mj: Any, joints: list[str], used: set[int], held: dict[int, float]) -> dict[int, Coupling]:
    """Joint: (its leader, multiplier, offset), for equality constraints that couple two joints with one coordinate.

    Those of joints are y − y₀ = a₀ + a₁ (x − x₀); of tendons, L − L₀ = a₀, or a₀ + a₁ times the same of the second one, with lengths L = Σ c q.
    used: constraints that the model has are added.  held: joints that are held at a position are added, with that.  Raises
    :class:`ksl.DescriptionError` for those that are neither: without them it would be another machine.
    """
    found: dict[int, Coupling] = {}
    leader: dict[int, int] = {}
    driven = {j for i in range(actuator_count(mj)) for j in actuated(mj, i)}
    for i in range(mj.neq):
        if mj.eq_type[i] not in (JOINT, TENDON) or not is_active(mj, i):
            continue
        y, x, multiplier, free = _of_joints(mj, i, joints) if mj.eq_type[i] == JOINT else _of_tendons(mj, i, joints, found, driven)
        if y in found or y in held:
            said = f"follows joint {found[y][0]}" if y in found else "is held"
            raise _refused(mj, i, f"{'couples' if x >= 0 else 'holds'} joint {joints[y]}, which {said} already; keep one of both")
        y0, x0 = (float(mj.qpos0[mj.jnt_qposadr[j]]) if j >= 0 else 0.0 for j in (y, x))
        offset = y0 + free - multiplier * x0
        if x < 0:
            held[y] = offset
            used.add(i)
            continue
        leads, m, b = x, 1.0, 0.0  # x = m leads + b
        while leads in leader:
            step = found[leads]
            leads, m, b = leader[leads], m * step[1], m * step[2] + b
        if leads != y:
            found[y], leader[y] = (joints[x], multiplier, offset), x
            used.add(i)
        elif abs(multiplier * m - 1) > CLOSE or abs(multiplier * b + offset) > CLOSE:
            raise _refused(mj, i, f"couples joint {joints[y]} to itself over joint {joints[x]}, so that it can't move; remove one coupling")
    _hold_followers(found, leader, held)
    return found


def _hold_followers(found: dict[int, Coupling], leader: dict[int, int], held: dict[int, float]) -> None:
    """Joints that follow one that is held are held, too."""
    for y in list(found):
        path = [y]
        while path[-1] in leader and path[-1] not in held:
            path.append(leader[path[-1]])
        if path[-1] in held:
            for one, x in zip(path[-2::-1], path[::-1], strict=False):
                _, multiplier, offset = found.pop(one)
                held[one] = multiplier * held[x] + offset
                del leader[one]


def _of_joints(mj: Any, i: int, joints: list[str]) -> tuple[int, int, float, float]:
    """y, x, a₁ and a₀ of a constraint of joints; x is −1 where it holds y alone."""
    y, x, a = int(mj.eq_obj1id[i]), int(mj.eq_obj2id[i]), mj.eq_data[i]
    if x < 0:
        return y, x, 0.0, float(a[0])
    if a[2:5].any():
        raise _refused(mj, i, f"couples joint {joints[y]} to joint {joints[x]} by a polynomial that isn't linear; make it linear")
    return y, x, float(a[1]), float(a[0])


def _of_tendons(mj: Any, i: int, joints: list[str], followers: Mapping[int, Coupling], driven: set[int]) -> tuple[int, int, float, float]:
    """y, x, a₁ and a₀ of a constraint of tendons.  The joint leads that has a motor or follows another one already, else the first of the tendon."""
    first, second, a = int(mj.eq_obj1id[i]), int(mj.eq_obj2id[i]), mj.eq_data[i]
    names = " and ".join(mj.tendon(k).name or f"{k + 1}" for k in (first, second) if k >= 0)
    sums = [tendon_terms(mj, k) for k in (first, second) if k >= 0]
    if None in sums:
        raise _refused(mj, i, f"is about the length of tendon {names}, which is no sum of joint positions; fixed tendons are read")
    if second >= 0 and a[2:5].any():
        raise _refused(mj, i, f"couples tendons {names} by a polynomial that isn't linear; make it linear")
    terms: dict[int, float] = {}
    for coefficients, factor in zip(sums, (1.0, -float(a[1])), strict=False):
        for j, c in (coefficients or {}).items():
            terms[j] = terms.get(j, 0.0) + factor * c
    moved = [j for j, c in terms.items() if c]
    if len(moved) == 1:
        return moved[0], -1, 0.0, float(a[0]) / terms[moved[0]]
    if len(moved) != 2:
        raise _refused(mj, i, f"couples {len(moved)} joints by tendon {names}; couplings of two are read")
    x, y = sorted(moved, key=lambda j: (j not in driven and j not in followers, moved.index(j)))
    return y, x, -terms[x] / terms[y], float(a[0]) / terms[y]


def _refused(mj: Any, i: int, what: str) -> DescriptionError:
    return DescriptionError(f'equality constraint {name_of(mj, i)} {what}, or load the file with mimic="independent", without couplings')


def check_kinds(mj: Any) -> None:
    """Refuses constraints of kinds that are not known, and soft bodies that join several bodies: without them it would be another machine."""
    cut = 'or load the file with loops="cut" (--loops cut), without what closes loops'
    for i in range(mj.neq):
        if is_active(mj, i) and mj.eq_type[i] >= len(KINDS_OF_EQUALITY):
            raise DescriptionError(
                f"equality constraint {name_of(mj, i)} is of kind {int(mj.eq_type[i])}, which KSL doesn't know; state it by connect, weld or joint, {cut}"
            )
    for f in range(getattr(mj, "nflex", 0)):
        bodies: set[int] = set()
        for of in ("vert", "node"):  # a body of its own for each point, or for each node between which points are interpolated
            first, count = (int(getattr(mj, f"flex_{of}{what}", np.zeros(mj.nflex))[f]) for what in ("adr", "num"))
            bodies.update(getattr(mj, f"flex_{of}bodyid")[first : first + count].tolist() if count else ())
        bodies.discard(-1)
        if len(bodies) > 1:
            raise DescriptionError(
                f"flex {bytes(mj.names[mj.name_flexadr[f] :]).split(bytes(1), 1)[0].decode() or f + 1} is a soft body that joins {len(bodies)} bodies, and KSL's are rigid; remove it, {cut}"
            )


def bodies_of(mj: Any, i: int) -> tuple[int, int]:
    """The bodies that a `connect` or `weld` joins."""
    first, second = int(mj.eq_obj1id[i]), int(mj.eq_obj2id[i])
    return (int(mj.site_bodyid[first]), int(mj.site_bodyid[second])) if mj.eq_objtype[i] == SITE else (first, second)


def handles(mj: Any) -> set[int]:
    """Mocap bodies that carry no joint, and what is on them: handles by which a simulator moves a robot, and no part of it."""
    moves = set()
    for body in mj.jnt_bodyid.tolist():
        while body:
            moves.add(body)
            body = int(mj.body_parentid[body])
    found: set[int] = set()
    for i in range(1, mj.nbody):  # parents come first
        if (mj.body_mocapid[i] >= 0 and i not in moves) or int(mj.body_parentid[i]) in found:
            found.add(i)
    return found


def is_of_handle(mj: Any, i: int, left_out: set[int]) -> bool:
    return mj.eq_type[i] in (CONNECT, WELD) and not left_out.isdisjoint(bodies_of(mj, i))


def closures(mj: Any, used: set[int], left_out: set[int], say: Callable[[str], None]) -> list[Closure]:
    """The joints of `connect` and `weld`, in the order of the file, but for those to bodies that are left out.

    say: what a user must know about those that were folded.
    """
    found: list[Closure] = []
    for i in range(mj.neq):
        if mj.eq_type[i] not in (CONNECT, WELD) or not is_active(mj, i) or is_of_handle(mj, i, left_out):
            continue
        used.add(i)
        closure = _closure(mj, i)
        earlier = next((other for other in found if {"connect"} == {other.kind, closure.kind} and set(other.bodies) == set(closure.bodies)), None)
        if earlier is None or not _fold(earlier, closure):
            found.append(closure)
        else:
            say(
                f"equality constraints {' and '.join(earlier.said)} connect the same two bodies at two points; they are read as one revolute joint about the line through these"
            )
    for closure in found:
        closure.kind = "spherical" if closure.kind == "connect" else closure.kind
    return found


def _closure(mj: Any, i: int) -> Closure:
    is_weld, data, ids = mj.eq_type[i] == WELD, mj.eq_data[i], (int(mj.eq_obj1id[i]), int(mj.eq_obj2id[i]))
    if is_weld and data[10] == 0:  # the scale of its torque: it holds the point alone
        is_weld = False
        points = data[3:6], data[0:3]
    else:
        points = (data[3:6], data[0:3]) if is_weld else (data[0:3], data[3:6])
    names, said, kind = [mj.equality(i).name], [name_of(mj, i)], "fixed" if is_weld else "connect"
    if mj.eq_objtype[i] == SITE:
        bodies = bodies_of(mj, i)
        if is_weld:
            return Closure(names, said, kind, bodies, *(pose(mj.site_quat[s], mj.site_pos[s]) for s in ids))
        return Closure(names, said, kind, bodies, *(moved(mj.site_pos[s]) for s in ids))
    if is_weld:
        return Closure(names, said, kind, ids, pose(data[6:10], points[0]), moved(points[1]))
    return Closure(names, said, kind, ids, moved(points[0]), moved(points[1]))


def _fold(earlier: Closure, other: Closure) -> bool:
    """Makes a revolute joint of two spherical ones, if their points are apart, and as far on one body as on the other."""
    ends = (other.predecessor_pose, other.successor_pose) if other.bodies == earlier.bodies else (other.successor_pose, other.predecessor_pose)
    a, b = (end[:3, 3] - own[:3, 3] for end, own in zip(ends, (earlier.predecessor_pose, earlier.successor_pose)))
    lengths = np.linalg.norm(a), np.linalg.norm(b)
    scale = max(*lengths, *(np.abs(p[:3, 3]).max() for p in (*ends, earlier.predecessor_pose, earlier.successor_pose)))
    if min(lengths) <= CLOSE * scale or abs(lengths[0] - lengths[1]) > CLOSE * max(lengths):
        return False
    earlier.kind, earlier.axis = "revolute", b / lengths[1]
    earlier.predecessor_pose[:3, :3] = _least_turn(earlier.axis, a / lengths[0])
    earlier.names += other.names
    earlier.said += other.said
    return True


def _least_turn(u: Array, to: Array) -> Array:
    """The smallest rotation that leads one unit vector to another."""
    n, c = np.cross(u, to), float(u @ to)
    if c < 0.0:  # half a turn about the same axis, and then the rest: 1 + c would lose its digits
        p = n if np.linalg.norm(n) > 1e-15 else np.eye(3)[int(np.argmin(np.abs(u)))]
        p = p - (p @ u) * u
        p /= np.linalg.norm(p)
        return np.asarray(_least_turn(-u, to) @ (2 * np.outer(p, p) - np.eye(3)))
    K = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    return np.asarray(np.eye(3) + K + K @ K / (1 + c))


def common_name(names: list[str]) -> str:
    """C of C_0 and C_1; empty where they have no beginning in common."""
    return os.path.commonprefix(names).rstrip("_-./ ")  # noqa: RUF071 - letters in common are meant, not folders


def drives(mj: Any, name_of_joint: dict[int, str], leader: dict[str, str], floats: set[str]) -> tuple[list[str], int]:
    """The joints that have a motor, each once, and how many actuators are no motor of one joint.

    name_of_joint: of the model, by MuJoCo's number.  leader: of joints that follow others, whose motor is then that one's.  A fixed tendon
    counts where all its joints follow one.
    """
    found: dict[str, None] = {}
    others = 0
    for i in range(actuator_count(mj)):
        moved_joints = {_first(name_of_joint[j], leader) for j in actuated(mj, i) if j in name_of_joint}
        if len(moved_joints) == 1 and not moved_joints & floats:
            found.setdefault(moved_joints.pop())
        else:
            others += 1
    return list(found), others


def _first(joint: str, leader: dict[str, str]) -> str:
    while joint in leader:
        joint = leader[joint]
    return joint
