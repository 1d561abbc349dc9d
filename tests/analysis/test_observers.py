"""Eyes against published formulas, written again from the papers with loops and plain numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import colour
import numpy as np
import pytest

from mitsuba_diffraction.analysis.false_colour import (
    adapted,
    false_colour_figure,
    shown_receptors,
)
from mitsuba_diffraction.analysis.observers import (
    GRID,
    contrasts,
    eye_of,
    illuminant_of,
    luminance_contrasts,
    noises,
    quantum_catches,
    relit,
    responses,
)

LAM = np.arange(300.0, 701.0, 5.0)
# ten smooth spectra, steps and bells among them
SPECTRA = np.stack(
    [0.5 + 0.4 * np.sin(LAM / (20.0 + 7.0 * n) + n) for n in range(4)]
    + [1.0 / (1.0 + np.exp(-(LAM - c) / 15.0)) + 0.02 for c in (380.0, 500.0, 620.0)]
    + [0.05 + np.exp(-(((LAM - c) / 40.0) ** 2)) for c in (350.0, 450.0, 550.0)],
    axis=1,
)
# λmax, and λcut with the line that gives a droplet's λmid (Hart and Vorobyev 2005), of pavo's
# example of `sensmodel` (the blue tit) and as docs/seen.md has them; whether the media are a bird's
CLEAR, C, Y, R = None, (0.99, 24.38), (0.9, 70.03), (0.99, 28.65)
MODELS = {
    "avian_uv": (
        ((371.0, 330.0, CLEAR), (448.0, 413.0, C), (502.0, 507.0, Y), (563.0, 572.0, R)),
        True, (1.0, 1.92, 2.68, 2.7),
    ),
    "avian_v": (
        ((424.0, 330.0, CLEAR), (458.0, 440.0, C), (505.0, 505.5, Y), (567.0, 569.5, R)),
        True, (1.0, 1.9, 2.2, 2.1),
    ),
    "lizard": (tuple((x, 0.0, CLEAR) for x in (365.0, 455.0, 495.0, 564.0)), False, (1.0,) * 4),
    "snake": (tuple((x, 0.0, CLEAR) for x in (360.0, 482.0, 554.0)), False, (1.0, 1.0, 11.8)),
    "bee": (tuple((x, 0.0, CLEAR) for x in (344.0, 436.0, 544.0)), False, (1.0,) * 3),
    "dog": (tuple((x, 0.0, CLEAR) for x in (429.0, 555.0)), False, (1.0,) * 2),
}  # fmt: skip
# eye and light of each comparison: white light, and one that is not
SEEN_IN = [(name, light) for name in MODELS for light in ("ideal", "leaves")]


def media(bird):
    """Transmittance of pavo's `om = "bird"`, wavelength by wavelength."""
    if not bird:
        return [1.0] * 401
    inside = [0.5013 * w - 55.56 - 0.001736 * w**2 + 3.006e-6 * w**3 for w in range(300, 701)]
    inside = [m - 2.595e-9 * w**4 + 8.928e-13 * w**5 for w, m in enumerate(inside, 300)]
    return [math.log(m) if m > 1.0 else 0.0 for m in inside]


def absorbance(lam, peak, beta):
    """Return the A1 template of Govardovskii and others 2000, eq. 1, 2, 4, 5."""
    x, a = peak / lam, 0.8795 + 0.0459 * math.exp(-((peak - 300) ** 2) / 11940)
    rise, middle = math.exp(69.7 * (a - x)), math.exp(28 * (0.922 - x))
    s = 1 / (rise + middle + math.exp(-14.9 * (1.104 - x)) + 0.674)
    if beta:
        s += 0.26 * math.exp(-(((lam - (189 + 0.315 * peak)) / (-40.5 + 0.195 * peak)) ** 2))
    return s


