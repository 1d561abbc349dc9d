"""Results of solvers in a folder: a damaged or foreign file is solved again."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.orders.solve import jobs
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.jobs import Jobs, Problem, Solved, remove_results
from mitsuba_diffraction.orders.solve.nodes import Place
from mitsuba_diffraction.orders.solve.profiles import sinusoidal
from mitsuba_diffraction.orders.solve.stations import Grating
from mitsuba_diffraction.tables.store import Record, write_record

RANGE = (500.0, 600.0)
PLACES = [Place(1, 0, tau, 0.4, (0.5,)) for tau in (0.1, 0.2)]
PROBLEM = Problem(
    Grating(sinusoidal(0.7, 0.1), material_of(1.5, RANGE), 1.0, RANGE), "chandezon", 8, "digest"
)


@pytest.fixture
def solved(tmp_path, monkeypatch):
    """`solved()`: the results at two places, and the places that were solved for them."""

    def call(folder=tmp_path / "kept", times=1):
        made = []

        def solve_place(problem, place):
            made.append(place)
            return Solved(np.full(3, place.tau, np.complex64), 1.5)

        monkeypatch.setattr(jobs, "solve_place", solve_place)
        work = Jobs(folder)
        for _ in range(times):
            found = work.amplitudes(PROBLEM, PLACES, "places")
        return {place: values.tolist() for place, values in found.items()}, made

    return call


def test_results_are_read_again(solved):
    first, made = solved()
    assert made == PLACES
    assert solved() == (first, [])


def test_no_place_is_solved_twice(solved):
    assert solved(None, times=2)[1] == PLACES


@pytest.mark.parametrize(
    "damage",
    [
        lambda file: file.write_bytes(b""),
        lambda file: file.write_bytes(file.read_bytes()[:-1]),
        lambda file: file.write_bytes(b"PK\x03\x04" + bytes(500)),
        lambda file: write_record(file, "another", Record({"seconds": 1}, [np.zeros(3)])),
        lambda file: [file.write_bytes(other.read_bytes()) for other in file.parent.iterdir()],
    ],
    ids=["empty", "cut", "no result", "another's title", "another item"],
)  # fmt: skip
def test_a_damaged_result_is_solved_again(solved, tmp_path, damage):
    first, _ = solved()
    damage(next((tmp_path / "kept").iterdir()))
    again, made = solved()
    assert again == first
    assert len(made) == 1


def test_only_results_are_removed_from_their_folder(solved, tmp_path):
    solved()
    (tmp_path / "kept" / "profile.txt").write_text("0 0\n")
    remove_results(tmp_path / "kept")
    assert [file.name for file in (tmp_path / "kept").iterdir()] == ["profile.txt"]
    solved()
    (tmp_path / "kept" / "profile.txt").unlink()
    remove_results(tmp_path / "kept")
    assert not (tmp_path / "kept").exists()
