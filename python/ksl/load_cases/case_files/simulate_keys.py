"""The key `simulate` of a load case: docs/cases.md says what it may hold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from ksl.base.errors import CaseError, near_names
from ksl.load_cases.case_files.case_values import number_of
from ksl.load_cases.case_files.simulated import CONTROLLERS, ControllerName, Simulated
from ksl.simulation.simulate import METHODS, Method

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

    def number(key: str, usual: float) -> float:
        return number_of(f"{where}: {key}", given[key]) if key in given else usual

    def number_if_any(key: str) -> float | None:
        return number_of(f"{where}: {key}", given[key]) if key in given else None

    def numbers_if_any(key: str) -> float | dict[str, float] | None:
        return _numbers(f"{where}: {key}", given[key]) if key in given else None

    usual = Simulated()
    pose = given.get("pose")
    if pose is not None and not isinstance(pose, Mapping):
        raise CaseError(f"{where}: pose is {pose!r}; expected a table of positions, as {{ elbow = 1.2 }}")
    velocity = _numbers(f"{where}: velocity", given.get("velocity", {}))
    if not isinstance(velocity, Mapping):
        raise CaseError(f"{where}: velocity is {velocity!r}; expected a table of joints, as {{ elbow = 0.5 }}")
    found = Simulated(
        until=number_if_any("until"),
        start=number_if_any("from"),
        pose=pose,
        velocity=velocity,
        controller=cast(ControllerName, _one_of(f"{where}: controller", given.get("controller", usual.controller), CONTROLLERS)),
        stiffness=numbers_if_any("stiffness") or usual.stiffness,
        damping=numbers_if_any("damping") or usual.damping,
        brake_at=number_if_any("brake_at"),
        brake=numbers_if_any("brake"),
        friction=numbers_if_any("friction"),
        restitution=numbers_if_any("restitution"),
        rate=number("rate", usual.rate),
        method=cast(Method, _one_of(f"{where}: method", given.get("method", usual.method), METHODS)),
        step=number_if_any("step"),
        rtol=number("rtol", usual.rtol),
        atol=number("atol", usual.atol),
    )
    _require_use(where, given)
    return found


def _require_use(where: str, given: Mapping[str, Any]) -> None:
    """Refuses keys that would change nothing, and a controller without what it controls by."""
    if "brake" in given and "brake_at" not in given:
        raise CaseError(f"{where}: brake: brakes engage at a time; give brake_at, s")
    controller = given.get("controller", "none")
    gains = [key for key in ("stiffness", "damping") if key in given]
    if controller in ("pd", "computed torque") and not gains:
        raise CaseError(f"{where}: controller {controller!r} needs stiffness and damping")
    if idle := [key for key in gains if controller == "none" or (controller == "gravity" and key == "stiffness")]:
        raise CaseError(
            f'{where}: {idle[0]} is that of a controller; give controller = "pd" or "computed torque"{", or gravity, which damps" if idle == ["damping"] else ""}'
        )


def _numbers(where: str, x: Any) -> float | dict[str, float]:
    """One number, or a table of joints."""
    if isinstance(x, Mapping):
        return {name: number_of(f"{where}: {name}", value) for name, value in x.items()}
    return number_of(where, x)


def _one_of(where: str, x: Any, known: tuple[str, ...]) -> str:
    if not isinstance(x, str) or x not in known:
        raise CaseError(f"{where} {x!r}; {near_names(x, known)}expected one of {', '.join(known)}")
    return x
