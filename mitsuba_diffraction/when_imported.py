"""Actions that follow the import of another package, whenever that happens."""

from __future__ import annotations

import importlib.abc
import importlib.util
import sys
from collections.abc import Callable, Sequence
from importlib.machinery import ModuleSpec
from types import ModuleType


def when_imported(package: str, action: Callable[[], None]) -> None:
    """Call `action` right after the import of a package; now if it is imported already."""
    if package in sys.modules:
        action()
    else:
        sys.meta_path.insert(0, _Finder(package, action))


class _Finder(importlib.abc.MetaPathFinder):
    """Finder of one package, once: the usual finders find it, and an action follows."""

    def __init__(self, package: str, action: Callable[[], None]) -> None:
        self._package, self._action = package, action

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != self._package:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        if spec is None or spec.loader is None:  # not installed, now
            sys.meta_path.insert(0, self)
            return spec
        loader, action, run = spec.loader, self._action, spec.loader.exec_module

        def run_and_act(module: ModuleType) -> None:
            del loader.exec_module  # this loader's own again: the class has one, too
            run(module)
            action()

        loader.exec_module = run_and_act  # type: ignore[method-assign]
        return spec