def sensitivities(receptors, bird):
    """Sensitivities of pavo's `sensmodel`, wavelength by wavelength; no β band in birds."""
    rows = []
    for peak, cut, line in receptors:
        row = []
        for lam in range(300, 701):
            s = absorbance(lam, peak, not bird)
            if line is not None:
                gradient = 0.5 / (line[0] * cut + line[1] - cut)
                s *= math.exp(-math.exp(-2.89 * gradient * (lam - cut) + 1.08))
            row.append(s)
        rows.append([s / sum(row) * t for s, t in zip(row, media(bird), strict=True)])
    return rows


def caught(rows, spectrum, light):
    """Return pavo's Q = sum R S I of each row, with R linear between its 81 values."""
    sums = [0.0] * len(rows)
    for n in range(401):
        low = min(n // 5, 79)
        part = n / 5.0 - low
        reflectance = (1 - part) * spectrum[low] + part * spectrum[low + 1]
        for i, row in enumerate(rows):
            sums[i] += row[n] * reflectance * light[n]
    return sums


def distance(first, second, e):
    """Return Vorobyev and Osorio's ΔS, eq. 3, 4 and 5, of log catches."""
    d = [math.log(a / b) for a, b in zip(first, second, strict=True)]
    if len(d) == 2:
        return abs(d[0] - d[1]) / math.hypot(e[0], e[1])
    if len(d) == 3:
        above = sum((e[i] * (d[j] - d[k])) ** 2 for i, j, k in ((0, 2, 1), (1, 2, 0), (2, 1, 0)))
        return math.sqrt(above / sum((e[i] * e[j]) ** 2 for i, j in ((0, 1), (0, 2), (1, 2))))
    pairs = ((0, 1, 3, 2), (0, 2, 3, 1), (0, 3, 2, 1), (1, 2, 3, 0), (1, 3, 2, 0), (2, 3, 1, 0))
    above = sum((e[i] * e[j] * (d[k] - d[m])) ** 2 for i, j, k, m in pairs)
    threes = ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))
    return math.sqrt(above / sum((e[i] * e[j] * e[k]) ** 2 for i, j, k in threes))


@pytest.mark.parametrize(("name", "light"), SEEN_IN)
def test_quantum_catches_and_contrasts_are_those_of_the_published_formulas(name, light):
    receptors, bird, numbers = MODELS[name]
    rows, photons = sensitivities(receptors, bird), illuminant_of(light)
    expected = [caught(rows, spectrum, photons) for spectrum in SPECTRA.T]
    catches = quantum_catches(eye_of(name), LAM, SPECTRA, photons)
    assert catches == pytest.approx(np.array(expected), rel=1e-3)
    # pavo's coldist: a Weber fraction of 0.1 of the longest waves' receptor
    noise = [0.1 * math.sqrt(numbers[-1] / n) for n in numbers]
    distances = contrasts(catches, noises(eye_of(name)))
    for i, j in ((0, 1), (2, 5), (4, 7), (6, 9), (8, 3)):
        assert distances[i, j] == pytest.approx(distance(expected[i], expected[j], noise), rel=1e-3)


def test_people_s_catches_are_those_of_the_cie_s_observer_of_2015():
    """CIE 170-2:2015, table 10.2: x̄, ȳ, z̄ are these sums of the cone fundamentals."""
    matrix = [[1.94735469, -1.41445123, 0.36476327], [0.68990272, 0.34832189, 0.0],
              [0.0, 0.0, 1.93485343]]  # fmt: skip
    observer = colour.MSDS_CMFS["CIE 2015 2 Degree Standard Observer"]
    bars = np.stack([np.interp(GRID, observer.wavelengths, c, 0.0, 0.0) for c in observer.values.T])
    cones = np.linalg.solve(matrix, bars)[::-1] / GRID
    cones /= cones.sum(axis=1, keepdims=True)
    expected = [caught(cones, spectrum, np.ones(401)) for spectrum in SPECTRA.T]
    catches = quantum_catches(eye_of("human"), LAM, SPECTRA)
    assert catches == pytest.approx(np.array(expected), rel=1e-3)


