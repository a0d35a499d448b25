"""The operators: which algorithm computes each of them, and which algorithms compute its derivatives.

All derivatives are analytic, and those of api/algorithms/.  That by q is along joint velocities there; the extension makes one by the nq numbers
of it, as functions of any nq numbers that divide quaternions by their length first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Row:
    """An operator.

    value, result: the algorithm, and which of its results.
    inputs: their names, in the order of the algorithm.
    first, by: the algorithm whose results are derivatives of it, and which of these is the one by each input.
    gradient: the algorithm that computes the products of a cotangent and all first derivatives, if there is one.
    second, by_two: the same for second derivatives: (result, input, other input), the inputs by number, first axis first.
    regressor, by_parameters: the algorithm whose result is the derivative by the parameters of links, and which result.
    solved: regressor and gradient are those of efforts, and the result are accelerations, which change by −M⁻¹ times what efforts do.
    lift: what derivatives are of: the result itself, the tangent of a position, or twists of frames, where the result are poses.
    """

    value: str
    inputs: tuple[str, ...]
    first: str
    by: tuple[int, ...]
    result: int = 0
    gradient: str = ""
    second: str = ""
    by_two: tuple[tuple[int, int, int], ...] = ()
    regressor: str = ""
    by_parameters: int = 0
    solved: bool = False
    lift: Literal["", "position", "poses"] = ""


_QUV = ("q", "v", "a")

ROWS: dict[str, Row] = {
    "inverse_dynamics": Row(
        "inverse_dynamics", _QUV, "inverse_dynamics_derivatives", (0, 1, 2),
        gradient="inverse_dynamics_gradient", second="inverse_dynamics_second_derivatives",
        by_two=((0, 0, 0), (1, 1, 1), (2, 0, 1), (3, 2, 0)), regressor="inverse_dynamics_regressor",
    ),
    "bias": Row(
        "bias", ("q", "v"), "inverse_dynamics_derivatives", (0, 1),
        gradient="inverse_dynamics_gradient", second="inverse_dynamics_second_derivatives",
        by_two=((0, 0, 0), (1, 1, 1), (2, 0, 1)), regressor="inverse_dynamics_regressor",
    ),
    "gravity_torque": Row(
        "gravity_torque", ("q",), "stiffness", (0,),
        gradient="inverse_dynamics_gradient", second="inverse_dynamics_second_derivatives",
        by_two=((0, 0, 0),), regressor="gravity_torque_regressor",
    ),
    "forward_dynamics": Row(
        "forward_dynamics", ("q", "v", "tau"), "forward_dynamics_derivatives", (0, 1, 2),
        gradient="inverse_dynamics_gradient", second="forward_dynamics_second_derivatives",
        by_two=((0, 0, 0), (1, 1, 1), (2, 0, 1), (3, 0, 2)), regressor="inverse_dynamics_regressor", solved=True,
    ),
    "reactions": Row("reactions", _QUV, "reactions_derivatives", (0, 1, 2), regressor="reactions_regressor"),
    "mass_matrix": Row("mass_matrix", ("q",), "inverse_dynamics_second_derivatives", (3,)),
    "kinetic_energy": Row("energy", ("q", "v"), "energy_derivatives", (0, 1), regressor="energy_regressor"),
    "potential_energy": Row(
        "energy", ("q",), "energy_derivatives", (2,), result=1, second="stiffness", by_two=((0, 0, 0),), regressor="energy_regressor", by_parameters=1,
    ),
    "frame_poses": Row("frame_poses", ("q",), "frame_velocities_derivatives", (1,), lift="poses"),
    "frame_velocities": Row("frame_velocities", ("q", "v"), "frame_velocities_derivatives", (0, 1)),
    "frame_accelerations": Row("frame_accelerations", _QUV, "frame_accelerations_derivatives", (0, 1, 2)),
    "center_of_mass": Row("center_of_mass", ("q",), "center_of_mass_jacobian", (0,)),
    "centroidal_momentum": Row("centroidal_momentum", ("q", "v"), "centroidal_momentum_derivatives", (0, 1)),
    "centroidal_momentum_rate": Row("centroidal_momentum_rate", _QUV, "centroidal_momentum_rate_derivatives", (0, 1, 2)),
    "integrate": Row("integrate", ("q", "dv"), "integrate_jacobians", (0, 1), lift="position"),
    "difference": Row("difference", ("q0", "q1"), "difference_jacobians", (0, 1)),
}  # fmt: skip

COMPLETIONS: dict[str, Row] = {
    "close": Row("close", ("q",), "", (0,), lift="position"),
    "consistent_velocity": Row("consistent_velocity", ("q", "v"), "", (0, 1)),
    "consistent_acceleration": Row("consistent_acceleration", _QUV, "", (0, 1, 2)),
}
"""Calls of mechanisms with loops, whose derivatives follow from the equations of these."""
