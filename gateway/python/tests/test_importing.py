"""Tests of `tandem.importing`; skipped where MuJoCo is not installed."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("trimesh")
pytest.importorskip("yaml")

from tandem.importing import import_file
from tandem.importing.command_line import main

SCENE = """<mujoco model="others">
  <compiler inertiagrouprange="0 0"/>
  <option gravity="0 0 -1.62"/>
  <asset><hfield name="hill" nrow="2" ncol="2" size="1 1 1 1"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 0.1"/>
    <geom type="hfield" hfield="hill" pos="9 9 0"/>
    <body name="cabinet" pos="0 0 0.5">
      <geom type="box" size="0.3 0.2 0.3" mass="4"/>
      <body name="drawer" pos="0 -0.15 0">
        <joint name="rail" type="slide" axis="0 -1 0" range="0 0.3" damping="5"/>
        <geom name="lid" type="box" size="0.2 0.1 0.1" mass="2"/>
        <geom type="box" size="0.2 0.1 0.1" group="1" contype="0" conaffinity="0" rgba="1 0 0 1"/>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="cabinet" body2="drawer"/><pair geom1="floor" geom2="lid" condim="1" friction="0.5"/></contact>
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
        '<pair geom1="floor" geom2="lid" condim="1" friction="0.5',
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
    for name, told in [
        ("scene.usd", "let the program that wrote the file export MJCF"),
        ("scene.txt", "these are: .xml, .mjcf"),
    ]:
        assert main([str(tmp_path / name), str(tmp_path / "out")]) == 1
        assert told in capsys.readouterr().err
    assert main(["a/model.xml", "b/model.xml", str(tmp_path / "out")]) == 1
    assert "import them one by one" in capsys.readouterr().err
    (tmp_path / "bad.xml").write_text("<mujoco><worldbody><geom type='box'/></worldbody></mujoco>")
    assert main([str(tmp_path / "bad.xml"), str(tmp_path / "out")]) == 1
    assert "bad.xml: " in capsys.readouterr().err


WEDGE = "v 0 0 1\nv 1 0 1\nv 0 1 1\nv 0 0 2\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def compiled(out: Path) -> Any:
    from tandem.importing.engine import mujoco

    return mujoco.MjModel.from_xml_path(str(out))


def heights(model: Any) -> list[float]:
    """Returns the lowest and the highest corner of all meshes, in the world."""
    from tandem.importing.engine import mujoco

    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found: list[float] = []
    for geom in range(model.ngeom):
        mesh = model.geom_dataid[geom]
        corners = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
        placed = corners @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
        found += [float(placed[:, 2].min()), float(placed[:, 2].max())]
    return [min(found), max(found)]


def test_a_mesh_becomes_an_object_that_weighs_what_it_encloses(tmp_path: Path) -> None:
    (tmp_path / "wedge.obj").write_text(WEDGE)
    report = import_file(tmp_path / "wedge.obj", tmp_path / "out")
    assert report.bodies == [{"name": "wedge", "mass_kg": pytest.approx(500 / 6), "joints": ["free"]}]
    ends = heights(compiled(tmp_path / "out" / "object.xml"))
    assert ends == pytest.approx([0.0, 1.0], abs=1e-6), "it stands on its lowest point"
    assert [row["is_concave"] for row in report.collisions] == [False]


def crate() -> Any:
    """Returns a box without a lid, of five boards."""
    trimesh: Any = import_module("trimesh")
    places = [((0.6, 0.4, 0.02), (0, 0, 0.01))]
    places += [((0.02, 0.4, 0.3), (x, 0, 0.17)) for x in (-0.29, 0.29)]
    places += [((0.56, 0.02, 0.3), (0, y, 0.17)) for y in (-0.19, 0.19)]
    boards: list[Any] = []
    for extents, place in places:
        board: Any = trimesh.creation.box(extents)
        board.apply_translation(place)
        boards.append(board)
    return trimesh.util.concatenate(boards)


