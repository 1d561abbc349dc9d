"""Precomputed series of diffraction orders: what the renderer looks up instead of transforming."""

from .table import DiffractionTable

__all__ = ["DiffractionTable"]
