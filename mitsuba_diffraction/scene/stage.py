"""The studio of `scenes/own_mesh.xml`, for meshes that are rendered without a scene."""

from __future__ import annotations

from pathlib import Path

# Wheels bring the studio's files along; a clone has them among its scenes.
_BROUGHT, _CLONE = Path(__file__).with_name("studio"), Path(__file__).parents[2] / "scenes"
#: Scene that meshes are put into.
STUDIO = (_BROUGHT if _BROUGHT.is_dir() else _CLONE) / "own_mesh.xml"
