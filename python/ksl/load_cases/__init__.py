"""Load cases: every wrench along a motion, and the files of the results."""
