"""Base parameters: what :mod:`ksl.identify.base_parameters` has for users (docs/identification.md)."""

from ksl.identify.base_parameters import TOLERANCE, BaseParameters, moving_links, of_motion, of_regressor, structural

__all__ = ["TOLERANCE", "BaseParameters", "moving_links", "of_motion", "of_regressor", "structural"]
