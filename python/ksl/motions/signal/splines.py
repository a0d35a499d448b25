"""Splines through the samples of a motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from ksl.base.errors import MotionError
from ksl.base.extras import require
from ksl.mechanism.states import Array

TOO_CLOSE = "times are so close to each other, for their distances elsewhere, that no spline goes through the samples; check their unit (s), or leave some out"


def spline_through(time: Array, x: Array, degree: int = 5) -> Any:
    """The not-a-knot spline of scipy through x (n, …) at increasing times (n).  Raises MotionError where rounding leaves no equations for one."""
    require("a spline through samples", "scipy")
    from scipy.interpolate import make_interp_spline

    if (np.diff(time) <= 0).any():  # times that differ by less than their distance from the first one can show
        raise MotionError(TOO_CLOSE)
    try:
        return make_interp_spline(time, x, k=degree, check_finite=False)
    except np.linalg.LinAlgError:
        raise MotionError(TOO_CLOSE) from None
