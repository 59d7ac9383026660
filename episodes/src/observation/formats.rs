//! Views in formats for programs: raw colours, and depth at every pixel.

use tandem_sim::render::{PictureError, encode_depth_png};
use tandem_tools_spec::{Bytes, CameraArrays, DepthFormat, Formats, ImageFormat, Protocol};

use super::RobotView;
use crate::EpisodeError;

/// Checks that a protocol allows these formats. Agents may measure depth only at chosen pixels, which is
/// part of their task.
pub fn check_formats(formats: &Formats, protocol: Protocol) -> Result<(), EpisodeError> {
    match (formats.depth, protocol) {
        (Some(_), Protocol::Agentic) => Err(EpisodeError::DepthImage { protocol: protocol.name() }),
        (Some(_), Protocol::Benchmark) | (None, _) => Ok(()),
    }
}

/// Returns the arrays requested in addition to a PNG, for the camera of `robot`; `None` if no arrays are
/// requested.
pub fn arrays(
    robot: &str,
    view: &RobotView,
    formats: &Formats,
) -> Result<Option<CameraArrays>, PictureError> {
    let RobotView { picture, depth_m, .. } = view;
    let rgb = (formats.images == Some(ImageFormat::Rgb)).then(|| Bytes(picture.rgb().to_vec()));
    let (mut depth_float16, mut depth_png16) = (None, None);
    match formats.depth {
        Some(DepthFormat::Float16) => {
            let halves = depth_m.iter().map(|depth_m| half_bits(*depth_m));
            depth_float16 = Some(Bytes(halves.flat_map(u16::to_le_bytes).collect()));
        }
        Some(DepthFormat::Png16) => {
            depth_png16 = Some(Bytes(encode_depth_png(picture.width, picture.height, depth_m)?));
        }
        None => {}
    }
    let asked = rgb.is_some() || depth_float16.is_some() || depth_png16.is_some();
    Ok(asked.then(|| CameraArrays { robot: robot.into(), rgb, depth_float16, depth_png16 }))
}

/// Converts a number from 0 to infinity to half precision (IEEE 754 binary16), rounded to nearest, ties
/// to even.
fn half_bits(value: f32) -> u16 {
    const INFINITY: u16 = 0x7c00;
    /// 2^-112 shifts exponents from the bias of single precision, 127, to that of half precision, 15.
    const REBIAS: f32 = f32::from_bits((127 - 112) << 23);
    if !value.is_finite() {
        return INFINITY;
    }
    let bits = (value * REBIAS).to_bits();
    let tie_to_even = (bits >> 13) & 1;
    ((bits + 0xfff + tie_to_even) >> 13).min(INFINITY.into()) as u16
}

#[cfg(test)]
mod tests {
    use tandem_sim::render::{Distortion, Frame, Intrinsics};

    use super::*;

    /// Expected values from `numpy.float16(x).view(numpy.uint16)`.
    #[test]
    fn half_precision() {
        for (number, bits) in [
            (0.0, 0x0000),
            (1.0, 0x3c00),
            (1.5, 0x3e00),
            (0.1, 0x2e66),
            (2.7182817, 0x4170),
            (1.0004883, 0x3c00),
            (1.0014648, 0x3c02),
            (0.00006104, 0x0400),
            (0.000001, 0x0011),
            (65504.0, 0x7bff),
            (65520.0, 0x7c00),
            (1e9, 0x7c00),
            (f32::INFINITY, 0x7c00),
        ] {
            assert_eq!(half_bits(number), bits, "{number}");
        }
    }

    #[test]
    fn only_what_is_asked_for_comes() {
        let distortion = Distortion::NONE;
        let intrinsics = Intrinsics { width: 2, height: 1, focal_px: 1.0, cx: 0.5, cy: 0.0, distortion };
        let frame = Frame {
            width: 2,
            height: 1,
            rgb: vec![7; 6],
            depth_m: vec![1.5, f32::INFINITY],
            ids: vec![0; 2],
        };
        let view = RobotView::new(intrinsics, frame);
        let of = |images, depth| arrays("A", &view, &Formats { images, depth }).unwrap();
        assert_eq!(of(None, None), None);
        assert_eq!(of(Some(ImageFormat::Png), None), None);
        let all = of(Some(ImageFormat::Rgb), Some(DepthFormat::Float16)).unwrap();
        assert_eq!(all.rgb, Some(Bytes(vec![7; 6])));
        assert_eq!((all.depth_float16, all.depth_png16), (Some(Bytes(vec![0, 0x3e, 0, 0x7c])), None));
        let png = of(None, Some(DepthFormat::Png16)).unwrap().depth_png16.unwrap();
        assert!(png.0.starts_with(b"\x89PNG"));
    }

    #[test]
    fn agents_get_no_depth_images() {
        let depth = Formats { images: None, depth: Some(DepthFormat::Float16) };
        let refused = check_formats(&depth, Protocol::Agentic).unwrap_err().to_string();
        assert!(refused.contains("query_depth") && refused.contains("benchmark"), "{refused}");
        assert!(check_formats(&depth, Protocol::Benchmark).is_ok());
        assert!(check_formats(&Formats::default(), Protocol::Agentic).is_ok());
    }
}
