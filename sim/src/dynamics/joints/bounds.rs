//! Rows of single joints, each along one degree of freedom: drives at their limits, dry friction and limits
//! of position.

use std::array::from_fn;
use std::ops::Range;

use super::DriveLaw;
use crate::dynamics::settings::{Pass, Settings};
use crate::dynamics::trees::Trees;
use crate::dynamics::trees::abreast::{ABREAST, Abreast, AbreastRow, Alike};
use crate::dynamics::trees::rows::Whitened;
use crate::dynamics::trees::tree::Tree;

#[derive(Default)]
pub struct JointRows {
    /// All rows in the order of the links, with the rows of trees of one layout side by side.
    all: Vec<JointRow>,
    /// Range of the rows of each group of trees of one layout.
    of_alike: Vec<Range<usize>>,
    /// Columns within a tree, and the entries of Y in them, for all rows.
    column: Vec<u16>,
    y: Vec<Abreast>,
    drives: Vec<BoundedDrive>,
    /// Whitened velocities of the trees being processed.
    w: Vec<Abreast>,
}

/// Rows of one joint, with a lane for each tree of a group. For a tree without such a row, masses, friction
/// and impulses are zero.
struct JointRow {
    link: usize,
    exists: [bool; ABREAST],
    /// Range of this row's columns among those of all rows; the same for Y.
    places: Range<usize>,
    /// Inverse mass Y . Y, and its inverse.
    inverse_mass: Abreast,
    mass: Abreast,
    /// Range of this joint's drives among all bounded drives.
    drives: Range<usize>,
    dry: DryFriction,
    range: JointRange,
}

/// Drive near its limit of effort or speed, which the mass matrix does not contain.
struct BoundedDrive {
    lane: usize,
    law: DriveLaw,
    impulse: f64,
}

struct DryFriction {
    most: Abreast,
    impulse: Abreast,
}

/// Both ends of a joint's range: the allowed velocities towards them, by [`Pass`], and the impulses. An end
/// that does not exist never limits the velocity.
struct JointRange {
    exists: [bool; ABREAST],
    down: [Abreast; 2],
    up: [Abreast; 2],
    impulse_up: Abreast,
    impulse_down: Abreast,
    /// True if one of the impulses is not zero.
    pushes: bool,
}

/// Extra speed (rad/s or m/s) in the test for a row. A joint without other rows gets one for its range at
/// first only if it could reach an end when moving faster by this amount.
const NEAR_RANGE: f64 = 10.0;
/// Overshoot (rad or m) beyond the range at which a joint without a row gets one, and the step is repeated.
const MAX_OVERSHOOT: f64 = 0.01;

impl Tree {
    /// Returns true if a joint has a row regardless of its range.
    fn is_held(&self, link: usize) -> bool {
        self.bounded[link] || self.links[link].joint.axis().is_some_and(|axis| axis.friction_loss > 0.0)
    }

    /// Returns true if a joint's range is part of its row.
    fn range_is_row(&self, link: usize, dt_s: f64) -> bool {
        let Some([low, high]) = self.links[link].joint.axis().and_then(|axis| axis.range) else {
            return false;
        };
        let (q, v) = (self.q[link], self.v[self.layout.first_dof[link]]);
        let reach = (v.abs() + NEAR_RANGE) * dt_s;
        self.is_held(link) || self.overrun[link] || q - reach < low || q + reach > high
    }

    /// Marks the joints that were not near an end but leave their ranges at the velocities `v`. Returns true
    /// if there are any.
    pub(in crate::dynamics) fn hold_more(&mut self, dt_s: f64, v: &[f64]) -> bool {
        let mut more = false;
        for i in 0..self.links.len() {
            let Some([low, high]) = self.links[i].joint.axis().and_then(|axis| axis.range) else { continue };
            let next = self.q[i] + dt_s * v[self.layout.first_dof[i]];
            let beyond = next < low - MAX_OVERSHOOT || next > high + MAX_OVERSHOOT;
            if beyond && !self.range_is_row(i, dt_s) {
                self.overrun[i] = true;
                more = true;
            }
        }
        more
    }
}

impl JointRows {
    /// Builds the rows of the joints that may need one. The trees must be factorised.
    #[inline(always)]
    pub fn prepare(&mut self, trees: &Trees, settings: &Settings) {
        self.all.clear();
        self.of_alike.clear();
        self.column.clear();
        self.y.clear();
        self.drives.clear();
        for alike in &trees.alike {
            let first = self.all.len();
            let layout = alike.layout(trees);
            for link in 0..layout.first_dof.len() {
                let mut exists = [false; ABREAST];
                for (lane, tree) in alike.trees.iter().enumerate() {
                    let tree = &trees.all[*tree];
                    exists[lane] = tree.is_held(link) || tree.range_is_row(link, settings.dt_s);
                }
                if exists != [false; ABREAST] {
                    self.push(trees, alike, link, exists, settings);
                }
            }
            self.of_alike.push(first..self.all.len());
        }
    }

