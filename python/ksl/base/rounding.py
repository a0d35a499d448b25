"""What rounding in memory makes of numbers that are differentiated."""

from __future__ import annotations

import sys

OF_POSITIONS = 64 * sys.float_info.epsilon
"""Rounding of a position in a rate: relative to the joint's largest position, over the step between samples.  Some units in the last place,
amplified by the spline."""
