"""Eyes of animals: spectral sensitivities, quantum catches and contrasts.

A receptor's sensitivity is its pigment's template, times the transmittance of its oil
droplet, normalised to an area of 1, times the media's transmittance, as in pavo's `sensmodel`.

References
----------
V. I. Govardovskii, N. Fyhrquist, T. Reuter, D. G. Kuzmin and K. Donner, In search of the visual
pigment template, Visual Neuroscience 17, 509-528 (2000): A1 pigments, α and β bands.
N. S. Hart and M. Vorobyev, Modelling oil droplet absorption spectra and spectral sensitivities of
bird cone photoreceptors, J. Comp. Physiol. A 191, 381-392 (2005).
M. Vorobyev and D. Osorio, Receptor noise as a determinant of colour thresholds, Proc. R. Soc. B
265, 351-358 (1998).
N. S. Hart, J. C. Partridge, I. C. Cuthill and A. T. D. Bennett, Visual pigments, oil droplets,
ocular media and cone photoreceptor distribution in two species of passerine bird, J. Comp. Physiol.
A 186, 375-387 (2000): blue tit, `avian_uv`.
A. J. Sillman, V. I. Govardovskii, P. Röhlich, J. A. Southard and E. R. Loew, The photoreceptors and
visual pigments of the garter snake, J. Comp. Physiol. A 181, 89-101 (1997): `snake`; the small
single cones, 14.5 %, are taken as equally many of each kind.
N. S. Hart, Vision in the peafowl (Aves: Pavo cristatus), J. Exp. Biol. 205, 3925-3935 (2002):
`avian_v`; pigments, numbers of cones, and the peaks that media and droplets give them, 432, 477,
537 and 605 nm. The cut-offs here give the last three under a blue tit's ocular media.
E. R. Loew, L. J. Fleishman, R. G. Foster and I. Provencio, Visual pigments and oil droplets in
diurnal lizards, J. Exp. Biol. 205, 927-938 (2002): `lizard`, anoles; pigments without droplets.
J. Neitz, T. Geist and G. H. Jacobs, Color vision in the dog, Visual Neuroscience 3, 119-125 (1989):
`dog`.
D. Peitsch, A. Fietz, H. Hertel, J. de Souza, D. F. Ventura and R. Menzel, The spectral input
systems of hymenopteran insects, J. Comp. Physiol. A 170, 23-40 (1992): `bee`, the honeybee.
A. Stockman and L. T. Sharpe, Vision Research 40, 1711-1737 (2000): `human`, the cone fundamentals
of CIE 2006 (170-1), for 2 degrees.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Real
from ..errors import DiffractionError, quoted
from ..optics.colour import cone_fundamentals, illuminant_power, leaf_green
from ..text_spectra import SPECTRA, choice_of, read_spectra

#: Wavelengths of sensitivities, nm: the range in which animals see.
GRID = np.arange(300.0, 701.0)
#: Lights of catches: as many quanta everywhere; CIE's daylight of direct sun, of sun and sky, and
#: of the northern sky, in open shade (G. Wyszecki and W. S. Stiles, Color Science, Wiley 1982);
#: shade under leaves, a model (`_under_leaves`).
ILLUMINANTS = ("ideal", "d55", "d65", "d75", "leaves")
#: Weber fraction of the receptor of the longest waves, of the Pekin robin, and of luminance: pavo's
#: defaults.
WEBER = 0.1
# Names that a film's channel cannot have, since the film has such parameters.
_TAKEN = ("width", "height", "component_format", "rfilter", "sample_border", "compensate")
# Share of the quanta under leaves that come through gaps.
_GAPS = 0.5

# Of oil droplets, the wavelength of half transmittance from that of the cut: slope, intercept (nm).
_DROPLETS = {"C": (0.99, 24.38), "Y": (0.9, 70.03), "R": (0.99, 28.65), "P": (0.96, 33.57)}


@dataclass(frozen=True)
class Eye:
    """Receptors of an animal, shortest wavelength first.

    Attributes
    ----------
    names : of the receptors.
    sensitivity : (receptors, GRID), each of area 1 before the ocular media.
    density : relative numbers of receptors, by which noise is shared.
    weber : Weber fraction of the receptor of the longest waves, or one of each receptor.
    weber_luminance : Weber fraction of luminance.
    luminance : receptors whose catches, times their numbers, add up to luminance.
    """

    names: tuple[str, ...]
    sensitivity: Real
    density: tuple[float, ...]
    weber: tuple[float, ...] = (WEBER,)
    weber_luminance: float = WEBER
    luminance: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.luminance:
            object.__setattr__(self, "luminance", self.names[-1:])

        counts = {"density": (len(self.names),), "weber": (1, len(self.names))}
        for what, count in counts.items():
            values = getattr(self, what)
            if len(values) not in count or not all(0.0 < value < np.inf for value in values):
                raise DiffractionError(
                    f"{'cone ratios' if what == 'density' else 'Weber fractions'}: expected "
                    f"{' or '.join(map(str, count))} numbers above 0, one for each of "
                    f"{', '.join(self.names)}; got {', '.join(f'{value:g}' for value in values)}"
                )

    def __str__(self) -> str:
        cones = " : ".join(
            f"{name} {n:g}" for name, n in zip(self.names, self.density, strict=True)
        )
        noise = " : ".join(f"{e:g}" for e in self.weber)
        noisy = self.names[-1] if len(self.weber) == 1 else "each"
        return (
            f"numbers of receptors {cones}; Weber fraction {noise} of {noisy}; luminance by "
            f"{' and '.join(self.luminance)}, Weber fraction {self.weber_luminance:g}"
        )


def pigment_template(peak: float, beta: bool = True) -> Real:
    """Return the absorbance of an A1 pigment with this λmax in nm at `GRID`, its maximum 1."""
    x = peak / GRID
    a = 0.8795 + 0.0459 * np.exp(-((peak - 300.0) ** 2) / 11940.0)
    alpha = 1.0 / (
        np.exp(69.7 * (a - x)) + np.exp(28.0 * (0.922 - x)) + np.exp(-14.9 * (1.104 - x)) + 0.674
    )
    if beta:
        place, width = 189.0 + 0.315 * peak, -40.5 + 0.195 * peak
        alpha += 0.26 * np.exp(-(((GRID - place) / width) ** 2))
    return np.asarray(alpha / alpha.max())


def droplet_transmittance(kind: str, cut: float) -> Real:
    """Return the transmittance of an oil droplet at `GRID`: C, Y, R, P by λcut in nm; T, clear."""
    if kind == "T":
        return np.ones_like(GRID)
    slope, intercept = _DROPLETS[kind]
    gradient = 0.5 / (slope * cut + intercept - cut)
    return np.asarray(np.exp(-np.exp(-2.89 * gradient * (GRID - cut) + 1.08)))


def bird_media() -> Real:
    """Return the transmittance of a blue tit's ocular media at `GRID`, the polynomial of pavo."""
    terms = (8.928e-13, -2.595e-9, 3.006e-6, -0.001736, 0.5013, -55.56)
    return np.asarray(np.maximum(np.log(np.maximum(np.polyval(terms, GRID), 1e-300)), 0.0))


