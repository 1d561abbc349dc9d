"""docs/validation/layers.md: gratings under a coat and under a film."""

from __future__ import annotations

from ..cases import COAT
from ..filmed import ANGLES, GRATINGS, beyond
from .markdown import angle, percent, table
from .measurements import Measurements


def write(measured: Measurements) -> str:
    """Write the page."""
    return f"""# Coats and films

{_coat(measured)}

{_film(measured)}"""


def _coat(measured: Measurements) -> str:
    rows = [
        [
            str(deviation.grating),
            angle(deviation.theta),
            *map(percent, (deviation.single, deviation.share, deviation.bounced)),
        ]
        for deviation in measured.coats
    ]
    header = ["grating", "incidence", "one passage", "share of the bounces", "with bounces"]
    return f"""## Under a coat

Aluminium under polycarbonate (`coat_ior` {COAT:g}). The rigorous solutions are matrices between all
orders inside the coat; the coat's faces then transmit and return their powers
(docs/make/validation/coated.py; sinusoids by Rayleigh's expansion, the others by `gratinglab`).
Deviation of colours of the default:

- *one passage*: light that is diffracted once, compared with the model without bounces.
- *with bounces*: the whole series, with light that the face reflects totally.
- *share of the bounces*: part of the rigorous colours that the face has returned at least once, the
  error of a model without bounces.

{table(header, rows)}

Refraction and transmission are exact to a few tenths of a per cent on gentle sinusoids. Walls
deviate as they do without a coat. The model has the bounces between two mirrors. It lacks light
that is diffracted twice, much of it beyond the critical angle, which the face returns whole. This
light grows with slope and with the angle of incidence."""


def _film(measured: Measurements) -> str:
    rows = []
    for film in measured.films:
        for grating, *by_model in zip(
            GRATINGS, film.kirchhoff, film.first_order, film.default, strict=True
        ):
            cells = [" / ".join(map(percent, angles)) for angles in zip(*by_model, strict=True)]
            rows.append([film.stack.name, f"{grating.period:g}/{grating.depth:g} µm", *cells])
    stacks = [film.stack for film in measured.films]
    sizes = [[s.name, f"{s.film:g}", f"{s.thickness:g} nm"] for s in stacks]
    thick = [
        [f"{b.thickness:g} nm", f"2.5/{b.depth:g} µm", percent(b.first_order), percent(b.default)]
        for b in beyond()
    ]
    worst = max(film.default.max() for film in measured.films)
    return f"""## Under a film

A film that follows the heights, beside Rayleigh's expansion at both of its faces
(docs/make/validation/filmed.py). The steepest slopes are 0.03 to 0.1.

{table(["film", "`film_ior` + i `film_k`", "`film_thickness`"], sizes)}

Deviation of colours as Kirchhoff / small slope of first order / the default, which has the
[mean of the second order](../theory/layers.md#the-mean-of-the-second-order) as well:

{table(["film", "sinusoid", *map(angle, ANGLES)], rows)}

The goal was 10 %; the default deviates by at most {percent(float(worst))}.

In the lacquer, a thick film, the second order matters in oblique light: light that is diffracted
twice meets the film's fringes at the intermediate order, and the fringes are narrower in angle than
the orders are apart. Its mean corrects most of that. It uses the roughness that a table holds,
taken as isotropic.

Thicker films and deeper gratings deviate more. The plugin warns about thick films on rough metals.
Lacquer at {angle(ANGLES[-1])}:

{table(["`film_thickness`", "sinusoid", "first order", "default"], thick)}"""
