"""Parts of docs/validation/scans.md: hues of scanned gratings, and crops of a rough surface."""

from __future__ import annotations

import numpy as np

from ..scans import BESIDE, LIGHT, WAVELENGTHS, WIDTH, crops, random_hues, spectrum
from ..tapers import ESTIMATORS, lobe_widths, seen
from .markdown import percent, table
from .measurements import Measurements


def parts(measured: Measurements) -> dict[str, str]:
    """Return the parts of the page by name."""
    lam = WAVELENGTHS[::9] if measured.quick else WAVELENGTHS
    return {
        **_hues(2 if measured.quick else 300),
        "crops": _crops(measured.quick, lam),
        "choice-of-the-estimator": _estimators(lam, measured.quick),
    }


def _hues(count: int) -> dict[str, str]:
    found = random_hues(count)
    hue, peak = (np.abs([getattr(one, name) for one in found]) for name in ("hue", "peak"))
    width = np.array([one.width for one in found])
    rows = [
        [name, percent(np.quantile(values, 0.95)), percent(values.max())]
        for name, values in (("mean wavelength above half height", hue), ("highest point", peak))
    ]
    low, high = np.quantile(width, [0.05, 0.95])
    return {
        "count": f"{count}",
        "light": f"{LIGHT:g}°",
        "hues": table(["", "95 % are below", "largest"], rows),
        "wider": percent(width.mean() - 1.0),
        "widths": f"{percent(low - 1.0)} to {percent(high - 1.0)}; "
        f"{percent(np.mean(np.abs(width - 1.0) < 0.15))}",
    }


def _crops(quick: bool, lam: np.ndarray) -> str:
    few = {"count": 3, "degrees": (10.0,), "wavelengths": np.array([500.0, 600.0]), "surfaces": 1}
    found = crops(**few) if quick else crops(degrees=BESIDE)  # type: ignore[arg-type]
    own = next(iter(ESTIMATORS.values()))
    expected = [seen(own, spectrum, WIDTH, one.degrees, lam) for one in found]
    rows = [
        [
            f"{one.degrees:g}°", f"{one.seen.ratio:.2f} ± {one.error:.2f}", f"{one.seen.worst:.2f}",
            f"{one.scatter:.2f}", f"{each.ratio:.2f}", f"{each.worst:.2f}",
        ]
        for one, each in zip(found, expected, strict=True)
    ]  # fmt: skip
    heads = ["from the mirror", "mean", "colour", "scatter", "mean expected", "colour expected"]
    return table(heads, rows)


def _estimators(lam: np.ndarray, quick: bool) -> str:
    rows = []
    for name, each in list(ESTIMATORS.items())[: 2 if quick else None]:
        widths = lobe_widths(each, 30 if quick else 300)
        low, high = np.quantile(widths, [0.05, 0.95])
        colours = [f"{seen(each, spectrum, WIDTH, d, lam).worst:.2f}" for d in (15.0, 20.0, 30.0)]
        rows.append([name, f"{widths.mean():.2f}", f"{low:.2f} to {high:.2f}", *colours])
    return table(["estimator", "width", "range", "colour at 15°", "at 20°", "at 30°"], rows)
