"""A name that nothing defines."""


def area(width: float, height: float) -> float:
    return width * heigth
