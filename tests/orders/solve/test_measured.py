"""Tables of imported efficiencies: CSV and NetCDF, units and conventions, damage."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import netcdf_file

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError, DiffractionWarning
from mitsuba_diffraction.orders.listing import list_orders
from tests.support.orders import thin_grating
from tests.support.refusals import refused

HEADER = "wavelength_nm,theta_deg,phi_deg,order,R_s,R_p\n"
PERIOD = 0.8
UNITS = {"wavelength": "nm", "theta": "degrees", "phi": "degrees"}
AXES = {
    "wavelength": np.arange(500.0, 641.0, 35),
    "theta": np.arange(0.0, 86, 5),
    "phi": np.arange(0.0, 181, 15),
    "order": np.arange(-3, 4),
}


@pytest.fixture(scope="module")
def truth():
    return thin_grating(PERIOD, counts=(8, 8, 4), wavelengths=(500.0, 640.0))


@pytest.fixture(scope="module")
def power(truth):
    """(wavelength, θ, φ, order) unpolarised efficiencies; NaN where an order does not propagate."""
    lam, theta, phi, order = np.meshgrid(*AXES.values(), indexing="ij")
    sine = np.sin(np.radians(theta))
    x, y = -sine * np.cos(np.radians(phi)), sine * np.sin(np.radians(phi))
    inside = np.abs(x + order * lam / (1e3 * PERIOD)) < np.sqrt(1 - y * y)
    return np.where(inside, truth.efficiency(x, y, lam, order), np.nan)


@pytest.fixture(scope="module")
def lines(truth, tmp_path_factory):
    """Lines of a CSV without the first."""
    file = tmp_path_factory.mktemp("list") / "list.csv"
    list_orders(truth, *list(AXES.values())[:3]).save(file)
    return file.read_text().splitlines(keepends=True)[1:]


def imported(path, period=PERIOD, **more):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DiffractionWarning)
        return md.read_orders(path, period, **more)


@pytest.fixture(scope="module")
def table(lines, tmp_path_factory):
    """The table of the CSV."""
    file = tmp_path_factory.mktemp("csv") / "bench.csv"
    file.write_text(HEADER + "".join(lines))
    return md.read_orders(file, PERIOD)  # without a warning


def write_classic(path, axes, variables, units):
    """A classic NetCDF file of variables {name: (dimensions, array)}."""
    with netcdf_file(path, "w") as file:
        for name, length in zip(*next((d, v.shape) for d, v in variables.values()), strict=True):
            file.createDimension(name, length)
        for name, values in axes.items():
            file.createVariable(name, "d", (name,))[:] = values
            if units.get(name):
                file.variables[name].units = units[name]
        for name, (dimensions, values) in variables.items():
            file.createVariable(name, "d", dimensions)[:] = values


def write_hdf5(path, axes, variables, units):
    """The same as NetCDF 4."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        for name, values in axes.items():
            file[name] = values
            file[name].make_scale(name)
            if units.get(name):
                file[name].attrs["units"] = units[name]
        for name, (dimensions, values) in variables.items():
            file[name] = values
            for n, dimension in enumerate(dimensions):
                file[name].dims[n].attach_scale(file[dimension])


def content(power, dimensions=tuple(AXES)):
    """Variables of a file with its dimensions in some order."""
    places = [list(AXES).index(name) for name in dimensions]
    return {name: (dimensions, power.transpose(places)) for name in ("R_s", "R_p")}


@pytest.mark.parametrize("write", [write_classic, write_hdf5])
@settings(max_examples=3, deadline=None)
@given(
    dimensions=st.permutations(list(AXES)),
    length=st.sampled_from([("nm", 1), ("um", 1e-3), ("m", 1e-9)]),
    angle=st.sampled_from([("degrees", 1), ("radian", np.pi / 180)]), backwards=st.booleans(),
)  # fmt: skip
def test_netcdf_has_what_csv_has(power, table, write, dimensions, length, angle, backwards):
    factors = {"wavelength": length[1], "theta": angle[1], "phi": angle[1]}
    axes = {name: values * factors.get(name, 1) for name, values in AXES.items()}
    if backwards:
        axes, power = {**axes, "theta": axes["theta"][::-1]}, power[:, ::-1]
    units = {"wavelength": length[0], "theta": angle[0], "phi": angle[0]}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "mine.nc")
        write(path, axes, content(power, tuple(dimensions)), units)
        other = md.read_orders(path, PERIOD)
    # single precision
    assert np.abs(other.response.values - table.response.values).max() < 1e-5


