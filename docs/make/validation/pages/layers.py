"""docs/validation/layers.md: gratings under a coat and under a film."""

from __future__ import annotations

from ..cases import COAT, FEW_WAVELENGTHS, Case, Grating, Light, Media
from ..coated import returned
from ..compare import compare
from ..filmed import BEYOND, FILMS, GRATINGS
from ..models import ANGLES, of_colours
from ..solutions import Solutions
from ..solve import solve_case
from .markdown import angle, both_models, percent, table
from .measurements import Measurements


def write(measured: Measurements) -> str:
    """Write the page."""
    return f"""# Coats and films

{_coat(measured)}

{_film(measured)}"""


def _coat(measured: Measurements) -> str:
    rows = []
    for grating in dict.fromkeys(solved.case.surface for solved in measured.coats[0].solved):
        for theta in ANGLES:
            once, bounced = (part.where(grating=grating, theta=theta) for part in measured.coats)
            values = of_colours(once), returned(once, bounced), of_colours(bounced)
            rows.append([grating, angle(theta), *map(percent, values)])
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
    rows = [
        [film, f"{grating.period:g}/{grating.depth:g} µm", *both_models(sides, grating, ANGLES)]
        for film, sides in measured.films.items()
        for grating in GRATINGS
    ]
    layers = [(film, *(FILMS[film].film or ())) for film in measured.films]
    sizes = [[name, f"{index:g}", f"{thickness:g} nm"] for name, index, thickness in layers]
    thick = [[f"{d:g} nm", f"2.5/{h:g} µm", percent(_lacquered(d, h))] for d, h in BEYOND]
    worst = percent(measured.worst_under_films)
    return f"""## Under a film

Beside Chandezon's method, with films. The steepest slopes are 0.03 to 0.1.

{table(["film", "`film_ior` + i `film_k`", "`film_thickness`"], sizes)}

Deviation of colours as Kirchhoff / the default:

{table(["film", "sinusoid", *map(angle, ANGLES)], rows)}

The default deviates by at most {worst} ([why](../theory/layers.md#films)). Thicker
films and deeper gratings deviate more; the plugin warns of thick films on rough metals.
Lacquer at {angle(ANGLES[-1])}:

{table(["`film_thickness`", "sinusoid", "deviation"], thick)}"""


def _lacquered(thickness: float, depth: float) -> float:
    """Deviation of the default under lacquer (nm) on a sinusoid of 2.5 µm (depth in µm)."""
    surface, media = Grating("sinusoidal", 2.5, depth), Media("aluminium", (1.5 + 0.02j, thickness))
    cases = [Case(surface, Light(lam, ANGLES[-1]), media) for lam in FEW_WAVELENGTHS]
    solved = [solve_case(case, solver="films") for case in cases]
    return of_colours(compare(Solutions(solved), "small_slope"))
