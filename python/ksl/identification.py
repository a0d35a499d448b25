"""Identification: what :mod:`ksl.identify.identification` has for users (docs/identification.md)."""

from ksl.identify.certificate import Certificate
from ksl.identify.effort_scale import EffortScale
from ksl.identify.identification import Identification, identify

__all__ = ["Certificate", "EffortScale", "Identification", "identify"]
