"""What can go wrong with files, and what is only worth a warning."""


class DescriptionError(ValueError):
    """A robot file that can't be read or describes no mechanism: names file, line, link or joint, fault and mend."""


class MotionError(ValueError):
    """A motion that can't be used: names the file, the line or column, the fault and the mend."""


class DescriptionWarning(UserWarning):
    """What is odd in a robot file, and used all the same: an inertia that no rigid body can have, a moving link without mass, an encoding that was guessed."""


class FrameError(ValueError):
    """Two spatial values whose frames don't meet: names the operation and both frames."""
