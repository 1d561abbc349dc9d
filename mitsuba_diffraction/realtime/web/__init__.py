"""Self-contained pages that draw a scene in a browser, without a server.

Contents
--------
export_viewer   write a page
Viewer          show a page in a cell of a notebook
"""

from __future__ import annotations

from .export import Viewer, export_viewer

__all__ = ["Viewer", "export_viewer"]
