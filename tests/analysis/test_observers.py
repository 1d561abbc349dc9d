"""Eyes against published formulas, written again from the papers with loops and plain numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mitsuba_diffraction.analysis.observers import (
    EYES,
    GRID,
    contrasts,
    eye_of,
    illuminant_of,
    noises,
    pigment_template,
    quantum_catches,
)
from mitsuba_diffraction.errors import DiffractionError

LAM = np.arange(300.0, 701.0, 5.0)
# ten smooth spectra, steps and bells among them
SPECTRA = np.stack(
    [0.5 + 0.4 * np.sin(LAM / (20.0 + 7.0 * n) + n) for n in range(4)]
    + [1.0 / (1.0 + np.exp(-(LAM - c) / 15.0)) + 0.02 for c in (380.0, 500.0, 620.0)]
    + [0.05 + np.exp(-(((LAM - c) / 40.0) ** 2)) for c in (350.0, 450.0, 550.0)],
    axis=1,
)
# λmax, λcut, and the line that gives a droplet's λmid (Hart and Vorobyev 2005)
BLUE_TIT = (
    (371.0, 330.0, None), (448.0, 413.0, (0.99, 24.38)), (502.0, 507.0, (0.9, 70.03)),
    (563.0, 572.0, (0.99, 28.65)),
)  # fmt: skip


def blue_tit():
    """Sensitivities of pavo's example of `sensmodel`, wavelength by wavelength."""
    media = [0.5013 * w - 55.56 - 0.001736 * w**2 + 3.006e-6 * w**3 for w in range(300, 701)]
    media = [m - 2.595e-9 * w**4 + 8.928e-13 * w**5 for w, m in enumerate(media, 300)]
    media = [math.log(m) if m > 1.0 else 0.0 for m in media]
    rows = []
    for peak, cut, line in BLUE_TIT:
        row = []
        for lam in range(300, 701):
            x, a = peak / lam, 0.8795 + 0.0459 * math.exp(-((peak - 300) ** 2) / 11940)
            rise, middle = math.exp(69.7 * (a - x)), math.exp(28 * (0.922 - x))
            s = 1 / (rise + middle + math.exp(-14.9 * (1.104 - x)) + 0.674)
            if line is not None:
                gradient = 0.5 / (line[0] * cut + line[1] - cut)
                s *= math.exp(-math.exp(-2.89 * gradient * (lam - cut) + 1.08))
            row.append(s)
        rows.append([s / sum(row) * t for s, t in zip(row, media, strict=True)])
    return rows


def test_quantum_catches_are_those_of_the_published_formulas():
    catches = quantum_catches(eye_of("avian_uv"), LAM, SPECTRA)
    rows = blue_tit()
    for spectrum, found in zip(SPECTRA.T, catches, strict=True):
        for row, q in zip(rows, found, strict=True):
            expected = 0.0
            for n, s in enumerate(row):
                low = min(n // 5, 79)
                part = n / 5.0 - low
                expected += s * ((1 - part) * spectrum[low] + part * spectrum[low + 1])
            assert q == pytest.approx(expected, rel=1e-3)


def test_contrasts_are_vorobyev_and_osorio_s_of_four_three_and_two_receptors():
    q = np.random.default_rng(0).uniform(0.1, 0.9, (2, 4))
    e = np.array([0.2, 0.14, 0.14, 0.1])
    d = np.log(q[0] / q[1])
    # eq. 5: noise of two receptors, times the difference of the other two
    pairs = ((0, 1, 3, 2), (0, 2, 3, 1), (0, 3, 2, 1), (1, 2, 3, 0), (1, 3, 2, 0), (2, 3, 1, 0))
    square = sum((e[i] * e[j]) ** 2 * (d[k] - d[m]) ** 2 for i, j, k, m in pairs)
    below = sum(np.prod(np.delete(e, n)) ** 2 for n in range(4))
    assert contrasts(q, e)[0, 1] == pytest.approx(math.sqrt(square / below), rel=1e-12)
    # eq. 4
    three = sum(e[i] ** 2 * (d[j] - d[k]) ** 2 for i, j, k in ((0, 2, 1), (1, 2, 0), (2, 1, 0)))
    below = sum((e[i] * e[j]) ** 2 for i, j in ((0, 1), (0, 2), (1, 2)))
    assert contrasts(q[:, :3], e[:3])[0, 1] == pytest.approx(math.sqrt(three / below), rel=1e-12)
    # eq. 3
    dichromat = abs(d[0] - d[1]) / math.hypot(e[0], e[1])
    assert contrasts(q[:, :2], e[:2])[0, 1] == pytest.approx(dichromat, rel=1e-12)


@pytest.mark.parametrize("name", EYES)
def test_white_catches_the_media_alone_and_brightness_is_no_colour(name):
    eye = eye_of(name)
    white, grey = np.ones_like(LAM), np.full_like(LAM, 0.3)
    catches = quantum_catches(eye, LAM, np.stack([white, grey], axis=1))
    assert catches[0] == pytest.approx(eye.sensitivity.sum(axis=1), rel=1e-12)
    assert contrasts(catches, noises(eye)) == pytest.approx(0.0, abs=1e-9)
    assert (catches <= 1.0 + 1e-9).all()


def test_templates_peak_at_their_wavelength():
    for peak in (360.0, 450.0, 570.0):
        # the β band pulls the maximum by a nanometre or two
        assert GRID[pigment_template(peak).argmax()] == pytest.approx(peak, abs=2.0)


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("", "is empty"),
        ("wl,a,b\n300,1\n", "is no eye"),
        ("wl,a,b\n500,1,1\n600,1,1\n", "400"),
        ("wl,a,b\n300,1,-1\n700,1,1\n", "0 or more"),
    ],
)
def test_files_that_are_no_eyes_are_one_line(tmp_path, content, named):
    file = tmp_path / "eye.csv"
    file.write_text(content)
    with pytest.raises(DiffractionError, match=named):
        eye_of(str(file))


