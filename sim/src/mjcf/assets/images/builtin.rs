//! Textures that MuJoCo draws itself. Source: MuJoCo's `user_objects.cc`, version 3.3.

use std::f64::consts::FRAC_PI_2;

use image::{Rgb, RgbImage};
use roxmltree::Node;

/// Maximum width and height; MuJoCo's own textures repeat and need no more.
const MAX_SIDE: u32 = 1024;
/// Maximum width and height of a sky without marks.
const MAX_PLAIN_SKY_SIDE: u32 = 128;
const DEFAULT_RGB_1: [f64; 3] = [0.8; 3];
/// Share of the texels that `mark="random"` paints if a file gives no share.
const DEFAULT_RANDOM_SHARE: f64 = 0.01;

/// A builtin texture as a file states it.
struct Builtin {
    kind: Kind,
    first_rgb: [f64; 3],
    second_rgb: [f64; 3],
    mark: Mark,
    mark_rgb: [f64; 3],
    random_share: f64,
}

#[derive(Clone, Copy)]
enum Kind {
    Flat,
    Checker,
    Gradient,
}

#[derive(Clone, Copy, PartialEq)]
enum Mark {
    None,
    Edge,
    Cross,
    Random,
}

/// Returns the image of an element `<texture builtin=...>`, or the six images of a cube in the order +x, -x,
/// +y, -y, +z, -z. Returns an empty vector for other textures.
pub(super) fn images(texture: &Node) -> Vec<RgbImage> {
    let kind = match texture.attribute("builtin") {
        Some("flat") => Kind::Flat,
        Some("checker") => Kind::Checker,
        Some("gradient") => Kind::Gradient,
        _ => return Vec::new(),
    };
    let builtin = Builtin {
        kind,
        first_rgb: numbers(texture, "rgb1").unwrap_or(DEFAULT_RGB_1),
        second_rgb: numbers(texture, "rgb2").unwrap_or([0.5; 3]),
        mark: match texture.attribute("mark") {
            Some("edge") => Mark::Edge,
            Some("cross") => Mark::Cross,
            Some("random") => Mark::Random,
            _ => Mark::None,
        },
        mark_rgb: numbers(texture, "markrgb").unwrap_or([0.0; 3]),
        random_share: numbers(texture, "random").map_or(DEFAULT_RANDOM_SHARE, |[share]| share),
    };
    let side = |name: &str| {
        let pixels = texture.attribute(name).and_then(|text| text.trim().parse::<u32>().ok());
        pixels.unwrap_or(1).clamp(1, MAX_SIDE)
    };
    let (width, height) = (side("width"), side("height"));
    match texture.attribute("type") {
        // One texel is enough for a plain colour.
        Some("2d") if builtin.is_plain() => vec![builtin.flat_image(1, 1)],
        Some("2d") => vec![builtin.flat_image(width, height)],
        // Plain gradients need few texels: the sky is blended between them.
        Some("skybox") if builtin.mark == Mark::None => {
            (0..6).map(|face| builtin.face(face, width.min(MAX_PLAIN_SKY_SIDE))).collect()
        }
        _ => (0..6).map(|face| builtin.face(face, width)).collect(),
    }
}

/// Returns the attribute `rgb1` as bytes.
pub(super) fn first_colour(texture: &Node) -> [u8; 3] {
    bytes(numbers(texture, "rgb1").unwrap_or(DEFAULT_RGB_1)).0
}

fn numbers<const N: usize>(node: &Node, name: &str) -> Option<[f64; N]> {
    let words = node.attribute(name)?.split_ascii_whitespace();
    let values: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
    values.try_into().ok()
}

impl Builtin {
    fn is_plain(&self) -> bool {
        matches!((self.kind, self.mark), (Kind::Flat, Mark::None))
    }

    /// Returns the image of a `2d` texture.
    fn flat_image(&self, width: u32, height: u32) -> RgbImage {
        let plain = |column: u32, row: u32| match self.kind {
            Kind::Flat => bytes(self.first_rgb),
            Kind::Checker => self.square(2 * column >= width, 2 * row >= height),
            Kind::Gradient => {
                let (x, y) = (across(column, width), -across(row, height));
                self.between(2.0 * x.hypot(y) - 1.0, [self.first_rgb, self.second_rgb])
            }
        };
        RgbImage::from_fn(width, height, |column, row| {
            self.marked([column, row], [width, height]).unwrap_or_else(|| plain(column, row))
        })
    }

    /// Returns the image of a cube's face.
    fn face(&self, face: u32, side: u32) -> RgbImage {
        let is_along_z = face >= 4;
        let plain = |column: u32, row: u32| match self.kind {
            Kind::Flat if face == 3 => bytes(self.second_rgb),
            Kind::Flat => bytes(self.first_rgb),
            Kind::Checker => self.square((2 * column >= side) != is_along_z, 2 * row >= side),
            Kind::Gradient => {
                let (x, y) = (across(column, side), -across(row, side));
                let along = (1.0 + x * x + y * y).sqrt();
                let up_share = 1.0 - (1.0 / along).acos() / FRAC_PI_2;
                let elevation_share = match face {
                    2 => up_share,
                    3 => -up_share,
                    _ => (y / along).asin() / FRAC_PI_2,
                };
                self.between(elevation_share, [self.second_rgb, self.first_rgb])
            }
        };
        RgbImage::from_fn(side, side, |column, row| {
            self.marked([column, row], [side; 2]).unwrap_or_else(|| plain(column, row))
        })
    }

