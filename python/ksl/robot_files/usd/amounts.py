"""What a few words of a USD file ask Pixar's library to compose, counted in its layers before: prims that refer twice to what refers twice are any number.

Each reference, payload, inherited or specialised class brings all prims of its target, with what these refer to in turn.  A prim that is brought by a chain of
five of them counts five times: that is what it costs.  Variants count where a layer selects them, instances once; what is relocated counts at both places.  Left out are
classes inside of what is referenced that an outer layer changes.
"""

from __future__ import annotations

import mmap
import re
from bisect import bisect_left
from collections.abc import Iterator
from typing import Any, NamedTuple

from ksl.base.limits import USD_LAYERS, USD_PRIMS

_WORDS = re.compile(rb"references|payload|inherits|specializes|relocates|subLayers")
_VARIANT = re.compile(r"\{([^=]*)=([^}]*)\}")
_RESTARTS = 20
"""Selections of variants may be found late, in a layer that another selection brings.  After so many times all variants count."""


def too_much(root: Any) -> str:
    """A sentence about a layer that asks for more prims, or sublayers, than are read; empty for others."""
    try:
        if brought(root) <= USD_PRIMS:
            return ""
    except _TooManyLayers:
        return f"its sublayers, or those of a layer that it refers to, are more than {USD_LAYERS:,} with those that they name in turn, and those are the most that are read; put them together"
    return (
        f"its references, payloads, inherited and specialised classes bring more than {USD_PRIMS:,} prims, each counted once for every arc that leads to it, "
        "and those are the most that are read; give the robot's prims in a file of their own"
    )


def brought(root: Any) -> int:
    """How many prims arcs bring, each counted once for every arc that leads to it; some number beyond the limit where they are more."""
    counter = _Counter(root)
    for number in range(_RESTARTS + 1):
        counter.all_variants, selected = number == _RESTARTS, len(counter.selected)
        count = counter.count()
        if count > USD_PRIMS or len(counter.selected) == selected:
            break
    return count


class _Arc(NamedTuple):
    layer: Any
    """The layer that has it."""
    asset: str
    """Empty for the layers that have it."""
    path: str
    """The path of the arc's target; empty for the default prim."""
    below: str
    """What is taken below the target: of an arc above the prim that is asked for."""
    variants: frozenset[tuple[str, str]]
    """Variants that it is in."""
    of_class: bool
    once: str
    """What identifies an instance; empty for other prims."""


class _Layers:
    """A layer and its sublayers: keys of their prims, and their arcs, in order.  A key is a path without variants whose / sorts before all characters of names."""

    def __init__(self, layers: list[Any], copies: int) -> None:
        self.root, self.copies = layers[0], copies
        self.selected: set[tuple[str, str]] = set()
        prims: list[str] = []
        arcs: list[tuple[str, _Arc]] = []
        for layer in layers:
            if _may_have_arcs(layer):
                self._add(layer, prims, arcs)
        self.prims = sorted(prims)
        arcs.sort(key=lambda arc: arc[0])
        self.keys, self.arcs = [key for key, _ in arcs], [arc for _, arc in arcs]
        self.found: dict[str, tuple[int, list[_Arc]]] = {}

    def _add(self, layer: Any, prims: list[str], arcs: list[tuple[str, _Arc]]) -> None:
        def look(path: Any) -> None:
            if not (path.IsPrimPath() or path.IsPrimVariantSelectionPath()):
                return
            text = str(path)
            plain, variants = (_VARIANT.sub("/", text), frozenset(_VARIANT.findall(text))) if "{" in text else (text, frozenset[tuple[str, str]]())
            key = _key(plain.replace("//", "/"))
            prims.append(key)
            spec = layer.GetPrimAtPath(path)
            if spec is None:
                return
            given = spec.ListInfoKeys()
            if "variantSelection" in given:
                self.selected.update(dict(spec.variantSelections).items())
            once = f"{layer.identifier}{text}" if "instanceable" in given and spec.instanceable else ""
            for name, of_class in (("reference", False), ("payload", False), ("inheritPath", True), ("specializes", True)):
                if {"reference": "references", "inheritPath": "inheritPaths"}.get(name, name) in given:
                    for item in getattr(spec, f"{name}List").GetAddedOrExplicitItems():
                        asset, target = ("", str(item)) if of_class else (item.assetPath, str(item.primPath))
                        arcs.append((key, _Arc(layer, asset, target, "", variants, of_class, once)))

        layer.Traverse("/", look)
        for source, target in getattr(layer, "relocates", ()):  # since USD 24.11
            arcs.append((_key(str(target)), _Arc(layer, "", str(source), "", frozenset(), False, "")))

    def at(self, path: str) -> tuple[int, list[_Arc]]:
        """How many prims the layers have at and below a path, and the arcs of these, and of the prims above."""
        if path not in self.found:
            key = _key(path)
            arcs = [self.arcs[i] for a, b in _ranges(self.keys, key) for i in range(a, b)]
            names = key.split("\x01")
            for k in range(2, len(names)):
                a, b = _ranges(self.keys, "\x01".join(names[:k]))[0]
                arcs += [arc._replace(below=f"{arc.below}/{'/'.join(names[k:])}", once="") for arc in self.arcs[a:b]]
            self.found[path] = sum(b - a for a, b in _ranges(self.prims, key)), arcs
        return self.found[path]


