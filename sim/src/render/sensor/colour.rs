//! Colour images of a D435i's sensor, an OmniVision OV2740: exposure and gain, rolling shutter, motion blur
//! and noise.

use std::sync::LazyLock;

use super::Shot;
use super::lens::LensMap;
use super::noise::PixelNoise;
use super::warp::{LinearImage, Warp};
use crate::render::shading::srgb::SrgbTable;
use crate::srgb::linear_light;

/// Number of sensor rows that the image covers.
const SENSOR_ROWS: f32 = 1080.0;
/// Readout time of a sensor row: 1080 cycles of 72 MHz. Source: Linux's driver `ov2740`.
const ROW_S: f32 = 15e-6;
/// Time from the readout of the first row to that of the last.
pub const READOUT_S: f32 = SENSOR_ROWS * ROW_S;

/// Range of a row's exposure time: librealsense's minimum is 100 us, and 33 ms fill a frame period at 30 Hz.
const EXPOSURE_S: [f32; 2] = [1e-4, 0.033];
/// Range of the analogue gain in Linux's driver `ov2740`: 128 to 1983 in units of 1/128.
const GAIN: [f32; 2] = [1.0, 1983.0 / 128.0];
/// Target mean luminance of automatic exposure, which is that of a grey card.
const MEAN_LUMINANCE: f32 = 0.18;

/// Full-well capacity and read noise of a pixel, in electrons. OmniVision publishes neither for the OV2740.
/// These are the values of its OV5647, whose pixels have the same pitch of 1.4 um: a full well of 4300, and a
/// dynamic range of 68 dB.
const FULL_WELL: f32 = 4300.0;
const READ_NOISE: f32 = 1.7;
/// Electrons per second in a pixel that sees a white surface in linear light 1. Assumed: an illuminance of
/// 500 lx (EN 12464-1, offices), and a lens of f/2.0 that passes 28 lx to the sensor; 8000 photons per second
/// and lux on 1.4 um squared, and 0.3 electrons per photon behind the colour filter.
const WHITE_1_S: f32 = 7e4;
/// Shares of the sensor's pixels with a red, green and blue filter.
const FILTERED: [f32; 3] = [0.25, 0.5, 0.25];

/// Luminance weights of linear sRGB, after Rec. 709.
const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];
/// Stride of the metered pixels.
const METERED: usize = 5;

static DECODED: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| linear_light(byte as f32 / 255.0)));
static ENCODER: LazyLock<SrgbTable> = LazyLock::new(SrgbTable::default);

/// Light that falls on the sensor.
pub struct SensorLight {
    ideal: LinearImage,
    mean_value: f32,
}

/// Exposure time and gain of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    pub time_s: f32,
    pub gain: f32,
}

impl Exposure {
    /// Returns the setting that multiplies the light by `wanted_factor`, within the sensor's limits. A longer
    /// exposure is preferred to a higher gain.
    fn of(wanted_factor: f32) -> Exposure {
        let light_1_s = WHITE_1_S / FULL_WELL;
        let time_s = (wanted_factor / light_1_s).clamp(EXPOSURE_S[0], EXPOSURE_S[1]);
        Exposure { time_s, gain: (wanted_factor / (light_1_s * time_s)).clamp(GAIN[0], GAIN[1]) }
    }

    /// Returns the factor from light to image values, where 1 is saturation.
    pub fn factor(&self) -> f32 {
        WHITE_1_S / FULL_WELL * self.time_s * self.gain
    }

    /// Returns the variance of image values per colour channel, as a slope and an offset. The slope is shot
    /// noise, proportional to the number of electrons; the offset is read noise. If the image has fewer rows
    /// than the sensor, each of its pixels is the mean of several sensor pixels.
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
            // The image's time is the exposure of its middle row.
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
