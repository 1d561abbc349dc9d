"""The realtime port in GLSL: shaders, what they read, and a renderer (extra `gl`).

Contents
--------
Renderer   draws a scene of Mitsuba by shaders, without a window
"""

from __future__ import annotations

from .renderer import Renderer

__all__ = ["Renderer"]