def test_eyes_are_names_or_files_and_see_what_spectra_cover(tmp_path):
    file = tmp_path / "eye.csv"
    file.write_text("wl,a,b\n300,1,0\n700,1,1\n")
    assert eye_of(str(file)).names == ("a", "b")
    with pytest.raises(DiffractionError, match="avian_uv"):
        eye_of("dragon")
    with pytest.raises(DiffractionError, match="wavelength_range"):
        quantum_catches(eye_of("avian_uv"), [400.0, 700.0], [[1.0], [1.0]])


def test_a_violet_sensitive_bird_s_cones_peak_where_they_were_measured():
    """Hart 2002: 432, 477, 537 and 605 nm."""
    peaks = GRID[eye_of("avian_v").sensitivity.argmax(axis=1)]
    assert peaks == pytest.approx([432.0, 477.0, 537.0, 605.0], abs=1.0)  # the grid's step


def test_people_s_cones_peak_where_quanta_are_counted():
    """Stockman and Sharpe 2000, per quantum: about 441, 542 and 566 nm at the cornea."""
    peaks = GRID[eye_of("human").sensitivity.argmax(axis=1)]
    assert peaks == pytest.approx([441.0, 542.0, 566.0], abs=2.0)


def test_lights_have_quanta_of_mean_1_and_the_sky_is_bluer_than_the_sun(tmp_path):
    sun, sky, ideal = (illuminant_of(name) for name in ("d55", "d75", "ideal"))
    assert [light.mean() for light in (sun, sky, ideal)] == pytest.approx([1.0] * 3, rel=1e-12)
    assert ideal == pytest.approx(1.0)
    assert sky[GRID == 350.0] > sun[GRID == 350.0]
    file = tmp_path / "leaves.csv"
    file.write_text("wl,photons\n300,1\n700,3\n")
    assert illuminant_of(str(file))[[0, -1]] == pytest.approx([0.5, 1.5])
    catches = quantum_catches(eye_of("dog"), LAM, SPECTRA[:, :1], sun)
    expected = (np.interp(GRID, LAM, SPECTRA[:, 0]) * sun * eye_of("dog").sensitivity).sum(axis=1)
    assert catches[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("content", ["wl,photons\n400,1\n700,1\n", "wl,photons\n300,0\n700,0\n"])
def test_files_that_are_no_lights_are_one_line(tmp_path, content):
    file = tmp_path / "light.csv"
    file.write_text(content)
    with pytest.raises(DiffractionError, match="is no light"):
        illuminant_of(str(file))
    with pytest.raises(DiffractionError, match="choose one of ideal, d55"):
        illuminant_of("moon")
