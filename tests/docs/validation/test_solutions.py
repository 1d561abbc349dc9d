"""The rigorous solutions that are shipped: whole, converged, and the same by two methods."""

from __future__ import annotations

import sys
from importlib.util import find_spec

import numpy as np
import pytest

from docs.make.validation import coupled_wave, solutions, solve
from docs.make.validation.agreement import agreement
from docs.make.validation.cases import (
    FEW_WAVELENGTHS,
    MATERIALS,
    PROFILES,
    Grating,
    Scan,
    index_of,
    scans,
)
from docs.make.validation.solutions import CONVERGED, KEY, ROW, Solutions, load, save_rows, shipped
from docs.make.validation.solve import main, solve_scan
from mitsuba_diffraction.errors import DiffractionError

pytestmark = pytest.mark.thorough

gratinglab = pytest.mark.skipif(
    find_spec("gratinglab") is None, reason="gratinglab is not installed (extra `validation`)"
)
scatmech = pytest.mark.skipif(
    find_spec("pySCATMECH") is None, reason="pySCATMECH is not installed (extra `validation`)"
)


def rows_of(found: Solutions, scan: Scan) -> np.ndarray:
    rows = found.rows
    keep = rows["profile"] == PROFILES.index(scan.grating.profile)
    for name, value in (
        ("period", scan.grating.period),
        ("depth", scan.grating.depth),
        ("theta", scan.theta),
    ):
        keep &= rows[name] == np.float32(value)
    return rows[keep & np.isin(rows["wavelength"], scan.wavelengths)]


@pytest.mark.parametrize("material", MATERIALS)
def test_every_scan_is_there_and_nearly_all_of_it_has_converged(material):
    every = shipped(material)
    for scan in scans(material):
        found = np.unique(rows_of(every, scan)["wavelength"])
        assert tuple(found) == scan.wavelengths
    assert np.median(every.change) < 1e-4
    assert np.mean(every.change > 1e-3) < 0.05
    assert np.mean(every.converged) > 0.99


def test_a_solution_with_one_order_that_has_not_converged_is_left_out_as_a_whole():
    rows = shipped("keratin").rows.copy()
    rows["tm_change"][7] = 2 * CONVERGED
    same = np.all([rows[name] == rows[name][7] for name in KEY], axis=0)
    assert 1 < same.sum() < len(rows)
    changed = Solutions(rows, {})
    assert np.array_equal(~changed.converged, same)
    assert changed.trusted().rows.tobytes() == rows[~same].tobytes()


@pytest.mark.parametrize("material", MATERIALS)
def test_energy_is_conserved(material):
    every = shipped(material).trusted()
    # a theorem, which the meshes meet as well as they converge
    assert every.balance.max() < 2 * CONVERGED
    if material == "perfect":
        rows = every.rows
        _, inverse = np.unique(rows[KEY], return_inverse=True)
        for polarisation in ("te", "tm"):
            total = np.bincount(inverse.ravel(), rows[polarisation])
            assert np.abs(total - 1).max() < 2 * CONVERGED  # no order is missing


def test_two_methods_agree():
    found = agreement()
    assert len(found) >= 10
    for part in found:
        # what is left is within the second method's own change, or the first one's
        assert part.largest < max(2 * part.own_change, 2 * CONVERGED), part.label


def test_aluminium_is_mitsuba_s(some_variant):
    import mitsuba as mi

    for wavelength in FEW_WAVELENGTHS:
        for name, value in (
            ("eta", index_of("aluminium", wavelength).real),
            ("k", index_of("aluminium", wavelength).imag),
        ):
            file = str(mi.file_resolver().resolve(f"data/ior/Al.{name}.spd"))
            nodes, values = np.loadtxt(file).T
            assert np.interp(wavelength, nodes, values) == pytest.approx(value, abs=6e-4)  # rounded


@gratinglab
@pytest.mark.parametrize(
    ("grating", "material", "theta"),
    [
        (Grating("sinusoidal", 2.5, 0.1), "perfect", 30.0),
        (Grating("blazed", 1.1, 0.2), "perfect", -30.0),
        (Grating("lamellar", 1.1, 0.1), "keratin", 30.0),
    ],
)
def test_the_integral_method_gives_the_shipped_solutions_again(grating, material, theta):
    scan = Scan(grating, material, theta, (610.0,))
    again = solve_scan(scan, (100, 140))
    stored = rows_of(shipped(material), scan)
    for polarisation in ("te", "tm"):
        # a coarser mesh: corners are worth up to a few 1e-3 of the light then
        assert again[polarisation] == pytest.approx(stored[polarisation], abs=3e-3)


