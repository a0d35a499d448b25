"""Motions: read from files and arrays, differentiated; what they say of themselves; motions that programs make."""