def _key(path: str) -> str:
    return path.rstrip("/").replace("/", "\x01")


def _ranges(keys: list[str], key: str) -> list[tuple[int, int]]:
    """Where a key is among sorted ones, and where those below it are."""
    return [(bisect_left(keys, key), bisect_left(keys, key + "\x00")), (bisect_left(keys, key + "\x01"), bisect_left(keys, key + "\x02"))]


def _may_have_arcs(layer: Any) -> bool:
    """Whether to look through a layer: a text that has none of the words has no arcs, and its prims count as one."""
    try:
        with open(layer.realPath, "rb") as source, mmap.mmap(source.fileno(), 0, access=mmap.ACCESS_READ) as text:
            return text[:5] != b"#usda" or _WORDS.search(text) is not None
    except (OSError, ValueError):  # inside of a package, or empty
        return True


_Target = tuple[_Layers, str]


class _TooManyLayers(Exception):
    """A layer with too many sublayers."""


class _Counter:
    """Goes along all arcs, as composition does."""

    def __init__(self, root: Any) -> None:
        from pxr import Sdf

        self.open = Sdf.Layer.FindOrOpenRelativeToLayer
        self.root = root
        self.known: dict[str, _Layers] = {}
        self.opened: dict[tuple[str, str], Any] = {}
        self.selected: set[tuple[str, str]] = set()
        self.all_variants = False
        self.instances: set[str] = set()
        self._layers(root)

    def count(self) -> int:
        top: _Target = (self._layers(self.root), "/")
        self.instances.clear()
        total, way, on_way = 0, [top], {top}
        pending = [self._targets(top[0].at("/")[1], way)]
        while pending:
            target = next(pending[-1], None)
            if target is None:
                pending.pop()
                on_way.discard(way.pop())
            elif target not in on_way:  # a cycle otherwise, which USD names
                prims, arcs = target[0].at(target[1])
                total += max(prims, 1) * len(pending) * target[0].copies
                if total > USD_PRIMS:
                    return total
                way.append(target)
                on_way.add(target)
                pending.append(self._targets(arcs, way))
        return total

    def _targets(self, arcs: list[_Arc], way: list[_Target]) -> Iterator[_Target]:
        """Where arcs of the last target on the way lead: a class is also looked for in the layers that refer to it."""
        own = way[-1][0]
        for arc in arcs:
            if not (self.all_variants or arc.variants <= self.selected) or arc.once in self.instances:
                continue
            if arc.once:
                self.instances.add(arc.once)
            layers, path = own, arc.path
            if arc.asset:
                layer = self._opened(arc.layer, arc.asset)
                if layer is None:  # USD names it
                    continue
                layers = self._layers(layer)
            if not path:
                if not layers.root.HasDefaultPrim():
                    continue
                path = f"/{layers.root.defaultPrim.lstrip('/')}"
            yield layers, path + arc.below
            if arc.of_class:
                yield from ((other, path) for other in dict.fromkeys(at for at, _ in way) if other is not own and other.at(path)[0])

    def _opened(self, layer: Any, asset: str) -> Any:
        key = (layer.identifier, asset)
        if key not in self.opened:
            try:
                self.opened[key] = self.open(layer, asset)
            except Exception:  # errors of Tf, which composition finds again
                self.opened[key] = None
        return self.opened[key]

    def _layers(self, root: Any) -> _Layers:
        if root.identifier not in self.known:
            count, found = 0, dict[str, Any]()
            pending: list[tuple[Any, tuple[str, ...]]] = [(root, (root.identifier,))]
            while pending:
                layer, way = pending.pop()
                count += 1
                if count > USD_LAYERS:
                    raise _TooManyLayers
                found[layer.identifier] = layer
                for path in reversed(list(layer.subLayerPaths)):
                    below = self._opened(layer, path)
                    if below is not None and below.identifier not in way:
                        pending.append((below, (*way, below.identifier)))
            self.known[root.identifier] = made = _Layers(list(found.values()), -(-count // len(found)))
            self.selected |= made.selected
        return self.known[root.identifier]
