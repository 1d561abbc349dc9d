"""Comparisons that the pages of the validation share, each computed on first use."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from .. import (
    cells,
    coated,
    filmed,
    models,
    orders,
    published,
    statistics,
    transmitted,
)
from ..cases import FEW_WAVELENGTHS, Grating
from ..compare import Comparison, compare
from ..goals import Sides
from ..patches import KINDS
from ..solutions import shipped

#: Ideal gratings whose order powers have closed forms: period and depth in µm.
_IDEAL = ((1.1, 0.4), (2.5, 0.1), (5.0, 0.4))


@dataclass(frozen=True)
class Measurements:
    """Everything that the pages show, computed when a page asks for it.

    Attributes
    ----------
    quick : a small version for tests: one wavelength, few gratings and random surfaces.
    """

    quick: bool = False

    @cached_property
    def solved_orders(self) -> list[orders.Case]:
        """Shipped tables of solved orders."""
        return [orders.Case(name) for name in orders.TABLES[: 1 if self.quick else None]]

    @property
    def mounts(self) -> tuple[tuple[int, int], ...]:
        """Directions of light on the tables of solved orders: θ and φ, degrees."""
        return orders.MOUNTS[: 1 if self.quick else None]

    @property
    def diffuse_samples(self) -> int:
        """Random directions in which tables are compared with their solver."""
        return 4 if self.quick else orders.SAMPLES

    @property
    def published(self) -> tuple[published.Published, ...]:
        """Efficiencies printed by others."""
        return published.PUBLISHED[1 if self.quick else 0 :][: 1 if self.quick else None]

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
        return [c for m in models.MATERIALS for c in cells.compared(m, self.kinds)]

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of cells in two dimensions that are compared."""
        return KINDS[:1] if self.quick else KINDS

    @cached_property
    def coats(self) -> list[coated.CoatDeviation]:
        """Deviations of gratings under a coat."""
        return coated.deviations(coated.GRATINGS[:1] if self.quick else coated.GRATINGS)

    @cached_property
    def films(self) -> list[filmed.FilmDeviations]:
        """Deviations of gratings under each film."""
        stacks = filmed.STACKS[:1] if self.quick else filmed.STACKS
        return [filmed.compare_models(stack) for stack in stacks]

    @cached_property
    def transmitted(self) -> list[transmitted.Deviations]:
        """Deviations of transmitted orders of gratings."""
        return transmitted.deviations(transmitted.GRATINGS[: 1 if self.quick else None])

    @cached_property
    def sums_of_surfaces(self) -> list[transmitted.Sums]:
        """R + T of surfaces with a narrow coherence window."""
        names = list(transmitted.SURFACES)
        return list(transmitted.sums_of_surfaces(names[:1] if self.quick else names))

    @cached_property
    def sums_of_recipes(self) -> list[transmitted.Sums]:
        """R + T of recipes with their own coherence widths."""
        recipes = [p for p in transmitted.PRECOMPUTE if not self.quick or p.stem == "cd"]
        return list(transmitted.sums_of_recipes(recipes))

    @cached_property
    def statistics(self) -> statistics.Statistics:
        """Random surfaces beside their closed forms."""
        return statistics.measure(*((15, 80) if self.quick else (200, 2000)))

    @property
    def ideal(self) -> list[Grating]:
        """Period and depth of the ideal gratings, as sinusoids."""
        chosen = _IDEAL[1:2] if self.quick else _IDEAL
        return [Grating("sinusoidal", period, depth) for period, depth in chosen]

    def _compare(self, material: str) -> Comparison:
        every = shipped(material)
        return compare(
            material, every.where(wavelength=FEW_WAVELENGTHS[0]) if self.quick else every
        )
