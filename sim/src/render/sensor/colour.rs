//! Colours by a D435i's sensor, an OmniVision OV2740: exposure and gain, rolling shutter, blur of a moving
//! camera, and noise.

use std::sync::LazyLock;

use super::Shot;
use super::lens::LensMap;
use super::noise::PixelNoise;
use super::warp::{LinearImage, Warp};
use crate::render::shading::srgb::SrgbTable;
use crate::srgb::linear_light;

/// Rows of the sensor that become the image's.
const SENSOR_ROWS: f32 = 1080.0;
/// Time from one row of the sensor to the next: 1080 cycles of 72 MHz. Source: Linux's driver `ov2740`.
const ROW_S: f32 = 15e-6;
/// Time from the first row to the last.
pub const READOUT_S: f32 = SENSOR_ROWS * ROW_S;

/// Exposure of a row: 100 us is the least that librealsense sets, and 33 ms fill a frame of 30 Hz.
const EXPOSURE_S: [f32; 2] = [1e-4, 0.033];
/// Analogue gain of Linux's driver `ov2740`, 128 to 1983 in units of 1/128.
const GAIN: [f32; 2] = [1.0, 1983.0 / 128.0];
/// Mean luminance for which the camera exposes: a grey card's.
const MEAN_LUMINANCE: f32 = 0.18;

/// Electrons of a saturated pixel and of its readout. OmniVision publishes neither for the OV2740; these are
/// those of its OV5647, whose pixel has the same 1.4 um: full well 4300, and a dynamic range of 68 dB.
const FULL_WELL: f32 = 4300.0;
const READ_NOISE: f32 = 1.7;
/// Electrons that a pixel collects in a second from white at the brightness of linear light 1. Assumed: 500 lx
/// (EN 12464-1, offices), a lens of f/2.0, which lets 28 lx through to the sensor, 8000 photons a second and
/// lux on 1.4 um squared, and 0.3 electrons a photon behind the colour filter.
const WHITE_1_S: f32 = 7e4;
/// Share of the sensor's pixels behind a filter of red, green and blue.
const FILTERED: [f32; 3] = [0.25, 0.5, 0.25];

/// Luminance of linear sRGB, after Rec. 709.
const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];
/// One pixel of this many is metered.
const METERED: usize = 5;

static DECODED: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| linear_light(byte as f32 / 255.0)));
static ENCODER: LazyLock<SrgbTable> = LazyLock::new(SrgbTable::default);

/// Light that falls on the sensor.
pub struct SensorLight {
    ideal: LinearImage,
    mean_value: f32,
}

/// Setting of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    pub time_s: f32,
    pub gain: f32,
}

impl Exposure {
    /// Returns the setting that multiplies the light by `wanted_factor`, within its limits. A long exposure
    /// is preferred to gain.
    fn of(wanted_factor: f32) -> Exposure {
        let light_1_s = WHITE_1_S / FULL_WELL;
        let time_s = (wanted_factor / light_1_s).clamp(EXPOSURE_S[0], EXPOSURE_S[1]);
        Exposure { time_s, gain: (wanted_factor / (light_1_s * time_s)).clamp(GAIN[0], GAIN[1]) }
    }

    /// Returns the factor from light to values of the image, of which 1 is saturated.
    pub fn factor(&self) -> f32 {
        WHITE_1_S / FULL_WELL * self.time_s * self.gain
    }

    /// Returns the variance of a value of the image, of each colour, as a slope and an offset: shot noise,
    /// which is the number of electrons, and that of reading. An image of fewer rows than the sensor is the
    /// mean of its pixels.
    pub fn variance(&self, height: u32) -> [[f32; 2]; 3] {
        let pixels = (SENSOR_ROWS / height as f32).powi(2);
        let value = self.gain / FULL_WELL;
        FILTERED.map(|share| {
            let mean_of = (share * pixels).max(1.0);
            [value / mean_of, (READ_NOISE * value).powi(2) / mean_of]
        })
    }
}

impl SensorLight {
    /// Converts an ideal image, three bytes a pixel.
    pub fn of(rgb: &[u8], width: u32, height: u32) -> SensorLight {
        let ideal = LinearImage::of(rgb, width as usize, height as usize, &DECODED);
        let mean_value = LUMINANCE.iter().zip(ideal.mean(METERED)).map(|(weight, mean)| weight * mean).sum();
        SensorLight { ideal, mean_value }
    }

    /// Returns the exposure that the camera settles on in this light.
    pub fn exposure(&self) -> Exposure {
        Exposure::of(MEAN_LUMINANCE / self.mean_value.max(1e-6))
    }

    /// Returns the sensor's image, three bytes a pixel, sRGB.
    pub fn taken(&self, exposure: &Exposure, depth_m: &[f32], map: &LensMap, shot: &Shot) -> Vec<u8> {
        let (width, height) = (map.lens.width as usize, map.lens.height as usize);
        let (factor, variance) = (exposure.factor(), exposure.variance(map.lens.height));
        let noise = PixelNoise::new(shot.seed, 0);
        let mut warp = Warp::new(map);
        let mut rgb = vec![0; 3 * width * height];
        let [mut values, mut drawn]: [[Vec<f32>; 3]; 2] =
            std::array::from_fn(|_| std::array::from_fn(|_| vec![0.0; width]));
        for (row, bytes) in rgb.chunks_exact_mut(3 * width).enumerate() {
            // The image is of the moment in which its middle row is exposed.
            let late_s = ((row as f32 + 0.5) / height as f32 - 0.5) * READOUT_S;
            warp.place_row(row, depth_m, &shot.motion);
            for column in 0..width {
                let light = warp.light(&self.ideal, column, late_s, exposure.time_s);
                let three = noise.three(row * width + column);
                for axis in 0..3 {
                    values[axis][column] = light[axis];
                    drawn[axis][column] = three[axis];
                }
            }
            for ((values, drawn), [slope, offset]) in values.iter_mut().zip(&drawn).zip(variance) {
                for (value, drawn) in values.iter_mut().zip(drawn) {
                    let exposed = *value * factor;
                    *value = exposed + (slope * exposed + offset).sqrt() * drawn;
                }
            }
            ENCODER.encode(&values, bytes);
        }
        rgb
    }
}
