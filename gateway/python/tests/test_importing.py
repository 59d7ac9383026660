"""Tests of `tandem.importing`; skipped where MuJoCo is not installed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mujoco")

from tandem.importing import import_file
from tandem.importing.command_line import main

SCENE = """<mujoco model="others">
  <compiler inertiagrouprange="0 0"/>
  <option gravity="0 0 -1.62"/>
  <asset><hfield name="hill" nrow="2" ncol="2" size="1 1 1 1"/></asset>
  <worldbody>
    <geom type="plane" size="5 5 0.1"/>
    <geom type="hfield" hfield="hill" pos="9 9 0"/>
    <body name="cabinet" pos="0 0 0.5">
      <geom type="box" size="0.3 0.2 0.3" mass="4"/>
      <body name="drawer" pos="0 -0.15 0">
        <joint name="rail" type="slide" axis="0 -1 0" range="0 0.3" damping="5"/>
        <geom type="box" size="0.2 0.1 0.1" mass="2"/>
        <geom type="box" size="0.2 0.1 0.1" group="1" contype="0" conaffinity="0" rgba="1 0 0 1"/>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="cabinet" body2="drawer"/></contact>
  <actuator><general name="puller" joint="rail" gainprm="7"/></actuator>
</mujoco>
"""


def test_a_scene_is_written_plainly_with_a_report(tmp_path: Path) -> None:
    (tmp_path / "scene.xml").write_text(SCENE)
    (tmp_path / "LICENSE").write_text("as you like")
    report = import_file(tmp_path / "scene.xml", tmp_path / "out")
    text = (tmp_path / "out" / "scene.xml").read_text()
    for part in [
        'name="drawn_groups" data="1 2"',
        'gravity="0 0 -1.62"',
        '<exclude body1="cabinet" body2="drawer"/>',
        '<motor joint="rail" gear="7"',
        'limited="true" range="0 0.3"',
    ]:
        assert part in text, part
    assert report.bodies == [{"name": "drawer", "mass_kg": 2.0, "joints": ["slide"]}]
    assert report.dropped["<hfield>"] == 1
    assert report.after_1_s["from_source_m"] < 1e-3
    assert json.loads((tmp_path / "out" / "report.json").read_text())["bodies"] == report.bodies
    assert (tmp_path / "out" / "LICENSE").read_text() == "as you like"


PICTURES = """<mujoco>
  <asset>
    <texture name="flat" type="2d" file="four.png"/>
    <texture name="cube" type="cube" file="four.png"/>
    <material name="flat" texture="flat" texrepeat="2 3"/>
    <material name="cube" texture="cube" texuniform="true"/>
    <mesh name="wedge" file="wedge.obj"/>
  </asset>
  <worldbody>
    <geom type="mesh" mesh="wedge" material="flat"/>
    <geom type="box" size="1 1 1" material="cube"/>
  </worldbody>
</mujoco>
"""


def test_pictures_are_placed_on_surfaces_as_in_the_source(tmp_path: Path) -> None:
    import numpy as np

    from tandem.importing.engine import mujoco
    from tandem.importing.files import png_bytes

    pixels: Any = np.arange(12)
    (tmp_path / "four.png").write_bytes(png_bytes(pixels.reshape(2, 2, 3) * 20))
    faces = "f 1/1 3/3 2/2\nf 1/1 2/2 4/3\nf 2/2 3/3 4/1\nf 3/3 1/1 4/2\n"
    vertices = "v 0 0 1\nv 1 0 1\nv 0 1 1\nv 0 0 2\nvt 0 0.25\nvt 1 0.5\nvt 0 1\n"
    (tmp_path / "wedge.obj").write_text(vertices + faces)
    (tmp_path / "scene.xml").write_text(PICTURES)
    import_file(tmp_path / "scene.xml", tmp_path / "out")
    source, written = (mujoco.MjModel.from_xml_path(str(tmp_path / file)) for file in ("scene.xml", "out/scene.xml"))
    for name in ("tex_type", "tex_data", "mat_texrepeat", "mat_texuniform", "mesh_texcoord"):
        assert np.allclose(getattr(source, name), getattr(written, name), atol=1e-5), name
    text = (tmp_path / "out" / "meshes" / "mesh_0.obj").read_text()
    assert text.count("\nvn ") == source.mesh_normal.shape[0]


LAYERS = """<mujoco>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="0.2 0.4 0.8" rgb2="1 1 1" width="8" height="48"/>
    <texture name="die" type="cube" builtin="checker" mark="edge" rgb1="1 0 0" rgb2="0 0 1" width="4" height="4"/>
    <texture name="paint" type="2d" file="four.png" colorspace="sRGB"/>
    <texture name="rough" type="2d" file="four.png" nchannel="1"/>
    <material name="die" texture="die"/>
    <material name="worn" texrepeat="2 3" metallic="1" roughness="0.4">
      <layer role="rgb" texture="paint"/>
      <layer role="roughness" texture="rough"/>
    </material>
  </asset>
  <worldbody>
    <geom type="box" size="1 1 1" material="die"/>
    <geom type="box" size="1 1 1" material="worn"/>
  </worldbody>
</mujoco>
"""


def test_skies_cubes_and_layers_are_those_of_the_source(tmp_path: Path) -> None:
    import numpy as np

    from tandem.importing.engine import mujoco
    from tandem.importing.files import png_bytes

    pixels: Any = np.arange(12)
    (tmp_path / "four.png").write_bytes(png_bytes(pixels.reshape(2, 2, 3) * 20))
    (tmp_path / "scene.xml").write_text(LAYERS)
    report = import_file(tmp_path / "scene.xml", tmp_path / "out")
    assert (report.pictures, report.dropped) == (4, {})
    source, written = (mujoco.MjModel.from_xml_path(str(tmp_path / file)) for file in ("scene.xml", "out/scene.xml"))
    for name in ("tex_type", "tex_data", "tex_nchannel", "mat_texid", "mat_texrepeat", "mat_metallic", "mat_roughness"):
        assert np.array_equal(getattr(source, name), getattr(written, name)), name
    text = (tmp_path / "out" / "scene.xml").read_text()
    assert 'type="skybox" file="texture_0.png" gridsize="6 1"' in text
    assert text.count('colorspace="sRGB"') == 1


def test_what_is_not_imported_says_what_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path / "scene.usd"), str(tmp_path / "out")]) == 1
    assert "these are: .xml, .mjcf, .urdf" in capsys.readouterr().err
    (tmp_path / "bad.xml").write_text("<mujoco><worldbody><geom type='box'/></worldbody></mujoco>")
    assert main([str(tmp_path / "bad.xml"), str(tmp_path / "out")]) == 1
    assert "bad.xml: " in capsys.readouterr().err


def test_a_mesh_becomes_an_object(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    (tmp_path / "wedge.obj").write_text("v 0 0 1\nv 1 0 1\nv 0 1 1\nv 0 0 2\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    report = import_file(tmp_path / "wedge.obj", tmp_path / "out")
    text = (tmp_path / "out" / "object.xml").read_text()
    assert '<body name="wedge"><freejoint/>' in text
    assert report.triangles == 4
    lines = (tmp_path / "out" / "meshes" / "piece_0.obj").read_text().splitlines()
    heights = [float(line.split()[3]) for line in lines if line.startswith("v ")]
    assert (min(heights), max(heights)) == (0.0, 1.0), "it stands on its lowest point"