def test_other_conventions_are_noticed(power, tmp_path):
    path = tmp_path / "mine.nc"
    write_classic(path, {**AXES, "order": -AXES["order"]}, content(power), UNITS)
    with pytest.raises(DiffractionError, match="signs of the orders"):
        md.read_orders(path, PERIOD)
    # without the ratio of cosines that makes a power of a squared amplitude
    cosine = np.cos(np.radians(AXES["theta"]))[:, None, None]
    write_classic(path, AXES, content(power * cosine), UNITS)
    with pytest.warns(DiffractionWarning, match="ratio of cosines"):
        md.read_orders(path, PERIOD)


def test_transmitted_light_makes_a_sheet(power, tmp_path):
    path = tmp_path / "sheet.nc"
    variables = content(0.2 * power) | {name: (tuple(AXES), 0.7 * power) for name in ("T_s", "T_p")}
    write_classic(path, AXES, variables, {})
    sheet = md.read_orders(path, PERIOD)
    assert sheet.thin
    at = (np.array([0.1, -0.4]), np.array([0.2, 0.3]), np.array([530.0, 600.0]), 1)
    above = sheet.efficiency(*at)
    through = sheet.efficiency(*at, transmitted=True)
    np.testing.assert_allclose(through, 3.5 * above, atol=1e-3)
    # the file's own efficiencies are reciprocal within 1 %, so that light from below is the same
    below = sheet.efficiency(*at, from_below=True, transmitted=True)
    np.testing.assert_allclose(below, through, atol=0.02)
    assert sheet.header["reciprocity_error"] < 0.05


@pytest.mark.parametrize(("theta", "phi"), [(0, 0), (20, 0), (-20, 0), (20, 180)])
def test_one_direction_gives_its_efficiencies_to_all(theta, phi, tmp_path):
    """As an efficiency curve over wavelength has them; θ below 0 is light from the other side."""
    x = -np.sin(np.radians(theta)) * np.cos(np.radians(phi))
    curve, rows = {-2: 0.03, -1: 0.2, 0: 0.3, 1: 0.4, 2: 0.04}, []
    for lam in range(520, 641, 20):
        orders = [m for m in curve if abs(x + m * lam / 800) < 1]
        rows += [f"{lam},{theta},{phi},{m},{curve[m]},{curve[m] / 2}\n" for m in orders]
    file = tmp_path / "curve.csv"
    file.write_text(HEADER + "".join(rows))
    with pytest.warns(md.DiffractionWarning, match="no light from some directions"):
        table = md.read_orders(file, 0.8)
    sine = np.linspace(-0.15, 0.15, 7) + x
    for m in (order for order in curve if abs(x + order * 0.58 / 0.8) < 1):
        inside = np.abs(sine + m * 0.58 / 0.8) < 0.99
        s, p = table.polarised_efficiency(sine[inside], 0.0, 580.0, m).T
        # polynomials through values that are constant, stored with 16 bits
        np.testing.assert_allclose(s, curve[m], atol=2e-4)
        np.testing.assert_allclose(p, curve[m] / 2, atol=2e-4)


def edited(lines, *changes):
    """Lines of which some have another number in a column: (line, column, text)."""
    rows = [line.rstrip("\n").split(",") for line in lines]
    for line, column, text in changes:
        rows[line][column] = text
    return [",".join(row) + "\n" for row in rows]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda lines: lines[:40] + lines[60:], "has a hole: no line for"),
        (lambda lines: lines[1:], "order -?1 propagates"),
        (lambda lines: [*lines, "640,85.0,180.0,3,0.1,0.1\n"], "does not propagate"),
        (lambda lines: [lines[0], *lines], "twice"),
        (lambda lines: edited(lines, (5, 4, "1.5")), "0 to 1"),
        (lambda lines: edited(lines, (5, 5, "-0.2")), "0 to 1"),
        (lambda lines: edited(lines, (5, 4, "0.9"), (6, 4, "0.9")), "orders sum to 1"),
        (lambda lines: edited(lines, (5, 4, "inf")), "expected numbers"),
        (lambda lines: edited(lines, (5, 0, "0.5")), "unit"),
        (lambda lines: edited(lines, (5, 1, "95")), "theta"),
        (lambda lines: edited(lines, (5, 3, "0.5")), "order"),
        (lambda lines: edited(lines, (5, 3, "1e9")), "order"),
        (lambda lines: [*lines, "red\n"], "where the first row has 6"),
        (lambda lines: [*lines, "500,1\n"], "where the first row has 6"),
        (lambda lines: [], "no lines"),
        (lambda lines: [HEADER.replace("phi_deg", "R_s"), *lines], "several columns R_s"),
    ],
)
def test_a_wrong_file_of_efficiencies_is_refused(lines, tmp_path, change, message):
    file, content = tmp_path / "bench.csv", "".join(change(lines))
    file.write_text(content if content.startswith("wavelength_nm") else HEADER + content)
    refused(lambda: md.read_orders(file, PERIOD), message)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda axes, variables, units: axes.pop("theta"), "theta"),
        (lambda axes, variables, units: variables.pop("R_p"), "R_p"),
        (lambda axes, variables, units: axes.update(theta=np.full(18, 3.0)), "listed twice"),
        (lambda axes, variables, units: axes.update(theta=np.full(18, np.nan)), "theta nan"),
        (lambda axes, variables, units: axes.update(wavelength=AXES["wavelength"] / 1e3), "unit"),
        (lambda axes, variables, units: units.update(wavelength="THz"), "THz"),
    ],
)
def test_a_wrong_netcdf_file_is_refused(power, tmp_path, change, message):
    axes, variables, units, path = dict(AXES), content(power), {}, tmp_path / "mine.nc"
    change(axes, variables, units)
    write_classic(path, axes, variables, units)
    refused(lambda: md.read_orders(path, PERIOD), message)


