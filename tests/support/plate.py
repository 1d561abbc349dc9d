"""A plate with a grating in light from a direction, as a scene file."""

from __future__ import annotations

from pathlib import Path

SCENE = """<scene version="3.0.0">
    <sensor type="perspective"/>
    <shape type="rectangle">
        {bsdf}
    </shape>
    <emitter type="directional"><vector name="direction" value="0.2, 0, -1"/></emitter>
</scene>"""
SKIN = """<bsdf type="diffraction">
    <string name="filename" value="grating.toml"/>
    <float name="coherence_width" value="4"/>
    <boolean name="energy_conserving" value="false"/>
</bsdf>"""
GRATING = 'generator = "sinusoidal"\n[arguments]\nperiod = 1.6\ndepth = 0.06\nperiods = 3\n'


def plate_file(folder: Path) -> Path:
    """Write the scene `plate.xml` and its recipe into a folder."""
    (folder / "grating.toml").write_text(GRATING)
    file = folder / "plate.xml"
    file.write_text(SCENE.format(bsdf=SKIN))
    return file
