"""The key `simulate` of a load case: docs/cases.md says what it may hold."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, cast

from ksl.base.errors import CaseError, near_names
from ksl.load_cases.simulated import CONTROLLERS, ControllerName, Simulated
from ksl.model.simulate import METHODS, Method

KEYS = (
    "until", "from", "pose", "velocity", "controller", "stiffness", "damping", "brake_at", "brake", "friction", "restitution",
    "rate", "method", "step", "rtol", "atol",
)  # fmt: skip


def simulated_of(where: str, given: Any) -> Simulated:
    """Raises CaseError with the key."""
    if not isinstance(given, Mapping):
        raise CaseError(f"{where} is {given!r}; expected a table, as {{ until = 2.0 }}")
    for key in given:
        if key not in KEYS:
            raise CaseError(f"{where}: unknown key {key!r}; {near_names(key, KEYS)}known: {', '.join(KEYS)}")
    number = lambda key: None if key not in given else _number(f"{where}: {key}", given[key])
    numbers = lambda key: None if key not in given else _numbers(f"{where}: {key}", given[key])
    usual = Simulated()
    pose = given.get("pose")
    if pose is not None and not isinstance(pose, Mapping):
        raise CaseError(f"{where}: pose is {pose!r}; expected a table of positions, as {{ elbow = 1.2 }}")
    velocity = _numbers(f"{where}: velocity", given.get("velocity", {}))
    if not isinstance(velocity, Mapping):
        raise CaseError(f"{where}: velocity is {velocity!r}; expected a table of joints, as {{ elbow = 0.5 }}")
    return Simulated(
        number("until"),
        number("from"),
        pose,
        velocity,
        cast(ControllerName, _one_of(f"{where}: controller", given.get("controller", "none"), CONTROLLERS)),
        numbers("stiffness") or usual.stiffness,
        numbers("damping") or usual.damping,
        number("brake_at"),
        numbers("brake"),
        numbers("friction"),
        numbers("restitution"),
        number("rate") or usual.rate,
        cast(Method, _one_of(f"{where}: method", given.get("method", "dop853"), METHODS)),
        number("step"),
        usual.rtol if number("rtol") is None else number("rtol"),
        usual.atol if number("atol") is None else number("atol"),
    )


def _number(where: str, x: Any) -> float:
    if isinstance(x, bool) or not isinstance(x, (int, float)) or not math.isfinite(x):
        raise CaseError(f"{where} is {x!r}; expected a number")
    return float(x)


def _numbers(where: str, x: Any) -> float | dict[str, float]:
    """One number, or a table of joints."""
    if isinstance(x, Mapping):
        return {name: _number(f"{where}: {name}", value) for name, value in x.items()}
    return _number(where, x)


def _one_of(where: str, x: Any, known: tuple[str, ...]) -> str:
    if not isinstance(x, str) or x not in known:
        raise CaseError(f"{where} {x!r}; {near_names(x, known)}expected one of {', '.join(known)}")
    return x
