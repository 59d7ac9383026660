//! Images in the size and axis order that a policy expects.

use image::{RgbImage, imageops};
use tandem_episodes::Picture;

use crate::{
    map::{Fit, Layout},
    values::{Array, Elements},
};

/// Returns the image in the requested size as an array of bytes.
pub fn array(picture: &Picture, size_px: [u32; 2], fit: Fit, layout: Layout) -> Array {
    if [picture.width, picture.height] == size_px {
        return arranged(picture.rgb().to_vec(), size_px, layout);
    }
    arranged(fitted(picture, size_px, fit).into_raw(), size_px, layout)
}

/// Resizes the image.
fn fitted(picture: &Picture, [width, height]: [u32; 2], fit: Fit) -> RgbImage {
    match fit {
        Fit::Stretch => picture.scaled([width, height]),
        Fit::Pad => {
            let ratio = shrinking(picture, [width, height]).into_iter().fold(0.0, f64::max);
            let [w, h] = [picture.width, picture.height].map(|side| (f64::from(side) / ratio) as u32);
            let small = picture.scaled([w.clamp(1, width), h.clamp(1, height)]);
            let mut padded = RgbImage::new(width, height);
            let [left, top] = [(width - small.width()) / 2, (height - small.height()) / 2];
            imageops::replace(&mut padded, &small, left.into(), top.into());
            padded
        }
        Fit::Crop => {
            let ratio = shrinking(picture, [width, height]).into_iter().fold(f64::INFINITY, f64::min);
            let [w, h] = [width, height].map(|side| (f64::from(side) * ratio) as u32);
            let [w, h] = [w.clamp(1, picture.width), h.clamp(1, picture.height)];
            let [left, top] = [(picture.width - w) / 2, (picture.height - h) / 2];
            let pixels = picture.pixels();
            let part = RgbImage::from_fn(w, h, |u, v| *pixels.get_pixel(left + u, top + v));
            Picture::new(w, h, part.into_raw()).scaled([width, height])
        }
    }
}

/// Returns the reduction factors of width and height.
fn shrinking(picture: &Picture, size_px: [u32; 2]) -> [f64; 2] {
    let [width, height] = size_px.map(f64::from);
    [f64::from(picture.width) / width, f64::from(picture.height) / height]
}

/// Converts bytes in row-major order, with colours last, to the requested axis order.
fn arranged(rgb: Vec<u8>, [width, height]: [u32; 2], layout: Layout) -> Array {
    let [width, height] = [width as usize, height as usize];
    match layout {
        Layout::Hwc => Array { shape: vec![height, width, 3], elements: Elements::Bytes(rgb) },
        Layout::Chw => {
            let plane = |colour: usize| rgb.iter().skip(colour).step_by(3).copied();
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

    /// Returns an image whose left half is red and whose right half is blue.
    fn halves() -> Picture {
        let image = RgbImage::from_fn(320, 240, |u, _| if u < 160 { RED } else { BLUE });
        Picture::new(320, 240, image.into_raw())
    }

    fn fit_to_square(fit: Fit) -> RgbImage {
        let array = array(&halves(), [224, 224], fit, Layout::Hwc);
        assert_eq!(array.shape, [224, 224, 3]);
        RgbImage::from_raw(224, 224, array.bytes()).unwrap()
    }

    #[test]
    fn pictures_fit_in_three_ways() {
        let seen = |fit: Fit| {
            let picture = fit_to_square(fit);
            [(10, 10), (10, 112), (213, 112), (213, 213)].map(|(u, v)| *picture.get_pixel(u, v))
        };
        assert_eq!(seen(Fit::Pad), [BLACK, RED, BLUE, BLACK]);
        assert_eq!(seen(Fit::Stretch), [RED, RED, BLUE, BLUE]);
        assert_eq!(seen(Fit::Crop), [RED, RED, BLUE, BLUE]);
        // The height is three quarters of the width: 224 by 168, with 28 black rows above and below.
        let padded = fit_to_square(Fit::Pad);
        let rows = (0..224).filter(|v| *padded.get_pixel(5, *v) == RED).count();
        assert_eq!((rows, *padded.get_pixel(5, 27), *padded.get_pixel(5, 28)), (168, BLACK, RED));
    }

    #[test]
    fn colours_come_last_or_first() {
        let picture = Picture::new(2, 1, vec![1, 2, 3, 4, 5, 6]);
        let array = |layout| super::array(&picture, [2, 1], Fit::Pad, layout);
        let bytes = |bytes: [u8; 6]| Elements::Bytes(bytes.into());
        assert_eq!(array(Layout::Hwc), Array { shape: vec![1, 2, 3], elements: bytes([1, 2, 3, 4, 5, 6]) });
        assert_eq!(array(Layout::Chw), Array { shape: vec![3, 1, 2], elements: bytes([1, 4, 2, 5, 3, 6]) });
    }
}
