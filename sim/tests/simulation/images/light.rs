//! Lights of files, blended surfaces and skies. Colours are those of MuJoCo 3.3.5's images.

use tandem_sim::Vector;
use tandem_sim::render::{Camera, Frame, RendererKind};

use super::{drawn, looking, pixel};

const DARK: &str = r#"<visual><headlight active="0"/></visual>"#;
const SUN: &str = r#"<light directional="true" diffuse="0.7 0.6 0.5" specular="0 0 0" castshadow="false"/>"#;
const FLOOR: &str = r#"<geom type="plane" size="3 3 1" rgba="0.5 0.5 0.5 1"/>"#;
/// Maximum difference of colours: MuJoCo lights corners of triangles and blends in bytes.
const TOLERANCE: u8 = 4;

fn overhead() -> Camera {
    looking(Vector::new(0.0, 0.0, 3.0), Vector::ZERO)
}

fn room(settings: &str, inside: &str) -> String {
    format!("{settings}<worldbody>{FLOOR}{inside}</worldbody>")
}

fn check(frame: &Frame, at: [usize; 2], expected: [u8; 3], what: &str) {
    let found = pixel(frame, at);
    let is_near = found.iter().zip(expected).all(|(found, expected)| found.abs_diff(expected) <= TOLERANCE);
    assert!(is_near, "{what}: {found:?} instead of {expected:?}");
}

