"""Linear models with names, as scipy.signal and control take them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ksl.base.extras import require
from ksl.mechanism.states import Array


@dataclass(frozen=True, repr=False)
class LinearModel:
    """ẋ = rate + A x + B u, y = y₀ + C x + D u, or in steps x⁺ = rate + A x + B u.  x = (q ⊖ q₀, v − v₀) of `coordinates`, u = tau − tau₀ of `inputs`, all about the state that was given.

    It unpacks into A, B, C, D: `scipy.signal.StateSpace(*l)`, `control.ss(*l)`.
    """

    A: Array
    """(2n, 2n)."""
    B: Array
    """(2n, inputs)."""
    C: Array
    """(outputs, 2n)."""
    D: Array
    """(outputs, inputs)."""
    rate: Array
    """(2n): v₀ and the accelerations there; of a discrete model what x gains in a step."""
    coordinates: tuple[str, ...]
    """Names of the n independent coordinates."""
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    equilibrium: bool
    """Whether the state is at rest and stays so."""
    output: Array
    """(outputs): y₀, what the outputs are at the state."""
    dt: float | None = None
    """s, of a discrete model; None of a continuous one."""

    def __iter__(self) -> Iterator[Array]:
        return iter((self.A, self.B, self.C, self.D))

    def __len__(self) -> int:
        return 4

    def __repr__(self) -> str:
        """One line; the arrays are in the fields."""
        steps = "" if self.dt is None else f", dt={self.dt:g} s"
        return f"<ksl linear model: {', '.join(self.states)}; inputs {', '.join(self.inputs) or 'none'}; outputs {', '.join(self.outputs) or 'none'}{steps}>"

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the 2n states: those of the coordinates, and d/dt of these."""
        return (*self.coordinates, *(f"d/dt {name}" for name in self.coordinates))

    def discrete(self, dt: float) -> LinearModel:
        """The model in steps of dt, s, between which inputs are held (zero-order hold); C and D stay.

        Exact: the exponential of [[A, B, rate], [0, 0, 0]] dt (Franklin, Powell, Workman, Digital Control of Dynamic Systems, 1998, section 4.3).
        Needs SciPy, of the extra `ksl[loads]`.  Raises ValueError for a step that isn't positive, and of a discrete model.
        """
        if self.dt is not None:
            raise ValueError(f"the model is discrete, in steps of {self.dt:g} s; call discrete of the continuous one")
        if isinstance(dt, bool) or not isinstance(dt, (int, float, np.number)) or not 0 < dt < np.inf:
            raise ValueError(f"dt={dt!r}; expected a step in s, above 0")
        require("LinearModel.discrete", "scipy")
        from scipy.linalg import expm

        n, k = self.B.shape
        M = np.zeros((n + k + 1, n + k + 1))
        M[:n] = np.hstack([self.A, self.B, self.rate[:, None]]) * dt
        E = expm(M)
        return LinearModel(
            E[:n, :n], E[:n, n:-1], self.C, self.D, E[:n, -1], self.coordinates, self.inputs, self.outputs, self.equilibrium, self.output, float(dt)
        )

    def state_space(self) -> Any:
        """The model as `scipy.signal.StateSpace`, for lsim, bode, dlsim …; without chosen outputs, all states are.  Needs SciPy, of the extra `ksl[loads]`."""
        require("LinearModel.state_space", "scipy")
        from scipy.signal import StateSpace

        return StateSpace(*self._with_outputs()) if self.dt is None else StateSpace(*self._with_outputs(), dt=self.dt)

    def control(self) -> Any:
        """This model as a `control.StateSpace` with names of states, inputs and outputs, for lqr, place, step responses …; without chosen outputs, all states are.

        Needs the package control, which comes with no extra.
        """
        try:
            import control
        except ModuleNotFoundError:
            raise ModuleNotFoundError("LinearModel.control needs the package control; install it with: pip install control", name="control") from None
        names = {"states": _plain(self.states), "inputs": _plain(self.inputs), "outputs": _plain(self.outputs or self.states)}
        return control.ss(*self._with_outputs(), **({} if self.dt is None else {"dt": self.dt}), **names)

    def _with_outputs(self) -> tuple[Array, Array, Array, Array]:
        if self.outputs:
            return self.A, self.B, self.C, self.D
        return self.A, self.B, np.eye(len(self.A)), np.zeros(self.B.shape)


def _plain(names: tuple[str, ...]) -> list[str]:
    """Names without dots, which stand between system and signal there."""
    return [name.replace(".", "_").replace("d/dt ", "d_") for name in names]