def _modelled(
    peaks: Sequence[float], density: Sequence[float], droplets: str = "",
    cuts: Sequence[float] = (), media: Real | None = None, names: str = "usml",
) -> Eye:  # fmt: skip
    """Model an eye from its pigments."""
    # the droplets of birds hide the β band, which pavo leaves out of their eyes
    curves = np.stack([pigment_template(peak, beta=not droplets) for peak in peaks])
    if droplets:
        curves *= [droplet_transmittance(k, c) for k, c in zip(droplets, cuts, strict=True)]
    curves /= curves.sum(axis=1, keepdims=True)
    if media is not None:
        curves = curves * media
    return Eye(tuple(names[-len(peaks) :]), curves, tuple(density))


def _human() -> Eye:
    """Model the human eye: cone fundamentals per quantum, and 2, 33 and 65 % of the cones."""
    curves = cone_fundamentals(GRID) / GRID
    sensitivity = curves / curves.sum(axis=1, keepdims=True)
    return Eye(("s", "m", "l"), sensitivity, (1.0, 16.0, 32.0), luminance=("m", "l"))


#: Animals by name: λmax, relative numbers of receptors (1 if unknown), oil droplets, their λcut.
EYES: dict[str, Callable[[], Eye]] = {
    "avian_uv": lambda: _modelled(
        (371.0, 448.0, 502.0, 563.0), (1.0, 1.92, 2.68, 2.7), "TCYR", (300.0, 413.0, 507.0, 572.0),
        bird_media(),
    ),
    "avian_v": lambda: _modelled(
        (424.0, 458.0, 505.0, 567.0), (1.0, 1.9, 2.2, 2.1), "TCYR", (300.0, 440.0, 505.5, 569.5),
        bird_media(), names="vsml",
    ),
    "lizard": lambda: _modelled((365.0, 455.0, 495.0, 564.0), (1.0, 1.0, 1.0, 1.0)),
    "dog": lambda: _modelled((429.0, 555.0), (1.0, 1.0), names="sl"),
    "bee": lambda: _modelled((344.0, 436.0, 544.0), (1.0, 1.0, 1.0), names="usm"),
    "human": _human,
    "snake": lambda: _modelled((360.0, 482.0, 554.0), (1.0, 1.0, 11.8), names="uml"),
}  # fmt: skip


