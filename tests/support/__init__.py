"""Helpers that several tests share. Tests import from here, never from one another."""

from __future__ import annotations

from pathlib import Path

#: The checkout, or the unpacked sdist.
ROOT = Path(__file__).resolve().parents[2]
