"""How many random cases a test marked `many_cases` takes; test/conftest.py sets it when pytest is run with --long."""

LONG = 100_000
MANY = 5_000
