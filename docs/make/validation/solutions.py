"""Files of rigorous solutions: orders of cases, and the solver that computed them."""

from __future__ import annotations

import importlib.metadata
import json
import os
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import groupby
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.arrays import Complex, Real, Whole
from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.errors import DiffractionError

from .cases import DATA, MATERIALS, PROFILES, Case, Grating, Light, Media, Surface
from .patches import CELLS

#: Polarisations of the light: s and p, which on gratings in light across the grooves have the
#: electric and the magnetic field along the grooves (TE, TM).
LIGHTS = ("te", "tm")

#: A case is left out if the last refinement changed one of its orders by more than this (absolute).
#: The next doubling of a mesh changes it by about a sixth of that.
CONVERGED = 5e-3

# Columns of a file: what has one case in common, and what each of its orders has
_KEY = ("surface", "wavelength", "theta", "phi")
_COLUMNS = {"order": "i2", "powers": "f4", "change": "f4", "balance": "f2", "jones": "c8"}


class Orders(NamedTuple):
    """Orders that a solver found at one resolution.

    Attributes
    ----------
    order : (n, 2) numbers.
    powers : (n, 2) efficiencies (power in the order, of the incident) for s and p light; NaN is
        what a solver cannot do.
    balance : (2,) all orders and the absorption, minus 1; NaN where this is not computed.
    jones : (n, 2, 2) amplitudes about `boundary.polarisation_axes`, phases from height 0.
    """

    order: Whole
    powers: Real
    balance: Sequence[float] = (np.nan, np.nan)
    jones: Complex | None = None

    @classmethod
    def of_amplitudes(cls, case: Case, order: Whole, jones: Any) -> Orders:
        """Return orders from their amplitudes."""
        index = case.index.real if case.media.through and case.index else 1.0
        cosines = index * np.abs(case.wo(order)[:, 2:]) / case.wi[2]
        return cls(order, np.sum(np.abs(jones) ** 2, axis=1) * cosines, jones=jones)


@dataclass(frozen=True)
class Solved:
    """Orders of a case, as `Orders` has them.

    Attributes
    ----------
    change : (n, 2) by how much the powers changed when the resolution grew to its final value.
    other : (n, 2) efficiencies by a model or another solver, in comparisons.
    """

    case: Case
    order: Whole
    powers: Real
    change: Real
    balance: Real
    jones: Complex
    other: Real | None = None

    @classmethod
    def between(cls, case: Case, coarse: Orders, fine: Orders) -> Solved:
        """Return the finer orders, with their change from the coarse ones."""
        before = dict(zip(map(tuple, coarse.order), coarse.powers, strict=True))
        nothing = np.zeros(2)
        change = [p - before.get(tuple(m), nothing) for m, p in zip(*fine[:2], strict=True)]
        count = len(fine.order)
        jones = np.full((count, 2, 2), np.nan) if fine.jones is None else fine.jones
        balance = np.tile(fine.balance, (count, 1))
        return cls(case, fine.order, fine.powers, np.abs(change), balance, jones)

    @property
    def converged(self) -> bool:
        """Whether no order changed by more than `CONVERGED`."""
        return bool(np.nanmax(self.change) <= CONVERGED)

    @property
    def wo(self) -> Real:
        """Directions of the orders, (n, 3)."""
        return self.case.wo(self.order)


@dataclass(frozen=True)
class Solutions:
    """Solved cases, and a description: solver, versions, settings, material."""

    solved: Sequence[Solved]
    about: Mapping[str, Any] = field(default_factory=dict)

    def where(self, **values: Any) -> Self:
        """The cases with these values: a grating, or such as profile="lamellar" or theta=30.0."""
        return replace(self, solved=[s for s in self.solved if s.case.has(**values)])

    def trusted(self) -> Self:
        """The cases that have converged."""
        return replace(self, solved=[s for s in self.solved if s.converged])

    def each(self) -> Iterator[Self]:
        """Yield each case alone."""
        return (replace(self, solved=[s]) for s in self.solved)

    def column(self, name: str) -> NDArray[Any]:
        """An attribute of the orders of all cases."""
        return np.concatenate([getattr(s, name) for s in self.solved])


@cache
def surface_of(name: str) -> Surface:
    """Return the surface that has this name in files."""
    if name in CELLS:
        return CELLS[name]
    profile, _, lengths = name.removesuffix(" µm").partition(" ")
    if profile not in PROFILES:
        raise ValueError(f"surface '{name}' is unknown")
    return Grating(profile, *map(float, lengths.split("/")))


def save(
    solved: Iterable[Solved], about: Mapping[str, Any], path: str | os.PathLike[str]
) -> Solutions:
    """Write solutions as columns of an .npz file, and what made them; return them.

    Raises
    ------
    DiffractionError
        If it cannot be written.
    """
    every = Solutions(list(solved), about)
    keys = [(str(s.case.surface), *s.case.light) for s in every.solved for _ in s.order]
    columns = dict(zip(_KEY, map(np.array, zip(*keys, strict=True)), strict=True))
    columns |= {name: every.column(name).astype(dtype) for name, dtype in _COLUMNS.items()}
    if np.isnan(columns["jones"]).all():
        del columns["jones"]
    text = json.dumps(dict(about), indent=1, ensure_ascii=False)
    with atomic_path(path) as temporary:
        np.savez_compressed(temporary, allow_pickle=False, about=np.array(text), **columns)
    return every


def load(path: str | os.PathLike[str], media: Media) -> Solutions:
    """Read what `save` wrote, of surfaces in some media.

    Raises
    ------
    DiffractionError
        If the file is missing or no set of solutions.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            about = json.loads(str(file["about"]))
            keys = zip(*(file[name].tolist() for name in _KEY), strict=True)
            columns = [file[name] for name in _COLUMNS if name in file]
        rows = groupby(enumerate(keys), key=lambda row: row[1])
        solved = []
        for (surface, *light), group in rows:
            members = [n for n, _ in group]
            part = slice(members[0], members[-1] + 1)
            order, powers, change, *others = (column[part] for column in columns)
            none = np.full((len(members), 2, 2), np.nan)
            balance, jones = (*others, none)[:2]
            case = Case(surface_of(surface), Light(*light), media)
            exact = (each.astype(float) for each in (powers, change, balance))
            solved.append(Solved(case, order.astype(np.int64), *exact, jones))
    except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile) as error:
        reason = " ".join(str(error).split())
        raise DiffractionError(
            f"cannot read solutions from '{os.fspath(path)}': {reason}; "
            "make them with `python -m docs.make.validation.solve`"
        ) from error
    return Solutions(solved, about)


def shipped(material: str, solver: str = "integral") -> Solutions:
    """The solutions of a material that are stored.

    solver : "integral" or "coupled_wave" of gratings, "patches_rayleigh" or "patches_coupled_wave"
        of cells.

    Raises
    ------
    DiffractionError
        If there are none for this material by this solver.
    """
    if material not in MATERIALS:
        raise DiffractionError(
            f"material '{material}' is unknown; choose one of {', '.join(MATERIALS)}"
        )
    return stored(f"{material}_{solver}", Media(material))


def stored(file: str, media: Media) -> Solutions:
    """The solutions of a file of `DATA`, named without its suffix."""
    return load(DATA / f"{file}.npz", media)


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
