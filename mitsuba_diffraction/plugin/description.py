"""Description of a surface: one record that shaders, page, OSL, maps, spectra and plans read.

`describe` returns the record of a BSDF. A `Consumer` declares the features that it shows; its
`check` refuses a surface with any other feature in one sentence.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError, warn
from ..heights import HeightField
from ..optics.geometry import sigma_of
from ..tables import DiffractionTable
from ..tables.directional import DirectionalTable
from .types import BSDF, Interaction, Texture


class Feature(Enum):
    """Feature of a surface: the group of features that exclude each other, and a phrase."""

    HEIGHTS = "table", "a table of heights"
    ORDERS = "table", "solved orders"
    CROSSED = "table", "orders of a crossed grating"
    MIX = "table", "a mix of surfaces (diffraction_mix)"
    VARYING_WEIGHTS = "", "weights that vary"
    LIMITED = "", "a table that lacks orders (frequency_limit)"
    TRANSMISSION = "", "light that goes through"
    MIRROR = "material", "material='none'"
    DIELECTRIC = "material", "a dielectric"
    RARER = "material", "a dielectric rarer than the medium above"
    CONDUCTOR = "material", "a conductor or a material with an index over wavelength"
    COAT = "", "a coat (coat_ior)"
    FILM = "", "a thin film (film_ior)"
    STACK = "", "a stack of layers (layers)"
    VARYING_FILM = "", "a film_thickness that varies"
    SMALL_SLOPE = "model", "model='small_slope'"
    KIRCHHOFF = "model", "model='kirchhoff'"
    OWN_MODEL = "model", "model='{model}'"
    ENERGY_SCALE = "", "a scale of energy (energy_conserving)"
    SHADOWING = "", "shadowing='vcavity'"
    PATCH = "coherence", "speckle (coherence='patch')"
    PLACED = "coherence", "speckle (coherence='surface')"
    HEIGHT_SCALE = "", "a height_scale other than 1"
    VARYING_HEIGHT = "", "a height_scale that varies"
    LATERAL_SCALE = "", "a lateral_scale other than 1"
    VARYING_LENGTH = "", "a lateral_scale that varies"
    ORIENTATION = "", "an orientation other than 0"
    VARYING_ORIENTATION = "", "an orientation that varies"
    NESTED = "", "a nested BSDF or pigment"
    OPAQUE = "", "a conductor or layers that absorb the light (film_k, layers)"
    COLOURS = "", "an RGB variant, whose light has no wavelengths to tell speckle by"

    def phrase(self, model: str = "") -> str:
        """Return the feature as messages call it; model : name of the boundary model."""
        phrase: str = self.value[1]
        return phrase.replace("{model}", model)


@dataclass(frozen=True)
class Quantity:
    """Number over a surface: the same everywhere, or a texture's or mesh attribute's.

    Attributes
    ----------
    number : the number; the largest where it varies.
    texture : the texture or mesh attribute, or None.
    """

    number: float
    texture: Texture | None = None


#: Index n + ik of a material, relative to the medium above, at wavelengths (n,) in nm.
Index = Callable[[NDArray[np.float64]], NDArray[np.complex128]]


@runtime_checkable
class SolvedOrders(Protocol):
    """Table of solved orders, as far as this room knows it; see `orders.table.OrderTable`."""

    @property
    def periods(self) -> tuple[float, float]:
        """Periods along x and y, µm; infinite along y for grooves."""

    @property
    def header(self) -> Mapping[str, Any]:
        """Facts about the table."""

    @property
    def reach(self) -> tuple[float, float]:
        """Wavelengths between which light has efficiencies, nm."""

    @property
    def crossed(self) -> bool:
        """Whether the grating repeats along y as well."""


def unscaled(height_scale: float) -> DirectionalTable | None:
    """Return None: all values are 1 at every height scale."""
    return None


def _unturned(si: Interaction) -> tuple[Any, Any, Any]:
    return 1.0, 0.0, 1.0


@dataclass(frozen=True)
class Surface:
    """Surface that diffracts, as its BSDF has it when it is described.

    Attributes
    ----------
    table : table of heights or of solved orders.
    text : material with its layers, for people.
    coherence_width : 4σ of the amplitude window, µm.
    orientation : degrees from the first tangent to the patch's x axis.
    frame : function of interactions that returns (cos, sin) of the orientation, and the stretch
        of lengths relative to the table's patch.
    coherence : "ensemble", "patch" or "surface".
    heights : function that reads the heights of the table; None for solved orders.
    height_scale, lateral_scale : factors on the heights and lengths of the table's patch.
    kind : of the structure's material: MIRROR, DIELECTRIC, RARER or CONDUCTOR; None for solved
        orders.
    index : of the material, see `Index`; None of a mirror and for solved orders. In RGB variants it
        interpolates three values.
    material : name of a material whose index is tabulated, else empty.
    layer : FILM or STACK on the structure, or None.
    film_varies : whether the thickness of a film varies.
    coat : index of a coat over the medium above it, or None.
    model : name of the boundary model; empty for solved orders.
    energy_scale : scale s of directions and wavelengths as a function of the height scale, on
        `tables.directional.FINE`; None where all are 1. The BSDF is multiplied by s(ωi) s(ωo).
    albedo_excess : likewise, albedo less the flat interface's reflectance, by which light goes on
        to a nested BSDF; None where the flat reflectance decides.
    nested : the BSDF beneath, or None.
    shadowing : whether grooves shadow each other (`vcavity`).
    transmits : whether light goes through.
    """

    table: DiffractionTable | SolvedOrders
    text: str
    coherence_width: float
    orientation: Quantity
    frame: Callable[[Interaction], tuple[Any, Any, Any]] = _unturned
    coherence: str = "ensemble"
    heights: Callable[[], HeightField] | None = None
    height_scale: Quantity = field(default_factory=lambda: Quantity(1.0))
    lateral_scale: Quantity = field(default_factory=lambda: Quantity(1.0))
    kind: Feature | None = None
    index: Index | None = None
    material: str = ""
    layer: Feature | None = None
    film_varies: bool = False
    coat: float | None = None
    model: str = ""
    energy_scale: Callable[[float], DirectionalTable | None] = unscaled
    albedo_excess: Callable[[float], DirectionalTable | None] = unscaled
    nested: BSDF | None = None
    shadowing: bool = False
    transmits: bool = False

    @property
    def patch(self) -> DiffractionTable:
        """Table of heights; for consumers that show no solved orders."""
        assert isinstance(self.table, DiffractionTable)
        return self.table

    @property
    def orders(self) -> Any:
        """Table of solved orders, or None."""
        return self.table if self.solved else None

    @property
    def solved(self) -> bool:
        """Whether the surface has solved orders, of grooves or of a crossed grating."""
        return not isinstance(self.table, DiffractionTable)

    @property
    def summary(self) -> str:
        """Material with its layers, and model of the boundary, for people."""
        if self.solved:
            periods = " x ".join(f"{d:g}" for d in self.orders.periods if math.isfinite(d))
            return f"solved orders, period {periods} µm"
        return "R = 1" if self.text == "none" else f"{self.text}, {self.model}"

    @property
    def sigma(self) -> float:
        """Standard deviation of the amplitude window, µm."""
        return sigma_of(self.coherence_width)

    @property
    def lit(self) -> tuple[float, float]:
        """Wavelengths between which the surface has light, nm.

        A table of heights serves all light above its shortest wavelength.
        """
        low, high = self.wavelengths
        return low, high if self.solved else math.inf

    @property
    def wavelengths(self) -> tuple[float, float]:
        """Shortest and longest wavelength of a table of heights; of orders, that have light; nm."""
        table = self.table
        return table.wavelength_range if isinstance(table, DiffractionTable) else table.reach

    def features(self) -> set[Feature]:
        """Return all features that the surface has."""
        known = {"": None, "small_slope": Feature.SMALL_SLOPE, "kirchhoff": Feature.KIRCHHOFF}
        turned, tall, wide = self.orientation, self.height_scale, self.lateral_scale
        present = {
            Feature.ORDERS: self.solved and not self.orders.crossed,
            Feature.CROSSED: self.solved and self.orders.crossed,
            Feature.HEIGHTS: not self.solved,
            Feature.LIMITED: not self.solved and self.patch.limited,
            Feature.TRANSMISSION: self.transmits,
            Feature.COAT: self.coat is not None,
            Feature.ENERGY_SCALE: not tall.texture and self.energy_scale(tall.number) is not None,
            Feature.SHADOWING: self.shadowing,
            Feature.PATCH: self.coherence == "patch",
            Feature.PLACED: self.coherence == "surface",
            Feature.HEIGHT_SCALE: tall.texture is None and tall.number != 1.0,
            Feature.VARYING_HEIGHT: tall.texture is not None,
            Feature.LATERAL_SCALE: wide.texture is None and wide.number != 1.0,
            Feature.VARYING_LENGTH: wide.texture is not None,
            Feature.ORIENTATION: turned.texture is None and turned.number != 0.0,
            Feature.VARYING_ORIENTATION: turned.texture is not None,
            Feature.NESTED: self.nested is not None,
            Feature.VARYING_FILM: self.film_varies,
        }
        chosen = (self.kind, self.layer, known.get(self.model, Feature.OWN_MODEL))
        found = {feature for feature, has in present.items() if has}
        return found | {feature for feature in chosen if feature is not None}


@dataclass(frozen=True)
class Mix:
    """Several BSDFs in one, by weights.

    Attributes
    ----------
    parts : BSDFs by name.
    textures : textures and mesh attributes among the weights.
    weights : function of interactions that returns the weight of each part, of sum 1.
    """

    parts: Mapping[str, BSDF]
    textures: Sequence[Texture]
    weights: Callable[[Interaction], Sequence[Any]]

    @property
    def model(self) -> str:
        """Names of the boundary models."""
        models = [part.model for part in map(describe, self.parts.values()) if part]
        return ", ".join(dict.fromkeys(models))

    def features(self) -> set[Feature]:
        """Return the features of the mix and of all its parts."""
        own = {Feature.MIX, *([Feature.VARYING_WEIGHTS] if self.textures else [])}
        return own.union(*(part.features() for part in map(describe, self.parts.values()) if part))


Description = Surface | Mix

#: Features that differ from place to place.
VARYING = frozenset(
    {
        Feature.VARYING_HEIGHT,
        Feature.VARYING_LENGTH,
        Feature.VARYING_ORIENTATION,
        Feature.VARYING_WEIGHTS,
        Feature.VARYING_FILM,
    }
)


def describe(bsdf: BSDF) -> Description | None:
    """Return the description of a BSDF of this package; None for any other BSDF.

    It has all that the surface has, with the current values of its parameters.
    """
    return bsdf.describe() if hasattr(bsdf, "describe") else None


@dataclass(frozen=True)
class Consumer:
    """Consumer of descriptions, and the features that it shows.

    Attributes
    ----------
    name : name for messages, with its article.
    shows : features that it shows.
    remedy : advice for any other feature; `remedies` : for some features.
    left_out : features that it leaves out with a warning, and the effect on the picture.
    """

    name: str
    shows: frozenset[Feature]
    remedy: str = "leave it out, or render with Mitsuba"
    remedies: Mapping[Feature, str] = field(default_factory=dict)
    left_out: Mapping[Feature, str] = field(default_factory=dict)

    def described(self, bsdf: BSDF, what: str = "the surface") -> Surface:
        """Return the description of a BSDF after `check`, for consumers that show no mixes."""
        if (described := describe(bsdf)) is None:
            raise DiffractionError(
                f"bsdf={type(bsdf).__name__} does not diffract, so {self.name} cannot show it; "
                "give a BSDF of type 'diffraction' or 'diffraction_orders', for instance "
                "mi.load_dict(md.bsdf_dict(...))"
            )
        self.check(described, what)
        assert isinstance(described, Surface)
        return described

    def refusal(self, described: Description, what: str = "the surface") -> str | None:
        """Return the sentence on the first feature that is not shown, or None.

        what : name of the surface, for messages.
        """
        lacking = described.features() - self.shows - set(self.left_out)
        for feature in Feature:
            if feature in lacking:
                group = feature.value[0]
                others = [f.phrase() for f in Feature if f in self.shows and f.value[0] == group]
                choices = f" (but {', '.join(others)})" if group and others else ""
                return (
                    f"{what} has {feature.phrase(described.model)}, which {self.name} cannot "
                    f"show{choices}; {self.remedies.get(feature, self.remedy)}"
                )
        return None

    def check(self, described: Description, what: str = "the surface") -> None:
        """Refuse a surface with a feature that is not shown; warn of those that are left out.

        Raises a DiffractionError with the feature, the consumer, the choices and a remedy.
        """
        if refusal := self.refusal(described, what):
            raise DiffractionError(refusal)
        for feature, effect in self.left_out.items():
            if feature in described.features():
                warn(f"{what}: {self.name} leaves out {feature.phrase()}: {effect}")