    #[inline(always)]
    fn push(
        &mut self,
        trees: &Trees,
        alike: &Alike,
        link: usize,
        exists: [bool; ABREAST],
        settings: &Settings,
    ) {
        let (layout, dt_s) = (alike.layout(trees), settings.dt_s);
        let dof = layout.first_dof[link];
        let (place, first_drive) = (self.y.len(), self.drives.len());
        self.column.extend_from_slice(layout.path(dof));
        let inverse_mass = alike.push_unit_row(layout, dof, &mut self.y);
        let mut dry = DryFriction { most: Abreast::ZERO, impulse: Abreast::ZERO };
        let mut is_ranged = [false; ABREAST];
        let [mut below, mut above] = [Abreast([f64::INFINITY; ABREAST]); 2];
        for (lane, tree) in alike.trees.iter().enumerate().filter(|(lane, _)| exists[*lane]) {
            let tree = &trees.all[*tree];
            let Some(axis) = tree.links[link].joint.axis() else { continue };
            let (most, q) = (axis.friction_loss * dt_s, tree.q[link]);
            dry.most.0[lane] = most;
            dry.impulse.0[lane] = tree.dry_friction[link].clamp(-most, most);
            if let Some([low, high]) = axis.range.filter(|_| tree.range_is_row(link, dt_s)) {
                is_ranged[lane] = true;
                (below.0[lane], above.0[lane]) = (q - low, high - q);
            }
            if tree.bounded[link] {
                self.drives.push(BoundedDrive::new(tree, link, lane, dt_s));
            }
        }
        self.all.push(JointRow {
            link,
            exists,
            places: place..self.y.len(),
            inverse_mass,
            mass: Abreast(from_fn(|lane| if exists[lane] { inverse_mass.0[lane].recip() } else { 0.0 })),
            drives: first_drive..self.drives.len(),
            dry,
            range: JointRange {
                exists: is_ranged,
                down: approach(below, settings),
                up: approach(above, settings),
                impulse_up: Abreast::ZERO,
                impulse_down: Abreast::ZERO,
                pushes: false,
            },
        });
    }

    #[inline(always)]
    pub fn warm_start(&mut self, trees: &Trees, w: &mut Whitened) {
        for (alike, rows) in trees.alike.iter().zip(&self.of_alike) {
            alike.load(trees, w, &mut self.w);
            for row in &self.all[rows.clone()] {
                let mut impulse = row.dry.impulse;
                for drive in &self.drives[row.drives.clone()] {
                    impulse.0[drive.lane] += drive.impulse;
                }
                let acts = impulse.mask(Abreast::ZERO, |impulse, zero| impulse != zero);
                row.of(&self.column, &self.y).push_impulse(impulse, acts, &mut self.w);
            }
            alike.store(&trees.offset, &self.w, w);
        }
    }

    /// Runs one sweep. Returns the greatest velocity (rad/s or m/s) removed by an end of a range or by a
    /// motor that is turned too fast.
    #[inline(always)]
    pub fn sweep(&mut self, pass: Pass, trees: &Trees, w: &mut Whitened) -> f64 {
        let mut greatest = 0.0f64;
        for (alike, rows) in trees.alike.iter().zip(&self.of_alike) {
            if rows.is_empty() {
                continue;
            }
            alike.load(trees, w, &mut self.w);
            for row in &mut self.all[rows.clone()] {
                let lanes = row.of(&self.column, &self.y);
                let before = lanes.velocity(&self.w);
                let mut v = before;
                if !row.drives.is_empty() {
                    let pushed = row.drive(&mut self.drives, &mut v);
                    greatest = greatest.max(pushed);
                }
                row.dry.update(row.inverse_mass, row.mass, &mut v);
                if !row.range.rests(pass, v) {
                    let pushed = row.range.update(pass, row.inverse_mass, row.mass, &mut v);
                    greatest = greatest.max(pushed);
                }
                let acts = v.mask(before, |v, before| v != before);
                if acts.any() {
                    lanes.push_impulse((v - before) * row.mass, acts, &mut self.w);
                }
            }
            alike.store(&trees.offset, &self.w, w);
        }
        greatest
    }

    /// Passes the impulses of dry friction and the efforts of bounded drives to the trees.
    pub fn commit(&self, trees: &mut Trees, dt_s: f64) {
        for (alike, rows) in trees.alike.iter().zip(&self.of_alike) {
            for row in &self.all[rows.clone()] {
                for (lane, tree) in alike.trees.iter().enumerate().filter(|(lane, _)| row.exists[*lane]) {
                    trees.all[*tree].dry_friction[row.link] = row.dry.impulse.0[lane];
                }
                for drive in &self.drives[row.drives.clone()] {
                    trees.all[alike.trees[drive.lane]].effort[row.link] = drive.impulse / dt_s;
                }
            }
        }
    }
}

