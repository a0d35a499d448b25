"""How many random cases a test marked `many_cases` takes; test/conftest.py calls take_more when pytest is run with --long."""

MANY = 2_000
AT_200_BITS = 100


def take_more() -> None:
    global MANY, AT_200_BITS
    MANY, AT_200_BITS = 100_000, 1_000
