"""Text where a number is promised."""


def area(width: float, height: float) -> float:
    return f"{width * height}"
