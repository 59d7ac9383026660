//! Blocks of numbers and points that are processed together.

use rapier3d::math::{Matrix, Pose, Vector};

/// Number of f32 values in the widest registers in common use.
pub const LANES: usize = 8;

/// A block of numbers, or a smaller one.
pub type Lanes<const N: usize = LANES> = [f32; N];

/// Computes the numbers of a block in a loop that compilers vectorise.
#[inline(always)]
pub fn lanes<T: Copy + Default, const N: usize>(each: impl Fn(usize) -> T) -> [T; N] {
    let mut numbers = [T::default(); N];
    for (i, number) in numbers.iter_mut().enumerate() {
        *number = each(i);
    }
    numbers
}

/// Computes one value for each axis.
#[inline(always)]
pub fn axes<T>(each: impl Fn(usize) -> T) -> [T; 3] {
    [each(0), each(1), each(2)]
}

/// An affine map of points: each coordinate is a scalar product plus a constant.
#[derive(Clone, Copy, Debug, Default)]
pub struct Affine(pub [(Vector, f32); 3]);

/// Points, stored coordinate by coordinate in whole blocks. The last block may end with meaningless points.
#[derive(Default)]
pub struct Points {
    count: usize,
    blocks_m: Vec<[Lanes; 3]>,
}

impl Affine {
    pub const IDENTITY: Affine = Affine([(Vector::X, 0.0), (Vector::Y, 0.0), (Vector::Z, 0.0)]);

    pub fn of(pose: Pose) -> Affine {
        let matrix = Matrix::from_quat(pose.rotation);
        let row = |i: usize| (matrix.row(i), pose.translation[i]);
        Affine([row(0), row(1), row(2)])
    }

    /// Returns the map that applies first `pose` and then this map.
    pub fn after(self, pose: Pose) -> Affine {
        let back = pose.rotation.inverse();
        Affine(self.0.map(|(axis, constant)| (back * axis, constant + axis.dot(pose.translation))))
    }

    #[inline(always)]
    pub fn map(&self, point_m: Vector) -> [f32; 3] {
        axes(
            #[inline(always)]
            |i| {
                let (axis, constant) = self.0[i];
                axis.x * point_m.x + axis.y * point_m.y + axis.z * point_m.z + constant
            },
        )
    }

    #[inline(always)]
    pub fn map_lanes<const N: usize>(&self, [x, y, z]: &[Lanes<N>; 3]) -> [Lanes<N>; 3] {
        axes(
            #[inline(always)]
            |row| {
                let (axis, constant) = self.0[row];
                lanes(|i| axis.x * x[i] + axis.y * y[i] + axis.z * z[i] + constant)
            },
        )
    }

    /// Returns the derivatives of the coordinates along directions.
    #[inline(always)]
    pub fn derivatives<const N: usize>(&self, [x, y, z]: &[Lanes<N>; 3]) -> [Lanes<N>; 3] {
        axes(
            #[inline(always)]
            |row| {
                let (axis, _) = self.0[row];
                lanes(|i| axis.x * x[i] + axis.y * y[i] + axis.z * z[i])
            },
        )
    }
}

impl Points {
    pub fn new(points_m: &[Vector]) -> Points {
        let mut blocks_m = vec![[[0.0; LANES]; 3]; points_m.len().div_ceil(LANES)];
        for (number, point_m) in points_m.iter().enumerate() {
            for (axis, coordinates_m) in blocks_m[number / LANES].iter_mut().enumerate() {
                coordinates_m[number % LANES] = point_m[axis];
            }
        }
        Points { count: points_m.len(), blocks_m }
    }

    pub fn count(&self) -> usize {
        self.count
    }

    /// Writes the result of `map` for each point, in the points' order.
    #[inline(always)]
    pub fn map_into<const N: usize>(
        &self,
        mapped_values: &mut Vec<[f32; N]>,
        map: impl Fn(&[Lanes; 3]) -> [Lanes; N],
    ) {
        mapped_values.resize(self.blocks_m.len() * LANES, [0.0; N]);
        for (block, mapped_values) in self.blocks_m.iter().zip(mapped_values.as_chunks_mut::<LANES>().0) {
            let numbers = map(block);
            for (i, mapped_values) in mapped_values.iter_mut().enumerate() {
                for (mapped_values, numbers) in mapped_values.iter_mut().zip(&numbers) {
                    *mapped_values = numbers[i];
                }
            }
        }
    }
}
