//! Images on surfaces: where their parts are, how often they repeat, and their means from afar.

mod light;
mod materials;

use std::path::Path;

use tandem_sim::mjcf::Document;
use tandem_sim::render::{Camera, Frame, RendererKind, Scenery};
use tandem_sim::{Pose, Vector, World};

const RED: [u8; 3] = [200, 30, 30];
const GREEN: [u8; 3] = [30, 160, 30];
const BLUE: [u8; 3] = [30, 30, 200];
const GREY: [u8; 3] = [120, 120, 120];

/// Draws a scene whose file `four.png` is red, green, blue and grey: top left, top right, bottom left and
/// bottom right.
fn drawn(kind: RendererKind, inside: &str, camera: &Camera) -> Frame {
    let folder = tempfile::tempdir().expect("a folder");
    let image = image::RgbImage::from_fn(64, 64, |x, y| {
        image::Rgb(match (x < 32, y < 32) {
            (true, true) => RED,
            (false, true) => GREEN,
            (true, false) => BLUE,
            (false, false) => GREY,
        })
    });
    image.save(folder.path().join("four.png")).expect("an image");
    let hole = image::RgbaImage::from_fn(64, 64, |x, y| {
        let is_hole = (16..48).contains(&x) && (16..48).contains(&y);
        image::Rgba([200, 30, 30, if is_hole { 0 } else { 255 }])
    });
    hole.save(folder.path().join("hole.png")).expect("an image");
    for (file, rgb) in [("red.png", RED), ("green.png", GREEN), ("blue.png", BLUE), ("grey.png", GREY)] {
        let plain = image::RgbImage::from_pixel(4, 4, image::Rgb(rgb));
        plain.save(folder.path().join(file)).expect("an image");
    }
    image::RgbImage::from_pixel(8, 8, image::Rgb(GREY))
        .save(folder.path().join("grey.jpg"))
        .expect("an image");
    // Normals (0.6, 0, 0.8).
    let tilted = image::RgbImage::from_pixel(4, 4, image::Rgb([204, 128, 230]));
    tilted.save(folder.path().join("tilted.png")).expect("an image");
    std::fs::write(folder.path().join("card.obj"), CARD).expect("a mesh");
    let file = folder.path().join("scene.xml");
    std::fs::write(&file, format!("<mujoco>{inside}</mujoco>")).expect("a scene");
    let world = World::of_scene(read(&file)).expect("a world");
    kind.renderer(Scenery::of(&world)).render(&world.present(), camera)
}

fn read(file: &Path) -> Document {
    Document::read(file).unwrap_or_else(|error| panic!("{error}"))
}

/// A square in the plane y = 0 that faces -y and shows the whole image upright.
const CARD: &str = "v -0.5 0 0\nv 0.5 0 0\nv 0.5 0 1\nv -0.5 0 1\nv 0 1 0.5\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\nf 2/2 5/3 3/3\nf 1/1 4/4 5/4\n";

fn looking(eye_m: Vector, target_m: Vector) -> Camera {
    let up = if eye_m.x == target_m.x && eye_m.y == target_m.y { Vector::Y } else { Vector::Z };
    Camera {
        world_from_camera: Pose::look_at_rh(eye_m, target_m, up).inverse(),
        vertical_fov_rad: 0.9,
        width: 96,
        height: 96,
        blur_px: 0.0,
    }
}

fn pixel(frame: &Frame, [column, row]: [usize; 2]) -> [u8; 3] {
    let first = 3 * (row * frame.width as usize + column);
    frame.rgb[first..first + 3].try_into().expect("three bytes")
}

/// Returns the name of a pixel's colour under any light.
fn name(rgb: [u8; 3]) -> &'static str {
    let [red, green, blue] = rgb.map(f32::from);
    match () {
        () if red > 1.5 * green.max(blue) => "red",
        () if green > 1.5 * red.max(blue) => "green",
        () if blue > 1.5 * red.max(green) => "blue",
        () => "grey",
    }
}

fn names<const N: usize>(frame: &Frame, pixels: [[usize; 2]; N]) -> [&'static str; N] {
    pixels.map(|at| name(pixel(frame, at)))
}

