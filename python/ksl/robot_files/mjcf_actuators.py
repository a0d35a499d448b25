"""Actuators of a compiled `mujoco.MjModel`: which joints they move, how hard they can, and what they add to these joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ksl.robot_files.mjcf_frames import Array

ON_JOINT, ON_JOINT_IN_PARENT, ON_TENDON, ON_ROTATION = 0, 1, 3, 6
"""Values of mjtTrn, which MuJoCo publishes; the last one since MuJoCo 4."""
WRAPS_JOINT = 1
"""The value of mjtWrap for joints of fixed tendons."""
SLIDE, HINGE = 2, 3
"""Values of mjtJoint."""
FIXED_GAIN, NO_BIAS, AFFINE_BIAS = 0, 0, 1
"""Values of mjtGain and mjtBias."""
NO_STATE, FILTERS = 0, (2, 3)
"""Values of mjtDyn: actuators without a state, and those whose state follows the control."""
CLAMP_DISABLED, ACTUATION_DISABLED = 1 << 8, 1 << 11
"""The bits of mjtDisableBit that let controls exceed their range, and that turn all actuators off."""

Range = tuple[float, float]
"""Least and largest effort, N m or N; infinite where there is no bound."""
UNBOUNDED: Range = (-np.inf, np.inf)


def actuator_count(mj: Any) -> int:
    return int(getattr(mj, "nactuator", mj.nu))  # since MuJoCo 4 an actuator may have several controls


def tendon_terms(mj: Any, k: int) -> dict[int, float] | None:
    """The coefficient of each joint in the length of a fixed tendon; None for others."""
    wraps = range(int(mj.tendon_adr[k]), int(mj.tendon_adr[k]) + int(mj.tendon_num[k]))
    if any(mj.wrap_type[w] != WRAPS_JOINT for w in wraps):
        return None
    return {int(mj.wrap_objid[w]): float(mj.wrap_prm[w]) for w in wraps}


def is_off(mj: Any, i: int) -> bool:
    """Whether the file turns an actuator off: it exerts nothing, while its armature and its damping act."""
    off, group = int(getattr(mj.opt, "disableactuator", 0)), int(mj.actuator_group[i])
    return bool(mj.opt.disableflags & ACTUATION_DISABLED) or (0 <= group < 31 and bool(off >> group & 1))


def actuated(mj: Any, i: int) -> list[int]:
    """The joints that an actuator moves: one, or those of a fixed tendon; none for what it acts on otherwise, or if it is off."""
    at, on = int(mj.actuator_trnid[i, 0]), int(mj.actuator_trntype[i])
    if is_off(mj, i):
        return []
    if on in (ON_JOINT, ON_JOINT_IN_PARENT) or (on == ON_ROTATION and mj.actuator_trnid[i, 1] < 0):  # of a ball; otherwise between sites
        return [at]
    return list(tendon_terms(mj, at) or {}) if on == ON_TENDON else []


def effort_ranges(mj: Any) -> dict[int, Range]:
    """The efforts of each hinge and slide that has actuators: the sum of theirs, within the joint's `actuatorfrcrange`; this alone of those without.

    An actuator exerts gear × (gain × control + bias), within its `forcerange`.  Of a servo, whose bias depends on position or velocity, that alone is a bound.
    """
    found: dict[int, Range] = {}
    on_tendon: dict[int, list[tuple[Range, float]]] = {}
    for i in range(actuator_count(mj)):
        if is_off(mj, i):
            continue
        at, on = int(mj.actuator_trnid[i, 0]), int(mj.actuator_trntype[i])
        force, gear = _force(mj, i), float(mj.actuator_gear[i, 0])
        if on in (ON_JOINT, ON_JOINT_IN_PARENT) and mj.jnt_type[at] in (SLIDE, HINGE):
            found[at] = _sum(found.get(at, (0.0, 0.0)), _times(force, gear))
        elif on == ON_TENDON:
            on_tendon.setdefault(at, []).append((force, gear))
    for k, forces in on_tendon.items():
        limited = getattr(mj, "tendon_actfrclimited", np.zeros(mj.ntendon))[k]
        tension = _tension(forces, mj.tendon_actfrcrange[k] if limited else None)
        for j, coefficient in (tendon_terms(mj, k) or {}).items():
            found[j] = _sum(found.get(j, (0.0, 0.0)), _times(tension, coefficient))
    for j in range(mj.njnt):
        if mj.jnt_actfrclimited[j] and mj.jnt_type[j] in (SLIDE, HINGE):
            found[j] = _within(found.get(j, UNBOUNDED), mj.jnt_actfrcrange[j])
    return found


def led(ranges: Mapping[int, Range], family: Mapping[int, tuple[int, float]]) -> dict[int, Range]:
    """Ranges of joints that lead: with what the motors of joints exert that follow them, `family` being {follower: (leader, multiplier)}."""
    found = {j: own for j, own in ranges.items() if j not in family}
    for j, (leader, multiplier) in family.items():
        if j in ranges:
            found[leader] = _sum(found.get(leader, (0.0, 0.0)), _times(ranges[j], multiplier))
    return found


def limit_of(own: Range) -> float | None:
    """One limit for both directions: that of the weaker one, or of the only one in which there is any; None without."""
    sides = [side for side in (-own[0], own[1]) if side > 0]
    least = min(sides, default=np.inf)
    return float(least) if np.isfinite(least) else None


def added(mj: Any, what: str) -> Array:
    """What actuators add to the armature or the damping of each coordinate, gear² times their own; that on tendons is not here."""
    found = np.zeros(mj.nv)
    for i, own in _own(mj, what):
        if mj.actuator_trntype[i] in (ON_JOINT, ON_JOINT_IN_PARENT):
            found[mj.dof_jntid == mj.actuator_trnid[i, 0]] += own
    return found


def of_tendons(mj: Any, what: str) -> Array:
    """The armature or the damping of each tendon, with what actuators add."""
    found = np.array(getattr(mj, f"tendon_{what}", np.zeros(mj.ntendon)), dtype=float)
    for i, own in _own(mj, what):
        if mj.actuator_trntype[i] == ON_TENDON:
            found[mj.actuator_trnid[i, 0]] += own
    return found


def _own(mj: Any, what: str) -> list[tuple[int, float]]:
    """The armature or damping of actuators where they act, gear² times their own."""
    own = getattr(mj, f"actuator_{what}", None)  # since MuJoCo 4
    if own is None:
        return []
    return [(i, float(mj.actuator_gear[i, 0] ** 2 * own.reshape(len(own), -1)[i, 0])) for i in range(actuator_count(mj))]


def _force(mj: Any, i: int) -> Range:
    """What the actuator exerts before its gear."""
    out = int(mj.actuator_outadr[i]) if hasattr(mj, "actuator_outadr") else i
    bound = UNBOUNDED
    bias = mj.actuator_biasprm[i]
    is_motor = mj.actuator_gaintype[i] == FIXED_GAIN and (
        mj.actuator_biastype[i] == NO_BIAS or (mj.actuator_biastype[i] == AFFINE_BIAS and not bias[1:3].any())
    )
    if is_motor:
        constant = float(bias[0]) if mj.actuator_biastype[i] == AFFINE_BIAS else 0.0
        low, high = _times(_input(mj, i), float(mj.actuator_gainprm[i, 0]))
        bound = (low + constant, high + constant)
    return _within(bound, mj.actuator_forcerange[out]) if mj.actuator_forcelimited[out] else bound


def _input(mj: Any, i: int) -> Range:
    """The range of what the gain multiplies: the control, or the actuator's state."""
    if getattr(mj, "actuator_ctrlnum", np.ones(actuator_count(mj)))[i] != 1:
        return UNBOUNDED
    at, dynamics = int(mj.actuator_ctrladr[i]) if hasattr(mj, "actuator_ctrladr") else i, int(mj.actuator_dyntype[i])
    control: Range = UNBOUNDED
    if mj.actuator_ctrllimited[at] and not mj.opt.disableflags & CLAMP_DISABLED:
        control = (float(mj.actuator_ctrlrange[at, 0]), float(mj.actuator_ctrlrange[at, 1]))
    if dynamics == NO_STATE:
        return control
    state = (min(control[0], 0.0), max(control[1], 0.0)) if dynamics in FILTERS else UNBOUNDED  # it starts at 0
    return _within(state, mj.actuator_actrange[i]) if mj.actuator_actlimited[i] else state


