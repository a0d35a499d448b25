"""Load cases: every wrench along a motion, tables of them, and their shares of limits."""
