"""The commands that the README shows run, in their order, on small patches and pictures."""

from __future__ import annotations

import pytest

from tests.support.commands import run_page, small_tree

pytestmark = [
    # heights as coarse and steep as the stand-ins' are worth a warning
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
    pytest.mark.usefixtures("some_variant"),
]


def test_the_commands_of_the_readme_run(tmp_path, monkeypatch):
    run_page("README.md", small_tree(tmp_path), monkeypatch)
