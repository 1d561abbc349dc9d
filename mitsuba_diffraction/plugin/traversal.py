"""What Mitsuba's objects show of themselves."""

from __future__ import annotations

from typing import Any

import mitsuba as mi


def children(thing: Any) -> dict[str, Any]:
    """The objects that one of Mitsuba's shows to `traverse`, by name."""
    found: dict[str, Any] = {}

    class Collector(mi.TraversalCallback):
        def put(self, name: str, value: Any, *rest: Any) -> None:
            if isinstance(value, mi.Object):
                found[name] = value

    thing.traverse(Collector())
    return found
