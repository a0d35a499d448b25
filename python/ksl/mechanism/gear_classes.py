"""Torsional stiffness of gears in classes of torque, as their makers give it: K1 up to T1, K2 up to T2, K3 beyond."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from ksl.mechanism import given
from ksl.mechanism.requests import one_of

Of = Literal["slope", "twist"]
"""Which stiffness: of small changes at a torque, or torque over twist."""


def has_classes(stiffness: Any) -> bool:
    """Whether the stiffness of some joint of {joint: …} depends on its effort."""
    return isinstance(stiffness, Mapping) and any(isinstance(x, Mapping) and isinstance(x.get("motion"), Mapping) for x in stiffness.values())


def along_motion(who: str, motion: Any, effort: float, of: Of) -> float:
    """The stiffness along a joint's motion at an effort: a number, or from classes {"stiffness": [K1, K2 …], "effort": [T1 …]}, N m/rad and N m, or N/m and N.

    At a limit of classes it is that of the one below.  Raises ValueError that begins with `who`.
    """
    if not isinstance(motion, Mapping):
        return given.number(motion, f"{who}: motion")
    for key in motion:
        one_of(key, f"{who}: motion has key", "stiffness", "effort")
    k, limits = (np.atleast_1d(given.numbers(motion.get(key, []), f"{who}: motion: {key}")).astype(float) for key in ("stiffness", "effort"))
    if k.ndim != 1 or len(k) != len(limits) + 1 or not ((k > 0) & np.isfinite(k)).all() or not (np.diff([0.0, *limits]) > 0).all():
        said = "expected stiffness = [K1, K2, …], positive, and effort = [T1, …], rising from above 0, one fewer"
        raise ValueError(f"{who}: motion has stiffness {k.tolist()} and effort {limits.tolist()}; {said}")
    size = abs(effort)
    if of == "slope" or size == 0:
        return float(k[np.searchsorted(limits, size)])
    ends = np.array([0.0, *limits, np.inf])
    twist = (np.clip(size, ends[:-1], ends[1:]) - ends[:-1]) / k
    return float(size / twist.sum())
