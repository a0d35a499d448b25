"""Packages that come with an extra: what is said where one is missing."""

from __future__ import annotations

from importlib.util import find_spec

LEAST = {"jax": ("JAX", "0.5"), "torch": ("torch", "2.6")}
"""{library that differentiates: (its name, the oldest version, as pyproject.toml has it)}: older ones lack what operators are made of."""


def missing(*packages: str, extra: str = "loads") -> str:
    """What to say of the first of these that is not installed; empty if all are."""
    for package in packages:
        if find_spec(package) is None:
            return f"needs the package {package}; install it with: pip install 'ksl[{extra}]'"
    return ""


def require(what: str, *packages: str) -> None:
    """Raises ModuleNotFoundError that names the command, where a package of the extra `loads` is missing."""
    if said := missing(*packages):
        raise ModuleNotFoundError(f"{what} {said}")


def require_version(what: str, package: str) -> None:
    """Raises ImportError that names the command, where a package of LEAST is missing, or too old."""
    from importlib.metadata import PackageNotFoundError, version

    name, least = LEAST[package]
    if find_spec(package) is None:
        raise ModuleNotFoundError(f"{what} needs {name}; install it with: pip install 'ksl[{package}]'", name=package)
    try:
        found = version(package)
    except PackageNotFoundError:  # as some builds from source leave it
        return
    if _release(found) < _release(least):
        raise ImportError(
            f"{what} needs {name} {least} or newer, and {found} is installed; install it with: pip install --upgrade 'ksl[{package}]'", name=package
        )


def _release(version: str) -> list[int]:
    """The numbers that a version begins with."""
    import re

    return [int(number) for number in re.findall(r"\d+", version.partition("+")[0])[:2]]
