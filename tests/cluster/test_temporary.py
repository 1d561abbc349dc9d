"""Files of tasks on a worker without a cache lie where no other user can put theirs."""

from __future__ import annotations

import stat

from mitsuba_diffraction.cluster import tasks
from tests.support.systems import posix


@posix
def test_without_a_cache_the_folder_is_new_and_private(tmp_path, monkeypatch):
    (tmp_path / "mitsuba_diffraction").mkdir()  # somebody else's
    monkeypatch.setattr(tasks.tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(tasks, "cache_folder", lambda: None)
    tasks._own_temporary.cache_clear()
    files = tasks.SceneFiles("/a/scene.xml", (), (("/a/scene.xml", "0" * 64),))
    files.keep({"0" * 64: b"<scene/>"})
    (made,) = (folder for folder in tmp_path.iterdir() if folder.name != "mitsuba_diffraction")
    assert stat.S_IMODE(made.stat().st_mode) == 0o700
    assert [*(tmp_path / "mitsuba_diffraction").iterdir()] == []
    tasks._own_temporary.cache_clear()
