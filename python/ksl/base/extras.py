"""Packages that come with an extra: what is said where one is missing."""

from __future__ import annotations

from importlib.util import find_spec


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
