"""Fixtures of the BSDF's tests."""

from __future__ import annotations

from tests.plugin.conftest import every_variant, mono

__all__ = ["every_variant", "mono"]
