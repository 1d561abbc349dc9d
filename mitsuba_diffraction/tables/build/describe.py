"""Description of the heights in a table: statistics, digest and roughness."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...heights.coherence import repeats, width_reason
from ...heights.field import LARGE, HeightField
from ...optics.blend import RoughnessTable, ScaleRoughness
from ...optics.geometry import wavenumber
from ...settings import TableSettings
from .spectrum import Spectrum
from .windows import Windows, extent_of, shape_of

# Points along a side of the windows whose roughness stands for that of a large patch.
_PART = 2048
_GREEN = 550.0  # nm, where the variation between patches is stated


def describe(patches: Sequence[HeightField], settings: TableSettings) -> dict[str, Any]:
    """Return statistics and digest of the patches, as plain data.

    Windows are described by their scans and the standard error of the mean over windows. With
    several patches, `variation` is the mean over orders of the standard deviation of |a_j|²
    between patches, over its mean, at 550 nm and normal incidence and reflection.
    """
    windows = patches if isinstance(patches, Windows) else None
    scans = windows.scans if windows else patches
    first, coherence_width = scans[0], settings.width
    source = first.summary() | {"digest": first.digest()}
    source["window"] = width_reason(settings, scans)
    if repeats(coherence_width, scans):
        source["repeats"] = True
    if len(scans) > 1:
        source["patches"] = [p.summary() | {"digest": p.digest()} for p in scans]
    if windows:
        source["windows"] = {
            "number": len(windows),
            "along x, y": windows.counts,
            "extent": list(windows[0].extent),
        }
        if len(windows) > 1:
            source["windows"]["standard_error"] = windows.standard_error(coherence_width)
    if len(scans) == len(patches) > 1:
        source["variation"] = _variation(patches)
    return source


def roughness_of(patches: Sequence[HeightField], q_max: float) -> RoughnessTable:
    """Return the height variance by spatial frequency up to q_max, rad/µm; a mean over patches."""
    if isinstance(patches, Windows):
        return ScaleRoughness.mean(_parts(patches).roughness()).table(q_max)
    roughness = []
    for patch in patches:
        if patch.heights.size <= LARGE:
            roughness.append(ScaleRoughness.from_heights(patch.heights, patch.pixel_size))
        else:
            roughness.append(ScaleRoughness.mean(_parts(_whole(patch)).roughness()))
    return ScaleRoughness.mean(roughness).table(q_max)


def _parts(windows: Windows) -> Windows:
    """Windows small enough for transforms, which take ten times their memory."""
    if max(windows.shape) <= _PART:
        return windows
    width = _PART * min(windows.scans[0].pixel_size)
    return Windows(windows.scans, width)


def _whole(patch: HeightField) -> Windows:
    width = max(patch.extent)
    return Windows([patch], width)


def _variation(patches: Sequence[HeightField]) -> float:
    kappa = 2.0 * float(wavenumber(_GREEN))
    reach = 2.0 * float(wavenumber(_GREEN)) / (2 * np.pi)
    ny, nx = shape_of(patches)
    x, y = extent_of(patches)
    last = int(min(reach * x, nx // 2)), int(min(reach * y, ny // 2))
    spectra = (
        patches.spectrum(n, last) if isinstance(patches, Windows) else Spectrum(patch, last)
        for n, patch in enumerate(patches)
    )
    powers = np.stack([np.abs(spectrum.of_phase(kappa)) ** 2 for spectrum in spectra])
    return float(powers.std(axis=0, ddof=1).sum() / powers.mean(axis=0).sum())
