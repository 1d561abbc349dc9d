"""docs/validation/scans.md: hues of scanned gratings, and crops of a rough surface."""

from __future__ import annotations

import numpy as np

from ..scans import BESIDE, LIGHT, WAVELENGTHS, WIDTH, crops, random_hues, spectrum
from ..tapers import ESTIMATORS, lobe_widths, seen
from .markdown import percent, table
from .measurements import Measurements


def write(measured: Measurements) -> str:
    """Write the page."""
    return "\n\n".join([_hues(2 if measured.quick else 300), _crops(measured.quick)])


def _hues(count: int) -> str:
    found = random_hues(count)
    hue, peak = (np.abs([getattr(one, name) for one in found]) for name in ("hue", "peak"))
    width = np.array([one.width for one in found])
    rows = [
        [name, percent(np.quantile(values, 0.95)), percent(values.max())]
        for name, values in (("mean wavelength above half height", hue), ("highest point", peak))
    ]
    low, high = np.quantile(width, [0.05, 0.95])
    return f"""# Scans

Errors of the windows through which a scan is evaluated ([theory.md](../theory.md#scans)), for
`md.reference.brdf`.

## Hues of gratings

{count} random sinusoids, scans of 10 to 65 µm with 3 to 40 periods, turned by 0 to 45°, light from
{LIGHT:g}°, detector at the normal. Deviation from the closed form J_m² under the light's window:

{table(["", "95 % are below", "largest"], rows)}

Peaks are {percent(width.mean() - 1.0)} wider than through the light's window on average, 90 % of
them {percent(low - 1.0)} to {percent(high - 1.0)}; {percent(np.mean(np.abs(width - 1.0) < 0.15))}
are within 15 %. Ripples of the look-up between orders move the highest point."""


def _crops(quick: bool) -> str:
    few = {"count": 3, "degrees": (10.0,), "wavelengths": np.array([500.0, 600.0]), "surfaces": 1}
    found = crops(**few) if quick else crops(degrees=BESIDE)  # type: ignore[arg-type]
    own = next(iter(ESTIMATORS.values()))
    lam = WAVELENGTHS[::9] if quick else WAVELENGTHS
    expected = [seen(own, spectrum, WIDTH, one.degrees, lam) for one in found]
    rows = [
        [
            f"{one.degrees:g}°", f"{one.seen.ratio:.2f} ± {one.error:.2f}", f"{one.seen.worst:.2f}",
            f"{one.scatter:.2f}", f"{each.ratio:.2f}", f"{each.worst:.2f}",
        ]
        for one, each in zip(found, expected, strict=True)
    ]  # fmt: skip
    heads = ["from the mirror", "mean", "colour", "scatter", "mean expected", "colour expected"]
    return f"""## Crops of a rough surface

Light from levelled crops of 10 µm over light from the whole, 133 µm of rough ridges, under the same
window. Light from 30°, 430 to 800 nm. *Mean* is over crops and wavelengths, with its
standard error; *colour* is the largest ratio of the mean crop at a wavelength; *scatter* is the
standard deviation of single crops. *Expected* is the closed form for low relief: the power spectrum
convolved with the window's lobe.

{table(heads, rows)}

Within 7° of the mirror direction, light is diffracted by waves longer than a crop.

## Choice of the estimator

*Width* is that of a lobe over the light's: the mean, and the range of 90 % of waves at random
angles and places between orders. *Colour* is the expected value, as above. σ_l = 2σ unless said.

{_estimators(lam, quick)}

None of the others has both narrower lobes and truer colours. Windows of wider scans are wider than
10 µm, with smaller errors of both."""


def _estimators(lam: np.ndarray, quick: bool) -> str:
    rows = []
    for name, each in list(ESTIMATORS.items())[: 2 if quick else None]:
        widths = lobe_widths(each, 30 if quick else 300)
        low, high = np.quantile(widths, [0.05, 0.95])
        colours = [f"{seen(each, spectrum, WIDTH, d, lam).worst:.2f}" for d in (15.0, 20.0, 30.0)]
        rows.append([name, f"{widths.mean():.2f}", f"{low:.2f} to {high:.2f}", *colours])
    return table(["estimator", "width", "range", "colour at 15°", "at 20°", "at 30°"], rows)
