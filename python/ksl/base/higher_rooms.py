"""Methods of a model that rooms above the model's compute: pictures, and tables of all wrenches.

The model's room imports nothing of those above it.  `ksl/__init__.py` says which functions they are.  This file imports nothing at its
start, since `import ksl` imports it.
"""

FUNCTIONS: dict[str, str] = {}
"""{method of `ksl.Model`: the function that computes it, as "module:function"}; the function takes the model first.  And {what is read: the function that takes a file}."""


def function_of(method: str):  # type: ignore[no-untyped-def]  # typing takes longer to import than everything here
    """The function of a method, whose module is imported when it is first used."""
    from importlib import import_module

    module, _, name = FUNCTIONS[method].partition(":")
    return getattr(import_module(module), name)