def eye_of(name: str) -> Eye:
    """Return an eye by name, or from a text: wavelengths and a column for each receptor.

    Raises a DiffractionError if the animal is unknown, or the file has no sensitivities from 400 to
    700 nm.
    """
    if name.lower() in EYES:
        return EYES[name.lower()]()
    names, table = _columns(name, "observer", EYES, "a column for each receptor")
    if len(names) < 2:
        raise DiffractionError(
            f"'{name}' is not a table of receptors: give a header, wl and a name for each of two "
            "receptors or more, and rows of wavelengths in nm and sensitivities"
        )
    # R puts dots into names of columns, and a film's channel may have none
    names = tuple(name.replace(".", "_") for name in names)
    if wrong := [n for n in names if names.count(n) > 1 or not n.isidentifier() or n in _TAKEN]:
        raise DiffractionError(
            f"'{name}': {quoted(wrong[0])} cannot name a receptor; give each a name of its own, of "
            "letters and digits, such as u, s, m, l"
        )
    if table[0, 0] > 400.0 or table[-1, 0] < 700.0 or table[:, 1:].min() < 0.0:
        raise DiffractionError(
            f"'{name}': sensitivities must be 0 or more, from 400 to 700 nm at least"
        )
    curves = np.stack([np.interp(GRID, table[:, 0], c, 0.0, 0.0) for c in table[:, 1:].T])
    if blind := [n for n, curve in zip(names, curves, strict=True) if not curve.any()]:
        raise DiffractionError(f"'{name}': receptor {blind[0]} is 0 at all wavelengths; drop it")
    return Eye(names, curves / curves.sum(axis=1, keepdims=True), (1.0,) * len(names))


def _columns(
    name: str, parameter: str, known: Collection[str], columns: str
) -> tuple[tuple[str, ...], Real]:
    """Return the names of the columns of a text, and its numbers, wavelengths (nm) first.

    Raises a DiffractionError if the file holds no spectrum, or the name is unknown; the message on
    an unknown name lists the known values of the parameter.
    """
    choice = choice_of(name)
    if Path(choice.path).suffix.lower() not in SPECTRA:
        close = difflib.get_close_matches(name.lower(), known, cutoff=0.65)
        hint = f" (did you mean {' or '.join(close)}?)" if close else ""
        raise DiffractionError(
            f"{parameter}={quoted(name)} is unknown{hint}; choose one of {', '.join(known)}, or a "
            f"text of wavelengths (nm) and {columns}"
        )
    lam, table = read_spectra(choice, columns, every=parameter == "observer")
    return table.names, np.column_stack([lam, table.numbers])


def illuminant_of(name: str) -> Real:
    """Return the quanta of a light at `GRID`, of mean 1: by name, or from a text of photons.

    name : one of `ILLUMINANTS`, or a text of wavelengths and relative photons, see
        `columns`, with a column's name behind a colon if there are several.

    Raises a DiffractionError if the light is unknown, or the file does not cover 300 to 700 nm.
    """
    light = name.lower()
    if light == "leaves":
        return _under_leaves()
    if light in ILLUMINANTS:
        power = 1.0 / GRID if light == "ideal" else illuminant_power(light.upper(), GRID)
        return _of_mean_1(power * GRID)
    _, table = _columns(name, "illuminant", ILLUMINANTS, "photons")
    covers = table[0, 0] <= GRID[0] and table[-1, 0] >= GRID[-1]
    if not (covers and table[:, 1].min() >= 0.0 < table[:, 1].max()):
        raise DiffractionError(
            f"'{name}' is not a spectrum: give rows of wavelengths from 300 to 700 nm and photons"
        )
    return _of_mean_1(np.interp(GRID, table[:, 0], table[:, 1]))


def _of_mean_1(quanta: Real) -> Real:
    """Scale a light."""
    return np.asarray(quanta / quanta.mean())


