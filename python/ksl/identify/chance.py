"""What chance does once in a million times: doubts are raised beyond it."""

from __future__ import annotations

import numpy as np

SURE = 4.75
"""Standard deviations of the normal distribution: where a true prior, possible bodies and the noise as it is would give such a value once in a million times."""


def rare(n: int) -> float:
    """What a sum of n squares of standard normal numbers exceeds once in a million times (Wilson, Hilferty, 1931)."""
    n = max(n, 1)
    return float(n * (1 - 2 / (9 * n) + SURE * np.sqrt(2 / (9 * n))) ** 3)
