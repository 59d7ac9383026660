//! Trees of one layout side by side, as robots of one model are: each has a lane of a vector, and what is done to one is done to all.
//! Lanes have no part in each other, and add and multiply as single numbers do, bit for bit.

mod alike;

use std::array::from_fn;
use std::ops::{Add, AddAssign, Mul, Sub};

pub use alike::Alike;

pub const ABREAST: usize = 4;
/// Sums over every fourth column grow independently of each other, as in `rows`.
const SIDE: usize = 4;

/// One number of each tree.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub struct Abreast(pub [f64; ABREAST]);

/// Rows of one degree of freedom side by side: their columns that are not zero, and Y in them.
pub struct AbreastRow<'a> {
    pub column: &'a [u16],
    pub y: &'a [Abreast],
}

impl Abreast {
    pub const ZERO: Abreast = Abreast([0.0; ABREAST]);
    pub const ONE: Abreast = Abreast([1.0; ABREAST]);

    #[inline(always)]
    pub fn with(self, other: Abreast, of: impl Fn(f64, f64) -> f64) -> Abreast {
        Abreast(from_fn(|lane| of(self.0[lane], other.0[lane])))
    }

    /// The bits that one of both has.
    #[inline(always)]
    pub fn or(self, other: Abreast) -> Abreast {
        self.with(other, |a, b| f64::from_bits(a.to_bits() | b.to_bits()))
    }
}

impl Add for Abreast {
    type Output = Abreast;

    #[inline(always)]
    fn add(self, other: Abreast) -> Abreast {
        self.with(other, |a, b| a + b)
    }
}

impl Sub for Abreast {
    type Output = Abreast;

    #[inline(always)]
    fn sub(self, other: Abreast) -> Abreast {
        self.with(other, |a, b| a - b)
    }
}

impl Mul for Abreast {
    type Output = Abreast;

    #[inline(always)]
    fn mul(self, other: Abreast) -> Abreast {
        self.with(other, |a, b| a * b)
    }
}

impl AddAssign for Abreast {
    #[inline(always)]
    fn add_assign(&mut self, other: Abreast) {
        *self = *self + other;
    }
}

impl AbreastRow<'_> {
    /// Velocities along the rows.
    #[inline(always)]
    pub fn velocity(&self, w: &[Abreast]) -> Abreast {
        let mut sums = [Abreast::ZERO; SIDE];
        let ((columns, last_columns), (ys, last_ys)) =
            (self.column.as_chunks::<SIDE>(), self.y.as_chunks::<SIDE>());
        for (column, y) in columns.iter().zip(ys) {
            for side in 0..SIDE {
                sums[side] += y[side] * w[usize::from(column[side])];
            }
        }
        for ((sum, column), y) in sums.iter_mut().zip(last_columns).zip(last_ys) {
            *sum += *y * w[usize::from(*column)];
        }
        sums[0] + sums[1] + sums[2] + sums[3]
    }

    /// Adds impulses where they act; elsewhere velocities stay what they are, the sign of a zero included.
    #[inline(always)]
    pub fn push_impulse(&self, impulse: Abreast, acts: [bool; ABREAST], w: &mut [Abreast]) {
        let impulse = Abreast(from_fn(|lane| if acts[lane] { impulse.0[lane] } else { 0.0 }));
        let nothing = Abreast(acts.map(|acts| if acts { 0.0 } else { -0.0 }));
        for (column, y) in self.column.iter().zip(self.y) {
            let change = (Abreast::ZERO + *y * impulse).or(nothing);
            w[usize::from(*column)] += change;
        }
    }
}
