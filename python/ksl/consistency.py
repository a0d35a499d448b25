"""Consistent inertial parameters: what :mod:`ksl.identify.consistency` has for users (docs/identification.md)."""

from ksl.identify.consistency import (
    BASIS,
    PARAMETERS,
    barrier,
    barrier_gradient,
    consistency_metric,
    from_log_cholesky,
    from_pseudo_inertia,
    is_consistent,
    log_cholesky,
    log_cholesky_jacobian,
    nearest_consistent,
    pseudo_inertia,
)

__all__ = [
    "BASIS",
    "PARAMETERS",
    "barrier",
    "barrier_gradient",
    "consistency_metric",
    "from_log_cholesky",
    "from_pseudo_inertia",
    "is_consistent",
    "log_cholesky",
    "log_cholesky_jacobian",
    "nearest_consistent",
    "pseudo_inertia",
]