#[test]
fn surfaces_are_as_bright_as_in_mujoco() {
    let head =
        r#"<visual><headlight ambient="0.1 0.1 0.1" diffuse="0.2 0.2 0.2" specular="0 0 0"/></visual>"#;
    let slanted = r#"<light directional="true" diffuse="0.8 0.8 0.8" specular="0 0 0" dir="0 0.6 -0.8"/>"#;
    let spot = r#"<light diffuse="1 1 1" specular="0 0 0" pos="0 0 2" castshadow="false"/>"#;
    let far = spot.replace("diffuse", r#"attenuation="1 0.5 0.1" diffuse"#);
    let lamp = format!(r#"{SUN}<geom type="box" size="0.3 0.3 0.3" material="lamp"/>"#);
    let emits =
        format!(r#"{DARK}<asset><material name="lamp" emission="0.5" rgba="0.4 0.5 0.6 1"/></asset>"#);
    let gloss = format!(r#"{DARK}<asset><material name="lamp" specular="1" shininess="0.1"/></asset>"#);
    let mirrored =
        SUN.replace("0.7 0.6 0.5", "0 0 0").replace("specular=\"0 0 0\"", "specular=\"0.3 0.3 0.3\"");
    let shiny = format!(r#"{mirrored}<geom type="box" size="0.3 0.3 0.3" material="lamp"/>"#);
    for (what, settings, inside, expected) in [
        ("directional", DARK, SUN, [89, 76, 64]),
        ("slanted", DARK, slanted, [82, 82, 82]),
        ("headlight", head, "", [38, 38, 38]),
        ("spot", DARK, spot, [127, 127, 127]),
        ("attenuated", DARK, far.as_str(), [53, 53, 53]),
        ("emission", emits.as_str(), lamp.as_str(), [122, 140, 153]),
        ("highlight", gloss.as_str(), shiny.as_str(), [76, 76, 76]),
    ] {
        let frame = drawn(RendererKind::Cpu, &room(settings, inside), &overhead());
        check(&frame, [48, 48], expected, what);
    }
}

#[test]
fn a_spot_ends_at_its_cutoff_and_a_point_does_not() {
    let light = |attributes: &str| {
        let light = format!(r#"<light pos="0 0 0.5" diffuse="1 1 1" specular="0 0 0" {attributes}/>"#);
        drawn(RendererKind::Cpu, &room(DARK, &light), &overhead())
    };
    // 1 m from the middle is 63 degrees from the light's direction.
    let aside = |frame: &Frame| pixel(frame, [48 + 33, 48])[0];
    let spot = light(r#"cutoff="60" exponent="1""#);
    assert!(pixel(&spot, [48, 48])[0] > 120 && aside(&spot) == 0, "{}", aside(&spot));
    assert!(aside(&light(r#"cutoff="70" exponent="1""#)) > 10);
    assert!(aside(&light(r#"type="point" cutoff="60""#)) > 30);
    assert_eq!(aside(&light(r#"active="false""#)), 0);
}

#[test]
fn things_cast_shadows_of_directional_lights_and_of_spots() {
    let plate = r#"<geom type="box" size="0.2 0.2 0.02" pos="-0.6 0 0.8"/>"#;
    let sun = r#"directional="true" dir="0.6 0 -0.8" pos="-1 0 3""#;
    let spot = r#"pos="-1.2 0 1.6" dir="0.6 0 -0.8""#;
    let ambient = r#"<visual><headlight ambient="0.1 0.1 0.1" diffuse="0 0 0" specular="0 0 0"/></visual>"#;
    for light in [sun, spot] {
        let shown = |shadow: &str| {
            let light = format!(r#"<light {light} diffuse="0.7 0.7 0.7" specular="0 0 0" {shadow}/>"#);
            pixel(
                &drawn(RendererKind::Cpu, &room(ambient, &format!("{plate}{light}")), &overhead()),
                [48, 48],
            )
        };
        let [dark, bright] = [shown("")[0], shown(r#"castshadow="false""#)[0]];
        assert!(dark.abs_diff(13) <= TOLERANCE && bright > 50, "{dark} in the shadow, {bright} without");
    }
}

#[test]
fn a_file_without_lights_has_a_sun_and_one_with_lights_has_none() {
    let own = drawn(RendererKind::Cpu, &room("", ""), &overhead());
    assert!(pixel(&own, [48, 48])[0] > 150, "{:?}", pixel(&own, [48, 48]));
    let dark = drawn(RendererKind::Cpu, &room(DARK, ""), &overhead());
    assert_eq!(pixel(&dark, [48, 48]), [0; 3]);
}

#[test]
fn what_is_behind_a_blended_surface_shows_in_colour_and_alone_in_depth() {
    let glass = |alpha: &str| {
        let glass = format!(r#"<geom type="box" size="0.3 0.3 0.3" rgba="1 0 0 {alpha}"/>"#);
        let inside = format!("{SUN}{glass}");
        [RendererKind::Cpu, RendererKind::Path].map(|kind| drawn(kind, &room(DARK, &inside), &overhead()))
    };
    let [cpu, path] = glass("0.5");
    check(&cpu, [48, 48], [155, 19, 16], "half");
    let traced = pixel(&path, [48, 48]);
    assert!(traced[0] > 2 * traced[1], "{traced:?} is reddish");
    for frame in [cpu, path] {
        assert!((frame.depth_m[48 * 96 + 48] - 3.0).abs() < 1e-3, "{}", frame.depth_m[48 * 96 + 48]);
    }
    for (alpha, depth_m) in [("0", 3.0f32), ("1", 2.7)] {
        for frame in glass(alpha) {
            assert!((frame.depth_m[48 * 96 + 48] - depth_m).abs() < 1e-3, "{alpha}");
        }
    }
    let clear = &glass("0")[0];
    check(clear, [48, 48], [89, 76, 64], "clear");
}

#[test]
fn blended_surfaces_are_over_those_behind_them() {
    let pane = |rgb: &str, z: &str| {
        format!(r#"<geom type="box" size="0.3 0.3 0.01" pos="0 0 {z}" rgba="{rgb} 0.5"/>"#)
    };
    // The result is the same in either order of the file.
    for (first, second) in [("1 0 0", "0 0 1"), ("0 0 1", "1 0 0")] {
        let height = |rgb: &str| if rgb == "1 0 0" { "0.8" } else { "0.4" };
        let white = SUN.replace("0.7 0.6 0.5", "1 1 1");
        let inside = format!("{white}{}{}", pane(first, height(first)), pane(second, height(second)));
        let found = pixel(&drawn(RendererKind::Cpu, &room(DARK, &inside), &overhead()), [48, 48]);
        assert!(found[0] > 2 * found[2] && found[2] > 2 * found[1], "{found:?}");
    }
}

#[test]
fn alpha_of_an_image_cuts_it_out_if_its_texture_has_four_channels() {
    let card = |channels: &str| {
        let asset = format!(
            r#"{DARK}<asset><texture name="hole" type="2d" file="hole.png" nchannel="{channels}"/>
            <material name="hole" texture="hole"/></asset>"#
        );
        let inside = format!(r#"{SUN}<geom type="plane" size="0.5 0.5 1" pos="0 0 1" material="hole"/>"#);
        [RendererKind::Cpu, RendererKind::Path].map(|kind| drawn(kind, &room(&asset, &inside), &overhead()))
    };
    let [middle, edge] = [48 * 96 + 48, 48 * 96 + 48 - 19];
    for frame in card("4") {
        let depths_m = [frame.depth_m[middle], frame.depth_m[edge]];
        assert!((depths_m[0] - 3.0).abs() < 1e-3 && (depths_m[1] - 2.0).abs() < 1e-3, "{depths_m:?}");
        let [through, red] = [[48, 48], [48 - 19, 48]].map(|at| pixel(&frame, at));
        let redness = |[red, green, _]: [u8; 3]| f32::from(red) / f32::from(green);
        assert!(redness(red) > 1.6 && redness(through) < 1.4, "{through:?} and {red:?}");
    }
    for frame in card("3") {
        assert!((frame.depth_m[middle] - 2.0).abs() < 1e-3);
    }
}

/// The faces are placed as MuJoCo's `render_gl3.c` places them: the cube's y is up, its front is behind -y.
#[test]
fn a_sky_is_around_the_camera() {
    let sky = r#"<asset><texture type="skybox" fileright="red.png" fileleft="green.png" fileup="blue.png"
        filedown="grey.png" filefront="green.png" fileback="red.png"/></asset>
        <worldbody><geom size="0.01" pos="9 9 9"/></worldbody>"#;
    for kind in [RendererKind::Cpu, RendererKind::Path] {
        for (direction, expected) in [
            (Vector::X, super::RED),
            (Vector::NEG_X, super::GREEN),
            (Vector::Y, super::RED),
            (Vector::NEG_Y, super::GREEN),
            (Vector::Z, super::BLUE),
            (Vector::NEG_Z, super::GREY),
        ] {
            let frame = drawn(kind, sky, &looking(Vector::ZERO, direction));
            check(&frame, [48, 48], expected, &format!("{kind:?} along {direction}"));
            assert!(frame.depth_m[48 * 96 + 48].is_infinite());
        }
    }
}

#[test]
fn a_gradient_is_light_above_and_dark_below() {
    let sky = r#"<asset><texture type="skybox" builtin="gradient" rgb1="0.9 0.9 1" rgb2="0.1 0.1 0.2" width="512"
        height="3072"/></asset><worldbody><geom size="0.01" pos="9 9 9"/></worldbody>"#;
    let camera = looking(Vector::ZERO, Vector::X);
    let frame = drawn(RendererKind::Cpu, sky, &camera);
    let column: Vec<u8> = (0..96).map(|row| pixel(&frame, [48, row])[0]).collect();
    assert!(column.is_sorted_by(|above, below| above >= below), "{column:?}");
    assert!(column[0] > 150 && column[95] < 110, "{column:?}");
}
