"""Pictures of patches (heights, spectra, far field) and of a table's raw albedo."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from numpy.typing import NDArray

from ..arrays import Real
from ..heights import HeightField, order_powers
from ..heights.spectra import far_field, height_spectrum, profile
from ..tables import DiffractionTable
from ..tables.energy.conservation import Conservation, SurfaceEnergy
from ..tables.energy.conserved import Reflector

RED, GREEN, BLUE = 650.0, 550.0, 450.0  # nm

# Largest width of the second picture, µm: fingers and pits are a few µm long.
_DETAIL = 16.0
# Spectral density drawn for a flat patch, below the axes, µm⁴.
_NOTHING = 1e-12
# Least range of the axes: heights (nm) on either side of the mean, and density (µm⁴).
_HEIGHTS, _DENSITY = 200.0, 1.0

# Light per unit of (u, v) that is drawn black and white: six decades below the mirror's order.
_DARKEST, _BRIGHTEST = 2e-3, 4.0

#: Largest polar angle of the albedo's curves, degrees: towards 90° the raw albedo diverges.
LAST = 89.0
#: Azimuths of the albedo's curves, degrees.
AZIMUTHS = (0.0, 45.0, 90.0)
#: Number of wavelengths of the albedo, over the table's range.
WAVELENGTHS = 24


def patches_figure(fields: Sequence[HeightField]) -> Figure:
    """Draw a row for each patch; panels of other patches have the first patch's curves in grey.

    From left to right: the patch and one detail, seen from above; the distribution of heights;
    the spectrum of heights along x and y; and the far field of light along the normal at 450, 550
    and 650 nm, shown as blue, green and red (not colorimetric), logarithmic.
    """
    figure = Figure(figsize=(19, 3.7 * len(fields)), layout="constrained")
    panels = figure.subplots(len(fields), 5, squeeze=False, width_ratios=[1.12, 1.12, 1, 1.15, 1])
    for row, field in zip(panels, fields, strict=True):
        others = fields[:1] if field is not fields[0] else []
        _heights(row[0], field, max(field.extent))
        row[0].set_title(field.name, loc="left", fontweight="bold")
        _heights(row[1], field, min(_DETAIL, 0.25 * max(field.extent)))
        _distribution(row[2], field, others)
        _spectrum(row[3], field, others)
        _light(row[4], field)
    return figure


def _heights(axes: Axes, field: HeightField, width: float) -> None:
    """Draw the corner of a patch up to `width` µm in both directions."""
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    rows, columns = (max(1, min(n, round(width / d))) for n, d in ((ny, dy), (nx, dx)))
    part = field.heights[:rows, :columns] * 1000
    low, high = np.percentile(part, [0.05, 99.95])
    extent = (0, part.shape[1] * dx, 0, part.shape[0] * dy)
    image = axes.imshow(
        part, cmap="gray", origin="lower", extent=extent, vmin=low, vmax=high,
        interpolation="lanczos" if part.shape[0] < 500 else "antialiased",
    )  # fmt: skip
    axes.set(xlabel="x (µm)", ylabel="y (µm)")
    bar = axes.figure.colorbar(image, ax=axes, shrink=0.85)
    bar.set_label("height (nm)")


def _distribution(axes: Axes, field: HeightField, others: Sequence[HeightField]) -> None:
    """Draw the density of heights."""
    furthest = 1000 * float(np.abs(field.heights - field.heights.mean()).max())
    limit = max(_HEIGHTS, 1.05 * furthest)
    for patch, style in _drawn(field, others):
        heights = (patch.heights - patch.heights.mean()) * 1000
        share, edges = np.histogram(heights, bins=68, range=(-limit, limit), density=True)
        axes.semilogy((edges[1:] + edges[:-1]) / 2, share, **style)
    axes.set(xlabel="height above the mean (nm)", ylabel="density (1/nm)", ylim=(1e-6, 0.1))
    text = f"rms height {field.rms_height * 1000:.1f} nm\nrms slope {field.rms_slope:.3f}"
    axes.text(0.03, 0.97, text, transform=axes.transAxes, va="top", fontsize=8)


def _spectrum(axes: Axes, field: HeightField, others: Sequence[HeightField]) -> None:
    """Draw the spectral density along x and y."""
    edges = np.geomspace(0.04, 8, 61)
    middle = np.sqrt(edges[1:] * edges[:-1])
    for patch, style in _drawn(field, others):
        density = height_spectrum(patch)
        for direction, dashes in (("x", "-"), ("y", "--")):
            curve = profile(density, patch, edges, direction)  # type: ignore[arg-type]
            label = f"along {direction}" if patch is field else None
            rings = np.isfinite(curve)
            axes.loglog(
                middle[rings], np.maximum(curve[rings], _NOTHING), dashes, label=label, **style
            )
    axes.set(xlabel="frequency (1/µm)", ylabel="spectral density (µm⁴)", ylim=(1e-9, None))
    axes.set_ylim(top=max(_DENSITY, axes.get_ylim()[1]))
    axes.legend(fontsize=8, loc="lower left", title=f"{others[0].name} grey" if others else None)


def _light(axes: Axes, field: HeightField) -> None:
    """Draw the far field, and write the share of light in the mirror direction."""
    light = colour_field(field)
    axes.imshow(light, origin="lower", extent=(-1, 1, -1, 1), interpolation="bilinear")
    axes.set(xlabel="u = sinθ cosφ", ylabel="v = sinθ sinφ")
    shares = [(w, _mirror_share(field, w)) for w in (BLUE, GREEN, RED)]
    text = "unscattered: " + ", ".join(f"{share:.0%} at {w:g} nm" for w, share in shares)
    axes.text(0.5, 1.02, text, transform=axes.transAxes, ha="center", fontsize=8)


def colour_field(field: HeightField, size: int = 301) -> Real:
    """Return far fields at 650, 550 and 450 nm as red, green, blue, (size, size, 3) in [0, 1]."""
    light = np.stack([far_field(field, w, size) for w in (RED, GREEN, BLUE)], axis=-1)
    bright = np.log(np.maximum(light, _DARKEST) / _DARKEST) / np.log(_BRIGHTEST / _DARKEST)
    return np.asarray(np.nan_to_num(np.clip(bright, 0, 1), nan=1.0))


def _mirror_share(field: HeightField, wavelength: float) -> float:
    """Return the share of the light within 3 orders of the mirror direction."""
    powers = order_powers(field, wavelength)
    y, x = (slice(max(0, n // 2 - 3), n // 2 + 4) for n in powers.shape)
    return float(powers[y, x].sum())


def _drawn(
    field: HeightField, others: Sequence[HeightField]
) -> list[tuple[HeightField, dict[str, object]]]:
    """Return the patches of a panel with the style of their curves."""
    grey = [(other, {"color": "0.65", "lw": 2.2}) for other in others]
    return [*grey, (field, {"color": "tab:blue", "lw": 1.0})]


def albedo_figure(table: DiffractionTable) -> Figure:
    """Draw the directional albedo for R = 1 of the raw Kirchhoff BRDF.

    Left: against the angle of incidence at three azimuths, the range over the table's wavelengths
    (shaded) and their mean. Right: the largest over the wavelengths, against both angles; the
    colour scale is centred at 1, where energy is conserved, and ends at the largest value at 80°.
    """
    surface = SurfaceEnergy(table, Reflector("kirchhoff", lambda wavelengths: None))
    theta = LAST * (1.0 - np.linspace(1.0, 0.0, 64) ** 1.5)  # denser towards grazing angles
    phi = np.arange(0.0, 360.1, 5.0)
    wavelengths = np.geomspace(*table.wavelength_range, WAVELENGTHS)
    azimuths = np.radians(np.concatenate([AZIMUTHS, phi]))
    directions = np.radians(theta), azimuths
    albedo = np.stack(
        [surface.albedos(Conservation(), *directions, lam)[0][0] for lam in wavelengths.tolist()]
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
    """Draw curves of the albedo (wavelengths, angles, azimuths)."""
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
    """Draw the albedo (angles, azimuths) in false colours."""
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
