"""A function without types."""


def area(width, height):
    return width * height
