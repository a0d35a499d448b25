"""What VDI 2230 takes from a bolt's name: preload, resiliences, loss by embedding, and what the bolt may carry.

Lengths in m, forces in N, stresses in Pa.  Source: VDI 2230 part 1:2015.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple, get_args

from ksl.sizing.bolt_names import Bolt
from ksl.sizing.figures import Formula

ThreadIn = Literal["plate", "nut"]
THREADS_IN = get_args(ThreadIn)

BOLT_MODULUS = 205e9
"""Young's modulus of steel, Pa, as VDI 2230 takes it."""
MODULI = {"steel": 205e9, "aluminium": 70e9, "titanium": 110e9, "cast iron": 110e9, "magnesium": 44e9}
"""Young's moduli of plates by their material, Pa."""

TIGHTENING = {"torque wrench": 2.0, "torque wrench, tested": 1.6, "angle": 1.4, "yield": 1.4, "hydraulic": 1.6, "impact": 4.0}
"""α_A by method, the larger end of its range in Table A8: torque wrench with estimated friction 1.6 to 2, with friction from tests on the joint
1.4 to 1.6; by angle or yield 1.2 to 1.4; hydraulic 1.2 to 1.6; impact wrench 2.5 to 4."""

BEARING_DIAMETERS = {
    3: 5.07, 4: 6.53, 5: 8.03, 6: 9.38, 8: 12.33, 10: 15.33, 12: 17.23, 14: 20.17, 16: 23.17, 20: 28.87, 24: 34.81, 30: 43.61, 36: 52.54,
}  # fmt: skip
"""d_W of socket heads, smallest, mm, by thread: ISO 4762."""
HOLES = {3: 3.4, 4: 4.5, 5: 5.5, 6: 6.6, 8: 9.0, 10: 11.0, 12: 13.5, 14: 15.5, 16: 17.5, 20: 22.0, 24: 26.0, 30: 33.0, 36: 39.0}
"""d_h, medium series, mm: ISO 273."""

CONE = 0.6
"""tan φ of the cone of pressure under the head."""
EMBEDDING = {"plate": 8e-6, "nut": 11e-6}
"""f_Z, m, for surfaces of Rz up to 10 µm and shear load, Table 5: thread 3 µm, each head or nut 3 µm, one interface 2 µm."""


PRELOAD = Formula(
    "α_A F_M = A_S ν Rp0.2/√(1 + 3 k²), k = 3/2 (d2/d_S) (P/(π d2) + 1.155 μ_G)", "VDI 2230 part 1:2015, R7 and Table A8; ISO 898-1:2013, Table 3; ISO 68-1"
)
RESILIENCE = Formula(
    "δ_S of head, shank, free and engaged thread; δ_P of a cone with tan φ = 0.6; F_Z = f_Z/(δ_S + δ_P)",
    "VDI 2230 part 1:2015, 5.1.1, 5.1.2, Table 5; ISO 4762; ISO 273",
)
AMPLITUDE_LIMIT = Formula("limit: 0.85 (150/d + 45) N/mm² · A_S, d in mm", "VDI 2230 part 1:2015, R9, threads rolled before heat treatment")


class Loads(NamedTuple):
    """What a bolt may carry, N."""

    preload: float
    """F_M zul: the largest assembly preload."""
    yield_force: float
    amplitude: float


def torsion(bolt: Bolt, friction: float, section: float) -> float:
    """Torsional stress of tightening over the axial one: c (d2/d_S) (P/(π d2) + 1.155 μ_G); c is 3/2 where the section yields, 2 where it is elastic."""
    d2 = bolt.pitch_diameter
    return section * d2 / bolt.stress_diameter * (bolt.pitch / (math.pi * d2) + 1.155 * friction)


def assembly_preload(bolt: Bolt, friction: float = 0.12, utilisation: float = 0.9) -> float:
    """Largest assembly preload F_M zul, N: A_S ν Rp0.2/√(1 + 3 k²), k the ratio of :func:`torsion`.

    friction μ_G: smallest one in the thread; utilisation ν: share of the yield strength that tension and torsion together may use.
    Source: R7; Table A1 has the values for ν = 0.9.
    """
    k = torsion(bolt, friction, 1.5)
    return bolt.stress_area * utilisation * bolt.yield_strength / math.sqrt(1 + 3 * k * k)


def allowed_loads(bolt: Bolt, friction: float = 0.12, utilisation: float = 0.9) -> Loads:
    """Preload, force at which the bolt yields in service with half of the torsion of tightening (R8), and amplitude (R9).

    The endurance limit is that of threads rolled before heat treatment, 0.85 (150/d + 45) N/mm², d in mm.
    """
    preload = assembly_preload(bolt, friction, utilisation)
    tau = torsion(bolt, friction, 2.0) * preload / bolt.stress_area
    yields = bolt.stress_area * math.sqrt(bolt.yield_strength**2 - 3 * (0.5 * tau) ** 2)
    return Loads(preload, yields, 0.85e6 * (0.150 / bolt.diameter + 45) * bolt.stress_area)


def bolt_resilience(bolt: Bolt, clamp_length: float, shank_length: float = 0.0, thread_in: ThreadIn = "plate", modulus: float = BOLT_MODULUS) -> float:
    """δ_S, m/N: head, shank, free thread and engaged thread one after the other, of a socket head.

    clamp_length l_K; shank_length: how much of it has no thread; thread_in: a plate that is tapped, of this modulus, or a nut.  Source: 5.1.1, head 0.4 d,
    thread 0.5 d, nut 0.4 d, tapped plate 0.33 d.
    """
    d, nominal, core = bolt.diameter, math.pi / 4 * bolt.diameter**2, math.pi / 4 * bolt.core_diameter**2
    held = 0.33 * d / modulus if thread_in == "plate" else 0.4 * d / BOLT_MODULUS
    return ((0.4 * d + shank_length) / nominal + (clamp_length - shank_length + 0.5 * d) / core) / BOLT_MODULUS + held / nominal


def plate_resilience(bolt: Bolt, clamp_length: float, modulus: float, thread_in: ThreadIn = "plate") -> float:
    """δ_P, m/N: of a cone of pressure from the head into a tapped plate, or of two from head and nut, in plates that are wide enough.

    2 ln[(d_W + d_h)(d_W + w l_K tan φ − d_h)/((d_W − d_h)(d_W + w l_K tan φ + d_h))]/(w E π d_h tan φ), w = 2 in a tapped plate and 1 with a nut.
    Source: 5.1.2, tan φ = 0.6.
    """
    dW, dh = bearing(bolt)
    w = 2 if thread_in == "plate" else 1
    far = dW + w * clamp_length * CONE
    inside = (dW + dh) * (far - dh) / ((dW - dh) * (far + dh))
    return 2 * math.log(inside) / (w * modulus * math.pi * dh * CONE)


def bearing(bolt: Bolt) -> tuple[float, float]:
    """Diameters d_W of the head's bearing surface and d_h of the hole, m.  Raises ValueError for threads without a socket head in ISO 4762."""
    d = round(bolt.diameter * 1000, 2)
    if d not in HOLES:
        raise ValueError(f"ISO 4762 has no socket head for M{d:g}")
    return BEARING_DIAMETERS[int(d)] / 1000, HOLES[int(d)] / 1000
