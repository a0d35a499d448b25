"""Inertial parameters from recorded motions: which ones a motion identifies, and which ones a body can have."""
