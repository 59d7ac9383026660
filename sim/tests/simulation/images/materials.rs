//! Materials: layers with roles, roughness and metal. Colours of images are those of MuJoCo 3.3.5's.

use tandem_sim::Vector;
use tandem_sim::mjcf::Document;
use tandem_sim::render::{Camera, Frame, RendererKind};

use super::{GREEN, GREY, RED, drawn, looking, pixel};

const DARK: &str = r#"<visual><headlight active="0"/></visual>"#;
/// Maximum difference of colours.
const TOLERANCE: u8 = 4;

fn overhead() -> Camera {
    looking(Vector::new(0.0, 0.0, 3.0), Vector::ZERO)
}

/// Returns a floor of a material in the light of a sun, with textures of the files of [`drawn`].
fn floor(material: &str, sun: &str) -> String {
    let texture = |name: &str, attributes: &str| {
        format!(r#"<texture name="{name}" type="2d" file="{name}.png" {attributes}/>"#)
    };
    let textures: String =
        ["four", "red", "green", "grey", "tilted"].iter().map(|name| texture(name, "")).collect();
    let linear = r#"<texture name="light" type="2d" file="red.png" colorspace="sRGB"/>"#;
    let light = format!(r#"<light directional="true" castshadow="false" {sun}/>"#);
    format!(
        r#"{DARK}<asset>{textures}{linear}<material name="own" {material}</asset>
        <worldbody><geom type="plane" size="1 1 1" material="own"/>{light}</worldbody>"#
    )
}

const WHITE: &str = r#"diffuse="1 1 1" specular="0 0 0""#;

fn check(frame: &Frame, expected: [u8; 3], what: &str) {
    let found = pixel(frame, [48, 48]);
    let is_near = found.iter().zip(expected).all(|(found, expected)| found.abs_diff(expected) <= TOLERANCE);
    assert!(is_near, "{what}: {found:?} instead of {expected:?}");
}

#[test]
fn an_image_limits_the_light_and_colours_highlights() {
    let bright = r#"diffuse="2 2 2" specular="1 1 1""#;
    let shiny = r#"diffuse="0 0 0" specular="1 1 1""#;
    for (what, material, sun, expected) in [
        ("white light", r#"texture="red"/>"#, WHITE, RED),
        ("bright light", r#"texture="red" specular="1"/>"#, bright, RED),
        ("a highlight", r#"texture="red" specular="0.5"/>"#, shiny, [100, 15, 15]),
        ("a tint", r#"texture="red" rgba="0.5 1 1 1"/>"#, WHITE, [100, 30, 30]),
        ("sRGB", r#"texture="light"/>"#, WHITE, [147, 3, 3]),
    ] {
        check(&drawn(RendererKind::Cpu, &floor(material, sun), &overhead()), expected, what);
    }
    // Lights with shadows add up beyond the image.
    let two = floor(r#"texture="red"/>"#, WHITE).replace("castshadow=\"false\"", "");
    let sun = &two[two.find("<light").expect("a light")..two.find("</worldbody>").expect("an end")];
    let two = two.replace(sun, &format!("{sun}{}", sun.replace("1 1 1", "0.2 0.2 0.2")));
    check(&drawn(RendererKind::Cpu, &two, &overhead()), [240, 36, 36], "two lights");
    // Without light in the file, colours are those of the image.
    let own = floor(r#"texture="light"/>"#, WHITE).replace(DARK, "");
    let unlit = &own[..own.find("<light").expect("a light")];
    let frame = drawn(RendererKind::Cpu, &format!("{unlit}</worldbody>"), &overhead());
    let [red, green, _] = pixel(&frame, [48, 48]).map(f32::from);
    assert!((2.0..6.0).contains(&(red / green)), "{red} and {green}");
}

#[test]
fn layers_give_colour_opacity_and_notes() {
    let layers = |layers: &str| format!(r#">{layers}</material>"#);
    let of_colour = floor(&layers(r#"<layer role="rgb" texture="four"/>"#), WHITE);
    let of_texture = floor(r#"texture="four"/>"#, WHITE);
    for kind in [RendererKind::Cpu, RendererKind::Path] {
        assert_eq!(drawn(kind, &of_colour, &overhead()), drawn(kind, &of_texture, &overhead()));
    }
    let clear = layers(r#"<layer role="rgb" texture="red"/><layer role="opacity" texture="green"/>"#);
    let frame = drawn(RendererKind::Cpu, &floor(&clear, WHITE), &overhead());
    let alpha = f32::from(GREEN[0]) / 255.0;
    let share = 1.0 - (1.0 - alpha) * (1.0 - alpha);
    check(&frame, RED.map(|value| (f32::from(value) * share) as u8), "nothing is behind");
    let text = r#"<mujoco><asset><texture name="t" type="cube" builtin="gradient" width="2" height="2"/>
        <material name="m" reflectance="0.2"><layer role="emissive" texture="t"/><layer role="rgb" texture="t"/>
        </material></asset><worldbody><geom size="1" material="m"/></worldbody></mujoco>"#;
    let notes = Document::parse("room.xml", text).expect("a room").approximations().join("\n");
    assert!(
        notes.contains(r#"`room.xml:2`: <layer role="emissive"> is not drawn; it has an image for"#),
        "{notes}"
    );
    assert!(notes.contains("`room.xml:2`: material `m` has reflectance: path tracing alone"), "{notes}");
    let wrong =
        Document::parse("room.xml", &text.replace("emissive", "glow")).expect_err("a role").to_string();
    assert!(wrong.contains("rgb, rgba, opacity, normal, roughness, metallic, orm"), "{wrong}");
}

/// Texels of `tilted.png` lean to the right of the image by 37 degrees.
#[test]
fn normals_of_a_layer_are_lit_as_slopes_are() {
    let relief = r#"rgba="0.5 0.5 0.5 1"><layer role="normal" texture="tilted"/></material>"#;
    let plain = r#"rgba="0.5 0.5 0.5 1"/>"#;
    for (direction, facing) in [("-0.6 0 -0.8", 1.0), ("0.6 0 -0.8", 0.28), ("0 0.6 -0.8", 0.64)] {
        let sun = format!(r#"{WHITE} dir="{direction}""#);
        let expected = [(127.5 * facing) as u8; 3];
        check(&drawn(RendererKind::Cpu, &floor(relief, &sun), &overhead()), expected, direction);
    }
    let sun = |direction: &str| format!(r#"{WHITE} dir="{direction}""#);
    let traced = |material: &str, direction: &str| {
        let beside =
            r#"<geom type="box" size="0.3 0.3 0.01" pos="0.8 0 0" rgba="0.5 0.5 0.5 1"/></worldbody>"#;
        let scene = floor(material, &sun(direction)).replace("</worldbody>", beside);
        let frame = drawn(RendererKind::Path, &scene, &overhead());
        f32::from(pixel(&frame, [48, 48])[0]) / f32::from(pixel(&frame, [75, 48])[0])
    };
    let [flat, towards, away] =
        [(plain, "-0.6 0 -0.8"), (relief, "-0.6 0 -0.8"), (relief, "0.6 0 -0.8")].map(|(m, d)| traced(m, d));
    assert!(away < 0.8 * flat && flat < 0.97 * towards, "{away}, {flat} and {towards}");
}

#[test]
fn roughness_spreads_highlights_and_metal_colours_them() {
    let shiny = r#"diffuse="0 0 0" specular="1 1 1" dir="0.3 0 -1""#;
    let highlight = |material: &str| {
        let scene = floor(&format!("{material}/>"), shiny);
        pixel(&drawn(RendererKind::Cpu, &scene, &overhead()), [48, 48]).map(f32::from)
    };
    let red = r#"rgba="1 0.2 0.2 1""#;
    let smooth = highlight(&format!(r#"{red} roughness="0.45""#));
    let rough = highlight(&format!(r#"{red} roughness="0.8""#));
    assert!(smooth[0] > 2.0 * rough[0] && rough[0] > 1.0, "{smooth:?} and {rough:?}");
    assert!((smooth[0] - smooth[1]).abs() < 2.0, "{smooth:?} is white");
    let metal = highlight(&format!(r#"{red} roughness="0.45" metallic="1""#));
    assert!((metal[0] - smooth[0]).abs() < 2.0 && metal[1] < 0.3 * metal[0], "{metal:?} is red");
    let stated = format!(r#"{red} shininess="0.5""#);
    let usual = format!(r#"{stated} roughness="0.8""#);
    assert_eq!(highlight(&usual), highlight(&stated), "highlights are those of the stated shininess");
    // A layer of 120 of 255 is as rough as a number of 0.47.
    let of_layer = format!(r#"{red}><layer role="roughness" texture="grey"/></material"#);
    let scene = floor(&format!("{of_layer}>"), shiny);
    let layered = pixel(&drawn(RendererKind::Cpu, &scene, &overhead()), [48, 48]).map(f32::from);
    let number = highlight(&format!(r#"{red} roughness="0.4706""#));
    assert!((layered[0] - number[0]).abs() < 2.0, "{layered:?} and {number:?}");
}

#[test]
fn path_tracing_mirrors_in_metal_in_its_own_colour() {
    let ball = |material: &str| {
        let scene = format!(
            r#"{DARK}<asset><material name="own" rgba="0.9 0.2 0.2 1" {material}/></asset><worldbody>
            <light directional="true" dir="0 0 -1" diffuse="1 1 1" specular="0 0 0"/>
            <geom type="plane" size="2 2 1" rgba="0.7 0.7 0.7 1"/><geom size="0.5" pos="0 0 0.5" material="own"/>
            </worldbody>"#
        );
        let frame = drawn(RendererKind::Path, &scene, &looking(Vector::new(0.0, -3.0, 1.2), Vector::Z * 0.5));
        // The middle of the ball, which is lit from above, and below it, where metal mirrors the floor.
        [42..48, 54..60].map(|rows| {
            let part = rows.flat_map(|row| (40..56).map(move |column| [column, row]));
            part.map(|at| pixel(&frame, at)).fold([0.0f32; 2], |[red_sum, green_sum], [red, green, _]| {
                [red_sum + f32::from(red), green_sum + f32::from(green)]
            })
        })
    };
    let [plain, metal] = [ball(""), ball(r#"metallic="1" roughness="0.3""#)];
    assert!(plain[1][0] < plain[0][0], "{plain:?} is scattered light");
    assert!(metal[1][0] > 2.0 * metal[0][0], "{metal:?} is mirrored");
    let greenness = |[red, green]: [f32; 2]| green / red;
    assert!(
        greenness(metal[1]) < 0.7 * greenness(plain[1]),
        "{metal:?} has one colour, {plain:?} a white coat"
    );
}

#[test]
fn images_may_be_jpeg() {
    let scene = floor(r#"texture="grey"/>"#, WHITE).replace("grey.png", "grey.jpg");
    check(&drawn(RendererKind::Cpu, &scene, &overhead()), super::GREY, "a JPEG file");
}

const NO_LIGHT: &str = r#"diffuse="0 0 0""#;

#[test]
fn a_layer_emits_its_own_light() {
    let emitting = |attributes: &str| {
        format!(r#"{attributes} specular="0"><layer role="emissive" texture="red"/></material>"#)
    };
    for kind in [RendererKind::Cpu, RendererKind::Path] {
        for (attributes, expected) in
            [(r#"rgba="0 1 0 1""#, RED), (r#"emission="0.5""#, [100, 9, 9]), (r#"emission="0""#, [0; 3])]
        {
            let frame = drawn(kind, &floor(&emitting(attributes), NO_LIGHT), &overhead());
            check(&frame, expected, &format!("{kind:?}, {attributes}"));
        }
    }
    // It is added to other light.
    let lit = floor(&emitting(r#"rgba="0 0.2 0 1""#), r#"diffuse="1 1 1""#);
    check(&drawn(RendererKind::Cpu, &lit, &overhead()), [200, 81, 30], "a light");
    let without_lights = |material: &str| {
        let scene = floor(material, NO_LIGHT).replace(DARK, "");
        let unlit = &scene[..scene.find("<light").expect("a light")];
        pixel(&drawn(RendererKind::Cpu, &format!("{unlit}</worldbody>"), &overhead()), [48, 48])
    };
    let [plain, bright] = [r#"rgba="0 0.5 0 1"/>"#, &emitting(r#"rgba="0 0.5 0 1""#)].map(without_lights);
    assert!(
        bright[0] > plain[0] + 140 && bright[1] >= plain[1] && bright[1] < plain[1] + 20,
        "{bright:?} and {plain:?}"
    );
}

#[test]
fn a_layer_keeps_out_ambient_light_alone() {
    let of_role = |role: &str| format!(r#"specular="0"><layer role="{role}" texture="grey"/></material>"#);
    for role in ["occlusion", "orm"] {
        for (sun, expected) in [(r#"diffuse="0 0 0" ambient="1 1 1""#, GREY), (WHITE, [255; 3])] {
            check(&drawn(RendererKind::Cpu, &floor(&of_role(role), sun), &overhead()), expected, role);
        }
    }
    let ratio = |material: &str| {
        let beside = r#"<geom type="box" size="0.3 0.3 0.01" pos="0.8 0 0" rgba="1 1 1 1"/></worldbody>"#;
        let scene = floor(material, r#"diffuse="0.1 0.1 0.1" specular="0 0 0" ambient="0.5 0.5 0.5""#);
        let frame = drawn(RendererKind::Path, &scene.replace("</worldbody>", beside), &overhead());
        f32::from(pixel(&frame, [48, 48])[0]) / f32::from(pixel(&frame, [75, 48])[0])
    };
    let [shaded, open] =
        [of_role("occlusion"), r#"rgba="1 1 1 1" specular="0"/>"#.into()].map(|material| ratio(&material));
    assert!(shaded < 0.85 && open > 0.95, "{shaded} and {open}");
}

/// A red wall stands behind the place of the floor at which the camera looks.
#[test]
fn path_tracing_mirrors_in_planes_and_upper_sides_of_boxes() {
    let wall = r#"<geom type="box" size="1 0.05 1" pos="0 1 1" rgba="0.8 0.1 0.1 1"/></worldbody>"#;
    let (camera, sun) =
        (looking(Vector::new(0.0, -1.5, 1.0), Vector::ZERO), format!(r#"{WHITE} dir="0 1 -1""#));
    let seen = |kind: RendererKind, reflectance: &str, geom: &str| {
        let scene =
            floor(&format!(r#"rgba="0.5 0.5 0.5 1" specular="0" reflectance="{reflectance}"/>"#), &sun);
        let scene = scene.replace(r#"type="plane" size="1 1 1""#, geom).replace("</worldbody>", wall);
        pixel(&drawn(kind, &scene, &camera), [48, 48]).map(i32::from)
    };
    let plane = r#"type="plane" size="1 1 1""#;
    for geom in [plane, r#"type="box" size="1 1 0.1" pos="0 0 -0.1""#] {
        let [plain, half, whole] = ["0", "0.5", "1"].map(|share| seen(RendererKind::Path, share, geom));
        assert!(whole[0] > 2 * whole[1], "{whole:?} is the wall");
        for axis in 0..3 {
            assert!(
                (half[axis] - (plain[axis] + whole[axis]) / 2).abs() <= 3,
                "{half:?}: {plain:?}, {whole:?}"
            );
        }
        assert_eq!(seen(RendererKind::Cpu, "1", geom), seen(RendererKind::Cpu, "0", geom));
    }
    let upright = r#"type="box" size="1 0.1 1" pos="0 0 -0.1" euler="90 0 0""#;
    assert_eq!(
        seen(RendererKind::Path, "1", upright),
        seen(RendererKind::Path, "0", upright),
        "another side"
    );
}
