"""Tables of whatever heights, sizes and wavelengths: right to their tolerance, or refused."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionTable, HeightField
from mitsuba_diffraction.optics.colour import response
from mitsuba_diffraction.optics.geometry import diffraction_coordinates, sigma_of, wavenumber
from mitsuba_diffraction.reference import Sigmas, screen_power

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.errors.DiffractionWarning"),
]

#: Tables, and samples of each.
TABLES, SAMPLES = 80, 50


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """A number spread evenly over the orders of magnitude."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def patch(rng: np.random.Generator) -> HeightField:
    """From a nanometre to 20 µm deep, 2 × 2 pixels up, with pixels of up to 1:10."""
    # deep surfaces take long series: one in four is as deep as any
    depth = between(rng, 1e-3, 20.0 if rng.random() < 0.25 else 1.0)
    most = 24 if depth < 2.0 else 8  # deep series are long: keep the tables small
    ny, nx = rng.integers(2, most + 1, 2)
    x, y = np.arange(nx), np.arange(ny)[:, None]
    shapes = (
        rng.random((ny, nx)),
        1.0 * ((x == nx // 2) & (y == ny // 3)),
        1.0 * (x % 4 < 2) + 0.0 * y,
        np.sin(2 * np.pi * x / nx) * np.cos(2 * np.pi * y / ny),
        0.0 * (x + y),
    )
    heights = depth * shapes[rng.integers(len(shapes))]
    heights += rng.choice([0.0, -3.0, 5e3])  # µm: a stage's position, say
    pixel = between(rng, 0.02, 1.0)
    return HeightField(heights, (pixel, pixel * between(rng, 0.1, 10.0)))


def settings(rng: np.random.Generator, field: HeightField) -> dict[str, object]:
    """What `build` is asked for."""
    shortest = between(rng, 200.0, 2400.0)
    return {
        "coherence": str(rng.choice(["ensemble", "patch"])),
        "basis": str(rng.choice(["auto", "chebyshev", "taylor"])),
        "tolerance": float(rng.choice([1e-2, 1e-3, 1e-4])),
        "wavelength_range": (shortest, rng.uniform(1.02 * shortest, 2500.0)),
        "coherence_width": between(rng, 0.1, 10.0) * min(field.extent),
    }


def directions(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """`SAMPLES` ωi and ωo: grazing to 89.99°, specular and retro-reflecting among them."""
    cos_i, cos_o = random.random((2, SAMPLES))
    phi_i, phi_o = random.uniform(0.0, 2.0 * np.pi, (2, SAMPLES))
    cos_i[:5], cos_o[:3] = np.cos(np.radians(89.99)), np.cos(np.radians(89.99))
    cos_o[5:20] = cos_i[5:20]
    phi_o[5:15], phi_o[15:20] = phi_i[5:15] + np.pi, phi_i[15:20]
    sin_i, sin_o = np.sqrt(1.0 - cos_i**2), np.sqrt(1.0 - cos_o**2)
    wi = np.stack([sin_i * np.cos(phi_i), sin_i * np.sin(phi_i), cos_i], axis=1)
    wo = np.stack([sin_o * np.cos(phi_o), sin_o * np.sin(phi_o), cos_o], axis=1)
    return wi, wo


def built(seed: int) -> tuple[DiffractionTable, HeightField, dict[str, object]] | None:
    """The table of a random patch, or None if it is refused in one line that says what to do."""
    rng = np.random.default_rng(seed)
    field = patch(rng)
    asked = settings(rng, field)
    try:
        return DiffractionTable.build(field, **asked), field, asked
    except DiffractionError as error:
        assert "\n" not in str(error)
        assert any(word in str(error) for word in ("raise", "use", "crop", "lower"))
        return None


def check(seed: int, table: DiffractionTable, field: HeightField, asked: dict[str, object]) -> None:
    rng = np.random.default_rng([seed, 1])
    wi, wo = directions(rng)
    wavelengths = rng.uniform(*asked["wavelength_range"], SAMPLES)
    brdf = table.brdf(wi, wo, wavelengths)
    assert np.all(np.isfinite(brdf))
    assert np.all(brdf >= 0.0)
    assert np.all(response(wavelengths) * brdf[:, None] >= 0.0)
    k, (u, v, w) = wavenumber(wavelengths), diffraction_coordinates(wi, wo)
    found = table.window_sum(k * u, k * v, k * w)
    sigma = sigma_of(asked["coherence_width"])
    exact = np.array(
        [
            screen_power(
                np.exp(1j * a), field.pixel_size, qx, qy, Sigmas(sigma, sigma), asked["coherence"]
            )
            for a, qx, qy in zip((k * w)[:, None, None] * field.heights, k * u, k * v, strict=True)
        ]
    ) / (4.0 * np.pi**2 * sigma**4)
    # What all directions have on average: Σ|a_j|² = 1, each order spread over 1/(s_x s_y) bins
    mean = min(1.0, 1.0 / np.prod([*table.grid.steps, *table.grid.radius]))
    mirror = slice(5, 15)
    for part in (mirror, np.setdiff1d(np.arange(SAMPLES), np.arange(SAMPLES)[mirror])):
        error = np.abs(found[part] - exact[part]).sum()
        # the tolerance is relative to the light of thousands of directions: twice that for some ten
        # of them, which may all be darker than the average
        allowed = asked["tolerance"] * (2.0 * exact[part].sum() + mean * len(exact[part]))
        assert error <= allowed, f"seed {seed}: {error:.3g} > {allowed:.3g}"


def test_right_or_refused():
    count, seed = 0, 0
    while count < TABLES:  # another one for each that is refused
        made = built(seed)
        if made is not None:
            check(seed, *made)
            count += 1
        seed += 1