@pytest.mark.parametrize("name", ["avian_uv", "human"])
def test_contrasts_of_luminance_are_logarithms_over_the_weber_fraction(name):
    eye = replace(eye_of(name), weber_luminance=0.05)
    bright, dark = np.full_like(LAM, 0.9), np.full_like(LAM, 0.3)
    catches = quantum_catches(eye, LAM, np.stack([bright, dark], axis=1))
    assert luminance_contrasts(eye, catches)[0, 1] == pytest.approx(math.log(3.0) / 0.05)
    # light that only the other receptors catch has no luminance
    alone = np.eye(len(eye.names))
    steps = luminance_contrasts(eye, alone)
    unseen = [n not in eye.luminance for n in eye.names]
    assert np.isnan(steps[unseen]).sum() == sum(unseen) * (len(unseen) - 1)


def test_ratios_and_weber_fractions_are_the_user_s():
    eye = eye_of("avian_v")
    assert noises(replace(eye, density=(1.0, 1.0, 4.0, 1.0))) == pytest.approx(
        [0.1, 0.1, 0.05, 0.1]
    )
    assert noises(replace(eye, weber=(0.2, 0.3, 0.4, 0.5))).tolist() == [0.2, 0.3, 0.4, 0.5]


def test_an_eye_may_be_a_file(tmp_path):
    file = tmp_path / "eye.csv"
    file.write_text("wl,a,b\n300,1,0\n700,1,1\n")
    assert eye_of(str(file)).names == ("a", "b")


def test_lights_have_quanta_of_mean_1_and_the_sky_is_bluer_than_the_sun(tmp_path):
    sun, sky, ideal = (illuminant_of(name) for name in ("d55", "d75", "ideal"))
    assert [light.mean() for light in (sun, sky, ideal)] == pytest.approx([1.0] * 3, rel=1e-12)
    assert ideal == pytest.approx(1.0)
    assert sky[GRID == 350.0] > sun[GRID == 350.0]
    file = tmp_path / "leaves.csv"
    file.write_text("wl,photons\n300,1\n700,3\n")
    assert illuminant_of(str(file))[[0, -1]] == pytest.approx([0.5, 1.5])


def test_shade_under_leaves_is_green_and_has_little_ultraviolet():
    shade, daylight = illuminant_of("leaves"), illuminant_of("d65")
    green = shade[GRID == 550.0]
    assert green > 1.3 * shade[GRID == 450.0]
    assert green > 1.3 * shade[GRID == 660.0]
    assert shade[GRID < 400.0].sum() < 0.8 * daylight[GRID < 400.0].sum()
    assert relit("leaves") * daylight == pytest.approx(shade)
    assert relit("d65") == pytest.approx(1.0)


def test_four_receptors_have_two_pictures_and_two_are_yellow_and_blue():
    assert shown_receptors(4) == [(3, 2, 1), (2, 1, 0)]
    assert shown_receptors(3) == [(2, 1, 0)]
    assert shown_receptors(2) == [(1, 1, 0)]


def test_a_receptor_adapts_to_the_light_and_without_light_stays_dark():
    catches = np.random.default_rng(0).uniform(0.1, 1.0, (3, 4, 3))
    dimmed = catches * [1.0, 0.02, 0.0]
    assert adapted(dimmed)[..., :2] == pytest.approx(adapted(catches)[..., :2], rel=1e-12)
    assert not adapted(dimmed)[..., 2].any()


@pytest.mark.parametrize("name", ["dog", "snake", "avian_uv"])
def test_a_grey_scene_is_grey_in_every_picture(name):
    eye = eye_of(name)
    grey = np.linspace(0.1, 1.0, 24).reshape(4, 6)[..., None] * responses(eye).sum(axis=1)
    figure = false_colour_figure(grey, eye)
    pictures = [axes.get_images()[0].get_array() for axes in figure.axes if axes.get_images()]
    assert len(pictures) == len(shown_receptors(len(eye.names)))
    for picture in pictures:
        assert np.ptp(picture, axis=2).max() < 1e-9
        assert np.ptp(picture) > 0.3
