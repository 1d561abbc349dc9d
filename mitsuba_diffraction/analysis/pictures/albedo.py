"""How much light a table's surface reflects, before energy is conserved: raw, above 1 too."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from numpy.typing import NDArray

from ...tables.energy.conservation import FINE
from ...tables.energy.transport import Orders
from ...tables.table import DiffractionTable

#: Polar angles of the curves end here: towards 90° the raw albedo has no limit.
LAST = 89.0
#: Azimuths of the curves, degrees.
AZIMUTHS = (0.0, 45.0, 90.0)
#: Wavelengths looked at across the table's range.
WAVELENGTHS = 24


def albedo_figure(table: DiffractionTable) -> Figure:
    """Directional albedo for R = 1 of the raw Kirchhoff BRDF.

    Left: against the angle of incidence at three azimuths, the range over the table's wavelengths
    (shaded) and their mean. Right: the largest over the wavelengths, against both angles; the
    colour scale is centred at 1, where energy is conserved, and ends at the largest value at 80°.
    """
    orders, weights = Orders(table), np.ones((FINE.polar + 1, FINE.azimuthal), np.float32)
    theta = LAST * (1.0 - np.linspace(1.0, 0.0, 64) ** 1.5)  # denser towards grazing angles
    phi = np.arange(0.0, 360.1, 5.0)
    wavelengths = np.geomspace(*table.wavelength_range, WAVELENGTHS)
    azimuths = np.radians(np.concatenate([AZIMUTHS, phi]))
    albedo = np.array(
        [
            orders.transport(np.radians(theta), azimuths, w, "kirchhoff", None, FINE)(weights)
            for w in wavelengths.tolist()
        ]
    )
    figure = Figure(figsize=(12, 5.2), layout="constrained")
    name = table.source.get("name", "table")
    figure.suptitle(f"{name}: raw directional albedo, R = 1")
    _curves(figure.add_subplot(1, 2, 1), theta, albedo[:, :, : len(AZIMUTHS)], wavelengths)
    polar = figure.add_subplot(1, 2, 2, projection="polar")
    assert isinstance(polar, PolarAxes)
    _map(polar, theta, phi, albedo[:, :, len(AZIMUTHS) :].max(axis=0))
    return figure


def _curves(
    axes: Axes, theta: NDArray[np.float64], albedo: NDArray[np.floating], wavelengths: NDArray
) -> None:
    """Albedo (wavelengths, angles, azimuths)."""
    for n, azimuth in enumerate(AZIMUTHS):
        values = albedo[:, :, n]
        (line,) = axes.plot(theta, values.mean(axis=0), label=f"φ = {azimuth:g}°")
        low, high = values.min(axis=0), values.max(axis=0)
        axes.fill_between(theta, low, high, color=line.get_color(), alpha=0.2, lw=0)
    axes.axhline(1.0, color="black", lw=0.8, ls="--")
    axes.set(
        xlabel="angle of incidence θ (°)", ylabel="directional albedo", xlim=(0, 90),
        title=f"mean and range over {wavelengths[0]:g} to {wavelengths[-1]:g} nm",
        ylim=(0, 1.1 * max(1.2, float(albedo.max()))),
    )  # fmt: skip
    axes.legend(loc="upper left")


def _map(
    axes: PolarAxes,
    theta: NDArray[np.float64],
    phi: NDArray[np.float64],
    albedo: NDArray[np.floating],
) -> None:
    """Albedo (angles, azimuths)."""
    reach = max(0.05, float(np.abs(albedo[theta <= 80.0] - 1.0).max()))
    image = axes.pcolormesh(
        np.radians(phi), theta, albedo, shading="gouraud", cmap="RdBu_r",
        vmin=1.0 - reach, vmax=1.0 + reach,
    )  # fmt: skip
    axes.set_rlim(0, 90)
    axes.set_rgrids([30, 60, 80], labels=["30°", "60°", "80°"])
    axes.set_title("largest over the wavelengths; radius θ, angle φ from the patch's x")
    bar = axes.figure.colorbar(image, ax=axes, shrink=0.85, extend="max")
    bar.set_label("directional albedo")