def _tension(forces: list[tuple[Range, float]], bounds: Any) -> Range:
    """The force of a tendon, by several actuators.  MuJoCo scales their forces, before their gears, so that their sum is within the bounds."""
    if bounds is None:
        ranges = [_times(force, gear) for force, gear in forces]
        return sum(r[0] for r in ranges), sum(r[1] for r in ranges)
    forces = [(_within(force, bounds), gear) for force, gear in forces]
    return -_largest([(force, -gear) for force, gear in forces], bounds), _largest(forces, bounds)


def _largest(forces: list[tuple[Range, float]], bounds: Any) -> float:
    """The largest Σ gear × force, each force in its range and their sum within the bounds: what is too much is taken where it costs least."""
    chosen = [force[1] if gear > 0 else force[0] for force, gear in forces]
    over, under = max(sum(chosen) - float(bounds[1]), 0.0), max(float(bounds[0]) - sum(chosen), 0.0)
    for i in sorted(range(len(forces)), key=lambda i: forces[i][1] if over else -forces[i][1]):
        (low, high), _ = forces[i]
        down, up = min(over, chosen[i] - low), min(under, high - chosen[i])
        chosen[i] += up - down
        over, under = over - down, under - up
    return sum(f * gear for f, (_, gear) in zip(chosen, forces, strict=True))


def _times(own: Range, factor: float) -> Range:
    if factor == 0.0:
        return 0.0, 0.0  # and not 0 · ∞
    a, b = own[0] * factor, own[1] * factor
    return min(a, b), max(a, b)


def _sum(a: Range, b: Range) -> Range:
    return a[0] + b[0], a[1] + b[1]


def _within(own: Range, bounds: Any) -> Range:
    """Clamped, as MuJoCo clamps forces: what is beyond a bound is that bound."""
    low, high = float(bounds[0]), float(bounds[1])
    return min(max(own[0], low), high), min(max(own[1], low), high)
