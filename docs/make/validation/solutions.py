"""Files of rigorous solutions: rows of numbers, and the solver that computed them."""

from __future__ import annotations

import importlib.metadata
import json
import os
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.errors import DiffractionError

from .cases import MATERIALS, PROFILES, Grating, order_sines

#: Folder of the stored solutions.
DATA = Path(__file__).parent / "data"
#: Polarisations: electric and magnetic field along the grooves.
LIGHTS = ("te", "tm")

#: A row is one order of one grating at one wavelength and angle. Lengths in µm, wavelength in nm,
#: theta in degrees; `te` and `tm` are the efficiencies (reflected power in this order, of the
#: incident), electric and magnetic field along the grooves; `te_change` and `tm_change` are how
#: much they changed when the solver's resolution doubled to its final value, and `te_balance` and
#: `tm_balance` by how much all orders and the absorption miss 1. NaN is what a solver cannot do.
ROW = np.dtype(
    [
        ("profile", "i1"),
        ("period", "f4"),
        ("depth", "f4"),
        ("theta", "f4"),
        ("wavelength", "f4"),
        ("order", "i2"),
        ("te", "f4"),
        ("tm", "f4"),
        ("te_change", "f2"),
        ("tm_change", "f2"),
        ("te_balance", "f2"),
        ("tm_balance", "f2"),
    ]
)

#: A grating at one angle and wavelength is left out if the last doubling changed one of its orders
#: by more than this (absolute). The next doubling changes it by about a sixth of that.
CONVERGED = 5e-3

#: What one solution is: rows that have these in common.
KEY = ["profile", "period", "depth", "theta", "wavelength"]


class Efficiencies:
    """Efficiencies of a scan by polarisation ("te", "tm").

    Attributes
    ----------
    orders : a list with an array (orders,) for each wavelength, ordered as `cases.order_sines`.
    balance : (wavelengths,) the sum of all orders and the absorption, minus 1; NaN where a solver
        does not compute the absorption.
    """

    def __init__(self, wavelengths: int) -> None:
        self.orders: dict[str, list[NDArray[np.float64]]] = {"te": [], "tm": []}
        self.balance = {"te": np.full(wavelengths, np.nan), "tm": np.full(wavelengths, np.nan)}


@dataclass(frozen=True)
class Solutions:
    """Rows (n,) of dtype `ROW`, and a description: solver, versions, settings, material."""

    rows: NDArray[np.void]
    about: Mapping[str, Any]

    @property
    def mean(self) -> NDArray[np.float64]:
        """Efficiency for unpolarised light, (n,)."""
        return 0.5 * (self.rows["te"].astype(float) + self.rows["tm"])

    @property
    def change(self) -> NDArray[np.float64]:
        """Last change of each row, the larger of both polarisations, (n,)."""
        return np.fmax(self.rows["te_change"], self.rows["tm_change"]).astype(float)

    @property
    def balance(self) -> NDArray[np.float64]:
        """Energy missing or gained, the larger of both polarisations, (n,)."""
        te, tm = np.abs(self.rows["te_balance"]), np.abs(self.rows["tm_balance"])
        return np.fmax(te, tm).astype(float)

    @property
    def converged(self) -> NDArray[np.bool_]:
        """Whether a row belongs to a solution that has converged (`CONVERGED`), (n,)."""
        _, solution = np.unique(self.rows[KEY], return_inverse=True)
        worst = np.zeros(solution.max(initial=-1) + 1)
        np.maximum.at(worst, solution.ravel(), self.change)
        return np.asarray(worst[solution.ravel()] <= CONVERGED)

    def where(self, **values: Any) -> Solutions:
        """The rows with these values: a grating, or such as profile="lamellar" or theta=30.0."""
        return Solutions(self.rows[self.having(**values)], self.about)

    def having(self, grating: Grating | None = None, **values: Any) -> NDArray[np.bool_]:
        """Which rows have these values, (n,); as in `where`."""
        keep = np.ones(len(self.rows), bool)
        if grating is not None:
            values |= vars(grating)
        for name, value in values.items():
            wanted: Any = PROFILES.index(value) if name == "profile" else np.float32(value)
            keep &= self.rows[name] == wanted
        return keep

    def trusted(self) -> Solutions:
        """The rows that have converged."""
        return Solutions(self.rows[self.converged], self.about)


