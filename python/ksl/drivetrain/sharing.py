"""Motors that are more than the joints that they move: how they share efforts, and what then stands for the inverse of their Jacobian.

Efforts τ_m with Wᵀ τ_m = τ whose sum of (τ_m / scale)² is least are τ_m = D W (Wᵀ D W)⁻¹ τ, with D = diag(scale²).  With J = (Wᵀ D W)⁻¹ Wᵀ D this is τ_m = Jᵀ τ, and J W = 1:
J gives the velocities of joints from those of motors, of least squares where these contradict each other (weighted pseudoinverse; Ben-Israel and Greville, Generalized Inverses, 2003, chapter 3).
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Literal

import numpy as np

from ksl.base.words import listed
from ksl.drivetrain.parts import Part
from ksl.mechanism.requests import one_of
from ksl.mechanism.states import Array

if TYPE_CHECKING:
    from ksl.model.model import Model

Sharing = Literal["limits", "weights"]


def scales_of(m: Model, part: Part, sharing: Sharing) -> Array:
    """Scales (motors) of efforts: the motors' effort limits, or 1/√weight of the model's drives.  Raises ValueError where a motor has no limit."""
    one_of(sharing, "sharing", "limits", "weights")
    if sharing == "limits":
        limits = np.asarray(m.effort_limit)[part.of_motors]
        if not (np.isfinite(limits) & (limits > 0)).all():
            motor = [name for name in part.motors for _ in range(m.joint(name).nv)][int(np.argmin(np.isfinite(limits) & (limits > 0)))]
            raise ValueError(
                f"sharing='limits': motor {motor!r} has no effort limit; give it one in the file, or pass sharing='weights' with m.with_drives({{motor: weight}})"
            )
        return limits
    weights = dict(zip(m.drives or (), m.drive_weights))
    return np.array([weights.get(name, 1.0) ** -0.5 for name in part.motors for _ in range(m.joint(name).nv)])


def require_as_many(motors: tuple[str, ...], part: Part) -> None:
    """Refuses motors that are more than the joints, which code of the maps doesn't have."""
    if len(part.of_motors) > len(part.of_joints):
        raise ValueError(
            f"{listed(motors)} are more motors than joints, which code doesn't have; name as many drives as joints, by m.with_drives([…]), or call the map itself"
        )


def held_motors(W: Array, scales: Array | None) -> list[int]:
    """As many motors as joints, of W (motors, joints), that together move the joints best: all, where they are as many."""
    motors, joints = W.shape
    if scales is None:
        return list(range(motors))
    rates = W / np.maximum(np.abs(W).max(axis=0), 1e-300)
    return list(max(combinations(range(motors), joints), key=lambda some: abs(np.linalg.det(rates[list(some)]))))


def inverse_of(W: Array, scales: Array) -> Array:
    """J (n, joints, motors) of W (n, motors, joints)."""
    scaled = W * scales[:, None]
    inverse: Array = np.linalg.pinv(scaled) * scales
    return inverse


def inverse_rate(W: Array, rate: Array, J: Array, scales: Array | None) -> Array:
    """dJ/dt (n, joints, motors) for dW/dt (n, motors, joints): differentiate Wᵀ D W J = Wᵀ D."""
    found: Array = -J @ rate @ J
    if scales is None:
        return found
    D = scales**2
    left = (np.eye(W.shape[1]) - W @ J) * D[:, None]
    found += np.linalg.solve(np.einsum("nmi,m,nmj->nij", W, D, W), rate.swapaxes(1, 2) @ left)
    return found
