"""A bar that swings about a hinge at its end under gravity, with a wrench at its tip; its inertia is that of the solid."""

import numpy as np

import ksl

SIZE, RHO = np.array([0.4, 0.03, 0.02]), 7850.0
MASS = RHO * SIZE.prod()


def bar_model(mass=MASS):
    L, b, h = SIZE
    inertia = mass * np.diag([b * b + h * h, L * L + h * h, L * L + b * b]) / 12
    builder = ksl.Builder("swing").add_link("base").add_link("bar", mass, (L / 2, 0, 0), inertia).add_link("tip")
    return builder.add_joint("hinge", "revolute", "base", "bar", axis=(0, 1, 0)).add_joint("weld", "fixed", "bar", "tip", xyz=(L, 0, 0)).build()


def bar_cases(speed=12.0, acceleration=150.0, mass=MASS, tip=(30.0, 20.0, -50.0, 1.0, -2.0, 3.0), times=(0.0,)):
    """Its free body at an angle of 0.3 rad."""
    q, v, a = (np.full((2, 1), x) for x in (0.3, speed, acceleration))
    run = ksl.compute_loads(bar_model(mass), (np.array([0.0, 1.0]), q, v, a), external={"tip": np.array(tip)})
    return ksl.free_bodies(run, times=times, links=["bar"])
