"""Tables of whatever heights, sizes and wavelengths: right to their tolerance, or refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

from mitsuba_diffraction import DiffractionError, DiffractionTable, HeightField
from mitsuba_diffraction.optics.colour import response
from mitsuba_diffraction.optics.geometry import diffraction_coordinates, sigma_of, wavenumber
from mitsuba_diffraction.reference import screen_power

pytestmark = pytest.mark.filterwarnings("ignore::mitsuba_diffraction.errors.DiffractionWarning")

#: Examples and samples of each: together more than 10 000 on more than 200 tables.
TABLES, SAMPLES = 206, 50


def between(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers spread evenly over the orders of magnitude."""
    return st.floats(np.log(low), np.log(high)).map(lambda x: float(np.exp(x)))


@st.composite
def patches(draw: st.DrawFn) -> HeightField:
    """From a nanometre to 20 µm deep, 2 × 2 pixels up, with pixels of up to 1:10."""
    # deep surfaces take long series: one in four is as deep as any
    depth = draw(between(1e-3, 20.0) if draw(st.integers(0, 3)) == 0 else between(1e-3, 1.0))
    most = 24 if depth < 2.0 else 8  # deep series are long: keep the tables small
    ny, nx = draw(st.integers(2, most)), draw(st.integers(2, most))
    x, y = np.arange(nx), np.arange(ny)[:, None]
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shapes = {
        "noise": lambda: random.random((ny, nx)),
        "spike": lambda: 1.0 * ((x == nx // 2) & (y == ny // 3)),
        "lamellar": lambda: 1.0 * (x % 4 < 2) + 0.0 * y,
        "waves": lambda: np.sin(2 * np.pi * x / nx) * np.cos(2 * np.pi * y / ny),
        "flat": lambda: 0.0 * (x + y),
    }
    heights = depth * shapes[draw(st.sampled_from(sorted(shapes)))]()
    heights += draw(st.sampled_from([0.0, -3.0, 5e3]))  # µm: a stage's position, say
    pixel = draw(between(0.02, 1.0))
    return HeightField(heights, (pixel, pixel * draw(between(0.1, 10.0))))


@st.composite
def settings_of_tables(draw: st.DrawFn) -> dict[str, object]:
    """What `build` is asked for; the coherence width in units of the patch."""
    shortest = draw(between(200.0, 2400.0))
    return {
        "coherence": draw(st.sampled_from(["ensemble", "patch"])),
        "basis": draw(st.sampled_from(["auto", "chebyshev", "taylor"])),
        "tolerance": draw(st.sampled_from([1e-2, 1e-3, 1e-4])),
        "wavelength_range": (shortest, draw(st.floats(1.02 * shortest, 2500.0))),
        "coherence_width": draw(between(0.1, 10.0)),
    }


def directions(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """`SAMPLES` ωi and ωo: grazing to 89.99°, specular and retro-reflecting among them."""
    random = np.random.default_rng(seed)
    cos_i, cos_o = random.random((2, SAMPLES))
    phi_i, phi_o = random.uniform(0.0, 2.0 * np.pi, (2, SAMPLES))
    cos_i[:5], cos_o[:3] = np.cos(np.radians(89.99)), np.cos(np.radians(89.99))
    cos_o[5:20] = cos_i[5:20]
    phi_o[5:15], phi_o[15:20] = phi_i[5:15] + np.pi, phi_i[15:20]
    sin_i, sin_o = np.sqrt(1.0 - cos_i**2), np.sqrt(1.0 - cos_o**2)
    wi = np.stack([sin_i * np.cos(phi_i), sin_i * np.sin(phi_i), cos_i], axis=1)
    wo = np.stack([sin_o * np.cos(phi_o), sin_o * np.sin(phi_o), cos_o], axis=1)
    return wi, wo


@settings(
    max_examples=TABLES,
    deadline=None,
    derandomize=True,
    phases=[Phase.explicit, Phase.generate],  # shrinking takes minutes and shows little
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
@given(field=patches(), asked=settings_of_tables(), seed=st.integers(0, 2**32 - 1))
def test_right_or_refused(field, asked, seed):
    asked["coherence_width"] *= min(field.extent)
    try:
        table = DiffractionTable.build(field, **asked)
    except DiffractionError as error:
        # in one line that says what to do
        assert "\n" not in str(error)
        assert any(word in str(error) for word in ("raise", "use", "crop", "lower"))
        assume(False)  # another one, so that as many tables are built
    wi, wo = directions(seed)
    wavelengths = np.random.default_rng(seed).uniform(*asked["wavelength_range"], SAMPLES)
    brdf = table.brdf(wi, wo, wavelengths)
    assert np.all(np.isfinite(brdf))
    assert np.all(brdf >= 0.0)
    assert np.all(response(wavelengths) * brdf[:, None] >= 0.0)
    k, (u, v, w) = wavenumber(wavelengths), diffraction_coordinates(wi, wo)
    found = table.window_sum(k * u, k * v, k * w)
    sigma = sigma_of(asked["coherence_width"])
    exact = np.array(
        [
            screen_power(np.exp(1j * a), field.pixel_size, qx, qy, sigma, asked["coherence"])
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
        assert error <= asked["tolerance"] * (2.0 * exact[part].sum() + mean * len(exact[part]))
