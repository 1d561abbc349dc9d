"""Clear media with a published index over wavelength, followed by spectra.

Light's paths in a BSDF have one index, at sodium's line. A spectrum measured wavelength by
wavelength has n(λ) instead: in a coat, by the parameter coat_eta; in a medium above the surface, in
which waves are shorter, by the factors on all lengths. The index of a dielectric, eta, is relative
to the medium above it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import drjit as dr
import mitsuba as mi

from ..errors import DiffractionError, quoted
from ..optics.materials import SODIUM, TISSUES, index_at_sodium, material_named
from ..tables import TableSource

#: Largest index of a medium above a surface.
MOST_MEDIUM = 2.0
#: Factors that waves in a medium are followed by.
_LENGTHS = ("height_scale", "lateral_scale")


def medium_index(ext_ior: str | float | None, wavelength: float = SODIUM) -> float:
    """Return the index of the medium above a surface at a wavelength in nm; 1 for air.

    Raises a DiffractionError if the medium is unknown or absorbs.
    """
    if ext_ior in (None, "none", "air", "vacuum"):
        return 1.0
    index = index_at_sodium(ext_ior, "ext_ior")
    if isinstance(index, str) or not 1.0 <= index <= MOST_MEDIUM:
        raise DiffractionError(
            f"ext_ior={quoted(ext_ior)}: give water, or an index from 1 to {MOST_MEDIUM:g}"
        )
    return index * _dispersion(ext_ior, wavelength)


def in_medium(
    source: TableSource, ext_ior: str | float | None, wavelength: float = SODIUM
) -> TableSource:
    """Return heights for light in a medium, whose waves are shorter: lengths times its index.

    Parameters
    ----------
    ext_ior : index of the medium above the surface, or its name; None for air.
    wavelength : nm, of the index.

    Raises a DiffractionError if the medium is unknown or absorbs.
    """
    index = medium_index(ext_ior, wavelength)
    if index == 1.0:
        return source
    line = f"lengths times {index:.5g}, the index of the medium above"
    patches = source.fields()
    return TableSource.of([p.changed(index * p.heights, line).stretched(index) for p in patches])


def optical_scale(parameters: Mapping[str, Any]) -> float:
    """Return the factor on heights that a table has to serve: height_scale, times a coat's index.

    parameters : of the BSDF. The coat's index is relative to the medium above it.
    """
    coat = index_at_sodium(parameters.get("coat_ior", 1.0), "coat_ior")
    relative = 1.0 if isinstance(coat, str) else coat / medium_index(parameters.get("ext_ior"))
    return float(parameters.get("height_scale", 1.0)) * max(relative, 1.0)


def loaded_in_media(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return parameters of a BSDF with which `follow` can change its paths.

    The coat has an index of one number, and lengths have a factor.
    """
    changed = dict(parameters)
    if _disperses(coat := changed.get("coat_ior")):
        changed["coat_ior"] = index_at_sodium(str(coat), "coat_ior")
    if _disperses(changed.get("ext_ior")):
        changed["lateral_scale"] = 1.0
    return changed


def follow(
    bsdf: Any, parameters: Mapping[str, Any], shortest: float
) -> Callable[[float], None] | None:
    """Return a function that sets the indices of paths to a wavelength in nm; None if they are one.

    Parameters
    ----------
    bsdf : loaded with `loaded_in_media`, on lengths times the medium's index at `shortest`, nm.
    parameters : as given to `loaded_in_media`.
    """
    coat, medium = parameters.get("coat_ior"), parameters.get("ext_ior")
    changes: dict[str, Callable[[float], float]] = {}
    if _disperses(coat) or (coat is not None and _disperses(medium)):
        changes["coat_eta"] = lambda lam: _dispersion(coat, lam) / _dispersion(medium, lam)
    if _disperses(medium):
        most = _dispersion(medium, shortest)
        for name in _LENGTHS:
            changes[name] = lambda lam: _dispersion(medium, lam) / most
    if not changes:
        return None
    shown = mi.traverse(bsdf)
    above = medium if coat is None else coat
    if "eta" in shown and _disperses(above):
        changes["eta"] = lambda lam: 1.0 / _dispersion(above, lam)
    loaded = {name: float(dr.slice(shown[name])) for name in changes}

    def set_paths(wavelength: float) -> None:
        for name, factor in changes.items():
            shown[name] = mi.Float(loaded[name] * factor(wavelength))
            # scales of energy of optimised lengths serve an interval, and so most wavelengths
            dr.set_grad_enabled(shown[name], name in _LENGTHS)
        shown.update()
        for name in changes:
            dr.disable_grad(shown[name])

    return set_paths


def _disperses(medium: str | float | None) -> bool:
    return isinstance(medium, str) and material_named(medium) in TISSUES


def _dispersion(medium: str | float | None, wavelength: float) -> float:
    """Return a medium's index at a wavelength in nm over that at sodium's line."""
    if medium is None or not _disperses(medium):
        return 1.0
    index = TISSUES[str(material_named(medium))].index
    return float(index(wavelength).real / index(SODIUM).real)
