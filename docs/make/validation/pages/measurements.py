"""Comparisons that pages and pictures of the validation share, each computed on first use."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from .. import coated, filmed, models, statistics
from ..cases import FEW_WAVELENGTHS
from ..compare import Comparison, Sides, compare, table_of
from ..patches import KINDS
from ..solutions import Solutions, shipped, stored


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
    def gratings(self) -> dict[str, Sides]:
        """Comparisons of each material by model, on gratings."""
        chosen = {"period": 2.5, "depth": 0.1} if self.quick else {}
        return {
            m: models.by_model(self._solutions(m, **chosen), models.COMPARED)
            for m in models.MATERIALS
        }

    @property
    def default(self) -> dict[str, Comparison]:
        """Small slope on gratings, by material."""
        return {material: sides["small_slope"] for material, sides in self.gratings.items()}

    @cached_property
    def cells(self) -> dict[str, Sides]:
        """Comparisons of each material by model, on cells in two dimensions."""
        chosen = {"kind": KINDS[0]} if self.quick else {}
        solved = {m: shipped(m, "patches_rayleigh").where(**chosen) for m in models.MATERIALS}
        return {m: models.by_model(each, models.COMPARED) for m, each in solved.items()}

    @cached_property
    def coats(self) -> list[Comparison]:
        """The default on gratings under a coat: light diffracted once, and with bounces."""
        return coated.compared(coated.GRATINGS[: self.most(1)])

    @cached_property
    def films(self) -> dict[str, Sides]:
        """Comparisons by model on gratings under each film."""
        media = list(filmed.FILMS.items())[: self.most(1)]
        return {n: models.by_model(stored(filmed.file_of(n), each)) for n, each in media}

    @property
    def worst_under_films(self) -> float:
        """Largest deviation of the default's colours under a film."""
        default = (sides["small_slope"] for sides in self.films.values())
        every = filmed.GRATINGS, models.ANGLES, models.of_colours
        tables = (table_of(part, *every) for part in default)
        return max(float(table.max()) for table in tables)

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
