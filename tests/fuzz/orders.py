"""Files of orders with random damage: tables, efficiencies, recipes, lines of profiles."""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.io import netcdf_file

import mitsuba_diffraction as md
from mitsuba_diffraction.orders.solve import SolvedRecipe
from mitsuba_diffraction.orders.solve.profiles import read_profile
from tests.fuzz.damage import check_damaged
from tests.support.orders import thin_grating

_RECIPE = """method = "solved"
profile = "lamellar"
material = "0.65+5.6i"
wavelengths = [400, 700]
tolerance = 0.02
[arguments]
period = 1.6
depth = 0.12
"""
_LINE = "x,z\n0,0.1\n0.4,0.1\n0.5,0\n1.0,0\n1.3,0.02\n"
_PERIOD = 0.7  # µm
_AXES = {"wavelength": np.array([500.0, 600.0]), "theta": np.array([-40.0, 0, 40]),
         "phi": np.array([0.0, 60]), "order": np.arange(-2, 3)}  # fmt: skip


@functools.cache
def originals() -> dict[str, bytes]:
    """Small whole files by name."""
    with tempfile.TemporaryDirectory() as folder:
        at = Path(folder)
        thin_grating(0.5, counts=(2, 2, 1)).save(at / "grating.nc")
        thin_grating(0.5, counts=(2, 2, 1), thin=True).save(at / "sheet.nc")
        lam, theta, phi, order = np.meshgrid(*_AXES.values(), indexing="ij")
        sine = np.sin(np.radians(theta))
        x = order * lam / (1e3 * _PERIOD) - sine * np.cos(np.radians(phi))
        y = sine * np.sin(np.radians(phi))
        power = np.where(x**2 + y**2 < 1, 0.15, np.nan)
        with netcdf_file(at / "mine.nc", "w") as file:
            for name, values in _AXES.items():
                file.createDimension(name, len(values))
                file.createVariable(name, "d", (name,))[:] = values
            for name in ("R_s", "R_p"):
                file.createVariable(name, "d", tuple(_AXES))[:] = power
            file.variables["wavelength"].units = "nm"
        lines = [
            ",".join(f"{axis[place]:g}" for axis, place in zip(_AXES.values(), light, strict=True))
            + ",0.15,0.15"
            for light in np.argwhere(~np.isnan(power))
        ]
        header = "wavelength_nm,theta_deg,phi_deg,order,R_s,R_p"
        (at / "mine.csv").write_text("\n".join([header, *lines]))
        (at / "recipe.toml").write_text(_RECIPE)
        (at / "line.csv").write_text(_LINE)
        return {path.name: path.read_bytes() for path in sorted(at.iterdir())}


#: Readers by the name of the file.
_USES: dict[str, Callable[[Path], object]] = {
    "grating.nc": lambda path: _look_up(md.OrderTable.load(path)),
    "sheet.nc": lambda path: _look_up(md.OrderTable.load(path)),
    "mine.nc": lambda path: _look_up(md.read_orders(path, _PERIOD)),
    "mine.csv": lambda path: _look_up(md.read_orders(path, _PERIOD)),
    "recipe.toml": lambda path: SolvedRecipe.load(path),
    "line.csv": lambda path: read_profile(path, 1.6),
}


def check(rng: np.random.Generator) -> None:
    """A file is refused in one line, or can be used."""
    name = str(rng.choice(sorted(_USES)))
    check_damaged(rng, name, originals()[name], _USES[name])


def _look_up(table: md.OrderTable) -> None:
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-0.9, 0.9, (2, 8))
    low, high = table.wavelengths
    for order in range(-2, 3):
        efficiency = table.efficiency(x, y, rng.uniform(low, high, 8), order)
        assert np.isfinite(efficiency).all()
        assert (efficiency >= 0.0).all()
