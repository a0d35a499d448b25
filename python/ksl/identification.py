"""Identification: what :mod:`ksl.identify.identification` has for users (docs/identification.md)."""

from ksl.identify.identification import Identification, identify

__all__ = ["Identification", "identify"]
