"""Comparisons that pages and pictures of the validation share, each computed on first use."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from .. import coated, filmed, models, statistics
from ..cases import FEW_WAVELENGTHS
from ..compare import Comparison, Sides, compare
from ..patches import KINDS
from ..solutions import Solutions, shipped


@dataclass(frozen=True)
class Measurements:
    """Comparisons, each computed when a page asks for it.

    Attributes
    ----------
    quick : a small version for tests: one wavelength, few gratings and random surfaces.
    """

    quick: bool = False

    @cached_property
    def perfect(self) -> Comparison:
        """Kirchhoff's model on gratings of a perfect conductor."""
        return compare(self._solutions("perfect"))

    @cached_property
    def by_model(self) -> Sides:
        """Comparison of each material and model on gratings."""
        chosen = {"period": 2.5, "depth": 0.1} if self.quick else {}
        return models.compare_all({m: self._solutions(m, **chosen) for m in models.MATERIALS})

    @cached_property
    def kirchhoff(self) -> dict[str, Comparison]:
        """Kirchhoff's model on gratings, by material."""
        return {material: self.by_model[material, "kirchhoff"] for material in models.MATERIALS}

    @cached_property
    def default(self) -> dict[str, Comparison]:
        """Small slope on gratings, by material."""
        return {material: self.by_model[material, "small_slope"] for material in models.MATERIALS}

    @cached_property
    def cells(self) -> Sides:
        """Comparison of each material and model on cells in two dimensions."""
        chosen = {"kind": KINDS[0]} if self.quick else {}
        solved = {m: shipped(m, "patches_rayleigh").where(**chosen) for m in models.MATERIALS}
        return models.compare_all(solved)

    @cached_property
    def coats(self) -> list[coated.CoatDeviation]:
        """Deviations of gratings under a coat."""
        return coated.deviations(coated.GRATINGS[: self.most(1)])

    @cached_property
    def films(self) -> list[filmed.FilmDeviations]:
        """Deviations of gratings under each film."""
        return [filmed.deviations(film) for film in list(filmed.FILMS)[: self.most(1)]]

    @cached_property
    def statistics(self) -> statistics.Statistics:
        """Random surfaces beside their closed forms."""
        return statistics.measure(*((15, 80) if self.quick else (200, 2000)))

    def most(self, count: int) -> int | None:
        """How many cases of a list are measured: all, or `count` if quick."""
        return count if self.quick else None

    def _solutions(self, material: str, **chosen: object) -> Solutions:
        every = shipped(material).where(**chosen)
        return every.where(wavelength=FEW_WAVELENGTHS[0]) if self.quick else every
