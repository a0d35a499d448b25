"""Force elements in MJCF: spatial tendons of a compiled `mujoco.MjModel` between exactly two sites, with stiffness or damping."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ksl.robot_files.mjcf_actuators import of_tendons, tendon_terms

WRAPS_SITE = 3
"""The value of mjtWrap for sites, which MuJoCo publishes."""
_NOT_USED = ("frictionloss", "armature", "limited", "actfrclimited", "stiffnesspoly", "dampingpoly", "springyield")
HELD = 1e-3
"""A tendon whose range is narrower holds what it goes over: a share of its length, and rad or m for a fixed tendon."""
_PASSIVE = ("stiffness", "stiffnesspoly", "damping", "dampingpoly", "frictionloss", "armature")
"""What makes a tendon couple the joints or bodies it goes over, whoever pulls it."""


def add_force_elements(builder: Any, mj: Any, bodies: list[str], joints: list[str], left_out: set[int], say: Callable[[str], None]) -> tuple[int, list[str]]:
    """Adds the force elements, and returns how many tendons they are, and a line for what is not used of them.

    left_out: bodies that are no part of the robot.  say: what a user must know, that forces of other tendons are missing.
    Between the two ends of `springlength` a tendon exerts no force of its spring: it has stops there and no spring.
    """
    taken: set[str] = set()
    lines: dict[str, list[str]] = {}
    damping = of_tendons(mj, "damping")
    for i in range(mj.ntendon):
        sites = _sites(mj, i)
        goes_to_handle = sites is not None and not left_out.isdisjoint(int(mj.site_bodyid[s]) for s in sites)
        if sites is None or goes_to_handle or not (mj.tendon_stiffness[i] or damping[i]):
            _say_missing(mj, i, joints, say)
            continue
        name = mj.tendon(i).name or f"tendon{i}"
        while name in taken:
            name += "_"
        taken.add(name)
        lower, upper = map(float, mj.tendon_lengthspring[i])
        stiffness = float(mj.tendon_stiffness[i])
        ends = [(bodies[mj.site_bodyid[s]], mj.site_pos[s]) for s in sites]
        spring: dict[str, Any] = {"stiffness": stiffness, "free_length": lower}
        if stiffness and lower < upper:
            spring = {"limits": (lower, upper), "stop_stiffness": stiffness}
        builder.add_force_element(name, *ends[0], *ends[1], damping=float(damping[i]), **spring)
        if _is_held(mj, i):
            _say_missing(mj, i, joints, say, ("narrow limits",))
        for what in _NOT_USED:
            if _has(mj, what, i):
                lines.setdefault(name, []).append(what)
    return len(taken), [f"tendon {name}: {', '.join(what)} (not used)" for name, what in lines.items()]


def _say_missing(mj: Any, i: int, joints: list[str], say: Callable[[str], None], what: Sequence[str] = ()) -> None:
    """Says that a tendon's forces are missing, where it couples joints or bodies by more than its actuators' pull.  what: those, or all that it has."""
    what = what or [word for word in _PASSIVE if _has(mj, word, i)] + (["narrow limits"] if _is_held(mj, i) else [])
    if what:
        terms = tendon_terms(mj, i)
        over = f"joints {', '.join(joints[j] for j in terms)}" if terms else "sites and surfaces"
        say(f"tendon {mj.tendon(i).name or i + 1} couples {over} by its {', '.join(what)}, which KSL doesn't read: these forces are missing")


def _is_held(mj: Any, i: int) -> bool:
    """Whether the limits of a tendon leave it hardly any way: it is a rod, or a coupling of joints."""
    low, high = map(float, mj.tendon_range[i])
    return bool(_has(mj, "limited", i)) and high - low <= HELD * (1.0 if tendon_terms(mj, i) else max(abs(low), abs(high)))


def _sites(mj: Any, i: int) -> tuple[int, int] | None:
    """The sites of a tendon that is the line between two of them, on two bodies."""
    first = int(mj.tendon_adr[i])
    if mj.tendon_num[i] != 2 or any(mj.wrap_type[first + k] != WRAPS_SITE for k in range(2)):
        return None
    a, b = (int(mj.wrap_objid[first + k]) for k in range(2))
    return None if mj.site_bodyid[a] == mj.site_bodyid[b] else (a, b)


def _has(mj: Any, what: str, i: int) -> bool:
    values = of_tendons(mj, what) if what in ("damping", "armature") else getattr(mj, f"tendon_{what}", None)  # older versions have fewer
    return values is not None and bool(np.any(values[i]))
