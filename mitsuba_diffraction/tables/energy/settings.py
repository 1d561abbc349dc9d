"""Resolution and limits of energy conservation; the whole record is part of the cache's key."""

from __future__ import annotations

from dataclasses import dataclass

#: Raised whenever the computation changes.
VERSION = 67


@dataclass(frozen=True)
class EnergySettings:
    """How finely energy is conserved, and how far scales may go.

    Attributes
    ----------
    polar, azimuthal : cells of the grid that scales are tabulated on.
    side_polar, side_wavelengths : of the scale of both sides of a dielectric, whose light bends
        quickly towards the critical angle.
    wavelengths : of a scale; variants of one wavelength have one. The model's albedo, which tells
        whether a scale is needed, has a quarter of them and half the directions.
    total_polar : cells of the albedo of a material that reflects light totally, and sends on the
        rest to a BSDF beneath. With 20, white beneath was 1.3 at an index of 1/1.05, with 160
        1.13 within 0.4° of the critical angle.
    parts, side_parts, few_orders : between nodes, light is looked at in middles of so many parts of
        a cell, either way, first of surfaces with more than `few_orders` strong orders, then of
        those with fewer, whose kinks are sharper. With 3 a blazed mirror has 1.04 in between.
    between : places between neighbouring wavelengths, as shares of the interval, at which light is
        looked at: first of dielectrics and of surfaces with more than `few_orders` strong orders,
        then of reflectors with fewer.
    rings, steps : directions of the quadrature over weak orders: rings, and azimuths on the widest,
        as close as rings.
    fringe_step, fringes : phase of a film's fringe, rad, from one wavelength of a scale to the
        next, and most wavelengths. Under thin films waves in between come and go.
    sweeps : of Sinkhorn and Knopp's iteration.
    threshold : a reflector's albedo that is nowhere above needs no scale.
    target : albedos above are scaled to this; the margin to 1 is for directions between nodes.
        Both margins are at most the light that other orders than 0 have.
    calm : light between wavelengths of which the middles of 600 cells send on no more is looked at
        no further, first of surfaces with more than `few_orders` strong orders, then of those with
        fewer, whose kinks such a look misses: a CD of aluminium had 1.012.
    ceiling : most that is left between nodes.
    largest : of a scale; of a reflector at most 1 from 80° on.
    close : light that differs from its aim by less needs no scale.
    passes : how often scales are lowered where an albedo between nodes is above the ceiling.
    """

    polar: int = 40
    azimuthal: int = 60
    side_polar: int = 80
    side_wavelengths: int = 8
    wavelengths: int = 16
    total_polar: int = 320
    fringe_step: float = 0.6
    fringes: int = 64
    parts: tuple[int, int] = (3, 5)
    side_parts: tuple[int, int] = (1, 2)
    few_orders: int = 32
    between: tuple[tuple[float, ...], tuple[float, ...]] = ((0.5,), (0.33, 0.67))
    rings: int = 36
    steps: int = 144
    sweeps: int = 12
    threshold: float = 0.99
    target: float = 0.992
    calm: tuple[float, float] = (0.996, 0.0)
    ceiling: float = 1.001
    largest: float = 1.5
    close: float = 5e-4
    passes: int = 4


_settings = EnergySettings()


def energy_settings() -> EnergySettings:
    """Return the settings by which this process conserves energy."""
    return _settings


def use_energy_settings(settings: EnergySettings) -> EnergySettings:
    """Conserve energy by other settings in this process from now on; return the previous ones."""
    global _settings
    previous, _settings = _settings, settings
    return previous
