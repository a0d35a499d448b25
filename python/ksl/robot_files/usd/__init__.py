"""USD stages: what is in them, with the library of its makers, and the mechanism that it means."""
