"""Values of the parameters for each case of a sweep."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ksl.sweeps.description import Sweep


def sample(sweep: Sweep) -> dict[str, NDArray[Any]]:
    """{parameter: its value in each case (cases)}, numbers or names of files.

    A grid varies the last parameter fastest.  A Latin hypercube divides every range into as many parts as there are cases, and uses each
    part once (McKay, Beckman and Conover, Technometrics 21 (1979) 239); values of a list are used equally often.  The same seed gives
    the same cases.
    """
    if sweep.sampling == "grid":
        indices = np.unravel_index(np.arange(sweep.cases), [len(p.values) for p in sweep.parameters])
        return {p.name: np.array(p.values)[i] for p, i in zip(sweep.parameters, indices, strict=True)}
    rng = np.random.default_rng(sweep.seed)
    columns = {}
    for p in sweep.parameters:
        cell = rng.permutation(sweep.cases)
        if p.values:
            columns[p.name] = np.array(p.values)[cell * len(p.values) // sweep.cases]
        else:
            columns[p.name] = p.lower + (p.upper - p.lower) * (cell + rng.random(sweep.cases)) / sweep.cases
    return columns