def test_concave_meshes_collide_as_convex_pieces_that_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("vhacdx")
    from tandem.importing.pieces import decompose

    def missing(_: str) -> None:
        """Returns that a module is not installed."""

    def in_cache(*_: Any) -> Any:
        pytest.fail("the pieces are in the cache")

    monkeypatch.setattr(decompose, "find_spec", missing)
    monkeypatch.setattr(decompose, "cache_folder", lambda: tmp_path / "cache")
    monkeypatch.setattr(decompose, "MAX_PIECES", 8)
    crate().export(tmp_path / "crate.stl")
    whole = import_file(tmp_path / "crate.stl", tmp_path / "whole")
    assert "they fill 21 to 21 %; --decompose" in whole.told()
    cut = import_file(tmp_path / "crate.stl", tmp_path / "cut", decompose=True)
    assert 5 <= cut.collisions[0]["pieces"] <= 8
    model = compiled(tmp_path / "cut" / "object.xml")
    colliding = model.geom_contype != 0
    assert colliding.sum() == cut.collisions[0]["pieces"]
    assert set(model.geom_group[colliding]) == {3} and set(model.geom_group[~colliding]) == {0}
    assert model.body_mass[1] == pytest.approx(500 * cut.collisions[0]["volume_m3"], rel=1e-3)

    in_cache.__name__ = "by_vhacd"
    monkeypatch.setattr(decompose, "by_vhacd", in_cache)
    import_file(tmp_path / "crate.stl", tmp_path / "again", decompose=True)
    texts = [(tmp_path / out / "meshes" / "mesh_1_0.obj").read_text() for out in ("cut", "again")]
    assert texts[0] == texts[1]


def card(images: dict[str, Any], **factors: Any) -> Any:
    """Returns a box with a material of glTF."""
    trimesh: Any = import_module("trimesh")
    visual: Any = import_module("trimesh.visual")
    box: Any = trimesh.creation.box((1, 2, 3))
    uv: Any = np.linspace(0, 1, 2 * len(box.vertices))
    material = visual.material.PBRMaterial(**images, **factors)
    box.visual = visual.TextureVisuals(uv=uv.reshape(-1, 2), material=material)
    return box


def test_an_object_looks_as_its_gltf_file(tmp_path: Path) -> None:
    from PIL import Image

    def image(colour: tuple[int, ...], mode: str) -> Any:
        return Image.new(mode, (4, 4), colour)

    images = {
        "baseColorTexture": image((10, 200, 30, 90), "RGBA"),
        "metallicRoughnessTexture": image((0, 120, 60), "RGB"),
        "normalTexture": image((128, 128, 255), "RGB"),
    }
    factors = {"metallicFactor": 0.25, "roughnessFactor": 0.5, "baseColorFactor": [255, 55, 255, 255]}
    card(images, **factors, alphaMode="MASK", alphaCutoff=0.5).export(tmp_path / "card.glb")
    import_file(tmp_path / "card.glb", tmp_path / "out")
    model = compiled(tmp_path / "out" / "object.xml")
    assert heights(model) == pytest.approx([0.0, 2.0], abs=1e-6), "in glTF y is up"
    assert (model.mat_metallic[0], model.mat_roughness[0]) == pytest.approx((0.25, 0.5))
    # 55 of 255 is a linear share, which is shown as 0.5.
    assert model.mat_rgba[0] == pytest.approx([1.0, 0.5, 1.0, 1.0], abs=0.005)
    by_channels = {int(channels): int(begin) for channels, begin in zip(model.tex_nchannel, model.tex_adr, strict=True)}
    texels = model.tex_data[by_channels[4] :][:4]
    assert list(texels) == [10, 200, 30, 0], "below the cutoff nothing is drawn"
    text = (tmp_path / "out" / "object.xml").read_text()
    assert [role for role in ("rgba", "orm", "normal") if f'<layer role="{role}"' in text] == ["rgba", "orm", "normal"]


