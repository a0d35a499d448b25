#!/usr/bin/env python3
"""Make the sample motions: one pick-and-place cycle for each sample robot.

    python3 make_motions.py

writes ur5_pick.csv and panda_pick.csv next to this file: a header line, then
one line every 4 ms with `time` in seconds and each joint's position in
radians, to 9 significant digits. It needs numpy, and reads the joint limits
from ../robots.

A cycle is three legs, home to pick, pick to place and place to home, with a
dwell at the pick and at the place. A leg starts and ends at rest and runs
through its way-points without stopping. Of all curves that meet the
way-points at the given times, with zero velocity, acceleration, jerk and
snap at both ends, it is the one with the smallest integral of the squared
fifth derivative. That curve is a polynomial of degree nine between
way-points, continuous to the eighth derivative where two of them join. So
the whole cycle has four continuous derivatives.

The way-points are joint positions, worked out once so that the flange points
straight down at the picks, and rounded to a milliradian.
"""

import os
import xml.etree.ElementTree as ET

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
STEP = 0.004  # seconds: 250 Hz
DEGREE = 9
REST = 4  # derivatives that vanish where a leg starts and ends

MOTIONS = [
    {
        "urdf": "ur5.urdf",
        "csv": "ur5_pick.csv",
        "way_points": {
            "home": (-1.084, -1.536, -1.347, -1.571, 1.214, -0.136),
            "above pick": (-1.714, -1.848, -2.004, -0.861, 1.571, 0.527),
            "pick": (-1.853, -2.067, -2.076, -0.569, 1.571, 0.624),
            "above place": (-0.418, -2.04, -1.483, -1.19, 1.571, -0.436),
            "place": (-0.247, -2.138, -1.584, -0.99, 1.571, -0.585),
        },
        # Each leg: way-points, and the seconds from each to the next.
        "legs": [
            (("home", "above pick", "pick"), (0.66, 0.46)),
            (("pick", "above pick", "above place", "place"), (0.52, 0.72, 0.52)),
            (("place", "above place", "home"), (0.42, 0.64)),
        ],
        "dwell": 0.08,
    },
    {
        "urdf": "panda.urdf",
        "csv": "panda_pick.csv",
        "way_points": {
            "home": (0.124, -0.182, -0.083, -2.412, 0.062, 2.171, 0.831),
            "above pick": (-0.323, 0.175, -0.222, -2.381, 0.069, 2.551, 0.486),
            "pick": (-0.502, 0.418, -0.126, -2.375, 0.148, 2.786, 0.429),
            "above place": (0.374, 0.301, 0.216, -2.005, -0.085, 2.298, 1.022),
            "place": (0.506, 0.462, 0.197, -2.031, -0.142, 2.48, 1.08),
        },
        "legs": [
            (("home", "above pick", "pick"), (0.68, 0.48)),
            (("pick", "above pick", "above place", "place"), (0.52, 0.62, 0.50)),
            (("place", "above place", "home"), (0.46, 0.66)),
        ],
        "dwell": 0.08,
    },
]


def read_limits(path):
    """Names, lower and upper positions and top speeds of the moving joints."""
    joints = [j for j in ET.parse(path).getroot().findall("joint") if j.get("type") == "revolute"]
    limits = [j.find("limit") for j in joints]
    lower, upper, speed = (np.array([float(limit.get(key)) for limit in limits]) for key in ("lower", "upper", "velocity"))
    return [j.get("name") for j in joints], lower, upper, speed


def powers(u, order):
    """The derivative of that order of (1, u, ..., u^DEGREE)."""
    row = np.zeros(DEGREE + 1)
    for k in range(order, DEGREE + 1):
        row[k] = np.prod(np.arange(k - order + 1, k + 1, dtype=float)) * u ** (k - order)
    return row


