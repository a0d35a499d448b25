"""Errors and warnings about files."""


class DescriptionError(ValueError):
    """A robot file can't be read or describes no mechanism.  Names file, line, link or joint, what is wrong and how to mend it."""


class MotionError(ValueError):
    """A motion can't be used.  Names the file, the line or column, what is wrong and how to mend it."""


class DescriptionWarning(UserWarning):
    """Suspicious content of a robot file that is used all the same: an impossible inertia, a moving link without mass, a guessed encoding."""


class QuaternionWarning(UserWarning):
    """A quaternion of a position differs from unit length by more than 1e-6, but by no more than 1e-2, and was normalised."""


class FrameError(ValueError):
    """Two spatial values whose frames don't match.  Names the operation and both frames."""
