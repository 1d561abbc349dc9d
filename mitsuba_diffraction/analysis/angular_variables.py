"""Five variables of iridescent colour over all angles in a plane.

References
----------
H. Gruson, C. Andraud, W. Daney de Marcillac, S. Berthier, M. Elias and D. Gomez, Quantitative
characterization of iridescent colours in biological studies, Interface Focus 9, 20180049 (2019).
Checked: the abstract, which has five variables for every pair of angles. Not checked: the formulas.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from ..arrays import Real
from ..errors import DiffractionError
from ..progress import Progress, silent
from .spectra import spectrum
from .spectral_variables import RANGE, colours_of, whole_nanometres

#: Angles of lamps and detectors, degrees. Each detector is 5° or more from the mirror direction,
#: whose light any smooth surface reflects.
LAMPS, DETECTORS = np.arange(0.0, 61.0, 10.0), np.arange(-55.0, 56.0, 10.0)
#: Names of the variables, and of the RMS errors of both fits, % and nm.
VARIABLES = ("Bmax", "t", "gammaB", "Hmax", "gammaH", "rmsB", "rmsH")
# Share of the largest brightness below which a colour is too dark for a hue.
_DARK = 0.01


def angular_variables(
    bsdf: Any,
    wavelengths: ArrayLike,
    azimuth: float = 0.0,
    acceptance: float = 2.0,
    before: Callable[[float], None] | None = None,
    progress: Progress = silent,
) -> dict[str, float]:
    """Return `fitted` of a surface's B2 and H1 for all `LAMPS` and `DETECTORS`.

    Parameters are those of `spectra.spectrum`.

    Raises a DiffractionError if the wavelengths have no two, a nanometre apart, within 300 to 700
    nm.
    """
    inside = [w for w in np.ravel(wavelengths) if RANGE[0] <= w <= RANGE[1]]
    if len(inside) < 2 or whole_nanometres(np.array(inside)).size < 2:
        raise DiffractionError(
            "iridescence is measured from 300 to 700 nm; give two wavelengths of these at least, a "
            "nanometre apart"
        )
    collected = np.tile(-DETECTORS, len(LAMPS))  # + on the lamp's side, as the lamp's own angle
    rows: list[dict[str, Any]] = []
    for n, lamp in enumerate(LAMPS):
        progress(n, len(LAMPS), "lamps")
        rows += colours_of(
            spectrum(bsdf, float(lamp), DETECTORS.tolist(), light_azimuth=azimuth,
                     acceptance=acceptance, wavelengths=inside, before=before)
        )  # fmt: skip
    brightness, hue = (np.array([row[name] for row in rows]) for name in ("B2", "H1"))
    return fitted(np.repeat(LAMPS, len(DETECTORS)), collected, brightness, hue)


def fitted(incident: Real, collected: Real, brightness: Real, hue: Real) -> dict[str, float]:
    """Fit the five variables to brightness (%) and hue (nm) at signed angles (n,) in degrees.

    B = Bmax exp(−(x − t)²/2γB²) with x = (Θinc + Θcol)/2, 0 in the mirror direction, and
    H = Hmax cos(γH y) with y = (Θinc − Θcol)/2. t and γB are in degrees. Empty without light.
    """
    top = float(brightness.max())
    if not top > 0.0:
        return {}
    x, y = 0.5 * (incident + collected), np.radians(0.5 * (incident - collected))
    share = brightness / top
    mean = float(np.average(x, weights=share))
    width = float(np.sqrt(np.average((x - mean) ** 2, weights=share)))
    b = least_squares(
        lambda p: p[0] * np.exp(-0.5 * ((x - p[1]) / p[2]) ** 2) - share,
        [1.0, mean, max(width, 1.0)],
    )
    lit = share > _DARK
    h = least_squares(lambda p: p[0] * np.cos(p[1] * y[lit]) - hue[lit] / hue.max(), [1.0, 0.5])
    values = (
        top * b.x[0], b.x[1], abs(b.x[2]), hue.max() * h.x[0], abs(h.x[1]),
        top * np.sqrt(np.mean(b.fun**2)), hue.max() * np.sqrt(np.mean(h.fun**2)),
    )  # fmt: skip
    return {name: float(f"{value:.5g}") for name, value in zip(VARIABLES, values, strict=True)}
