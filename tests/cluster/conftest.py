"""Workers for all tests of this folder: processes take seconds to start."""

from __future__ import annotations

import drjit as dr
import numpy as np
import pytest

pytest.importorskip("distributed")

from mitsuba_diffraction import cluster
from mitsuba_diffraction.cluster import groups, tasks
from mitsuba_diffraction.scene import load_scene, passes, set_variant
from tests.cluster.clusters import SPP, VARIANT, silent
from tests.support.kernels import vectors_of
from tests.support.room import SCENE


@pytest.fixture(scope="package")
def client():
    """Two workers of one thread each."""
    with cluster.connect(2) as connected:
        yield connected


@pytest.fixture(autouse=True)
def workers_vectors(own_vectors):
    """Vectors as long as the workers', whose pictures are this process's bit by bit."""
    before = vectors_of(own_vectors)
    yield
    vectors_of(before)


@pytest.fixture(autouse=True)
def own_scenes():
    """A scene that a worker keeps between tasks is let go of in this process.

    Dr.Jit's replay of a frozen function that was recorded beside it would end the process.
    """
    yield
    tasks.loaded_scene.cache_clear()


@pytest.fixture
def scene(tmp_path, monkeypatch):
    """A scene of 12 passes, each of which is a group; a worker is given two at a time.

    Dr.Jit's threads are restored at the end: with one, Mitsuba's EXR writer would wait forever.
    """
    before = dr.thread_count()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(groups, "AHEAD", 2)
    monkeypatch.setattr(passes, "SAMPLES", {"llvm": 2 * 24 * 16})
    (tmp_path / "room.xml").write_text(SCENE)
    yield tmp_path / "room.xml"
    dr.set_thread_count(before)


@pytest.fixture
def three_groups(monkeypatch):
    """Groups of four passes, each of which is a task; workers add two sums at a time."""
    monkeypatch.setattr(groups, "GROUPS", 4)
    monkeypatch.setattr(groups, "ADDED", 2)


@pytest.fixture
def expected(scene):
    """The picture of one process with one thread."""
    set_variant(VARIANT)
    before = dr.thread_count()
    dr.set_thread_count(1)
    loaded = load_scene(scene, {})
    result = passes.render_passes(
        loaded, loaded.sensors()[0], spp=SPP, seed=3, stop=passes.Stop(),
        progress=silent,
    )  # fmt: skip
    dr.set_thread_count(before)
    return np.array(result.bitmap)
