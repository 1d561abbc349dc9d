"""Effect of each imperfection of a groove on its orders."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from docs.make.validation.light import index_at
from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.optics.fresnel import Filmed, normal_reflectance
from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.orders.solve import IntegralSolver

from . import predict
from .cases import GLASS
from .grooves import Groove

_WAVELENGTHS = np.arange(405.0, 706.0, 50.0)
#: Periods (µm) of a grating of aluminium in light that returns along itself, and of one of glass.
REFLECTING, TRANSMITTING = 1e3 / 600.0, 1e3 / 300.0
#: Both drawings: a right angle at the ridge.
MIRROR, PRISM = Groove(9.4), Groove(17.5)
# index (assumed) and thickness (µm) of the oxide on aluminium in air
_OXIDE = 1.77, 0.004
_FLAWS: dict[str, Callable[[Groove], Groove]] = {
    "facet 0.5° steeper": lambda g: g._replace(facet=g.facet + 0.5),
    "apex of 100° instead of 90°": lambda g: g._replace(apex=100.0),
    "edges rounded over 100 nm": lambda g: g._replace(rounding=100.0),
    "edges rounded over 200 nm": lambda g: g._replace(rounding=200.0),
    "roughness of 5 nm RMS": lambda g: g._replace(roughness=5.0),
    "roughness of 15 nm RMS": lambda g: g._replace(roughness=15.0),
}


class Effect(NamedTuple):
    """Mean and largest change of the blazed order by a flaw, as parts of the light."""

    mean: float
    largest: float

    @classmethod
    def between(cls, drawn: Real, flawed: Real) -> Effect:
        """Return the effect from efficiencies over wavelength."""
        change = flawed - drawn
        return cls(float(change.mean()), float(change[np.abs(change).argmax()]))


def effects(quick: bool = False) -> dict[str, tuple[Effect | None, Effect | None]]:
    """Effects of each flaw, or of one, on the reflecting and on the transmitting grating."""
    drawn = _reflected(MIRROR), _transmitted(PRISM)
    found: dict[str, tuple[Effect | None, Effect | None]] = {}
    for name, flaw in list(_FLAWS.items())[: 1 if quick else None]:
        flawed = _reflected(flaw(MIRROR)), _transmitted(flaw(PRISM))
        found[name] = tuple(map(Effect.between, drawn, flawed))  # type: ignore[assignment]
    denser = _transmitted(PRISM, GLASS + 0.02)
    found["index 0.02 higher"] = None, Effect.between(drawn[1], denser)
    found["oxide of 4 nm on aluminium"] = Effect.between(drawn[0], _oxidised(drawn[0])), None
    return found


def _reflected(groove: Groove) -> Real:
    profile = groove.profile(REFLECTING)
    left = [groove.specular(lam, 2.0) for lam in _WAVELENGTHS]
    solver = IntegralSolver(profile, 160)
    return predict.littrow_solved("Al", profile, _WAVELENGTHS, solver) * left


def _transmitted(groove: Groove, index: float = GLASS) -> Real:
    left = [groove.specular(lam, index - 1.0) for lam in _WAVELENGTHS]
    profile = groove.profile(TRANSMITTING)
    return predict.through_solved(index, True, profile, _WAVELENGTHS) * left


def _oxidised(bare: Real) -> Real:
    """Return efficiencies under the oxide, by the ratio of the reflectances of flat faces."""
    aluminium = np.array([index_at("Al", lam) for lam in _WAVELENGTHS])
    index, thickness = _OXIDE
    film = Filmed(aluminium, np.full_like(aluminium, index), wavenumber(_WAVELENGTHS) * thickness)
    flat = [normal_reflectance(each) for each in (film, aluminium)]
    return np.asarray(bare * flat[0] / flat[1])
