"""Parts of docs/validation/layers.md: gratings under a coat and under a film."""

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


def parts(measured: Measurements) -> dict[str, str]:
    """Return the parts of the page by name."""
    films = [(film, *(FILMS[film].film or ())) for film in measured.films]
    sizes = [[name, f"{index:g}", f"{thickness:g} nm"] for name, index, thickness in films]
    rows = [
        [film, f"{grating.period:g}/{grating.depth:g} µm", *both_models(sides, grating, ANGLES)]
        for film, sides in measured.films.items()
        for grating in GRATINGS
    ]
    thick = [[f"{d:g} nm", f"2.5/{h:g} µm", percent(_lacquered(d, h))] for d, h in BEYOND]
    return {
        "coat": f"{COAT:g}",
        "under-a-coat": _coated(measured),
        "films": table(["film", "`film_ior` + i `film_k`", "`film_thickness`"], sizes),
        "under-a-film": table(["film", "sinusoid", *map(angle, ANGLES)], rows),
        "worst": percent(measured.worst_under_films),
        "oblique": angle(ANGLES[-1]),
        "lacquer": table(["`film_thickness`", "sinusoid", "deviation"], thick),
    }


def _coated(measured: Measurements) -> str:
    rows = []
    for grating in dict.fromkeys(solved.case.surface for solved in measured.coats[0].solved):
        for theta in ANGLES:
            once, bounced = (part.where(grating=grating, theta=theta) for part in measured.coats)
            values = of_colours(once), returned(once, bounced), of_colours(bounced)
            rows.append([grating, angle(theta), *map(percent, values)])
    header = ["grating", "incidence", "one passage", "share of the bounces", "with bounces"]
    return table(header, rows)


def _lacquered(thickness: float, depth: float) -> float:
    """Deviation of the default under lacquer (nm) on a sinusoid of 2.5 µm (depth in µm)."""
    surface, media = Grating("sinusoidal", 2.5, depth), Media("aluminium", (1.5 + 0.02j, thickness))
    cases = [Case(surface, Light(lam, ANGLES[-1]), media) for lam in FEW_WAVELENGTHS]
    solved = [solve_case(case, solver="films") for case in cases]
    return of_colours(compare(Solutions(solved), "small_slope"))