def test_units_that_are_missing_are_named_and_per_cent_are_converted(power, table, tmp_path):
    path = tmp_path / "mine.nc"
    write_classic(path, AXES, content(power), {"theta": "degrees"})
    with pytest.warns(DiffractionWarning, match="wavelength, phi without units"):
        md.read_orders(path, PERIOD)
    write_classic(path, AXES, content(power), UNITS)
    with netcdf_file(path, "a") as file:
        file.variables["R_s"].units = file.variables["R_p"].units = "%"
    percent = md.read_orders(path, PERIOD)
    np.testing.assert_allclose(percent.response.values, 0.01 * table.response.values, atol=1e-6)


@pytest.mark.parametrize("angles", [([-30, 30], [0, 180]), ([30], [0, 360]), ([30], [-90, 270])])
@pytest.mark.parametrize("more", [0.0, 0.1])
def test_a_direction_in_other_words_has_the_same_efficiencies(tmp_path, angles, more):
    lines = [
        f"500,{theta},{phi},0,{power},{power}\n"
        for theta in angles[0]
        for phi in angles[1]
        for power in [0.2 + more * (phi == angles[1][1])]
    ]
    (tmp_path / "bench.csv").write_text(HEADER + "".join(lines))
    if not more:
        table = imported(tmp_path / "bench.csv", 0.2)
        assert table.efficiency(0.0, 0.0, 500.0, 0) == pytest.approx(0.2, rel=1e-3)  # half floats
        return
    with pytest.raises(DiffractionError, match="is the direction of theta"):
        imported(tmp_path / "bench.csv", 0.2)


SMALL = {"wavelength": np.array([500.0, 600.0]), "theta": np.array([0.0, 40, 80]),
         "order": np.arange(-3, 4)}  # fmt: skip


@pytest.fixture(scope="module", params=[write_classic, write_hdf5], ids=["classic", "hdf5"])
def small(request, tmp_path_factory):
    """The bytes of a small file."""
    path = tmp_path_factory.mktemp("small") / "mine.nc"
    lam, theta, order = np.meshgrid(*SMALL.values(), indexing="ij")
    inside = np.abs(order * lam / 800 - np.sin(np.radians(theta))) < 1
    variables = {name: (tuple(SMALL), np.where(inside, 0.15, np.nan)) for name in ("R_s", "R_p")}
    request.param(path, SMALL, variables, {"wavelength": "nm"})
    assert imported(path).period == PERIOD
    return path.read_bytes()


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_a_damaged_netcdf_file_is_refused_in_one_line_or_read(small, data):
    damaged = bytearray(small)
    for _ in range(data.draw(st.integers(1, 3))):
        damaged[data.draw(st.integers(0, len(small) - 1))] = data.draw(st.integers(0, 255))
    damaged = damaged[: data.draw(st.sampled_from([len(small), len(small) // 2, 100, 9]))]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "mine.nc")
        path.write_bytes(damaged)
        try:
            table = imported(path)
        except DiffractionError as error:
            assert "\n" not in str(error)
        else:
            assert np.isfinite(table.efficiency(0.1, 0.0, 550.0, 0))
