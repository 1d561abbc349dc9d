"""The rigorous solutions that are stored: whole, converged, and the same by two methods."""

from __future__ import annotations

import sys
from importlib.util import find_spec

import numpy as np
import pytest

from docs.make.validation import coated, filmed, solve
from docs.make.validation.agreement import on_cells, on_gratings
from docs.make.validation.cases import (
    MATERIALS,
    Case,
    Grating,
    Light,
    Media,
    grating_cases,
)
from docs.make.validation.patches import CELLS
from docs.make.validation.solutions import (
    CONVERGED,
    DATA,
    Solved,
    load,
    shipped,
)
from docs.make.validation.solve import main, solve_case
from mitsuba_diffraction.errors import DiffractionError
from tests.support.refusals import refused

pytestmark = pytest.mark.thorough

gratinglab = pytest.mark.skipif(
    find_spec("gratinglab") is None, reason="gratinglab is not installed (extra `validation`)"
)
KERATIN, PERFECT = Media("keratin"), Media("perfect")


def needs(*modules: str):
    missing = [name for name in modules if find_spec(name) is None]
    return pytest.mark.skipif(bool(missing), reason=f"packages that are missing: {missing}")


def kept(file: str, case: Case) -> Solved:
    found = load(DATA / f"{file}.npz", case.media).solved
    return next(solved for solved in found if solved.case == case)


@pytest.mark.parametrize("material", MATERIALS)
def test_every_case_is_there_and_nearly_all_of_them_have_converged(material):
    every = shipped(material)
    assert {solved.case for solved in every.solved} == set(grating_cases(material))
    change = every.column("change").max(axis=1)
    assert np.median(change) < 1e-4
    assert np.mean(change > 1e-3) < 0.05
    assert len(every.trusted().column("order")) > 0.99 * len(change)


@pytest.mark.parametrize("material", MATERIALS)
def test_energy_is_conserved(material):
    every = shipped(material).trusted()
    # a theorem, which the meshes meet as well as they converge
    assert np.nanmax(np.abs(every.column("balance"))) < 2 * CONVERGED
    if material == "perfect":
        total = np.array([solved.powers.sum(axis=0) for solved in every.solved])
        assert np.abs(total - 1).max() < 2 * CONVERGED  # no order is missing


def test_two_methods_agree():
    on_lines = on_gratings()
    assert len(on_lines) >= 10
    for part in on_lines:
        # what is left is within the second method's own change, or the first one's
        assert part.largest < max(2 * part.own_change, 2 * CONVERGED), part.label
    for part in on_cells():
        assert part.deviation < part.second_change, part.case
        assert part.first_change < 0.005, part.case


FILM = "oxide on aluminium"


@pytest.mark.parametrize(
    ("file", "solver", "case", "resolutions", "tolerance"),
    [
        # coarser meshes: corners are worth up to a few 1e-3 of the light then
        *(
            pytest.param(
                f"{media.material}_integral", "integral",
                Case(grating, Light(610.0, theta), media), (100, 140), 3e-3,
                marks=needs("gratinglab"),
            )
            for grating, media, theta in (
                (Grating("sinusoidal", 2.5, 0.1), PERFECT, 30.0),
                (Grating("blazed", 1.1, 0.2), PERFECT, -30.0),
                (Grating("lamellar", 1.1, 0.1), KERATIN, 30.0),
            )
        ),
        pytest.param(
            "keratin_patches_coupled_wave", "patches_coupled_wave",
            Case(CELLS["sinusoid 2.5/0.05 µm"], Light(550.0, 60.0, 45.0), KERATIN), None, 1e-5,
            marks=needs("grcwa"),
        ),
        (
            filmed.file_of(FILM), "films",
            Case(filmed.GRATINGS[3], Light(460.0, 60.0), filmed.FILMS[FILM]), None, 1e-7,
        ),
        *(
            (file, "coated", Case(coated.GRATINGS[2], Light(610.0, 30.0), media), None, 1e-6)
            for file, media in coated.COATS.items()
        ),
    ],
)  # fmt: skip
def test_a_solver_gives_what_is_stored_again(file, solver, case, resolutions, tolerance):
    again, stored = solve_case(case, resolutions, solver=solver), kept(file, case)
    assert np.array_equal(again.order, stored.order)
    assert again.powers == pytest.approx(stored.powers, abs=tolerance)
    if solver.startswith("patches"):
        assert again.jones == pytest.approx(stored.jones, abs=tolerance)


@gratinglab
def test_the_command_solves_and_saves(tmp_path, monkeypatch, capsys):
    few = [
        Case(Grating("sinusoidal", 1.1, depth), Light(610.0, 30.0), PERFECT) for depth in (0.1, 0.2)
    ]
    monkeypatch.setattr(solve, "grating_cases", lambda material: few)
    assert main(["perfect_integral", "-j", "1", "-o", str(tmp_path)]) == 0
    assert "perfect_integral.npz" in capsys.readouterr().out
    found = load(tmp_path / "perfect_integral.npz", PERFECT)
    assert "gratinglab" in found.about["solver"]
    for solved, case in zip(found.solved, few, strict=True):
        # the same mesh; another BLAS rounds otherwise
        assert solved.powers == pytest.approx(kept("perfect_integral", case).powers, abs=1e-6)


def test_a_solver_that_is_missing_is_named(monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(sys.modules, "gratinglab", None)
    assert main(["perfect_integral", "-o", str(tmp_path)]) == 1
    error = capsys.readouterr().err
    assert "'.[validation]'" in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", [b"", b"not a zip"])
def test_a_file_that_holds_no_solutions_is_refused(tmp_path, content):
    path = tmp_path / "x.npz"
    path.write_bytes(content)
    with pytest.raises(DiffractionError, match="cannot read solutions"):
        load(path, KERATIN)


def test_what_does_not_exist_is_refused_in_one_line():
    for call, text in (
        (lambda: shipped("gold"), "material 'gold' is unknown"),
        (lambda: grating_cases("gold"), "material 'gold' is unknown"),
        (lambda: Grating("wavy", 1.0, 0.1).heights(), "profile 'wavy' is unknown"),
    ):
        refused(call, text)
