"""Description of the heights in a table: statistics, digest and roughness."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...heights.coherence import repeats, width_reason
from ...heights.field import LARGE
from ...optics.blend import RoughnessTable, ScaleRoughness
from ...optics.geometry import wavenumber
from ...settings import TableSettings
from .screens import Screens

# Points along a side of the windows whose roughness stands for that of a large patch.
_PART = 2048
_GREEN = 550.0  # nm, where the variation between patches is stated


def describe(screens: Screens, settings: TableSettings) -> dict[str, Any]:
    """Return statistics and digest of the patches, as plain data.

    Windows are described by their scans and the standard error of the mean over windows. With
    several patches, `variation` is the mean over orders of the standard deviation of |a_j|²
    between patches, over its mean, at 550 nm and normal incidence and reflection.
    """
    scans = screens.scans
    source = scans[0].summary() | {"digest": scans[0].digest()}
    source["window"] = width_reason(settings, scans)
    if repeats(settings.width, scans):
        source["repeats"] = True
    if len(scans) > 1:
        source["patches"] = [p.summary() | {"digest": p.digest()} for p in scans]
    if screens.windowed:
        source["windows"] = {
            "number": len(screens),
            "along x, y": screens.counts,
            "extent": list(screens[0].extent),
        }
        if len(screens) > 1:
            source["windows"]["standard_error"] = screens.standard_error(settings.width)
    if len(scans) == len(screens) > 1:
        source["variation"] = _variation(screens)
    return source


def roughness_of(screens: Screens, q_max: float) -> RoughnessTable:
    """Return the height variance by spatial frequency up to q_max, rad/µm; a mean over patches."""
    each = [screens] if screens.windowed else [Screens([scan]) for scan in screens.scans]
    return ScaleRoughness.mean([_roughness(one) for one in each]).table(q_max)


def _roughness(screens: Screens) -> ScaleRoughness:
    """Return the roughness of a patch, or of some windows if it is large, or of a scan's."""
    first = screens.scans[0]
    if not screens.windowed:
        if first.heights.size <= LARGE:
            return ScaleRoughness.from_heights(first.heights, first.pixel_size)
        screens = Screens([first], max(first.extent))
    if max(screens.shape) > _PART:  # transforms take ten times their memory
        screens = Screens(screens.scans, _PART * min(first.pixel_size))
    return ScaleRoughness.mean(screens.roughness())


def _variation(screens: Screens) -> float:
    kappa = 2.0 * float(wavenumber(_GREEN))
    reach = kappa / (2 * np.pi)
    (ny, nx), (x, y) = screens.tile, screens.extent
    last = int(min(reach * x, nx // 2)), int(min(reach * y, ny // 2))
    spectra = (screens.spectrum(n, last) for n in range(len(screens)))
    powers = np.stack([np.abs(spectrum.of_phase(kappa)) ** 2 for spectrum in spectra])
    return float(powers.std(axis=0, ddof=1).sum() / powers.mean(axis=0).sum())
