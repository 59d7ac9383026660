//! Trees of one layout side by side, for example robots of one model. Each tree has one lane of a vector, and
//! every operation acts on all lanes. Lanes are independent. Results are bit-identical to scalar operations.

mod alike;

use std::array::from_fn;
use std::ops::{Add, AddAssign, Mul, Sub};

pub use alike::Alike;

pub const ABREAST: usize = 4;
/// Number of independent partial sums, each over every fourth column, as in `rows`.
const SIDE: usize = 4;

/// One number for each tree.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub struct Abreast(pub [f64; ABREAST]);

/// Rows of one degree of freedom for several trees: the non-zero columns, and the entries of Y in them.
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

    /// Returns a mask that can stay in a vector register. In each lane, all bits are set if the condition
    /// holds, and otherwise none.
    #[inline(always)]
    pub fn mask(self, other: Abreast, is: impl Fn(f64, f64) -> bool) -> Abreast {
        self.with(other, |a, b| f64::from_bits(if is(a, b) { u64::MAX } else { 0 }))
    }

    #[inline(always)]
    pub fn and(self, mask: Abreast) -> Abreast {
        self.with(mask, |a, b| f64::from_bits(a.to_bits() & b.to_bits()))
    }

    #[inline(always)]
    pub fn or(self, other: Abreast) -> Abreast {
        self.with(other, |a, b| f64::from_bits(a.to_bits() | b.to_bits()))
    }

    /// Returns true if any bit of any number is set.
    #[inline(always)]
    pub fn any(self) -> bool {
        self.0.iter().fold(0, |bits, number| bits | number.to_bits()) != 0
    }

    /// Returns true if all bits of all numbers are set.
    #[inline(always)]
    pub fn all(self) -> bool {
        self.0.iter().fold(u64::MAX, |bits, number| bits & number.to_bits()) == u64::MAX
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
    /// Returns the velocities along the rows.
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

    /// Adds impulses in the lanes of the mask. Velocities in other lanes are unchanged, including the sign of
    /// a zero.
    #[inline(always)]
    pub fn push_impulse(&self, impulse: Abreast, acts: Abreast, w: &mut [Abreast]) {
        let impulse = impulse.and(acts);
        let nothing = Abreast([-0.0; ABREAST])
            .with(acts, |nothing, acts| f64::from_bits(nothing.to_bits() & !acts.to_bits()));
        for (column, y) in self.column.iter().zip(self.y) {
            let change = (Abreast::ZERO + *y * impulse).or(nothing);
            w[usize::from(*column)] += change;
        }
    }
}
