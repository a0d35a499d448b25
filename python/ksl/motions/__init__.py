"""Motions: read, differentiated."""
