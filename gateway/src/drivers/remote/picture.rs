//! Pictures in the size and order that a policy wants.

use image::{RgbImage, imageops};
use serde::{Deserialize, Serialize};

use super::values::{Array, Elements};

/// How a picture gets to another size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fit {
    /// As large as fits, in the middle of black, as `resize_with_pad` of openpi-client.
    #[default]
    Pad,
    /// To the new size, whatever becomes of its shape.
    Stretch,
    /// The largest part of the right shape, from the middle.
    Crop,
}

/// In which order the elements come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layout {
    /// Rows, columns, colours.
    #[default]
    Hwc,
    /// Colours, rows, columns.
    Chw,
}

/// Smooth in both directions, as Pillow's bilinear filter.
const FILTER: imageops::FilterType = imageops::FilterType::Triangle;

/// The picture in another size.
pub fn fitted(picture: &RgbImage, [width, height]: [u32; 2], fit: Fit) -> RgbImage {
    if picture.dimensions() == (width, height) {
        return picture.clone();
    }
    match fit {
        Fit::Stretch => imageops::resize(picture, width, height, FILTER),
        Fit::Pad => {
            let ratio = shrinking(picture, [width, height]).into_iter().fold(0.0, f64::max);
            let [w, h] = [picture.width(), picture.height()].map(|side| (f64::from(side) / ratio) as u32);
            let small = imageops::resize(picture, w.clamp(1, width), h.clamp(1, height), FILTER);
            let mut padded = RgbImage::new(width, height);
            let [left, top] = [(width - small.width()) / 2, (height - small.height()) / 2];
            imageops::replace(&mut padded, &small, left.into(), top.into());
            padded
        }
        Fit::Crop => {
            let ratio = shrinking(picture, [width, height]).into_iter().fold(f64::INFINITY, f64::min);
            let [w, h] = [width, height].map(|side| (f64::from(side) * ratio) as u32);
            let [w, h] = [w.clamp(1, picture.width()), h.clamp(1, picture.height())];
            let [left, top] = [(picture.width() - w) / 2, (picture.height() - h) / 2];
            let part = imageops::crop_imm(picture, left, top, w, h).to_image();
            imageops::resize(&part, width, height, FILTER)
        }
    }
}

/// How many times smaller each side becomes.
fn shrinking(picture: &RgbImage, size_px: [u32; 2]) -> [f64; 2] {
    let [width, height] = size_px.map(f64::from);
    [f64::from(picture.width()) / width, f64::from(picture.height()) / height]
}

/// The picture as an array of bytes.
pub fn array(picture: &RgbImage, layout: Layout) -> Array {
    let [width, height] = [picture.width() as usize, picture.height() as usize];
    match layout {
        Layout::Hwc => {
            Array { shape: vec![height, width, 3], elements: Elements::Bytes(picture.as_raw().clone()) }
        }
        Layout::Chw => {
            let plane = |colour: usize| picture.as_raw().iter().skip(colour).step_by(3).copied();
            Array {
                shape: vec![3, height, width],
                elements: Elements::Bytes((0..3).flat_map(plane).collect()),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use image::Rgb;

    use super::*;

    const RED: Rgb<u8> = Rgb([200, 0, 0]);
    const BLUE: Rgb<u8> = Rgb([0, 0, 200]);
    const BLACK: Rgb<u8> = Rgb([0, 0, 0]);

    /// Left half red, right half blue.
    fn halves() -> RgbImage {
        RgbImage::from_fn(320, 240, |u, _| if u < 160 { RED } else { BLUE })
    }

    #[test]
    fn pictures_fit_in_three_ways() {
        let seen = |fit: Fit| {
            let picture = fitted(&halves(), [224, 224], fit);
            assert_eq!(picture.dimensions(), (224, 224));
            [(10, 10), (10, 112), (213, 112), (213, 213)].map(|(u, v)| *picture.get_pixel(u, v))
        };
        assert_eq!(seen(Fit::Pad), [BLACK, RED, BLUE, BLACK]);
        assert_eq!(seen(Fit::Stretch), [RED, RED, BLUE, BLUE]);
        assert_eq!(seen(Fit::Crop), [RED, RED, BLUE, BLUE]);
        // A quarter less high than wide: 224 by 168, with 28 black rows above and below.
        let padded = fitted(&halves(), [224, 224], Fit::Pad);
        let rows = (0..224).filter(|v| *padded.get_pixel(5, *v) == RED).count();
        assert_eq!((rows, *padded.get_pixel(5, 27), *padded.get_pixel(5, 28)), (168, BLACK, RED));
    }

    #[test]
    fn colours_come_last_or_first() {
        let picture = RgbImage::from_raw(2, 1, vec![1, 2, 3, 4, 5, 6]).unwrap();
        let array = |layout| super::array(&picture, layout);
        let bytes = |bytes: [u8; 6]| Elements::Bytes(bytes.into());
        assert_eq!(array(Layout::Hwc), Array { shape: vec![1, 2, 3], elements: bytes([1, 2, 3, 4, 5, 6]) });
        assert_eq!(array(Layout::Chw), Array { shape: vec![3, 1, 2], elements: bytes([1, 4, 2, 5, 3, 6]) });
    }
}
