"""Patches side by side: heights, their distribution and spectrum, and the light that they throw."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...heights.field import HeightField
from ...heights.spectra import FloatArray, far_field, height_spectrum, order_powers, profile

RED, GREEN, BLUE = 650.0, 550.0, 450.0  # nm

# Width of the second picture, µm, at most: fingers and pits are a few µm long.
_DETAIL = 16.0
# Spectral density of a flat patch, below the axes, µm⁴.
_NOTHING = 1e-12
# Heights (nm) on either side of the mean, and density (µm⁴), that the axes show at least.
_HEIGHTS, _DENSITY = 200.0, 1.0

# Light per unit of (u, v) that is drawn black and white: six decades below the mirror's order.
_DARKEST, _BRIGHTEST = 2e-3, 4.0


def patches_figure(fields: Sequence[HeightField]) -> Figure:
    """Draw a row for each patch; the first one's curves stay in the others' panels, in grey.

    From left to right: the patch and a detail of it, seen from above; how the heights are
    distributed; the spectrum of the heights along x and y; and the far field of light along the
    normal at 450, 550 and 650 nm, shown as blue, green and red (not colorimetric), logarithmic.
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
    """The corner of a patch up to `width` µm in both directions."""
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    part = field.heights[: min(ny, round(width / dy)), : min(nx, round(width / dx))] * 1000
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
    furthest = 1000 * float(np.abs(field.heights - field.heights.mean()).max())
    limit = max(_HEIGHTS, 1.05 * furthest)
    for one, style in _drawn(field, others):
        heights = (one.heights - one.heights.mean()) * 1000
        share, edges = np.histogram(heights, bins=68, range=(-limit, limit), density=True)
        axes.semilogy((edges[1:] + edges[:-1]) / 2, share, **style)
    axes.set(xlabel="height above the mean (nm)", ylabel="density (1/nm)", ylim=(1e-6, 0.1))
    text = f"rms height {field.rms_height * 1000:.1f} nm\nrms slope {field.rms_slope:.3f}"
    axes.text(0.03, 0.97, text, transform=axes.transAxes, va="top", fontsize=8)


def _spectrum(axes: Axes, field: HeightField, others: Sequence[HeightField]) -> None:
    edges = np.geomspace(0.04, 8, 61)
    middle = np.sqrt(edges[1:] * edges[:-1])
    for one, style in _drawn(field, others):
        density = height_spectrum(one)
        for direction, dashes in (("x", "-"), ("y", "--")):
            curve = profile(density, one, edges, direction)  # type: ignore[arg-type]
            label = f"along {direction}" if one is field else None
            seen = np.isfinite(curve)
            axes.loglog(
                middle[seen], np.maximum(curve[seen], _NOTHING), dashes, label=label, **style
            )
    axes.set(xlabel="frequency (1/µm)", ylabel="spectral density (µm⁴)", ylim=(1e-9, None))
    axes.set_ylim(top=max(_DENSITY, axes.get_ylim()[1]))
    axes.legend(fontsize=8, loc="lower left", title=f"{others[0].name} grey" if others else None)


def _light(axes: Axes, field: HeightField) -> None:
    light = colour_field(field)
    axes.imshow(light, origin="lower", extent=(-1, 1, -1, 1), interpolation="bilinear")
    axes.set(xlabel="u = sinθ cosφ", ylabel="v = sinθ sinφ")
    shares = [(w, _mirror_share(field, w)) for w in (BLUE, GREEN, RED)]
    text = "unscattered: " + ", ".join(f"{share:.0%} at {w:g} nm" for w, share in shares)
    axes.text(0.5, 1.02, text, transform=axes.transAxes, ha="center", fontsize=8)


def colour_field(field: HeightField, size: int = 301) -> FloatArray:
    """Far fields at 650, 550 and 450 nm as red, green and blue, (size, size, 3) in [0, 1]."""
    light = np.stack([far_field(field, w, size) for w in (RED, GREEN, BLUE)], axis=-1)
    bright = np.log(np.maximum(light, _DARKEST) / _DARKEST) / np.log(_BRIGHTEST / _DARKEST)
    return np.asarray(np.nan_to_num(np.clip(bright, 0, 1), nan=1.0))


def _mirror_share(field: HeightField, wavelength: float) -> float:
    """Share of the light within 3 orders of the mirror direction."""
    powers = order_powers(field, wavelength)
    y, x = (n // 2 for n in powers.shape)
    return float(powers[y - 3 : y + 4, x - 3 : x + 4].sum())


def _drawn(
    field: HeightField, others: Sequence[HeightField]
) -> list[tuple[HeightField, dict[str, object]]]:
    grey = [(other, {"color": "0.65", "lw": 2.2}) for other in others]
    return [*grey, (field, {"color": "tab:blue", "lw": 1.0})]
