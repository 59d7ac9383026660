//! Checks that need no world. Each error is a sentence for the caller with the mistake, its place and a valid
//! value.

use crate::limits::{LARGEST, MAX_PIXELS, SMALLEST_COMPONENT};
use crate::parts::{BASE_COLUMNS, PixelRegion};

/// Checks that every number is finite and not too large.
pub fn finite(place: &str, values: &[f64]) -> Result<(), String> {
    match values.iter().find(|number| number.is_nan() || number.abs() > LARGEST) {
        Some(number) => Err(format!("{place} holds {number}; every number must be finite, from -1e6 to 1e6")),
        None => Ok(()),
    }
}

/// Checks that the given values of a base command are finite. They are in the order of the command's columns.
pub fn base(command: [Option<f64>; 4]) -> Result<(), String> {
    BASE_COLUMNS.iter().zip(command).try_for_each(|(column, part)| finite(column, part.as_slice()))
}

/// Checks that a quaternion has a direction. Its length does not matter, because it is normalized before use.
pub fn quaternion(place: &str, quaternion_wxyz: &[f64; 4]) -> Result<(), String> {
    finite(place, quaternion_wxyz)?;
    if quaternion_wxyz.iter().all(|part| part.abs() < SMALLEST_COMPONENT) {
        let norm = quaternion_wxyz.iter().map(|part| part * part).sum::<f64>().sqrt();
        return Err(format!(
            "{place} has norm {norm}, so it has no direction; give [w, x, y, z] with norm 1, for example [1, 0, 0, 0] for no rotation"
        ));
    }
    Ok(())
}

/// Checks a position and an orientation, both of which are optional.
pub fn pose(
    side: &str,
    position_m: Option<&[f64; 3]>,
    quaternion_wxyz: Option<&[f64; 4]>,
) -> Result<(), String> {
    if let Some(position_m) = position_m {
        finite(&format!("{side}_position_m"), position_m)?;
    }
    if let Some(quaternion_wxyz) = quaternion_wxyz {
        quaternion(&format!("{side}_quaternion_wxyz"), quaternion_wxyz)?;
    }
    Ok(())
}

/// Checks that there is at least one control step. The episode checks the maximum, which depends on the
/// protocol.
pub fn steps(steps: u32) -> Result<(), String> {
    if steps == 0 {
        return Err(
            "steps is 0; give at least 1 control step of 20 ms, for example 25 for half a second".into()
        );
    }
    Ok(())
}

/// Checks that there is at least one robot and that no robot is named twice.
pub fn robots(names: &[&str]) -> Result<(), String> {
    if names.is_empty() {
        return Err("robots is empty; name at least one robot, for example \"A\"".into());
    }
    let twice = names.iter().enumerate().find(|(index, name)| names[..*index].contains(name));
    match twice {
        Some((_, name)) => Err(format!("robot {name:?} is named twice; name each robot at most once")),
        None => Ok(()),
    }
}

/// Maximum stride that an error suggests. A region of the whole image is allowed with it.
const WIDEST_STRIDE: u32 = 20;

/// Checks that there is at least one pixel and not too many. The episode checks that pixels are in the image.
pub fn pixels(pixels: &[[i64; 2]]) -> Result<(), String> {
    if pixels.is_empty() {
        return Err("pixels is empty; give at least one [u, v], for example [[160, 120]]".into());
    }
    if pixels.len() > MAX_PIXELS {
        return Err(format!(
            "pixels holds {}; give at most {MAX_PIXELS}, for example every tenth one by a region with stride 10",
            pixels.len()
        ));
    }
    Ok(())
}

/// Checks that the stride of a region is not zero, and that the region does not contain too many pixels.
pub fn region(region: &PixelRegion) -> Result<(), String> {
    if region.stride == 0 {
        return Err(
            "region.stride is 0; give at least 1, for example 10 for every tenth pixel across and down"
                .into(),
        );
    }
    let fits = |stride: u32| region.count(stride) <= MAX_PIXELS as u128;
    if fits(region.stride) {
        return Ok(());
    }
    let count = region.count(region.stride);
    let way = match (region.stride..=WIDEST_STRIDE).find(|stride| fits(*stride)) {
        Some(stride) => format!("; with stride {stride} it fits"),
        None => String::new(),
    };
    Err(format!("region names {count} pixels; name at most {MAX_PIXELS}{way}"))
}

/// Checks every entry of a list of robots. Errors name the robot.
pub fn each<T>(
    entries: &[T],
    robot: impl Fn(&T) -> &str,
    check: impl Fn(&T) -> Result<(), String>,
) -> Result<(), String> {
    entries
        .iter()
        .try_for_each(|entry| check(entry).map_err(|reason| format!("robot {:?}: {reason}", robot(entry))))
}

/// Returns the number of control steps of a command with one row per step.
pub fn row_steps(rows: Option<&Vec<Vec<f64>>>) -> u32 {
    u32::try_from(rows.map_or(0, Vec::len)).unwrap_or(u32::MAX)
}

/// Checks that every robot has at least one row, and as many rows as the first robot.
pub fn equal_rows<'a>(robots: impl Iterator<Item = (&'a str, &'a Vec<Vec<f64>>)>) -> Result<(), String> {
    let counts: Vec<(&str, usize)> = robots.map(|(robot, rows)| (robot, rows.len())).collect();
    let Some((first, count)) = counts.first() else { return Ok(()) };
    if *count == 0 {
        return Err(format!("robot {first:?} has no rows; give at least 1, one per control step of 20 ms"));
    }
    match counts.iter().find(|(_, other)| other != count) {
        Some((robot, other)) => Err(format!(
            "robot {first:?} has {count} rows and robot {robot:?} has {other}; give every robot the same number of rows"
        )),
        None => Ok(()),
    }
}
