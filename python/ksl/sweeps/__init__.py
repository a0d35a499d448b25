"""Sweeps: one load case in thousands of variants, computed by processes or by a Ray cluster."""
