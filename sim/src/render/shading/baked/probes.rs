//! A grid of probes: light at points of a room, in six directions.

use rapier3d::math::Vector;
use serde::{Deserialize, Serialize};

use super::{LightCube, SurfacePoint};

/// Distance between probes. It is larger in rooms that would need more than `MAX_PROBES`.
const PITCH_M: f32 = 0.3;
const MAX_PROBES: f32 = 6000.0;

#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Probes {
    corner_m: [f32; 3],
    pitch_m: f32,
    counts: [usize; 3],
    /// Ambient cubes in the order of [`Probes::points`]: x varies fastest, z slowest.
    pub cubes: Vec<LightCube>,
}

impl Probes {
    /// Spreads probes over a box.
    pub fn over([low_m, high_m]: [Vector; 2]) -> Probes {
        let size_m = high_m - low_m;
        let usual = size_m.element_product() / (PITCH_M * PITCH_M * PITCH_M);
        let pitch_m = PITCH_M * (usual / MAX_PROBES).max(1.0).cbrt();
        let counts = size_m.to_array().map(|side_m| (side_m / pitch_m).ceil().max(1.0) as usize + 1);
        Probes { corner_m: low_m.to_array(), pitch_m, counts, cubes: Vec::new() }
    }

    /// Returns true if there is a cube for each probe.
    pub fn are_whole(&self) -> bool {
        self.counts.iter().all(|count| *count >= 2)
            && self.counts.iter().try_fold(1usize, |all, count| all.checked_mul(*count))
                == Some(self.cubes.len())
    }

    /// Returns the points of all probes, each with six normals.
    pub fn points(&self) -> impl Iterator<Item = SurfacePoint> {
        let [columns, rows, layers] = self.counts;
        (0..columns * rows * layers).flat_map(move |number| {
            let place = [number % columns, number / columns % rows, number / columns / rows];
            let point_m = Vector::from(self.corner_m) + Vector::from(place.map(|i| i as f32)) * self.pitch_m;
            (0..6).map(move |side| {
                let mut normal = Vector::ZERO;
                normal[side / 2] = if side % 2 == 0 { 1.0 } else { -1.0 };
                let seed = [(place[0] + columns * side) as u32, (place[1] + rows * place[2]) as u32];
                SurfacePoint { point_m, normal, seed }
            })
        })
    }

    /// Sets the light of the probes. A probe without light gets the mean of its neighbours' light.
    pub fn set(&mut self, mut cubes: Vec<Option<LightCube>>) {
        let [columns, rows, _] = self.counts;
        let steps = [1, columns, columns * rows];
        let place = |number: usize| [number % columns, number / columns % rows, number / columns / rows];
        while cubes.contains(&None) && cubes.iter().any(Option::is_some) {
            let before = cubes.clone();
            for (number, cube) in cubes.iter_mut().enumerate().filter(|(_, cube)| cube.is_none()) {
                let place = place(number);
                let beside = (0..3).flat_map(|axis| {
                    let lower = (place[axis] > 0).then(|| number - steps[axis]);
                    let upper = (place[axis] + 1 < self.counts[axis]).then(|| number + steps[axis]);
                    [lower, upper].into_iter().flatten()
                });
                let lit: Vec<LightCube> = beside.filter_map(|number| before[number]).collect();
                *cube = (!lit.is_empty()).then(|| mean(&lit));
            }
        }
        self.cubes = cubes.into_iter().map(Option::unwrap_or_default).collect();
    }

    /// Returns the light at a point, interpolated between the eight probes around it. Beyond the grid, the
    /// light is that at the border.
    pub fn cube(&self, point_m: Vector) -> LightCube {
        let [columns, rows, _] = self.counts;
        let (mut first, mut shares) = ([0; 3], [0.0; 3]);
        for axis in 0..3 {
            let last = (self.counts[axis] - 1) as f32;
            let at = ((point_m[axis] - self.corner_m[axis]) / self.pitch_m).clamp(0.0, last);
            first[axis] = (at as usize).min(self.counts[axis] - 2);
            shares[axis] = at - first[axis] as f32;
        }
        let mut sum = LightCube::default();
        for corner in 0..8 {
            let upper: [usize; 3] = std::array::from_fn(|axis| corner >> axis & 1);
            let share = (0..3).map(|axis| if upper[axis] == 1 { shares[axis] } else { 1.0 - shares[axis] });
            let [x, y, z]: [usize; 3] = std::array::from_fn(|axis| first[axis] + upper[axis]);
            add(&mut sum, &self.cubes[x + columns * (y + rows * z)], share.product());
        }
        sum
    }
}

fn mean(cubes: &[LightCube]) -> LightCube {
    let mut sum = LightCube::default();
    cubes.iter().for_each(|cube| add(&mut sum, cube, 1.0 / cubes.len() as f32));
    sum
}

fn add(sum: &mut LightCube, cube: &LightCube, share: f32) {
    for (sum, side) in sum.iter_mut().zip(cube) {
        for (sum, value) in sum.iter_mut().zip(side) {
            *sum += value * share;
        }
    }
}
