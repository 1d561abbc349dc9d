"""Columns of numbers in texts of all kinds come back; what is open is named."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from mitsuba_diffraction.columns import read_columns, save_rows
from mitsuba_diffraction.errors import DiffractionError, DiffractionWarning
from mitsuba_diffraction.text_spectra import choice_of, read_shares, read_spectra
from tests.support.refusals import refused

LAM, SHARE = np.arange(300.0, 701.0, 10.0), 0.1 + 0.5 * np.linspace(0, 1, 41) ** 2
NEEDED = (400.0, 700.0)


def lines(*columns, separator=",", decimal=".", factor=1.0, wavelength=1.0):
    rows = zip(LAM * wavelength, *(factor * c for c in columns or (SHARE,)), strict=True)
    texts = ([f"{value:.9g}".replace(".", decimal) for value in row] for row in rows)
    return "".join(separator.join(row) + "\n" for row in texts)


OCEAN = "Data from a.txt Node\n\nDate: Mon Jan 01 10:00:00 CET 2024\nPixels in Spectrum: 41\n"
AVANTES = "0804016U1\nIntegration time: 100.00 ms\nAverage: 20 scans\n"
RAW = [1000 * SHARE, 0 * SHARE, 1000 + 0 * SHARE]


@pytest.mark.parametrize(
    ("name", "text", "encoding"),
    [
        ("a.csv", "nm,r\n" + lines(), "utf-8"),
        ("a.csv", "nm,r\n" + lines(), "utf-16"),
        ("a.csv", "# Größe µm\nnm,r\n" + lines(), "latin-1"),
        ("a.csv", "wl;r\n" + lines(separator=";", decimal=","), "utf-8-sig"),
        ("a.csv", 'wl,r\n"300,0","0,1"\n"500,0","0,225"\n"700,0","0,6"\n', "utf-8"),
        ("a.txt", lines(separator="  ", decimal=","), "utf-8"),
        ("a.csv", "wl,specimen (%)\n" + lines(factor=100), "utf-8"),
        ("a.csv", "wl,percent_reflectance\n" + lines(factor=100), "utf-8"),
        ("a.csv", "Wavelength [µm],r\n" + lines(wavelength=1e-3), "utf-8"),
        ("a.csv", "wavelength_um,r\n" + lines(wavelength=1e-3), "utf-8"),
        ("a.csv", "Wavelength (Å),r\n" + lines(wavelength=10), "utf-8"),
        ("a.csv", "wl,r\n" + "".join(reversed(lines().splitlines(keepends=True))), "utf-8"),
        ("a.csv", '"","wl","r"\n"1",300,0.1\n"2",500,0.225\n"3",700,0.6\n', "utf-8"),
        ("a.txt", "wl r\n1 300 0.1\n2 500 0.225\n3 700 0.6\n", "utf-8"),
        ("a.csv", "wl,r,sex\n300,0.1,f\n500,0.225,f\n700,0.6,m\n", "utf-8"),
        ("a.ttt", AVANTES + "Wave   ;Sample  ;Dark ;Reference;Reflectance\n"
         "[nm]   ;[counts] ;[counts] ;[counts] ;[%]\n\n"
         + lines(*RAW, 100 * SHARE, separator=";"), "latin-1"),
        ("a.ttt", AVANTES + "Wave   ;Transmittance\n[nm]   ;[% transmittance]\n"
         + lines(factor=100, separator=";", decimal=","), "latin-1"),
        ("a.SSM", '"File: A.SSM   11-23-20","Smp 1"\n' + lines(separator="  "), "utf-8"),
    ],
)  # fmt: skip
def test_shares_come_back_without_a_guess(tmp_path, name, text, encoding):
    if "sex" in text:
        name += ":r"
    file = tmp_path / name.partition(":")[0]
    file.write_text(text, encoding=encoding)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        lam, value = read_shares(str(tmp_path / name), NEEDED)
    np.testing.assert_allclose(lam[[0, -1]], [300, 700], rtol=1e-12)
    # 9 digits are written; sparse files have three wavelengths
    np.testing.assert_allclose(np.interp([300, 500, 700], lam, value), [0.1, 0.225, 0.6], rtol=1e-8)


@pytest.mark.parametrize(
    ("text", "guess"),
    [
        ("wl,r\n" + lines(factor=100), "read as per cent"),
        ("um,r\n" + lines(), "read as nm"),
        ("nm,r\n" + lines(wavelength=1e-3), "read as µm"),
        (OCEAN + ">>>>>Begin Spectral Data<<<<<\n" + lines(factor=100, separator="\t")
         + ">>>>>End Spectral Data<<<<<\n", "read as per cent"),
        ("Jaz Data File\n>>>>>Begin Processed Spectral Data<<<<<\nW\tD\tR\tS\tP\n"
         + lines(*RAW, 100 * SHARE, separator="\t") + ">>>>>End Processed Spectral Data<<<<<\n",
         "read as per cent"),
        ("wl,r\n250,\n" + lines(), "line 2"),
        ("wl,r\n250,-51\n" + lines(), "left out"),
        ("wl,r\n290,-0.01\n" + lines(), "read as 0"),
    ],
)  # fmt: skip
def test_a_guess_is_said_aloud(tmp_path, text, guess):
    (tmp_path / "a.csv").write_text(text)
    with pytest.warns(DiffractionWarning, match=guess):
        lam, value = read_shares(str(tmp_path / "a.csv"), NEEDED)
    np.testing.assert_allclose(np.interp([300, 500, 700], lam, value), [0.1, 0.225, 0.6], rtol=1e-8)


@pytest.mark.parametrize(
    ("text", "choice", "named"),
    [
        ("wl,r\n" + lines(factor=2), "", "a.csv:fraction or .*percent"),
        ("wl,r\n" + lines(factor=2), ":fraction", "white standard"),
        ("wl,male,female\n" + lines(SHARE, SHARE), "", "male, female"),
        ("wl,male,female\n" + lines(SHARE, SHARE), ":mail", "male, female"),
        ("wl,r\n300,0.1\n500,x\n", "", "line 3: 'x'"),
        ("wl,r\n300,0.1\n500\n", "", "line 3"),
        ("wl,r\n3e7,0.1\n5e7,0.1\n", "", "expected nm"),
        ("wl,r\n300,0.1\n300,0.2\n", "", "each once"),
        ("wl,r\n", "", "is not a spectrum"),
    ],
)
def test_what_is_open_or_wrong_is_one_line(tmp_path, text, choice, named):
    (tmp_path / "a.csv").write_text(text)
    refused(lambda: read_shares(str(tmp_path / "a.csv") + choice, NEEDED), named)


def test_a_column_and_a_unit_are_chosen_by_name(tmp_path):
    (tmp_path / "a.csv").write_text("wl,male,female\n" + lines(SHARE, 30 * SHARE))
    for ending, factor in (("male", 1.0), ("female:percent", 0.3), ("male:percent", 0.01)):
        _, value = read_shares(f"{tmp_path / 'a.csv'}:{ending}", NEEDED)
        np.testing.assert_allclose(value, factor * SHARE, rtol=1e-8)
    assert choice_of("sienna") == ("sienna", "", "")
    assert choice_of("C:/x/a.csv:b c:%") == ("C:/x/a.csv", "b c", "%")


def test_all_columns_of_receptors_have_names_and_no_gaps(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text('"","wl","u.v","s"\n"1",300,1,2\n"2",700,3,4\n')
    _, table = read_spectra(file, "receptors", every=True)
    assert table.names == ("u.v", "s")
    assert table.numbers.tolist() == [[1, 2], [3, 4]]
    file.write_text("wl,a\n300,1\n400,\n700,3\n")
    with pytest.raises(DiffractionError, match="line 3"):
        read_spectra(file, "receptors", every=True)


def test_bytes_are_no_text(tmp_path):
    file = tmp_path / "a.csv"
    file.write_bytes(np.random.default_rng(0).bytes(4000))
    with pytest.raises(DiffractionError, match="export it as text"):
        read_columns(file)


def test_names_of_columns_may_hold_the_separator(tmp_path):
    save_rows(tmp_path / "a.csv", ["wl", "back, male"], np.array([[500.0, 0.25], [510.0, 0.5]]))
    read = read_columns(tmp_path / "a.csv")
    assert read.names == ("wl", "back, male")
    assert np.array_equal(read.numbers, [[500.0, 0.25], [510.0, 0.5]])
