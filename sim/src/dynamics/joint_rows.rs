//! Rows of single joints: effort limits of drives, dry friction and limits of position, all along one degree of freedom.

use super::jacobian::Rows;
use super::settings::{Pass, Settings};
use super::tree::Tree;

#[derive(Default)]
pub(super) struct JointRows {
    rows: Rows<1>,
    all: Vec<JointRow>,
}

struct JointRow {
    tree: usize,
    link: usize,
    /// Y . Y.
    inverse_mass: f64,
    drive: DriveLimit,
    dry: DryFriction,
    range: Option<Range>,
}

/// A drive's impulse  T = rest - implicit v' + excess  must keep to +-most. It is in the mass matrix without a limit;
/// `excess` is what has to be taken off, and nothing where T keeps to it by itself.
struct DriveLimit {
    rest: f64,
    implicit: f64,
    most: f64,
    excess: f64,
}

struct DryFriction {
    most: f64,
    impulse: f64,
}

/// Both ends of a joint's range: the velocities towards them that are allowed, by [`Pass`], and the impulses.
struct Range {
    down: [f64; 2],
    up: [f64; 2],
    impulse_up: f64,
    impulse_down: f64,
}

/// A joint without other rows gets one for its range only if it could reach an end when this much faster, rad/s or m/s.
const NEAR_RANGE: f64 = 10.0;
/// Efforts keep to their limits to this share.
const EFFORT_TOLERANCE: f64 = 1e-9;
const MOST_SETTLING_SWEEPS: usize = 50;

impl JointRows {
    pub fn clear(&mut self) {
        self.rows.clear();
        self.all.clear();
    }

    /// Rows of a tree's joints that may need one. The tree is factorised.
    pub fn push_tree(&mut self, tree: &Tree, index: usize, offset: usize, settings: &Settings) {
        let dt_s = settings.dt_s;
        for (i, link) in tree.links.iter().enumerate() {
            let Some(axis) = link.joint.axis() else { continue };
            let dof = tree.layout.first_dof[i];
            let (q, v, drive) = (tree.q[i], tree.v[dof], &tree.drives[i]);
            let limited = axis.effort_limit.is_finite() && *drive != super::Drive::NONE;
            let held = limited || axis.friction_loss > 0.0;
            let near = |[low, high]: [f64; 2]| {
                let reach = (v.abs() + NEAR_RANGE) * dt_s;
                held || q - reach < low || q + reach > high
            };
            let range = axis.range.filter(|range| near(*range));
            if !held && range.is_none() {
                continue;
            }
            let start = self.rows.column.len();
            self.rows.push_dof(tree, offset, dof, [1.0]);
            self.rows.close(start);
            let [[inverse_mass]] = self.rows.last_inverse_mass();
            let most = axis.friction_loss * dt_s;
            self.all.push(JointRow {
                tree: index,
                link: i,
                inverse_mass,
                drive: DriveLimit {
                    rest: drive.impulse_at_rest(q, dt_s),
                    implicit: drive.implicit(dt_s),
                    most: if limited { axis.effort_limit * dt_s } else { f64::INFINITY },
                    excess: 0.0,
                },
                dry: DryFriction { most, impulse: tree.dry_friction[i].clamp(-most, most) },
                range: range.map(|[low, high]| Range {
                    down: approach(q - low, settings),
                    up: approach(high - q, settings),
                    impulse_up: 0.0,
                    impulse_down: 0.0,
                }),
            });
        }
    }

    pub fn warm_start(&self, w: &mut [f64]) {
        for (group, row) in self.all.iter().enumerate() {
            if row.dry.impulse != 0.0 {
                self.rows.push_impulse(group, &[row.dry.impulse], w);
            }
        }
    }

    pub fn sweep(&mut self, pass: Pass, w: &mut [f64]) {
        for (group, row) in self.all.iter_mut().enumerate() {
            let [before] = self.rows.velocity(group, w);
            let mut v = before;
            row.drive.update(row.inverse_mass, &mut v);
            row.dry.update(row.inverse_mass, &mut v);
            if let Some(range) = &mut row.range {
                range.update(pass, row.inverse_mass, &mut v);
            }
            if v != before {
                self.rows.push_impulse(group, &[(v - before) / row.inverse_mass], w);
            }
        }
    }

    /// Repeats the effort limits alone until all are kept: other rows came after them in the last sweep.
    pub fn settle_efforts(&mut self, w: &mut [f64]) {
        for _ in 0..MOST_SETTLING_SWEEPS {
            let mut settled = true;
            for (group, row) in self.all.iter_mut().enumerate() {
                if row.drive.most.is_infinite() {
                    continue;
                }
                let [before] = self.rows.velocity(group, w);
                let mut v = before;
                row.drive.update(row.inverse_mass, &mut v);
                let change = (v - before) / row.inverse_mass;
                if change.abs() > EFFORT_TOLERANCE * row.drive.most {
                    settled = false;
                    self.rows.push_impulse(group, &[change], w);
                }
            }
            if settled {
                break;
            }
        }
    }

    /// Gives the trees the impulses of dry friction.
    pub fn keep_friction(&self, trees: &mut [Tree]) {
        for row in &self.all {
            trees[row.tree].dry_friction[row.link] = row.dry.impulse;
        }
    }

    /// Tells the trees what was taken off their drives, as impulses.
    pub fn excess(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        self.all.iter().map(|row| (row.tree, row.link, row.drive.excess))
    }
}

/// Velocity towards an end of the range that is allowed at a distance: up to the end within the step; beyond the end
/// backwards, or none while relaxing.
fn approach(distance: f64, settings: &Settings) -> [f64; 2] {
    let open = distance.max(0.0) / settings.dt_s;
    let correcting = if distance < 0.0 { distance * settings.joint_correction_per_s } else { open };
    [correcting, open]
}

impl DriveLimit {
    /// T as a function of the excess e rises by  1 - implicit Y.Y  per e, which is positive because `implicit` is part of
    /// the mass matrix. Chooses the smallest |e| that keeps T to its limit.
    fn update(&mut self, inverse_mass: f64, v: &mut f64) {
        if self.most.is_infinite() {
            return;
        }
        let rise = 1.0 - self.implicit * inverse_mass;
        let without = self.rest - self.implicit * *v + self.excess - rise * self.excess;
        let excess = (without.clamp(-self.most, self.most) - without) / rise;
        *v += inverse_mass * (excess - self.excess);
        self.excess = excess;
    }
}

impl DryFriction {
    fn update(&mut self, inverse_mass: f64, v: &mut f64) {
        if self.most > 0.0 {
            let impulse = (self.impulse - *v / inverse_mass).clamp(-self.most, self.most);
            *v += inverse_mass * (impulse - self.impulse);
            self.impulse = impulse;
        }
    }
}

impl Range {
    fn update(&mut self, pass: Pass, inverse_mass: f64, v: &mut f64) {
        let at = match pass {
            Pass::Correcting => 0,
            Pass::Relaxing => 1,
        };
        let up = (self.impulse_up - (*v + self.down[at]) / inverse_mass).max(0.0);
        *v += inverse_mass * (up - self.impulse_up);
        self.impulse_up = up;
        let down = (self.impulse_down - (*v - self.up[at]) / inverse_mass).min(0.0);
        *v += inverse_mass * (down - self.impulse_down);
        self.impulse_down = down;
    }
}
