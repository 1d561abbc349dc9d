"""Settings of the thesis' methods under test."""

from __future__ import annotations

#: Coherence width, µm: narrower than the rough patch.
WIDTH = 12.0