def test_layers_of_gltf_emit_light_and_keep_out_ambient_light(tmp_path: Path) -> None:
    from PIL import Image

    def image(*colour: int) -> Any:
        return Image.new("RGB", (4, 4), colour)

    both = {"occlusionTexture": image(90, 0, 0), "metallicRoughnessTexture": image(0, 120, 60)}
    for number, (images, factor, emitted) in enumerate(
        (
            ({"emissiveTexture": image(255, 255, 0), **both}, [1.0, 0.5, 1.0], [255, 188, 0]),
            (both, [0.0, 0.0, 0.2140411], [0, 0, 127]),
            ({"emissiveTexture": image(255, 255, 0), **both}, None, None),
        )
    ):
        source, out = tmp_path / f"{number}.glb", tmp_path / str(number)
        card(images, emissiveFactor=factor).export(source)
        import_file(source, out)
        root: Any = ElementTree.parse(out / "object.xml").getroot()
        files = {texture.get("name"): out / "textures" / texture.get("file") for texture in root.iter("texture")}
        shown: dict[str, list[int]] = {}
        for layer in root.iter("layer"):
            picture: Any = Image.open(files[layer.get("texture")])
            shown[layer.get("role")] = list(picture.convert("RGB").getpixel((0, 0)))
        expected = {"orm": [255, 120, 60], "occlusion": [90, 90, 90]} | ({"emissive": emitted} if emitted else {})
        assert {role: shown.get(role) for role in expected} == expected and len(shown) == len(expected)
        assert (root.find("asset/material").get("emission") is None) == (emitted is not None), "the layer's own light"


def test_images_of_ktx2_are_reported(tmp_path: Path) -> None:
    card({"baseColorTexture": None}).export(tmp_path / "card.gltf")
    text = (tmp_path / "card.gltf").read_text().replace('"asset":', '"images": [{"uri": "wood.ktx2"}], "asset":', 1)
    (tmp_path / "card.gltf").write_text(text)
    report = import_file(tmp_path / "card.gltf", tmp_path / "out")
    assert report.dropped == {"image of KTX2 in a glTF file; PNG and JPEG are read": 1}


CABINET = """<sdf version="1.7"><model name="cabinet">
  <link name="body">
    <inertial><mass>20</mass><pose>0 0 0.4 0 0 0</pose>
      <inertia><ixx>2</ixx><iyy>2</iyy><izz>1</izz><ixy>0.1</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>
    <visual name="v"><pose>0 0.2 0.4 0 0 0</pose><geometry><box><size>0.8 0.02 0.8</size></box></geometry>
      <material><diffuse>0.5 0.3 0.2 1</diffuse></material></visual>
    <collision name="c"><pose>0 0.2 0.4 0 0 0</pose><geometry><box><size>0.8 0.02 0.8</size></box></geometry>
      <surface><friction><ode><mu>0.4</mu></ode></friction></surface></collision>
  </link>
  <link name="drawer"><pose relative_to="body">0 -0.02 0.2 0 0 0</pose><inertial><mass>2</mass></inertial>
    <visual name="v"><geometry><mesh><uri>wedge.obj</uri><scale>0.5 0.5 -0.5</scale></mesh></geometry></visual>
    <collision name="c"><geometry><cylinder><radius>0.1</radius><length>0.3</length></cylinder></geometry></collision></link>
  <link name="door"><pose relative_to="body">-0.4 -0.2 0.5 0 0 1.5707963</pose><inertial><mass>1</mass></inertial>
    <collision name="c"><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent>body</parent><child>drawer</child>
    <axis><xyz>0 -1 0</xyz><limit><lower>0</lower><upper>0.3</upper></limit>
      <dynamics><damping>2</damping><friction>0.05</friction></dynamics></axis></joint>
  <joint name="hinge" type="revolute"><parent>body</parent><child>door</child>
    <axis><xyz expressed_in="__model__">1 0 0</xyz><limit><lower>-1</lower><upper>1e16</upper></limit></axis></joint>
  <drake:collision_filter_group name="own"><drake:member>drawer</drake:member><drake:member>door</drake:member>
    <drake:ignored_collision_filter_group>own</drake:ignored_collision_filter_group></drake:collision_filter_group>
  <plugin name="p" filename="f"/>
</model></sdf>"""
MUG = """<sdf version="1.7"><model name="mug">
  <link name="base"><inertial><mass>0.3</mass>
    <inertia><ixx>1e-3</ixx><iyy>1e-3</iyy><izz>1e-3</izz></inertia></inertial>
    <collision name="c"><geometry><mesh><uri>package://home/assets/wedge.obj</uri></mesh></geometry></collision></link>
  <link name="handle"><pose degrees="true">0.1 0 0 0 0 90</pose><inertial><mass>0.1</mass></inertial>
    <collision name="c"><geometry><box><size>0.1 0.1 0.1</size></box></geometry></collision></link>
  <joint name="glue" type="fixed"><parent>base</parent><child>handle</child></joint>
</model></sdf>"""
HOUSE = """directives:
- add_frame:
    name: room
    X_PF: {base_frame: world, translation: [10, 0, 0], rotation: !Rpy {deg: [0, 0, 90]}}
- add_model:
    name: shelf
    file: package://home/assets/cabinet.sdf
    default_joint_positions: {slide: [0.1], hinge: [0.5]}
- add_weld: {parent: room, child: "shelf::body", X_PC: {translation: [1, 0, 0.5]}}
- add_directives: {file: mugs.dmd.yaml, model_namespace: kitchen}
"""
MUGS = """directives:
- add_model:
    name: mug
    file: assets/mug.sdf
    default_free_body_pose:
      base: {base_frame: room, translation: [0, 2, 1], rotation: !AngleAxis {angle_deg: 180, axis: [0, 0, 1]}}
"""