    fn square(&self, is_right: bool, is_low: bool) -> Rgb<u8> {
        bytes(if is_right == is_low { self.first_rgb } else { self.second_rgb })
    }

    /// Returns a colour between two, the first at -1 and the second at 1, along a sigmoid.
    fn between(&self, level: f64, [first, second]: [[f64; 3]; 2]) -> Rgb<u8> {
        let share = (0.5 + level / (2.0 * (1.0 + level * level)).sqrt()).clamp(0.0, 1.0);
        bytes(std::array::from_fn(|i| share * second[i] + (1.0 - share) * first[i]))
    }

    /// Returns the colour of the marks if one covers this texel.
    fn marked(&self, [column, row]: [u32; 2], [width, height]: [u32; 2]) -> Option<Rgb<u8>> {
        let is_marked = match self.mark {
            Mark::None => false,
            Mark::Edge => column == 0 || row == 0 || column + 1 == width || row + 1 == height,
            Mark::Cross => column == width / 2 || row == height / 2,
            Mark::Random => scattered(column + row * width) < self.random_share,
        };
        is_marked.then(|| bytes(self.mark_rgb))
    }
}

/// Returns a column or row as a coordinate from -1 to 1.
fn across(pixel: u32, pixels: u32) -> f64 {
    2.0 * f64::from(pixel) / f64::from(pixels.saturating_sub(1).max(1)) - 1.0
}

/// Returns a pseudo-random number from 0 to 1. The marked texels therefore differ from MuJoCo's.
fn scattered(number: u32) -> f64 {
    let mixed = u64::from(number).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
    (mixed >> 11) as f64 / (1u64 << 53) as f64
}

fn bytes(rgb: [f64; 3]) -> Rgb<u8> {
    Rgb(rgb.map(|part| (255.0 * part) as u8))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(attributes: &str) -> Vec<RgbImage> {
        let colours = r#"rgb1="1 0.5 0" rgb2="0.2 0.3 0.9" markrgb="0 1 0""#;
        let text = format!("<texture {colours} {attributes}/>");
        images(&roxmltree::Document::parse(&text).expect("an element").root_element())
    }

    fn rows(image: &RgbImage, channel: usize) -> Vec<Vec<u8>> {
        image.rows().map(|row| row.map(|pixel| pixel.0[channel]).collect()).collect()
    }

    /// The numbers are those of MuJoCo 3.3.5.
    #[test]
    fn images_are_those_of_mujoco() {
        let [checker] = &drawn(r#"type="2d" builtin="checker" width="4" height="2""#)[..] else {
            panic!("one image")
        };
        assert_eq!(rows(checker, 0), [[255, 255, 51, 51], [51, 51, 255, 255]]);
        let edge = drawn(r#"type="2d" builtin="checker" mark="edge" width="6" height="4""#);
        assert_eq!(rows(&edge[0], 1)[1], [255, 127, 127, 76, 76, 255]);
        assert_eq!(rows(&edge[0], 1)[3], [255; 6]);
        let cross = drawn(r#"type="2d" builtin="checker" mark="cross" width="6" height="4""#);
        assert_eq!(rows(&cross[0], 1)[3], [76, 76, 76, 255, 127, 127]);
        let gradient = drawn(r#"type="2d" builtin="gradient" width="5" height="4""#);
        assert_eq!(rows(&gradient[0], 0)[1], [51, 124, 198, 124, 51]);
        assert_eq!(rows(&gradient[0], 2)[1], [229, 146, 63, 146, 229]);
    }

    /// The numbers are those of MuJoCo 3.3.5.
    #[test]
    fn cubes_have_six_faces() {
        let gradient = drawn(r#"builtin="gradient" width="4" height="4""#);
        let first_rows: Vec<_> = gradient.iter().map(|face| rows(face, 0).swap_remove(0)).collect();
        let [side, up, down] = [[205, 215, 215, 205], [205, 215, 215, 205], [100, 90, 90, 100]];
        assert_eq!(first_rows, [side, side, up, down, side, side]);
        assert_eq!(rows(&gradient[0], 0)[2], [131, 125, 125, 131]);
        assert_eq!(rows(&gradient[2], 0)[1], [215, 237, 237, 215]);
        let checker = drawn(r#"type="cube" builtin="checker" width="2" height="2""#);
        let corners: Vec<u8> = checker.iter().map(|face| face.get_pixel(0, 0).0[0]).collect();
        assert_eq!(corners, [255, 255, 255, 255, 51, 51]);
        let flat = drawn(r#"type="cube" builtin="flat" width="1" height="1""#);
        let reds: Vec<u8> = flat.iter().map(|face| face.get_pixel(0, 0).0[0]).collect();
        assert_eq!(reds, [255, 255, 255, 51, 255, 255]);
        assert_eq!(drawn(r#"type="skybox" builtin="gradient" width="4" height="24""#), gradient);
    }

    #[test]
    fn random_marks_are_as_many_as_asked() {
        let [image] =
            &drawn(r#"type="2d" builtin="flat" mark="random" random="0.1" width="100" height="100""#)[..]
        else {
            panic!("one image")
        };
        let marked = image.pixels().filter(|pixel| pixel.0[1] == 255).count();
        assert!((850..1150).contains(&marked), "{marked}");
    }
}
