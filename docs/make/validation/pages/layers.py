"""docs/validation/layers.md: gratings under a coat and under a film."""

from __future__ import annotations

from ..cases import COAT
from ..filmed import ANGLES, GRATINGS, beyond
from .markdown import angle, beside, percent, table
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

Aluminium under polycarbonate (`coat_ior` {COAT:g}). Rigorous solutions are matrices between all
orders inside the coat, whose face transmits and reflects their powers. Deviation of colours of the
default:

- *one passage*: light that is diffracted once.
- *with bounces*: the whole series, with total reflection at the face.
- *share of the bounces*: part of the rigorous colours that the face reflected.

{table(header, rows)}

Much of the light diffracted twice, which the model ignores, is beyond the critical angle."""


def _film(measured: Measurements) -> str:
    rows = []
    for film in measured.films:
        for grating, *by_model in zip(GRATINGS, film.kirchhoff, film.default, strict=True):
            rows.append([film.name, f"{grating.period:g}/{grating.depth:g} µm", *beside(*by_model)])
    layers = [(film.name, *(film.media.film or ())) for film in measured.films]
    sizes = [[name, f"{index:g}", f"{thickness:g} nm"] for name, index, thickness in layers]
    thick = [[f"{b.thickness:g} nm", f"2.5/{b.depth:g} µm", percent(b.deviation)] for b in beyond()]
    worst = max(film.default.max() for film in measured.films)
    return f"""## Under a film

Beside Rayleigh's expansion at both faces. The steepest slopes are 0.03 to 0.1.

{table(["film", "`film_ior` + i `film_k`", "`film_thickness`"], sizes)}

Deviation of colours as Kirchhoff / the default:

{table(["film", "sinusoid", *map(angle, ANGLES)], rows)}

The default deviates by at most {percent(float(worst))} ([why](../theory/layers.md#films)). Thicker
films and deeper gratings deviate more; the plugin warns of thick films on rough metals.
Lacquer at {angle(ANGLES[-1])}:

{table(["`film_thickness`", "sinusoid", "deviation"], thick)}"""