def house(tmp_path: Path) -> Path:
    """Writes a house as SceneSmith and Drake do: directives, and models in a package."""
    (tmp_path / "assets").mkdir()
    (tmp_path / "combined").mkdir()
    (tmp_path / "package.xml").write_text("<package><name>home</name></package>")
    for name, text in [("cabinet.sdf", CABINET), ("mug.sdf", MUG), ("wedge.obj", WEDGE)]:
        (tmp_path / "assets" / name).write_text(text)
    (tmp_path / "combined" / "house.dmd.yaml").write_text(HOUSE)
    (tmp_path / "combined" / "mugs.dmd.yaml").write_text(MUGS.replace("assets/", "../assets/"))
    return tmp_path / "combined" / "house.dmd.yaml"


def test_directives_place_and_weld_models(tmp_path: Path) -> None:
    from tandem.importing.engine import mujoco

    report = import_file(house(tmp_path), tmp_path / "out")
    model = compiled(tmp_path / "out" / "scene.xml")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    # The room is turned by 90 degrees: its x is the world's y.
    places = {
        "shelf": [10, 1, 0.5],
        "shelf/drawer": [10.02 + 0.1, 1, 0.7],
        "shelf/door": [10.2, 0.6, 1.0],
        "kitchen/mug": [8, 0, 1],
        "kitchen/mug/handle": [8, -0.1, 1],
    }
    for name, place in places.items():
        assert data.body(name).xpos == pytest.approx(place, abs=1e-6), name
    assert [body["joints"] for body in report.bodies] == [["slide"], ["hinge"], ["free"]]
    axes = {name: data.joint(f"shelf/{name}").xaxis for name in ("slide", "hinge")}
    assert axes["slide"] == pytest.approx([1, 0, 0], abs=1e-6)
    assert axes["hinge"] == pytest.approx([0, 1, 0], abs=1e-6), "the model's x"
    # Ranges are relative to the initial positions.
    assert model.joint("shelf/slide").range == pytest.approx([-0.1, 0.2])
    assert model.joint("shelf/hinge").range[0] == pytest.approx(-1.5)
    assert (model.dof_damping[0], model.dof_frictionloss[0]) == pytest.approx((2.0, 0.05))
    friction = {float(value) for value in model.geom_friction[:, 0]}
    assert friction == {0.4, 1.0}
    pairs = {(model.body(pair >> 16).name, model.body(pair & 0xFFFF).name) for pair in model.exclude_signature.tolist()}
    assert {tuple(sorted(pair)) for pair in pairs} >= {("shelf", "shelf/drawer"), ("shelf/door", "shelf/drawer")}
    assert report.dropped["<plugin> of a model"] == 1
    assert report.dropped["inertia of a link; those of its shapes are used"] == 3
    assert report.after_1_s["from_source_m"] < 1e-3


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        ("shelf::body", "shelf::bodi", "directive 3: there is no frame shelf::bodi; have: world, room, shelf::body"),
        ("assets/cabinet", "assets/cupboard", "there is no file package://home/assets/cupboard.sdf"),
        ("!Rpy {deg: [0, 0, 90]}", "!Uniform {}", "!Uniform are not read; use !Rpy or !AngleAxis"),
        ("add_weld", "add_glue", "there is no directive add_glue"),
        ("directives:", "models:", "has a list `directives`"),
    ],
)
def test_errors_of_directives_say_what_would_work(tmp_path: Path, before: str, after: str, told: str) -> None:
    file = house(tmp_path)
    file.write_text(file.read_text().replace(before, after, 1))
    with pytest.raises(ValueError, match=r"house\.dmd\.yaml") as error:
        import_file(file, tmp_path / "out")
    assert told in str(error.value)