const QUARTERS: [[usize; 2]; 4] = [[36, 36], [60, 36], [36, 60], [60, 60]];
const UPRIGHT: [&str; 4] = ["red", "green", "blue", "grey"];

fn asset(texture: &str, material: &str) -> String {
    format!(
        r#"<asset><texture name="four" file="four.png" {texture}/><mesh name="card" file="card.obj"/>
        <material name="four" texture="four" {material}/></asset>"#
    )
}

#[test]
fn an_image_along_z_has_its_top_at_the_far_side_and_repeats_as_asked() {
    let above = looking(Vector::new(0.0, 0.0, 1.5), Vector::ZERO);
    let floor = r#"<worldbody><geom type="plane" size="1 1 1" material="four"/></worldbody>"#;
    for kind in [RendererKind::Cpu, RendererKind::Path] {
        let once = drawn(kind, &(asset(r#"type="2d""#, "") + floor), &above);
        assert_eq!(names(&once, QUARTERS), UPRIGHT);
        // The image repeats twice over a plane of 2 m: a whole image in the middle, and halves around it.
        let twice = drawn(kind, &(asset(r#"type="2d""#, r#"texrepeat="2 2""#) + floor), &above);
        assert_eq!(names(&twice, [[40, 40], [56, 40], [40, 56], [56, 56]]), UPRIGHT);
        assert_eq!(names(&twice, [[8, 8], [88, 8], [8, 88], [88, 88]]), ["grey", "blue", "green", "red"]);
        let uniform =
            drawn(kind, &(asset(r#"type="2d""#, r#"texrepeat="2 2" texuniform="true""#) + floor), &above);
        assert_eq!(uniform.rgb, twice.rgb, "half of the plane is 1 m");
    }
}

#[test]
fn a_class_of_materials_may_say_how_often_an_image_repeats() {
    let above = looking(Vector::new(0.0, 0.0, 1.5), Vector::ZERO);
    let floor = r#"<worldbody><geom type="plane" size="1 1 1" material="four"/></worldbody>"#;
    let class = r#"<default><material texrepeat="2 2"/></default>"#.to_owned();
    let by_class = drawn(RendererKind::Cpu, &(class + &asset(r#"type="2d""#, "") + floor), &above);
    let stated = asset(r#"type="2d""#, r#"texrepeat="2 2""#) + floor;
    assert_eq!(by_class.rgb, drawn(RendererKind::Cpu, &stated, &above).rgb);
}

#[test]
fn each_side_of_a_cube_and_the_card_of_a_file_show_the_whole_image_upright() {
    let front = looking(Vector::new(0.0, -2.2, 0.5), Vector::new(0.0, 0.0, 0.5));
    let cube =
        r#"<worldbody><geom type="box" size="0.5 0.5 0.5" pos="0 0.5 0.5" material="four"/></worldbody>"#;
    let card = r#"<worldbody><geom type="mesh" mesh="card" material="four"/></worldbody>"#;
    for kind in [RendererKind::Cpu, RendererKind::Path] {
        for (texture, shape) in [("", cube), (r#"type="2d""#, card)] {
            assert_eq!(
                names(&drawn(kind, &(asset(texture, "") + shape), &front), QUARTERS),
                UPRIGHT,
                "{shape}"
            );
        }
    }
}

#[test]
fn from_afar_an_image_has_its_mean_colour() {
    let many = asset(r#"type="2d""#, r#"texrepeat="400 400""#);
    let mean = r#"<asset><material name="four" rgba="0.482 0.413 0.482 1"/></asset>"#;
    let floor = r#"<worldbody><geom type="plane" size="1 1 1" material="four"/></worldbody>"#;
    let above = looking(Vector::new(0.0, -0.6, 1.4), Vector::ZERO);
    for kind in [RendererKind::Cpu, RendererKind::Path] {
        let drawn = |asset: &str| drawn(kind, &(asset.to_owned() + floor), &above);
        let (images, plain) = (drawn(&many), drawn(mean));
        for at in QUARTERS {
            let [one, other] = [&images, &plain].map(|frame| pixel(frame, at));
            let most = one.iter().zip(other).map(|(a, b)| a.abs_diff(b)).max();
            assert!(most <= Some(8), "{kind:?}: {one:?} instead of {other:?}");
        }
    }
}

#[test]
fn the_colour_of_a_material_tints_its_image() {
    let above = looking(Vector::new(0.0, 0.0, 1.5), Vector::ZERO);
    let floor = r#"<worldbody><geom type="plane" size="1 1 1" material="four"/></worldbody>"#;
    let tinted = drawn(RendererKind::Cpu, &(asset(r#"type="2d""#, r#"rgba="0 1 0 1""#) + floor), &above);
    let [_, green, _, grey] = QUARTERS.map(|at| pixel(&tinted, at));
    assert_eq!([name(green), name(grey)], ["green", "green"]);
}

/// The faces of +x, -x, +y, -y, +z and -z; what a layout lacks has the first colour of the texture.
#[test]
fn each_face_of_a_cube_may_have_an_image_of_its_own() {
    let files = r#"fileright="red.png" fileleft="green.png" fileup="blue.png" filedown="grey.png"
        filefront="green.png" fileback="red.png""#;
    // Red and green are the upper cells of the grid, blue and grey the lower ones.
    let grid = r#"file="four.png" gridsize="2 2" gridlayout="RLUB" rgb1="0 0.8 0""#;
    let cube = |texture: &str| {
        format!(
            r#"<asset><texture name="cube" type="cube" {texture}/><material name="cube" texture="cube"/></asset>
            <worldbody><geom type="box" size="0.5 0.5 0.5" material="cube"/></worldbody>"#
        )
    };
    let sides = [Vector::X, -Vector::X, Vector::Y, -Vector::Y, Vector::Z, -Vector::Z];
    for kind in [RendererKind::Cpu, RendererKind::Path] {
        let seen = |texture: &str| {
            let shown = |side: &Vector| drawn(kind, &cube(texture), &looking(*side * 2.2, Vector::ZERO));
            sides.iter().map(|side| name(pixel(&shown(side), [48, 48]))).collect::<Vec<_>>()
        };
        assert_eq!(seen(files), ["red", "green", "blue", "grey", "green", "red"]);
        assert_eq!(seen(grid), ["red", "green", "blue", "green", "green", "grey"]);
    }
}

/// The pattern `tiles` of a material gives tiles of half a metre; without it, a checker repeats as its file
/// specifies.
#[test]
fn builtin_textures_repeat_as_images_do() {
    let above = looking(Vector::new(0.0, 0.0, 1.5), Vector::ZERO);
    let floor = r#"<worldbody><geom type="plane" size="1 1 1" material="checker"/></worldbody>"#;
    let asset = |material: &str| {
        format!(
            r#"<asset><texture name="checker" type="2d" builtin="checker" rgb1="1 0 0" rgb2="0 0 1" width="32"
            height="32"/><material name="checker" texture="checker" {material}/></asset>"#
        )
    };
    for kind in [RendererKind::Cpu, RendererKind::Path] {
        let once = drawn(kind, &(asset("") + floor), &above);
        assert_eq!(names(&once, QUARTERS), ["red", "blue", "blue", "red"]);
        let twice = drawn(kind, &(asset(r#"texrepeat="2 2""#) + floor), &above);
        assert_eq!(names(&twice, [[40, 40], [56, 40], [40, 56], [56, 56]]), ["red", "blue", "blue", "red"]);
    }
    let tiles = r#"<custom><text name="material_patterns" data="checker tiles"/></custom>"#;
    let tiled =
        |material: &str| drawn(RendererKind::Cpu, &(tiles.to_owned() + &asset(material) + floor), &above);
    let nine = r#"texrepeat="9 9""#;
    assert_eq!(tiled(nine).rgb, tiled("").rgb);
    assert_ne!(tiled(nine).rgb, drawn(RendererKind::Cpu, &(asset(nine) + floor), &above).rgb);
    // A tile's corner is at the middle; 0.12 m from it are the tiles around it, and at 0.6 m the next tile.
    assert_eq!(names(&tiled(""), [[40, 40], [56, 40], [8, 40], [88, 40]]), ["red", "blue", "blue", "red"]);
}
