"""What the room of orders refuses, in one line that says what is wrong. A refusal is one row."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import HeightField
from mitsuba_diffraction.heights import Source
from mitsuba_diffraction.orders import Band, CellResponse, OrderTable
from mitsuba_diffraction.orders.listed import Lights, listed_response
from mitsuba_diffraction.orders.listing import list_orders
from mitsuba_diffraction.orders.solve.films import structure_of
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.jobs import Jobs, problem_of
from mitsuba_diffraction.orders.solve.orders import solve_orders
from mitsuba_diffraction.orders.solve.profiles import (
    Profile,
    lamellar,
    polygon,
    read_profile,
    sinusoidal,
)
from mitsuba_diffraction.orders.solve.resolution import places_to_test, resolved
from mitsuba_diffraction.orders.solve.settings import Settings
from mitsuba_diffraction.orders.solve.stations import Grating
from tests.orders.kinds import BLOCK, KINDS
from tests.support.orders import load, shallow_grating, thin_grating
from tests.support.refusals import file, refused

RANGE = (400.0, 700.0)
PROFILE, WALLS, WIDE = sinusoidal(0.5, 0.05), lamellar(0.8, 0.1, 0.3), sinusoidal(8.0, 0.06)
LOOP = np.array([[0, 0.8, 0.5, 0.5], [0, 0.5, -0.5, 1.0]])
SPIKE = np.array([[0, 0.4, 0.4, 0.4, 0.9], [0, 0, 0.1, 0, 0]])
COARSE = Settings(wavelengths=(550.0, 550.0), resolution=12)
MANY, FILM = np.arange(80), [("1.46", 0.08)]
MIRROR, SMALL = OrderTable.mirror(0.5), thin_grating(0.8, counts=(2, 2, 1), wavelengths=(500, 640))
GRATING = shallow_grating(0.9 + 6.0j, 0.1)
CATALOGUE = "NM F2 2 0 1.62 0\nCD 1 0.01\nLD 0.3 2\nNM N-BK7 {} 0 1.5 0\nCD 1 0.01\nLD 0.3 2\n"
YAML = "DATA:\n  - type: {}\n    data: |\n        0.5 0.9 1.8\n        2.0 0.5 12\n"


def flat(pixel_size: float) -> HeightField:
    """A flat cell of a crossed grating."""
    return HeightField(np.zeros((4, 4)), pixel_size)


def index_of(name: str, text: str, glass: str = "") -> Any:
    return material_of(f"{file(name, text)}{glass}", RANGE)


def profile_of(points: str) -> Profile:
    return read_profile(file("groove.csv", points), 1.6)


def surface(profile: Profile, material: str = "1.46", above: float = 1.0, **media: Any) -> Grating:
    """A grating with films and layers; media are arguments of `structure_of`."""
    substance = material_of(material, RANGE)
    structure = structure_of(profile, substance, RANGE, **media)
    return Grating(profile, substance, above, RANGE, structure=structure)


def without_light(**media: Any) -> object:
    """A grating of the medium above it reflects nothing, of which no error is a share."""
    problem = problem_of(surface(lamellar(0.5, 0.1), "1.2", 1.2, **media), "coupled", 8)
    return resolved(problem, Jobs(), places_to_test(range(2)), 0.01)


def with_band(table: OrderTable, number: int, change: Callable[[Any], Any]) -> OrderTable:
    """A table with other values in one of its bands."""
    bands = list(table.bands)
    bands[number] = Band(bands[number].k, change(bands[number].a), bands[number].b)
    return replace(table, response=CellResponse(tuple(bands)))


def one_light(periods: tuple[float, float], value: float, **options: Any) -> OrderTable:
    """A crossed grating's table of one light with orders (0, 0) and (1, 0)."""
    at = np.array([500.0]), np.zeros(1), np.zeros(1), np.array([[0, 0], [1, 0]])
    lights = Lights(*at, np.full((1, 1, 1, 1, 1, 2, 1), value), crossed=True)
    response = listed_response(lights, periods, 1.0)
    return OrderTable(periods, (500.0, 500.0), response, **options)


