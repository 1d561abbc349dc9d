"""Tables of a restricted domain: exact within it, right on average beyond, never dark."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import jv

from mitsuba_diffraction import DiffractionError, DiffractionTable
from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.tables.colour.table import ColourTable
from mitsuba_diffraction.tables.energy.conservation import FINE
from mitsuba_diffraction.tables.energy.powers import power_series
from mitsuba_diffraction.tables.energy.transport import Orders
from tests.support.directions import rough_patch

#: 19.2 µm wide: a coarse cell holds five by five orders. Nyquist's frequency is 10.5 rad/µm.
PATCH = rough_patch((64, 64), (0.3, 0.3), 0.25, correlation=0.2)
WIDTH, Q_MAX, KAPPA_MAX = 18.0, 6.0, 20.0


@pytest.fixture(scope="module")
def whole():
    """All that light can probe."""
    return DiffractionTable.build(PATCH, coherence_width=WIDTH)


@pytest.fixture(scope="module", params=["ensemble", "patch"])
def restricted(request):
    """The same up to Q_MAX and KAPPA_MAX."""
    return DiffractionTable.build(
        PATCH, coherence_width=WIDTH, coherence=request.param, q_max=Q_MAX, kappa_max=KAPPA_MAX
    )


def plane(radius, step):
    """Frequencies (n,), (n,) of a square lattice in a disc."""
    axis = np.arange(-radius, radius + 0.5 * step, step)
    x, y = (a.ravel() for a in np.meshgrid(axis, axis))
    inside = np.hypot(x, y) <= radius
    return x[inside], y[inside]


def test_within_the_domain_the_tolerance_is_met(restricted):
    assert restricted.largest_error <= 1e-3
    full = DiffractionTable.build(
        PATCH, coherence_width=WIDTH, coherence=restricted.coherence, tolerance=1e-4
    )
    rng = np.random.default_rng(0)
    angle, radius = rng.uniform(0, 2 * np.pi, 4000), Q_MAX * np.sqrt(rng.uniform(0, 1, 4000))
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    assert restricted.covers(x, y, KAPPA_MAX).all()
    for kappa in (1.0, 8.0, 0.999 * KAPPA_MAX):
        exact = full.window_sum(x, y, kappa)
        difference = np.abs(restricted.window_sum(x, y, kappa) - exact)
        # Its own tolerance, and that of what it is compared with
        assert difference.sum() <= 1.1e-3 * exact.sum()


def test_it_takes_less_memory(whole, restricted):
    # (6 / 10.5)² of the bins, margins aside, and 20 of 52 rad/µm
    components = restricted.coefficients.shape[3]
    assert restricted.nbytes < 0.6 * components * whole.nbytes
    assert restricted.nbytes == restricted.coefficients.nbytes + restricted.coarse.nbytes


@pytest.mark.parametrize("kappa", [10.0, 30.0])
def test_no_light_is_lost(restricted, kappa):
    # Parseval: the lobes' integrals π/σ² add up to it, whatever the surface; lattice step below
    # the width of a lobe (0.22 rad/µm), so that a sum of Gaussians is their integral to 1e-4
    step = 0.1
    total = restricted.window_sum(*plane(14.0, step), kappa).sum() * step**2
    expected = np.pi / restricted.sigma**2
    # Cells that straddle the edge of the domain are counted twice or not at all; speckle (`patch`)
    # has twice its mean at its own centre, and averages only over the lobes there are (some 3000)
    assert total == pytest.approx(expected, rel=0.02 if restricted.coherence == "ensemble" else 0.1)


def test_cells_have_the_mean_of_their_orders(whole, restricted):
    x, y = plane(10.0, 0.1)
    for low, high in ((6.5, 8.0), (8.0, 10.0)):
        ring = (np.hypot(x, y) > low) & (np.hypot(x, y) < high)
        exact = whole.window_sum(x[ring], y[ring], 15.0).mean()
        # a ring is one or two cells wide, and its power falls steeply
        assert restricted.window_sum(x[ring], y[ring], 15.0).mean() == pytest.approx(exact, rel=0.1)


def test_order_0_keeps_its_lobe_beyond_kappa_max():
    depth = 0.1
    grating = gratings.sinusoidal(
        period=2.0, depth=depth, periods=10, pixels_per_period=32, rows=256
    )
    table = DiffractionTable.build(grating, coherence_width=18.0, q_max=8.0, kappa_max=20.0)
    kappa = np.array([25.0, 40.0, 52.0])
    power = jv(0, 0.5 * kappa * depth) ** 2
    # The next order is 3.1 rad/µm = 14/σ away, more than two cells of 1.6 rad/µm
    assert table.window_sum(0.0, 0.0, kappa) == pytest.approx(power, rel=1e-2)
    lobe = np.exp(-((table.sigma * 0.2) ** 2))
    assert table.window_sum(0.2, 0.0, kappa) == pytest.approx(power * lobe, rel=1e-2)


def test_the_bound_of_the_albedo_counts_what_lies_outside(whole):
    table = DiffractionTable.build(PATCH, coherence_width=WIDTH, q_max=Q_MAX)
    azimuths = np.linspace(0.0, 2 * np.pi, 5)
    theta, weights = (
        np.array([0.0, 0.6, 1.2]),
        np.ones((FINE.polar + 1, FINE.azimuthal), np.float32),
    )
    exact, found = (
        Orders(t).transport(theta, azimuths, 450.0, "kirchhoff", None, FINE)(weights)
        for t in (whole, table)
    )
    # what lies outside is some percent of all, and right on average
    assert found == pytest.approx(exact, rel=5e-3)


def test_what_sums_orders_on_its_own_refuses(restricted):
    for read in (ColourTable.build, power_series):
        with pytest.raises(DiffractionError, match="up to 6 along x, 6 along y and κ up to 20 "):
            read(restricted)


@pytest.mark.parametrize("name", ["q_max", "kappa_max"])
def test_a_domain_of_nothing_is_refused(name):
    with pytest.raises(DiffractionError, match=f"{name}=-1 must be a positive number"):
        DiffractionTable.build(PATCH, coherence_width=WIDTH, **{name: -1.0})


def test_a_domain_beyond_what_light_can_probe_is_the_whole(whole):
    table = DiffractionTable.build(PATCH, coherence_width=WIDTH, q_max=1e3, kappa_max=1e3)
    assert table.coarse is None
    assert table.settings.q_max is None
    assert np.array_equal(table.coefficients, whole.coefficients)


def test_the_domain_may_be_an_ellipse(whole):
    table = DiffractionTable.build(PATCH, coherence_width=WIDTH, q_max=(8.0, 3.0))
    _, ny, nx, _, _ = table.coefficients.shape
    assert ny < 0.6 * nx
    assert list(table.covers([7.9, 0.0, 7.0], [0.0, 2.9, 2.0], 5.0)) == [True, True, False]
    x, y = np.linspace(-7.9, 7.9, 100), np.full(100, 0.4)
    exact = whole.window_sum(x, y, 15.0)
    # either is within its tolerance of the truth
    assert np.abs(table.window_sum(x, y, 15.0) - exact).sum() <= 2e-3 * exact.sum()


def test_a_file_keeps_both_parts(restricted, tmp_path):
    file = tmp_path / "table.exr"
    restricted.save(file)
    loaded = DiffractionTable.load(file)
    assert (loaded.q_max, loaded.expansion) == ((Q_MAX, Q_MAX), restricted.expansion)
    assert loaded.coarse.grid == restricted.coarse.grid
    for a, b in ((loaded, restricted), (loaded.coarse, restricted.coarse)):
        assert np.array_equal(a.coefficients, b.coefficients)
        assert a.coefficients.dtype == b.coefficients.dtype
        assert np.array_equal(a.order_0, b.order_0)
