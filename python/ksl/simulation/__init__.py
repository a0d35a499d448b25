"""Mechanisms in motion: what drives a simulation, and what it gives.

import ksl
from ksl.simulation import PD, Reference

run = m.simulate(q, v, times, efforts=PD(Reference(times, q_d, v_d), stiffness=400.0, damping=40.0, gravity=True))
run.q, run.efforts, run.drift.energy
"""

from ksl.simulation.drives import PD, Brake, ComputedTorque, GravityCompensation, Reference
from ksl.simulation.simulation_result import Drift, Event, Simulation

__all__ = ["PD", "Brake", "ComputedTorque", "Drift", "Event", "GravityCompensation", "Reference", "Simulation"]
