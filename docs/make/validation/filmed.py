"""Gratings under a film that follows their heights, solved by Chandezon's method.

The lower face is the upper one displaced by the film's thickness along the vertical.
"""

from __future__ import annotations

from mitsuba_diffraction.orders import solve as solvers

from .cases import Case, Grating, Media
from .light import profile_of, solved_by
from .solutions import Orders

#: Films on materials, by name.
FILMS = {
    "wax on keratin": Media("keratin", (1.44, 150.0)),
    "titania on keratin": Media("keratin", (2.4, 100.0)),
    "oxide on silicon": Media("silicon", (1.46, 300.0)),
    "oxide on aluminium": Media("aluminium", (1.77, 250.0)),
    "lacquer on aluminium": Media("aluminium", (1.5 + 0.02j, 700.0)),
}
#: Steepest slopes of 0.03, 0.06, 0.1 and 0.1: of two, narrow and wide.
GRATINGS = tuple(
    Grating("sinusoidal", *lengths)
    for lengths in ((2.5, 0.025), (2.5, 0.05), (2.5, 0.08), (1.1, 0.035))
)
#: Thicknesses of lacquer, nm, and depths of a sinusoid of 2.5 µm, µm, beyond those that are stored.
BEYOND = ((700.0, 0.12), (1400.0, 0.05), (1400.0, 0.08))


def name() -> str:
    """Name of the solver."""
    return "Chandezon's method with films (mitsuba_diffraction.orders.solve)"


def file_of(film: str) -> str:
    """Name of the file of a film's solutions, without its suffix."""
    return f"film_{film.replace(' ', '_')}"


def resolutions(case: Case) -> tuple[int, int]:
    """Harmonics on either side: first and finally."""
    return 12, 16


def solve(case: Case, harmonics: int) -> Orders:
    """Efficiencies of every order of a grating in light across the grooves."""
    assert isinstance(case.surface, Grating)
    assert case.media.film is not None
    index, thickness = case.media.film
    alone = case.light.wavelength, case.light.wavelength
    film = solvers.films.ProfileFilm(solvers.material_of(index, alone), 1e-3 * thickness)
    structure = solvers.films.Structure((film,))
    return solved_by(solvers.Chandezon(profile_of(case.surface), harmonics, structure), case)
