//! The covariance of the errors of a state, and its update by measurements.

use pulp::{Arch, Simd, WithSimd};
use rapier3d::glamx::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// Start index of each part of the error.
pub(super) const TURN: usize = 0;
pub(super) const VELOCITY: usize = 3;
pub(super) const PLACE: usize = 6;
pub(super) const GYRO_BIAS: usize = 9;
pub(super) const ACC_BIAS: usize = 12;
pub(super) const FEET: usize = 15;
pub(super) const HEADINGS: usize = 21;
pub(super) const ERRORS: usize = 23;
/// Number of errors that a step of time changes: turn, velocity and place.
const MOVING: usize = GYRO_BIAS;

/// One number for each error.
pub(super) type Errors = [f64; ERRORS];

/// Symmetric matrix, rows and columns in the order of the errors.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Covariance([Errors; ERRORS]);

/// Non-zero derivatives of a measurement with respect to the errors.
pub(super) struct MeasurementRow {
    parts: [(usize, f64); MAX_PARTS],
    len: usize,
}

/// Maximum number of derivatives: two of the place, three of the turn.
const MAX_PARTS: usize = 5;

impl MeasurementRow {
    pub fn of<const N: usize>(parts: [(usize, f64); N]) -> MeasurementRow {
        let mut row = MeasurementRow { parts: [(0, 0.0); MAX_PARTS], len: 0 };
        parts.into_iter().for_each(|(error, derivative)| row.push(error, derivative));
        row
    }

    pub fn push(&mut self, error: usize, derivative: f64) {
        self.parts[self.len] = (error, derivative);
        self.len += 1;
    }

    fn dot(&self, errors: &Errors) -> f64 {
        self.parts[..self.len].iter().map(|(error, derivative)| errors[*error] * derivative).sum()
    }
}

impl Covariance {
    pub fn diagonal(sigma: impl Fn(usize) -> f64) -> Covariance {
        let mut rows = [[0.0; ERRORS]; ERRORS];
        (0..ERRORS).for_each(|error| rows[error][error] = sigma(error) * sigma(error));
        Covariance(rows)
    }

    /// Computes P+ = F P F^T with F the step of the errors over `dt_s`:
    ///   theta+ = theta - R b_g dt,   v+ = v - [f]x theta dt - R b_a dt,   p+ = p + v dt.
    /// F changes only the first three parts, so the covariances of the others with them in P F^T are
    /// those of F P, mirrored.
    pub fn predict(&mut self, rotation: DMat3, force_m_s2: DVec3, dt_s: f64) {
        let by_bias = rotation * -dt_s;
        let by_turn = cross(force_m_s2) * -dt_s;
        let biased = |i: usize, at: usize| [0, 1, 2].map(|j| (at + j, by_bias.col(j)[i]));
        for i in 0..3 {
            self.add_rows(PLACE + i, [(VELOCITY + i, dt_s)]);
        }
        for i in 0..3 {
            let [x, y, z] = biased(i, ACC_BIAS);
            let [j, k] = [(i + 1) % 3, (i + 2) % 3];
            let turns = [j, k].map(|axis| (TURN + axis, by_turn.col(axis)[i]));
            self.add_rows(VELOCITY + i, [turns[0], turns[1], x, y, z]);
        }
        for i in 0..3 {
            self.add_rows(TURN + i, biased(i, GYRO_BIAS));
        }
        for row in &mut self.0[..MOVING] {
            let part = |at: usize| DVec3::new(row[at], row[at + 1], row[at + 2]);
            let turned = by_bias * part(GYRO_BIAS);
            let hastened = by_turn * part(TURN) + by_bias * part(ACC_BIAS);
            let moved = part(VELOCITY) * dt_s;
            for i in 0..3 {
                row[TURN + i] += turned[i];
                row[VELOCITY + i] += hastened[i];
                row[PLACE + i] += moved[i];
            }
        }
        for i in MOVING..ERRORS {
            (0..MOVING).for_each(|j| self.0[i][j] = self.0[j][i]);
        }
    }

    /// Adds an independent step of this standard deviation to the error.
    pub fn widen(&mut self, error: usize, sigma: f64) {
        self.0[error][error] += sigma * sigma;
    }

    /// Removes all correlations of the error, and its variance.
    pub fn forget(&mut self, error: usize) {
        self.0[error] = [0.0; ERRORS];
        self.0.iter_mut().for_each(|row| row[error] = 0.0);
    }