@scatmech
def test_coupled_waves_give_the_shipped_solutions_again():
    scan = Scan(Grating("blazed", 1.1, 0.4), "keratin", -30.0, (610.0,))
    first, _ = coupled_wave.resolutions(scan)
    again = coupled_wave.solve(scan, first)
    stored = rows_of(shipped("keratin", "coupled_wave"), scan)
    for polarisation in ("te", "tm"):
        # the resolution from which the stored change is counted; that is stored in half floats
        change = np.abs(again.orders[polarisation][0] - stored[polarisation])
        assert change == pytest.approx(stored[f"{polarisation}_change"], rel=2e-3, abs=1e-7)


@gratinglab
def test_what_has_not_converged_is_solved_again_on_a_finer_mesh(monkeypatch):
    # short walls in grazing light, and a strict limit, so that coarse meshes do for the test
    monkeypatch.setattr(solutions, "CONVERGED", 1e-3)
    scan = Scan(Grating("lamellar", 2.5, 0.05), "perfect", 75.0, (410.0, 510.0))
    twice = Solutions(solve_scan(scan, (100, 200)), {})
    assert not twice.converged.any()
    thrice = Solutions(solve_scan(scan, (100, 200, 300)), {})
    expected = solve_scan(scan, (200, 300))
    assert thrice.rows.tobytes() == expected.tobytes()
    # what has converged is left as it is
    easy = Scan(Grating("sinusoidal", 2.5, 0.05), "perfect", 0.0, (610.0,))
    assert solve_scan(easy, (60, 80, 5)).tobytes() == solve_scan(easy, (60, 80)).tobytes()


@gratinglab
def test_the_command_solves_and_saves(tmp_path, monkeypatch, capsys):
    few = [
        Scan(Grating("sinusoidal", 1.1, depth), "perfect", 30.0, (610.0,)) for depth in (0.1, 0.2)
    ]
    monkeypatch.setattr(solve, "scans", lambda material: few)
    assert main(["perfect_integral", "-j", "1", "-o", str(tmp_path)]) == 0
    assert "perfect_integral.npz" in capsys.readouterr().out
    found = load(tmp_path / "perfect_integral.npz")
    assert "gratinglab" in found.about["solver"]
    stored = np.concatenate([rows_of(shipped("perfect"), scan) for scan in few])
    for name in ("order", "te", "tm"):
        # the same mesh; another BLAS rounds otherwise
        assert found.rows[name] == pytest.approx(stored[name], abs=1e-6)


def test_a_solver_that_is_missing_is_named(monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(sys.modules, "gratinglab", None)
    assert main(["perfect_integral", "-o", str(tmp_path)]) == 1
    error = capsys.readouterr().err
    assert "'.[validation]'" in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_what_was_saved_is_loaded(tmp_path):
    rows = np.zeros(3, ROW)
    rows["te"], rows["tm"], rows["te_change"] = 0.5, np.nan, 0.25
    path = tmp_path / "x.npz"
    save_rows(rows, {"solver": "none"}, path)
    loaded = load(path)
    assert loaded.about == {"solver": "none"}
    assert loaded.rows.tobytes() == rows.tobytes()
    assert np.all(loaded.change == 0.25)


@pytest.mark.parametrize("content", [b"", b"not a zip"])
def test_a_file_that_holds_no_solutions_is_refused(tmp_path, content):
    path = tmp_path / "x.npz"
    path.write_bytes(content)
    with pytest.raises(DiffractionError, match="cannot read solutions"):
        load(path)


def test_what_does_not_exist_is_refused_in_one_line():
    for call, text in (
        (lambda: shipped("gold"), "material 'gold' is unknown"),
        (lambda: scans("gold"), "material 'gold' is unknown"),
        (lambda: Grating("wavy", 1.0, 0.1).heights(), "profile 'wavy' is unknown"),
    ):
        with pytest.raises(DiffractionError, match=text) as error:
            call()
        assert "\n" not in str(error.value)
