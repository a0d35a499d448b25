"""Samples over time: rates, corners, noise, gaps, the filter, and what is doubtful about them."""
