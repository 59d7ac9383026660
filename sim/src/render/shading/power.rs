//! Powers in vectorisable steps, and the conversion between linear light and file values (sRGB).

/// Smallest base of a power. Smaller numbers are replaced by it.
const LEAST: f32 = 1e-12;

/// Returns a power of a non-negative number, within a thousandth. For exponents up to 200 the result is a
/// normal number.
#[inline(always)]
pub fn power(value: f32, exponent_value: f32) -> f32 {
    let value = if value > LEAST { value } else { LEAST };
    exp2(exponent_value * log2(value))
}

/// Converts linear light to sRGB, the colour space of files.
#[inline(always)]
pub fn file_value(linear_value: f32) -> f32 {
    let curve = 1.055 * power(linear_value, 1.0 / 2.4) - 0.055;
    if linear_value <= 0.003_130_8 { 12.92 * linear_value } else { curve }
}

/// Converts a file value (sRGB) to linear light.
#[inline(always)]
pub fn linear_value(file_value: f32) -> f32 {
    let curve = power((file_value + 0.055) / 1.055, 2.4);
    if file_value <= 0.040_45 { file_value / 12.92 } else { curve }
}

/// Blends linear light over other linear light in file values (sRGB), like MuJoCo.
#[inline(always)]
pub fn blended(behind_value: f32, front_value: f32, share: f32) -> f32 {
    linear_value(file_value(behind_value) * (1.0 - share) + file_value(front_value) * share)
}

/// Returns the binary logarithm of a normal positive number.
#[inline(always)]
fn log2(value: f32) -> f32 {
    let bits = value.to_bits();
    let whole = (bits >> 23) as f32 - 127.0;
    let rest = f32::from_bits(bits & 0x007f_ffff | 0x3f80_0000) - 1.0;
    // A least-squares fit between powers of two, exact at both ends.
    let bend = -0.441_740_3 + rest * (0.266_029_9 + rest * (-0.146_314_34 + rest * 0.044_004_69));
    whole + rest + rest * (rest - 1.0) * bend
}

/// Returns two to the power of a number; 0 below the range of normal numbers.
#[inline(always)]
fn exp2(value: f32) -> f32 {
    let value = if value < 127.0 { value } else { 127.0 };
    let whole = value.floor();
    let rest = value - whole;
    let bend = 0.307_004_34 + rest * (0.065_438_75 + rest * 0.013_686_47);
    let mantissa = 1.0 + rest + rest * (rest - 1.0) * bend;
    let exponent = (if whole > -127.0 { whole } else { -127.0 }) + 127.0;
    f32::from_bits((exponent as i32 as u32) << 23) * mantissa
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_and_values_are_those_of_the_library() {
        for value in [1e-9f32, 0.003, 0.2, 0.5, 0.999, 1.0, 1.5] {
            for exponent in [0.0f32, 0.45, 1.0, 2.2, 10.0, 64.0] {
                let (found, expected) = (power(value, exponent), value.powf(exponent));
                let tolerance = 2e-3 * expected + 1e-30;
                assert!((found - expected).abs() < tolerance, "{value}^{exponent}: {found}, {expected}");
            }
        }
        assert_eq!(power(0.0, 64.0), 0.0);
        for byte in 0..=255u8 {
            let value = f32::from(byte) / 255.0;
            let linear = linear_value(value);
            assert!((file_value(linear) - value).abs() < 1e-3, "{value}");
            assert!((linear - crate::render::shading::linear([value; 3]).x).abs() < 1e-3, "{value}");
        }
    }
}