def test_models_of_sdf_are_free_unless_they_are_static(tmp_path: Path) -> None:
    (tmp_path / "wedge.obj").write_text(WEDGE)
    (tmp_path / "mug.sdf").write_text(MUG.replace("package://home/assets/", ""))
    assert import_file(tmp_path / "mug.sdf", tmp_path / "free").bodies[0]["joints"] == ["free"]
    assert compiled(tmp_path / "free" / "scene.xml").body_mass.tolist() == pytest.approx([0.0, 0.3, 0.1])
    (tmp_path / "mug.sdf").write_text((tmp_path / "mug.sdf").read_text().replace('"mug">', '"mug"><static>true</static>'))
    assert import_file(tmp_path / "mug.sdf", tmp_path / "static").bodies == []


URDF = """<robot name="arm">
  <link name="base"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><mesh filename="package://arm/meshes/wedge.ply"/></geometry></visual>
    <visual><geometry><mesh filename="meshes/missing.dae"/></geometry></visual></link>
  <link name="hand"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><mesh filename="meshes/wedge.obj"/></geometry></collision></link>
  <joint name="wrist" type="revolute"><parent link="base"/><child link="hand"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="37" velocity="1"/></joint>
</robot>"""


def test_meshes_of_urdf_are_found_in_packages(tmp_path: Path) -> None:
    trimesh: Any = import_module("trimesh")
    (tmp_path / "arm" / "meshes").mkdir(parents=True)
    (tmp_path / "arm" / "meshes" / "wedge.obj").write_text(WEDGE)
    trimesh.load(str(tmp_path / "arm" / "meshes" / "wedge.obj")).export(tmp_path / "arm" / "meshes" / "wedge.ply")
    (tmp_path / "arm" / "arm.urdf").write_text(URDF)
    report = import_file(tmp_path / "arm" / "arm.urdf", tmp_path / "out")
    assert report.bodies == [{"name": "hand", "mass_kg": 1.0, "joints": ["hinge"]}]
    assert len(report.dropped) == 1 and "there is no file meshes/missing.dae" in next(iter(report.dropped))
    model = compiled(tmp_path / "out" / "scene.xml")
    assert sorted(zip(model.geom_group.tolist(), model.geom_contype.tolist(), strict=True)) == [(0, 1), (1, 0)]
    text = (tmp_path / "out" / "scene.xml").read_text()
    assert 'name="drawn_groups" data="1 2"' in text
    assert 'actuatorfrcrange="-37 37"' in text, "efforts of URDF limit actuators"