def load(path: str | os.PathLike[str]) -> Solutions:
    """Read what `save_rows` wrote.

    Raises
    ------
    DiffractionError
        If the file is missing or no set of solutions.
    """
    return Solutions(*load_rows(path, ROW))


def save_rows(
    rows: NDArray[np.void], about: Mapping[str, Any], path: str | os.PathLike[str]
) -> None:
    """Write rows of any type as columns of an .npz file, and what made them.

    Raises
    ------
    DiffractionError
        If it cannot be written.
    """
    text = json.dumps(dict(about), indent=1, ensure_ascii=False)
    columns = {name: rows[name] for name in rows.dtype.names or ()}
    with atomic_path(path) as temporary:
        np.savez_compressed(temporary, allow_pickle=False, about=np.array(text), **columns)


def load_rows(
    path: str | os.PathLike[str], dtype: np.dtype[np.void]
) -> tuple[NDArray[np.void], Mapping[str, Any]]:
    """Read rows of this type, and what made them, as `load`."""
    try:
        with np.load(path, allow_pickle=False) as file:
            columns = {name: file[name] for name in dtype.names or ()}
            about = json.loads(str(file["about"]))
    except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile) as error:
        reason = " ".join(str(error).split())
        raise DiffractionError(
            f"cannot read solutions from '{os.fspath(path)}': {reason}; "
            "make them with `python -m docs.make.validation.solve`"
        ) from error
    rows = np.empty(len(next(iter(columns.values()))), dtype)
    for name, column in columns.items():
        rows[name] = column
    return rows, about


def shipped(material: str, solver: str = "integral") -> Solutions:
    """The solutions that come with the package.

    Raises
    ------
    DiffractionError
        If there are none for this material by this solver.
    """
    if material not in MATERIALS:
        raise DiffractionError(
            f"material '{material}' is unknown; choose one of {', '.join(MATERIALS)}"
        )
    return stored(f"{material}_{solver}")


def stored(file: str) -> Solutions:
    """The solutions of a file of `DATA`, named without its suffix."""
    return load(DATA / f"{file}.npz")


class Work(NamedTuple):
    """Cases that are solved together.

    Attributes
    ----------
    cases : arguments of `solve`.
    solve : returns rows by file of `DATA`, named without its suffix; runs in other processes.
    about : solver, material and more of each file.
    """

    cases: Sequence[Any]
    solve: Callable[[Any], dict[str, NDArray[np.void]]]
    about: dict[str, dict[str, Any]]


def order_rows(
    grating: Grating, theta: float, wavelength: float,
    coarse: Sequence[ArrayLike], fine: Sequence[ArrayLike],
    balance: Sequence[float] = (np.nan, np.nan),
) -> NDArray[np.void]:  # fmt: skip
    """Return rows of `ROW` of a grating in light of one direction and wavelength.

    coarse, fine : efficiencies of the orders of `cases.order_sines` for each of `LIGHTS`, of the
        last two resolutions.
    """
    orders, _ = order_sines(grating.period, wavelength, theta)
    rows = np.empty(len(orders), ROW)
    rows["profile"] = PROFILES.index(grating.profile)
    rows["period"], rows["depth"] = grating.period, grating.depth
    rows["theta"], rows["wavelength"], rows["order"] = theta, wavelength, orders
    for n, light in enumerate(LIGHTS):
        rows[light] = fine[n]
        rows[f"{light}_change"] = np.abs(np.subtract(fine[n], coarse[n]))
        rows[f"{light}_balance"] = balance[n]
    return rows


def imported(module: str) -> Any:
    """Import a module of a package that the extra `validation` has.

    Raises
    ------
    DiffractionError
        If it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise DiffractionError(
            f"{module.partition('.')[0]} is not installed; install the extra: "
            "pip install '.[validation]'"
        ) from error


def version(package: str) -> str:
    """Return the version of a package of the extra; errors as `imported`."""
    imported(package)
    return importlib.metadata.version(package)
