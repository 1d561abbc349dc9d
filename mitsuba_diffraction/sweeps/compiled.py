"""The default look-up against `flss`, both compiled: the same map, timed side by side (Dr.Jit)."""

from __future__ import annotations

import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import DiffractionWarning
from ..heightfield import HeightField
from ..maps.light import Light
from ..methods import FullSpectrum, make
from ..tables.table import DiffractionTable

Progress = Callable[[int, int, str], None]

#: Each is timed so often, in turns; the first of them only warms up.
_ROUNDS = 3
# What Mitsuba's spectral variants span, nm.
_RANGE = (360.0, 830.0)


@dataclass(frozen=True)
class Compiled:
    """Seconds of one map, the smallest of the rounds.

    Attributes
    ----------
    default : the package's own look-up.
    flss : the documents' loop over terms and taps, an image a term.
    """

    default: float
    flss: float

    @property
    def ratio(self) -> float:
        """How many times faster the default is."""
        return self.flss / self.default


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
    """Evaluate one map with both, in the variant that is set; tables are not in the times.

    Raises
    ------
    DiffractionError
        If a parameter is out of range or a table cannot be built.
    """
    from ..benchmarks.documents import TermImages
    from ..maps import brdf_map

    common: dict[str, Any] = {
        "coherence_width": coherence_width, "tolerance": tolerance, "wavelength_range": _RANGE,
    }  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="mitsuba-diffraction-") as folder:
        own = DiffractionTable.build(heights, progress=progress, **common)
        full = make("flss", heights, progress=progress, **common)
        assert isinstance(full, FullSpectrum)
        bsdfs = {
            "default": _bsdf(own, Path(folder) / "own.exr"),
            "flss": _bsdf(full.table, Path(folder) / "flss.exr"),
        }
        bsdfs["flss"]._light._device = TermImages(full.table)
        best = dict.fromkeys(bsdfs, float("inf"))
        for n in range(_ROUNDS):
            for name, bsdf in bsdfs.items():
                start = time.perf_counter()
                brdf_map(
                    bsdf, light.theta, light.phi, wavelength_range=_RANGE, step=step,
                    resolution=resolution, samples=samples, progress=progress,
                )  # fmt: skip
                if n > 0:
                    best[name] = min(best[name], time.perf_counter() - start)
    return Compiled(best["default"], best["flss"])


def _bsdf(table: DiffractionTable, file: Path) -> Any:
    import mitsuba as mi

    table.save(file)
    with warnings.catch_warnings():
        # said when the table was built
        warnings.simplefilter("ignore", DiffractionWarning)
        return mi.load_dict(
            {
                "type": "diffraction",
                "table": str(file),
                "material": "none",
                "energy_conserving": False,
            }
        )
