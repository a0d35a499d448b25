"""Algorithms with their derivatives, for libraries of arrays that differentiate: one table of operators, and a file for each library.

:mod:`ksl.torch` and :mod:`ksl.jax` are what users import.
"""