def _under_leaves() -> Real:
    """Return a model of forest shade: daylight through gaps, and sunlight through green leaves.

    The transmittance of leaves is taken to have the shape of their colour in reflection, CIE's test
    colour "leaf green" (CIE 13.3-1995, sample 14). 97 % of these quanta coincide with the forest
    shade of J. A. Endler, The color of light in forests and its implications, Ecol. Monographs 63,
    1-27 (1993).
    """
    through = illuminant_of("d55") * leaf_green(GRID)
    return _GAPS * illuminant_of("d65") + (1.0 - _GAPS) * _of_mean_1(through)


def relit(light: str) -> Real:
    """Return factors (GRID,) that turn daylight, D65, into another light of as many quanta.

    light : as in `illuminant_of`.
    """
    return np.asarray(illuminant_of(light) / illuminant_of("d65"))


def responses(eye: Eye) -> Real:
    """Return the responses (receptors, GRID) to power, 1/nm, of integral 1: catches of quanta.

    Sensitivities below a thousandth of the largest are 0, so that a table need not serve them.
    """
    curves = eye.sensitivity * GRID
    curves = np.where(curves > 1e-3 * curves.max(axis=1, keepdims=True), curves, 0.0)
    return np.asarray(curves / curves.sum(axis=1, keepdims=True))


def quantum_catches(
    eye: Eye, wavelengths: ArrayLike, value: ArrayLike, illuminant: ArrayLike = 1.0
) -> Real:
    """Return the catches Q = ∫ R S I dλ (spectra, receptors), over nanometres; pavo's `Qi`.

    Raises a DiffractionError if the wavelengths do not cover the eye's range.

    Parameters
    ----------
    wavelengths : (n,), nm, which cover 300 to 700.
    value : (n, spectra), reflectance, 1 is white.
    illuminant : of `GRID`, quanta; 1 without.
    """
    lam, spectra = np.asarray(wavelengths, np.float64), np.asarray(value, np.float64)
    seen = GRID[eye.sensitivity.max(axis=0) > 1e-3 * eye.sensitivity.max()]
    if lam[0] > seen[0] or lam[-1] < seen[-1]:
        raise DiffractionError(
            f"the spectra are from {lam[0]:g} to {lam[-1]:g} nm, and this eye sees from "
            f"{seen[0]:g} to {seen[-1]:g} nm; the wavelength range must cover that"
        )
    fine = np.stack([np.interp(GRID, lam, curve) for curve in spectra.T])
    return np.asarray(fine * illuminant @ eye.sensitivity.T)


def noises(eye: Eye) -> Real:
    """Return the noise e of each receptor's channel, `Eye.weber` of the longest waves or of all."""
    if len(eye.weber) > 1:
        return np.array(eye.weber)
    density = np.array(eye.density)
    return np.asarray(eye.weber[0] * np.sqrt(density[-1] / density))


def luminance_contrasts(eye: Eye, catches: ArrayLike) -> Real:
    """Return contrasts of luminance ΔL (spectra, spectra) in just noticeable differences.

    ΔL = |ln(L1/L2)| / e, as in pavo's `coldist`. Dark spectra have none, nan.
    """
    weights = [n * (name in eye.luminance) for name, n in zip(eye.names, eye.density, strict=True)]
    luminance = np.asarray(catches, np.float64) @ weights
    f = np.where(luminance > 0.0, np.log(np.maximum(luminance, 1e-300)), np.nan)
    result = np.abs(f[:, None] - f) / eye.weber_luminance
    np.fill_diagonal(result, 0.0)
    return np.asarray(result)


def contrasts(catches: ArrayLike, noise: ArrayLike) -> Real:
    """Return chromatic distances ΔS (spectra, spectra) in just noticeable differences.

    Vorobyev and Osorio's eq. 3 to 5 for any number of receptors, with log catches: differences Δf
    without their mean, weighted by 1/e², over the noise of the channels. Spectra without light in
    one receptor have no contrast, nan.
    """
    q, e = np.asarray(catches, np.float64), np.asarray(noise, np.float64)
    with np.errstate(divide="ignore"):
        f = np.where(q > 0.0, np.log(np.maximum(q, 1e-300)), np.nan)
    weights = e**-2 / np.sum(e**-2)
    steps = f[:, None] - f
    result = np.sqrt(np.sum(((steps - (steps @ weights)[..., None]) / e) ** 2, axis=-1))
    np.fill_diagonal(result, 0.0)
    return np.asarray(result)