def fit_leg(points, durations):
    """Coefficients [piece, power, joint], in u = (time in piece) / duration."""
    points = np.array(points)
    offsets = points - points[0]
    scales = np.array(durations) / np.mean(durations)
    pieces, size = len(durations), DEGREE + 1
    rows, values = [], []

    def add(terms, value):
        row = np.zeros(pieces * size)
        for piece, u, order, sign in terms:
            row[piece * size : (piece + 1) * size] += sign * powers(u, order) / scales[piece] ** order
        rows.append(row)
        values.append(value)

    nothing = np.zeros(points.shape[1])
    for piece in range(pieces):
        add([(piece, 0.0, 0, 1)], offsets[piece])
        add([(piece, 1.0, 0, 1)], offsets[piece + 1])
    for order in range(1, REST + 1):
        add([(0, 0.0, order, 1)], nothing)
        add([(pieces - 1, 1.0, order, 1)], nothing)
    for piece in range(pieces - 1):
        for order in range(1, DEGREE):
            add([(piece, 1.0, order, 1), (piece + 1, 0.0, order, -1)], nothing)

    solution = np.linalg.solve(np.array(rows), np.array(values))
    coefficients = solution.reshape(pieces, size, points.shape[1])
    coefficients[:, 0] += points[0]
    return coefficients


def plan(motion):
    """The cycle as a list of (start, duration, coefficients), and its length."""
    spans, now = [], 0.0
    for number, (names, durations) in enumerate(motion["legs"]):
        points = [motion["way_points"][name] for name in names]
        if number > 0:
            still = np.zeros((DEGREE + 1, len(points[0])))
            still[0] = points[0]
            spans.append((now, motion["dwell"], still))
            now += motion["dwell"]
        for duration, coefficients in zip(durations, fit_leg(points, durations)):
            spans.append((now, duration, coefficients))
            now += duration
    return spans, now


def sample(spans, times, order=0):
    """The derivative of that order, one row for each time."""
    starts = np.array([start for start, _, _ in spans])
    rows = []
    for time in times:
        start, duration, coefficients = spans[np.searchsorted(starts, time + 1e-9) - 1]
        u = min(max((time - start) / duration, 0.0), 1.0)
        rows.append(powers(u, order) @ coefficients / duration**order)
    return np.array(rows)


def check(motion, spans, length, lower, upper, speed):
    """Limits, rest at both ends and at the picks. Returns the peak speeds."""
    fine = np.linspace(0.0, length, 1 + 4 * round(length / STEP))
    position, velocity = sample(spans, fine), sample(spans, fine, 1)
    peak = np.abs(velocity).max(axis=0)
    assert np.all(position > lower) and np.all(position < upper), "position limit"
    assert np.all(peak < speed), "velocity limit"
    assert np.all(position[0] == motion["way_points"]["home"])
    assert np.allclose(position[-1], motion["way_points"]["home"], rtol=0, atol=1e-9)
    still = [0.0, length]
    still += [start + part * motion["dwell"] for start, duration, coefficients in spans if not coefficients[1:].any() for part in (0.0, 0.5, 1.0)]
    for order in range(1, REST + 1):
        assert np.allclose(sample(spans, still, order), 0.0, atol=1e-6), "not at rest"
    return peak


def write(path, names, times, positions):
    with open(path, "w", encoding="ascii", newline="\n") as out:
        out.write(",".join(["time"] + names) + "\n")
        for time, row in zip(times, positions):
            out.write(",".join(f"{value:.9g}" for value in (time, *row)) + "\n")


def main():
    for motion in MOTIONS:
        names, lower, upper, speed = read_limits(os.path.join(HERE, "..", "robots", motion["urdf"]))
        spans, length = plan(motion)
        peak = check(motion, spans, length, lower, upper, speed)
        times = STEP * np.arange(round(length / STEP) + 1)
        write(os.path.join(HERE, motion["csv"]), names, times, sample(spans, times))
        shares = ", ".join(f"{name} {share:.0f}" for name, share in zip(names, 100 * peak / speed))
        print(f"{motion['csv']}: {len(times)} samples, {length:.3f} s; peak speed, % of limit: {shares}")


if __name__ == "__main__":
    main()
