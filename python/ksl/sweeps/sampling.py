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
    from scipy.stats import qmc

    points = qmc.LatinHypercube(len(sweep.parameters), rng=np.random.default_rng(sweep.seed)).random(sweep.cases)
    columns = {}
    for p, x in zip(sweep.parameters, points.T, strict=True):
        columns[p.name] = np.array(p.values)[(x * len(p.values)).astype(int)] if p.values else p.lower + (p.upper - p.lower) * x
    return columns