    /// Replaces the error at `to` by a copy of the present one at `from`.
    pub fn copy(&mut self, from: usize, to: usize) {
        self.0[to] = self.0[from];
        self.0[to][to] = self.0[from][from];
        let column = self.0[to];
        self.0.iter_mut().zip(column).for_each(|(row, value)| row[to] = value);
    }

    #[cfg(test)]
    pub fn of_rows(rows: [Errors; ERRORS]) -> Covariance {
        Covariance(rows)
    }

    #[cfg(test)]
    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.0[row][column]
    }

    /// Adds multiples of other rows to a row.
    fn add_rows<const N: usize>(&mut self, to: usize, from: [(usize, f64); N]) {
        let mut row = self.0[to];
        for (from, factor) in from {
            row.iter_mut().zip(&self.0[from]).for_each(|(value, other)| *value += factor * other);
        }
        self.0[to] = row;
    }

    /// Computes h^T P h.
    fn variance(&self, row: &MeasurementRow) -> f64 {
        let parts = &row.parts[..row.len];
        let by_row = parts.iter().map(|(i, d_i)| {
            let line = &self.0[*i];
            d_i * parts.iter().map(|(j, d_j)| d_j * line[*j]).sum::<f64>()
        });
        by_row.sum()
    }

    /// Computes P h.
    fn times(&self, row: &MeasurementRow) -> Errors {
        let mut product = [0.0; ERRORS];
        for (error, derivative) in &row.parts[..row.len] {
            product.iter_mut().zip(&self.0[*error]).for_each(|(sum, value)| *sum += value * derivative);
        }
        product
    }
}

/// Measurements at one instant, processed one by one: each is  y = h . errors + noise.
pub(super) struct Update<'a> {
    pub covariance: &'a mut Covariance,
    pub errors: Errors,
    /// Errors that are not corrected, but whose uncertainty is taken into account (Schmidt's filter).
    pub considered: &'a [usize],
}

impl Update<'_> {
    /// Widens the error at `slipped` by the deviation, if a measurement exceeds `SLIP_GATE`.
    pub fn gate(&mut self, row: &MeasurementRow, y: f64, sigma: f64, slipped: usize) {
        let rest = y - row.dot(&self.errors);
        if rest * rest > super::SLIP_GATE * (self.covariance.variance(row) + sigma * sigma) {
            self.covariance.widen(slipped, rest);
        }
    }

    /// Applies a measurement:
    ///   k = P h / s,   s = h^T P h + sigma^2,
    ///   P+ = P - k (P h)^T - P h k^T + s k k^T,   k = 0 where considered.
    pub fn measure(&mut self, row: &MeasurementRow, y: f64, sigma: f64) {
        let product = self.covariance.times(row);
        let spread = row.dot(&product) + sigma * sigma;
        let step = (y - row.dot(&self.errors)) / spread;
        let kept = self.considered_block();
        Arch::new().dispatch(Taking { update: self, product: &product, spread, step });
        self.restore(kept, &product, step);
    }

    /// Returns the covariances of the considered errors with one another, which a measurement leaves
    /// unchanged.
    fn considered_block(&self) -> [[f64; 2]; 2] {
        let mut kept = [[0.0; 2]; 2];
        for (i, error) in self.considered.iter().enumerate() {
            for (j, other) in self.considered.iter().enumerate() {
                kept[i][j] = self.covariance.0[*error][*other];
            }
        }
        kept
    }

    fn restore(&mut self, kept: [[f64; 2]; 2], product: &Errors, step: f64) {
        for (i, error) in self.considered.iter().enumerate() {
            self.errors[*error] -= product[*error] * step;
            for (j, other) in self.considered.iter().enumerate() {
                self.covariance.0[*error][*other] = kept[i][j];
            }
        }
    }
}

/// Update on the widest vector registers of the processor: the part of  k (P h)^T  for every row.
struct Taking<'a, 'b> {
    update: &'a mut Update<'b>,
    product: &'a Errors,
    spread: f64,
    step: f64,
}

impl WithSimd for Taking<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Taking { update, product, spread, step } = self;
        for (i, line) in update.covariance.0.iter_mut().enumerate() {
            // Errors unrelated to a measurement stay unchanged, for example headings of a walking robot.
            if product[i] == 0.0 {
                continue;
            }
            let gain = product[i] / spread;
            line.iter_mut().zip(product).for_each(|(value, other)| *value -= gain * other);
            update.errors[i] += product[i] * step;
        }
    }
}

/// Returns the matrix of a cross product: [v]x w = v x w.
pub(super) fn cross(v: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, v.z, -v.y), DVec3::new(-v.z, 0.0, v.x), DVec3::new(v.y, -v.x, 0.0))
}
