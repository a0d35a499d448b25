"""What is found about poses at rest: natural frequencies and shapes, and where efforts balance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ksl.mechanism.states import Array


@dataclass(frozen=True, repr=False)
class Modes:
    """What :meth:`ksl.Model.modes` returns; modes are in the order of their frequencies."""

    frequencies: Array
    """(n) Hz, rising; −f where the square is negative: the pose is unstable and leaves as exp(2π f t) does.  Zero is zero."""
    shapes: Array
    """(n, links, 6): twists of the links at their origins in their axes, linear first, of unit modal mass: φᵀ M φ = 1."""
    participation: Array
    """(n, 6): φᵀ M r for unit motions r of the ground along and about the world's axes, through its origin; √kg, and √kg m."""
    effective_mass: Array
    """(n, 6): its squares; kg, and kg m²."""
    strain: Array
    """(n, joints): shares of joints in the energy of their springs in each mode, in the order of `joints`; zeros where nothing is strained."""
    joints: tuple[str, ...]
    """The joints that have springs, those of loops last."""
    links: tuple[str, ...]
    zero: tuple[tuple[str, ...], ...]
    """The joints that move in each mode of frequency zero."""

    def __repr__(self) -> str:
        """One line; the arrays are in the fields."""
        shown = ", ".join(f"{f:.4g}" for f in self.frequencies[:6])
        more = f" and {len(self.frequencies) - 6} more" if len(self.frequencies) > 6 else ""
        return f"<ksl modes: {shown or 'none'}{more} Hz>"


@dataclass(frozen=True, repr=False)
class Equilibrium:
    """What :meth:`ksl.Model.equilibrium` found."""

    q: Array
    """(nq): at rest where `converged`; elsewhere where the search ended."""
    converged: bool
    reason: str
    """"at rest"; or how the search ended: "not found" where what is left has a minimum, "steps" where there were too few, "loops" where no closed position of these was found."""
    residual: Array
    """(n): the efforts that are left, N m or N, of the coordinates `independent`."""
    independent: NDArray[np.intp]
    """(n): indices into v, as :meth:`ksl.Model.independent` has them; all of a tree."""
    stiffness: Array
    """(n, n): what the efforts of these coordinates that would hold the pose change by, per rad or m."""
    stable: bool
    """Whether that, its symmetric part, is positive definite: pushed aside, the mechanism comes back.  False where nothing resists a motion."""

    def __repr__(self) -> str:
        """One line; the arrays are in the fields."""
        how = ("stable" if self.stable else "not stable") if self.converged else f"largest effort left {np.abs(self.residual).max(initial=0.0):.3g}"
        return f"<ksl equilibrium: {self.reason}, {how}, q={np.array2string(self.q, precision=4, separator=', ', threshold=12, max_line_width=1000)}>"