def saved(table: Any, name: str) -> str:
    table.save(name)
    return name


RECIPE = (
    'method = "solved"\nprofile = "lamellar"\noutput = "a.nc"\n[arguments]\nperiod = 1\ndepth = 0.1'
)

#: What is asked for, and words of the line.
REFUSED: list[tuple[Callable[[], object], str]] = [
    # profiles
    (lambda: lamellar(1.0, -1.0), "depth"),
    (lambda: lamellar(1.0, 0.1, 1.5), "duty"),
    (lambda: Profile(np.array([0, 2.0]), np.zeros(2), 1.0), "one period"),
    (lambda: Profile(np.array([0, np.nan]), np.zeros(2), 1.0), "finite"),
    (lambda: Profile(LOOP[0], LOOP[1], 1.0), "cross"),
    (lambda: polygon([(0, 0), (0.5, 0.1), (0.9, 0.3), (1.45, 0.02), (0.9, 0)], 1.0), "crosses its"),
    (lambda: Profile(SPIKE[0], SPIKE[1], 1.0), "turns back"),
    (lambda: profile_of("0,1\n800,1\n800,0\n"), "one period is 0 to 1.6 µm"),
    (lambda: profile_of("0,1\n0.3,1\n0.4,0\n"), "covers 0.4 µm of a period"),
    (lambda: profile_of("0,0\n0.2,0.1\n0.6,0.1\n0.8,0\n"), "covers 0.8 µm of a period"),
    (lambda: profile_of("".join(f"{0.01 * n},0\n" for n in range(150))), "covers 1.49 µm"),
    (lambda: profile_of("x,z\n0,1\n0.3\n"), "line 3"),
    (lambda: profile_of("0,1,2\n"), "line 1"),
    (lambda: profile_of("0,nan\n1,0\n"), "line 1"),
    (lambda: profile_of("# nothing\n"), "no points"),
    (lambda: profile_of("wavelength_nm,theta_deg,order,R_s,R_p\n500,0,0,1,1\n"), "read_orders"),
    # materials
    (lambda: solve_orders(PROFILE, "Unobtainium"), "is unknown"),
    (lambda: solve_orders(PROFILE, "-1"), "index"),
    (lambda: index_of("a.agf", CATALOGUE.format(2), ":SF6"), "one of 2 glasses: F2, N-BK7"),
    (lambda: index_of("a.agf", CATALOGUE.format(2)), "catalogue:glass"),
    (lambda: index_of("a.agf", CATALOGUE.format(9), ":N-BK7"), "formula 9"),
    (lambda: index_of("a.yml", YAML.format("formula 9")), "formula 9"),
    (lambda: index_of("a.yml", YAML.format("tabulated nk")), "500 to 2000 nm"),
    (lambda: index_of("a.csv", "wl,k\n0.3,1\n0.9,2\n"), "no column or formula of n"),
    (lambda: index_of("a.csv", "wl,n,k\n0.3,1,-1\n0.9,2,-1\n"), "k at least 0"),
    # settings of a solution, and listed light
    (lambda: solve_orders(PROFILE, "Al", settings=Settings((50.0, 700.0))), "nm"),
    (lambda: Settings(tolerance=2.0), "tolerance"),
    (lambda: solve_orders(PROFILE, settings=Settings(method="guess")), "unknown"),
    (lambda: solve_orders(lamellar(1.0, 90.0)), "lengths are in µm"),
    (lambda: solve_orders(lamellar(900.0, 0.1)), "directions of light alone"),
    (lambda: md.solve_orders("cd.toml"), "expected a profile"),
    (lambda: solve_orders(PROFILE, "Al", theta=95.0), "theta 95 must be"),
    (lambda: solve_orders(PROFILE, "Al", theta=MANY, phi=MANY, step=0.1), "fewer directions"),
    (lambda: solve_orders(WIDE, "Al", theta=0.0, settings=COARSE), "resolution of at least 14"),
    (lambda: solve_orders(WIDE, 1.5, theta=0.0, settings=COARSE), "resolution of at least 14"),
    # thin sheets and blocks
    *(
        (lambda index=index, side=side: solve_orders(WALLS, index, **{side: True}), "clear")
        for index in ("Al", "1.5+0.1i") for side in ("thin", "block")
    ),
    (lambda: solve_orders(WALLS, "1.005", thin=True), "1.01"),
    (lambda: solve_orders(WALLS, "1.5", thin=True, superstrate=1.3), "both sides"),
    (lambda: solve_orders(WALLS, "6", block=True), "1.01 to 5"),
    (lambda: solve_orders(WALLS, 1.5, settings=Settings(method="integral"), block=True), "coupled"),
    (lambda: solve_orders(WALLS, "1.5", settings=Settings(polarised=True), block=True), "alone"),
    # crossed gratings
    (lambda: md.solve_orders(flat(2.0)), "4 times the shortest wavelength"),
    (lambda: md.solve_orders(HeightField(20.0 * np.eye(4), 0.1), 1.5), "heights.* are 20 µm"),
    (lambda: md.solve_orders(flat(0.1), "none"), "perfect conductors"),
    (lambda: md.solve_orders(flat(0.1), "glas"), "material"),
    (lambda: md.solve_orders(flat(0.1), 1.5, thin=True), "leave out"),
    # films and layers
    *(
        (lambda media=media: surface(lamellar(0.5, 0.1), **media), words)
        for media, words in (
            ({"beneath": [("1.46", 0.0)]}, "beneath 1: thickness"),
            ({"beneath": [(0.1, ("1.5", 0.3, 0.2))]}, "must end after its beginning"),
            ({"beneath": [(0.1, ("1.5", 0.0, 0.3), ("2", 0.2, 0.4))]}, "before the next part"),
            ({"beneath": [(0.1, ("1.5", 0.3, 0.7), ("2", 0.1, 0.2))]}, "before the next part"),
            ({"beneath": [(0.1, "SiO2", 0.2)]}, "parts are a material"),
            ({"beneath": [("Alu", 0.2)]}, "did you mean Al"),
            ({"layers": [(0.1, ("1.5", 0.3, 0.7))]}, "slices lie beneath a profile"),
            ({"substrate": "none"}, "substrate: .*perfect conductor"),
            ({"layers": [("1.46", 0.0)]}, "layer 1: thickness"),
            ({"layers": [("1.4", 0.1), ("Unobtainium", 1)]}, "is unknown"),
            ({"layers": [("none", 0.1)]}, "layer 1: .*perfect conductor"),
            ({"layers": FILM, "material": "none"}, "not thin sheets or perfect"),
        )
    ),
    (lambda: problem_of(surface(PROFILE, layers=FILM), "integral", 20), "method=coupled"),
    (without_light, "reflects no light"),
    (lambda: without_light(beneath=[("1.2", 0.1)]), "reflects no light"),
    # tables and their files
    (lambda: with_band(MIRROR, 2, lambda a: a * 1.5), "band 2"),
    (lambda: with_band(MIRROR, 2, lambda a: a - 0.1), "band 2"),
    (lambda: with_band(MIRROR, 2, lambda a: np.where(a > 0.5, np.nan, a).astype("f4")), "band 2"),
    (lambda: with_band(MIRROR, 2, lambda a: a[:, :, :, :-1]), "band 2"),
    (lambda: with_band(MIRROR, 2, lambda a: a.astype(np.float64)), "band 2"),
    (lambda: with_band(GRATING, 0, lambda a: a * np.append(np.ones(15), 99.0)), "band [01]"),
    (lambda: with_band(GRATING, 0, lambda a: a[..., :3]), "band [01]"),
    (lambda: with_band(GRATING, 0, lambda a: a[..., :7]), "band [01]"),
    (lambda: replace(MIRROR, response=CellResponse(MIRROR.bands[:-1])), "expected 3"),
    (lambda: OrderTable.mirror(np.nan), "period"),
    (lambda: OrderTable.mirror(500.0), "period"),
    (lambda: OrderTable.mirror(0.5, wavelengths=(700.0, 400.0)), "nm"),
    (lambda: one_light((0.4, 2000.0), 0.1), "period=2000"),
    (lambda: one_light((0.4, float("nan")), 0.1), "must be"),
    (lambda: one_light((0.4, 0.4), 0.6), "sum to 1.2"),
    (lambda: one_light((0.4, 0.4), -0.1), "at least 0"),
    (lambda: one_light((0.4, 0.4), 0.1, superstrate=1.5), "in air"),
    *(
        (lambda change=change: replace(BLOCK, **change), "block=")
        for change in ({"superstrate": 1.2}, {"thin": True}, {"block": 1.001}, {"block": 7.0})
    ),
    (lambda: replace(OrderTable.mirror(0.5, superstrate=1.5), thin=True), "both sides"),
    (lambda: Source.of(file("groove.toml", RECIPE)), "the command 'solve groove.toml'"),
    (lambda: OrderTable.load(file("groove.toml", RECIPE)), "the command 'solve groove.toml'"),
    (lambda: OrderTable.load(saved(md.DiffractionTable.build(
        HeightField(np.eye(8), 0.2), coherence_width=1.6, tolerance=0.5), "a.exr")),
     "BSDF 'diffraction'"),
    (lambda: md.DiffractionTable.load(saved(MIRROR, "mirror.nc")), "mirror"),
    (lambda: OrderTable.load(file("other.nc", b"CDF\x01" + bytes(40))), "read_orders"),
    # what tables are asked for
    (lambda: MIRROR.mueller(0.0, 0.0, 550.0, 0), "polarised=True"),
    (lambda: MIRROR.efficiency(0.0, 0.0, 500.0, 0, transmitted=True), "thin"),
    (lambda: BLOCK.polarised_efficiency(0.1, 0.0, 550.0, 0), "unpolarised"),
    (lambda: BLOCK.groove_efficiency(0.1, 0.0, 550.0, 0), "unpolarised"),
    (lambda: list_orders(SMALL, 450.0, 0.0, 0.0), "the table has 500 to 640 nm"),
    (lambda: list_orders(SMALL, 550.0, 95.0, 0.0), "theta 95 must be"),
    (lambda: list_orders(SMALL, 550.0, 0.0, np.nan), "phi nan must be"),
    (lambda: list_orders(SMALL, np.linspace(500, 640, 3000), MANY, MANY), "lines"),
    (lambda: list_orders(SMALL, 550.0, 30.0, 45.0, polarised=True), "polarised=True"),
    (lambda: list_orders(SMALL, 550.0, 0.0, jones=True), "polarised"),
    # surfaces of a scene
    *(
        (lambda kind=kind, given=given: load(KINDS[kind](), **given), words)
        for kind, given, words in (
            ("grooves", {"coherence_width": 2.0}, "periods"),
            ("grooves", {"orientations": 1.0}, "orientation"),
            ("grooves", {"coat_ior": 1.5}, "is a parameter of the plugin 'diffraction'"),
            ("sheet", {"beneath": {"type": "diffuse"}}, "thin sheet"),
            ("block", {"beneath": {"type": "diffuse"}}, "block, beneath"),
            ("crossed", {"film_ior": 1.3}, "film_ior"),
            ("crossed", {"height_scale": 1.3}, "height_scale"),
            ("crossed", {"lateral_scale": 1.3}, "lateral_scale"),
        )
    ),
    (lambda: mi.load_dict({"type": "diffraction_orders", "filename": "none.nc"}), "does not exist"),
]  # fmt: skip


@pytest.mark.parametrize(("ask", "words"), REFUSED, ids=[words for _, words in REFUSED])
def test_what_does_not_fit_is_refused(some_variant, tmp_path, monkeypatch, ask, words):
    monkeypatch.chdir(tmp_path)
    refused(ask, words)
