"""Smaller tables for one scene: the light that each table sends, and limits that suffice.

Contents
--------
light        light of a scene's picture by table, spatial frequency, κ and wavelength
plan         limits of each table, as recipes, and loading a scene by them
report       requested range of a table and savings of its limits, as plain data
"""

from __future__ import annotations

__all__ = ["light", "plan", "report"]
