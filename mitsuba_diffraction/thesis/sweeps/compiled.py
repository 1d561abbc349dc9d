"""The default look-up against `flss`, both compiled: the same map, timed side by side (Dr.Jit)."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...analysis.maps.light import Light
from ...heights.field import HeightField
from ...progress import Progress
from ...tables.table import DiffractionTable
from ..methods import FullSpectrum, make

#: Each is timed so often, in turns; the first of them only warms up.
_ROUNDS = 3
# What Mitsuba's spectral variants span, nm.
_RANGE = (360.0, 830.0)


@dataclass(frozen=True)
class Compiled:
    """Seconds of one map, the smallest of the rounds."""

    spectral: float  # the package's own look-up, at every wavelength
    colours: float  # as in RGB variants: one look-up in the table of the whole spectrum's colours
    flss: float  # the thesis' loop over wavelengths, terms and taps, an image a term

    @property
    def ratio(self) -> float:
        """How many times faster than `flss` the default is, wavelength by wavelength."""
        return self.flss / self.spectral

    @property
    def colour_ratio(self) -> float:
        """How many times faster than `flss` the default's colours are."""
        return self.flss / self.colours


def time_compiled(
    heights: HeightField,
    light: Light,
    *,
    resolution: int,
    samples: int,
    step: float = 5.0,
    coherence_width: float = 65.0,
    tolerance: float = 1e-3,
    progress: Progress | None = None,
) -> Compiled:
    """Evaluate one map of the whole spectrum in three ways; tables are not in the times.

    The variants llvm_ad_spectral and llvm_ad_rgb (or those for a GPU, if the one that is set is)
    are set in turn, the spectral one last.

    Raises
    ------
    DiffractionError
        If a parameter is out of range or a table cannot be built.
    """
    import mitsuba as mi

    from ...analysis.bench.contenders import saved_bsdf, thesis_bsdf

    common: dict[str, Any] = {
        "coherence_width": coherence_width, "tolerance": tolerance, "wavelength_range": _RANGE,
    }  # fmt: skip
    backend = "cuda" if (mi.variant() or "").startswith("cuda") else "llvm"

    def seconds(bsdfs: dict[str, Any]) -> dict[str, float]:
        from ...analysis.maps import brdf_map

        best = dict.fromkeys(bsdfs, float("inf"))
        for n in range(_ROUNDS):
            for name, bsdf in bsdfs.items():
                start = time.perf_counter()
                brdf_map(
                    bsdf, light.theta, light.phi, step=step, resolution=resolution,
                    samples=samples, progress=progress,
                )  # fmt: skip
                if n > 0:
                    best[name] = min(best[name], time.perf_counter() - start)
        return best

    with tempfile.TemporaryDirectory(prefix="mitsuba-diffraction-") as folder:
        own, flss = Path(folder) / "own.exr", Path(folder) / "flss.exr"
        DiffractionTable.build(heights, progress=progress, **common).save(own)
        full = make("flss", heights, progress=progress, **common)
        assert isinstance(full, FullSpectrum)
        full.table.save(flss)
        mi.set_variant(f"{backend}_ad_rgb")
        raw: dict[str, Any] = {"material": "none", "energy_conserving": False}
        best = seconds({"colours": saved_bsdf(own, **raw)})
        mi.set_variant(f"{backend}_ad_spectral")
        best |= seconds({"spectral": saved_bsdf(own, **raw), "flss": thesis_bsdf(flss, **raw)})
    return Compiled(best["spectral"], best["colours"], best["flss"])
