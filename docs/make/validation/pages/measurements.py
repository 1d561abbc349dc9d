"""Comparisons that pages and pictures of the validation share, each computed on first use."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from .. import cells, coated, filmed, models, statistics
from ..cases import FEW_WAVELENGTHS
from ..compare import Comparison, compare
from ..goals import Sides
from ..patches import KINDS
from ..solutions import shipped


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
        return self._compare("perfect")

    @cached_property
    def by_model(self) -> Sides:
        """Comparison of each material and model on gratings."""
        materials = {name: self._compare(name) for name in models.MATERIALS}
        if self.quick:
            materials = {m: part.where(period=2.5, depth=0.1) for m, part in materials.items()}
        return models.compare_all(materials)

    @cached_property
    def kirchhoff(self) -> dict[str, Comparison]:
        """Kirchhoff's model on gratings, by material."""
        return {material: self.by_model[material, "kirchhoff"] for material in models.MATERIALS}

    @cached_property
    def default(self) -> dict[str, Comparison]:
        """Small slope on gratings, by material."""
        return {material: self.by_model[material, "small_slope"] for material in models.MATERIALS}

    @cached_property
    def cells(self) -> list[cells.PatchComparison]:
        """Comparisons on cells in two dimensions, of both materials."""
        kinds = KINDS[: self.most(1)]
        return [c for m in models.MATERIALS for c in cells.compared(m, kinds)]

    @cached_property
    def coats(self) -> list[coated.CoatDeviation]:
        """Deviations of gratings under a coat."""
        return coated.deviations(coated.GRATINGS[: self.most(1)])

    @cached_property
    def films(self) -> list[filmed.FilmDeviations]:
        """Deviations of gratings under each film."""
        return [filmed.of_stack(stack) for stack in filmed.STACKS[: self.most(1)]]

    @cached_property
    def statistics(self) -> statistics.Statistics:
        """Random surfaces beside their closed forms."""
        return statistics.measure(*((15, 80) if self.quick else (200, 2000)))

    def most(self, count: int) -> int | None:
        """How many cases of a list are measured: all, or `count` if quick."""
        return count if self.quick else None

    def _compare(self, material: str) -> Comparison:
        every = shipped(material)
        return compare(
            material, every.where(wavelength=FEW_WAVELENGTHS[0]) if self.quick else every
        )
