"""The figure of patches is drawn, and bad input to its program is one line."""

from __future__ import annotations

from PIL import Image

from docs.make.figures import patches
from mitsuba_diffraction.analysis.pictures import colour_field, patches_figure
from mitsuba_diffraction.heights.gratings import cd, elaphe_like


def test_a_row_of_panels_with_units_for_each_patch():
    fields = [elaphe_like(20.0, 128), cd(20.0, 128)]
    figure = patches_figure(fields)
    panels = [axes for axes in figure.axes if axes.get_xlabel()]
    assert len(panels) == 10
    for axes in panels:
        labels = axes.get_xlabel() + axes.get_ylabel()
        assert "(" in labels or "sinθ" in labels


def test_colours_lie_where_the_grating_throws_them():
    """A CD's first orders, 650 nm/1.6 µm and so on, along v."""
    colours = colour_field(cd(32.0, 320, irregularity=0), 201)
    for channel, wavelength in enumerate((0.65, 0.55, 0.45)):
        for order in (-2, -1, 1, 2):
            v = round(100 + 100 * order * wavelength / 1.6)  # a pixel is 0.01, an order 0.02 wide
            between = round(100 + 100 * (order - 0.5) * wavelength / 1.6)
            assert colours[v, 100, channel] > colours[between, 100, channel] + 0.1


def test_program_writes_the_figure(tmp_path, monkeypatch):
    monkeypatch.setattr(patches, "LOOKALIKES", (lambda seed: elaphe_like(16.0, 96, seed),))
    target = tmp_path / "patches.png"
    assert patches.main(["-o", str(target)]) == 0
    with Image.open(target) as image:
        assert image.size[0] > 1000


def test_program_refuses_bad_input_in_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(patches, "LOOKALIKES", (lambda seed: elaphe_like(16.0, 96, seed),))
    target = tmp_path / "patches.png"
    assert patches.main(["-o", str(target), "--measured", str(tmp_path / "none.png")]) == 1
    error = capsys.readouterr().err
    assert error.startswith("patches: error: ")
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