/// Returns the allowed velocities towards an end of the range that is `distance` away, for correcting and
/// relaxing. Before the end, the joint may reach it within the step. Beyond the end, the velocity must lead
/// back, or be zero while relaxing.
#[inline(always)]
fn approach(distance: Abreast, settings: &Settings) -> [Abreast; 2] {
    let open = distance.0.map(|distance| distance.max(0.0) / settings.dt_s);
    let correcting = from_fn(|lane| match distance.0[lane] < 0.0 {
        true => distance.0[lane] * settings.joint_correction_per_s,
        false => open[lane],
    });
    [Abreast(correcting), Abreast(open)]
}

impl JointRow {
    #[inline(always)]
    fn of<'a>(&self, column: &'a [u16], y: &'a [Abreast]) -> AbreastRow<'a> {
        AbreastRow { column: &column[self.places.clone()], y: &y[self.places.clone()] }
    }

    /// Applies the drives to the velocities. Returns the largest change by a motor that is turned too fast.
    #[inline(never)]
    fn drive(&self, drives: &mut [BoundedDrive], v: &mut Abreast) -> f64 {
        let mut greatest = 0.0f64;
        for drive in &mut drives[self.drives.clone()] {
            let (before, v) = (v.0[drive.lane], &mut v.0[drive.lane]);
            drive.update(self.inverse_mass.0[drive.lane], v);
            if v.abs() > drive.law.speed_limit {
                greatest = greatest.max((*v - before).abs());
            }
        }
        greatest
    }
}

impl BoundedDrive {
    /// Creates the row, starting with the effort of the last step.
    fn new(tree: &Tree, link: usize, lane: usize, dt_s: f64) -> BoundedDrive {
        let law = tree.laws[link];
        let impulse = tree.effort[link] * dt_s;
        BoundedDrive { lane, law, impulse }
    }

    fn update(&mut self, inverse_mass: f64, v: &mut f64) {
        let impulse = self.law.meet(inverse_mass, *v, self.impulse);
        *v += inverse_mass * (impulse - self.impulse);
        self.impulse = impulse;
    }
}

impl DryFriction {
    /// Applies dry friction to the lanes that have any.
    #[inline(always)]
    fn update(&mut self, inverse_mass: Abreast, mass: Abreast, v: &mut Abreast) {
        let stopping = self.impulse - *v * mass;
        let low = self.most.0.map(|most| -most);
        let least = stopping.with(Abreast(low), |stopping, low| if stopping < low { low } else { stopping });
        let impulse = least.with(self.most, |least, most| if least > most { most } else { least });
        let slowed = *v + inverse_mass * (impulse - self.impulse);
        *v = Abreast(from_fn(|lane| if self.most.0[lane] > 0.0 { slowed.0[lane] } else { v.0[lane] }));
        self.impulse =
            Abreast(from_fn(
                |lane| if self.most.0[lane] > 0.0 { impulse.0[lane] } else { self.impulse.0[lane] },
            ));
    }
}

impl JointRange {
    /// Returns the allowed velocities towards each end.
    #[inline(always)]
    fn allowed(&self, pass: Pass) -> [Abreast; 2] {
        let at = match pass {
            Pass::Correcting => 0,
            Pass::Relaxing => 1,
        };
        [self.down[at], self.up[at]]
    }

    /// Returns true if neither end has an effect. Most joints are far from both ends, so this check is fast.
    #[inline(always)]
    fn rests(&self, pass: Pass, v: Abreast) -> bool {
        let [down, up] = self.allowed(pass);
        let above = (v + down).mask(Abreast::ZERO, |v, zero| v >= zero);
        let below = (v - up).mask(Abreast::ZERO, |v, zero| v <= zero);
        !self.pushes & above.and(below).all()
    }

    /// Applies the ends to the velocities. Returns the greatest change.
    #[inline(never)]
    fn update(&mut self, pass: Pass, inverse_mass: Abreast, mass: Abreast, v: &mut Abreast) -> f64 {
        let [down, up] = self.allowed(pass);
        let mut greatest = 0.0f64;
        for lane in (0..ABREAST).filter(|lane| self.exists[*lane]) {
            let (most_down, most_up, v) = (down.0[lane], up.0[lane], &mut v.0[lane]);
            let (inverse_mass, mass) = (inverse_mass.0[lane], mass.0[lane]);
            let [impulse_up, impulse_down] = [&mut self.impulse_up.0[lane], &mut self.impulse_down.0[lane]];
            if *impulse_up == 0.0 && *impulse_down == 0.0 && *v + most_down >= 0.0 && *v - most_up <= 0.0 {
                continue;
            }
            let before = *v;
            let up = (*impulse_up - (*v + most_down) * mass).max(0.0);
            *v += inverse_mass * (up - *impulse_up);
            *impulse_up = up;
            let down = (*impulse_down - (*v - most_up) * mass).min(0.0);
            *v += inverse_mass * (down - *impulse_down);
            *impulse_down = down;
            greatest = greatest.max((*v - before).abs());
        }
        let impulses = self.impulse_up.0.iter().chain(&self.impulse_down.0);
        self.pushes = impulses.fold(false, |pushes, impulse| pushes | (*impulse != 0.0));
        greatest
    }
}
