"""Results of calls in Python: finite where their arguments are, or an error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import ResultError

CHECK_UNITS = "check the units of positions, rates, external wrenches, masses and gravity (rad, m, s, N, N m, kg)"
"""What helps where numbers of a file are finite and a result of them is not."""


def require_finite(call: str, result: str, x: NDArray[np.floating]) -> None:
    """Raises ResultError for a number of x (…, numbers) that is not finite.  The message begins with the names of the call and the result."""
    if np.isfinite(x).all():
        return
    rows = x.reshape(-1, x.shape[-1])
    state, index = (int(i) for i in np.argwhere(~np.isfinite(rows))[0])
    which = f"state {state}: " if len(rows) > 1 else ""
    precision = "single" if x.dtype == np.float32 else "double"
    error = ResultError(
        f"{call}: {which}{result}[{index}] is {rows[state, index]}, although all arguments are finite: they, or numbers of the model, are too large or too small for "
        f"{precision} precision"
    )
    error.state = state
    raise error
