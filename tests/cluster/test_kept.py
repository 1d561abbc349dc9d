"""Sums on disk: read as they were written, or not at all."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.thorough

pytest.importorskip("distributed")

from mitsuba_diffraction.cluster.kept import Kept  # noqa: E402
from mitsuba_diffraction.cluster.tasks import run_task  # noqa: E402
from mitsuba_diffraction.scene.passes import Span  # noqa: E402
from tests.cluster.clusters import passes_of_picture  # noqa: E402

FIRST, SECOND = Span(0, 1), Span(1, 1)


def cut(content: bytes) -> bytes:
    return content[:-100]


def times_50(content: bytes) -> bytes:
    return content[:-4096] + (50 * np.frombuffer(content[-4096:], np.float64)).tobytes()


def not_a_number(content: bytes) -> bytes:
    return content[:-4096] + np.full(512, np.nan).tobytes()


@pytest.mark.parametrize("damage", [cut, times_50, not_a_number])
def test_damaged_sums_are_rendered_again(scene, tmp_path, damage):
    frame, said = passes_of_picture(scene), []
    kept, sums = Kept(tmp_path / "passes", said.append), run_task(frame.part(FIRST))
    kept.write(frame, FIRST, sums)
    assert kept.spans(frame) == {FIRST}
    assert np.array_equal(kept.read(frame, FIRST).raw, sums.raw)
    (file,) = (tmp_path / "passes").iterdir()
    file.write_bytes(damage(file.read_bytes()))
    assert kept.read(frame, FIRST) is None
    assert kept.spans(frame) == set()
    (line,) = said
    assert str(file) in line


def test_sums_under_the_name_of_others_are_rendered_again(scene, tmp_path):
    frame = passes_of_picture(scene)
    kept = Kept(tmp_path / "passes", lambda _: None)
    kept.write(frame, FIRST, run_task(frame.part(FIRST)))
    (file,) = (tmp_path / "passes").iterdir()
    file.rename(file.with_name(file.name.replace("-0-1", "-1-1")))
    assert kept.spans(frame) == {SECOND}
    assert kept.read(frame, SECOND) is None


def test_sums_of_a_finished_picture_are_removed(scene, tmp_path):
    frame = passes_of_picture(scene)
    kept = Kept(tmp_path / "passes")
    kept.write(frame, FIRST, run_task(frame.part(FIRST)))
    kept.forget(frame)
    assert not (tmp_path / "passes").exists()
