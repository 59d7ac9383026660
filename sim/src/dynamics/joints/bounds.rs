//! Rows of single joints: drives at their limits, dry friction and limits of position, all along one degree of freedom.

use super::DriveLaw;
use crate::dynamics::settings::{Pass, Settings};
use crate::dynamics::trees::rows::ConstraintRows;
use crate::dynamics::trees::tree::Tree;

#[derive(Default)]
pub struct JointRows {
    rows: ConstraintRows<1>,
    all: Vec<JointRow>,
}

struct JointRow {
    tree: usize,
    link: usize,
    /// Y . Y, and its inverse.
    inverse_mass: f64,
    mass: f64,
    drive: Option<BoundedDrive>,
    dry: DryFriction,
    range: Option<Range>,
}

/// A drive near a limit of its effort or speed, which the mass matrix leaves out.
struct BoundedDrive {
    law: DriveLaw,
    impulse: f64,
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

/// A joint without other rows gets one for its range at first only if it could reach an end when this much faster, rad/s or m/s.
const NEAR_RANGE: f64 = 10.0;
/// A joint that would be beyond its range by more (rad or m) without a row gets one, and the step is repeated.
const MOST_BEYOND: f64 = 0.01;

impl Tree {
    /// Whether a joint has a row in any case.
    fn is_held(&self, link: usize) -> bool {
        self.bounded[link] || self.links[link].joint.axis().is_some_and(|axis| axis.friction_loss > 0.0)
    }

    /// Whether a joint's range is a part of its row.
    fn range_is_row(&self, link: usize, dt_s: f64) -> bool {
        let Some([low, high]) = self.links[link].joint.axis().and_then(|axis| axis.range) else {
            return false;
        };
        let (q, v) = (self.q[link], self.v[self.layout.first_dof[link]]);
        let reach = (v.abs() + NEAR_RANGE) * dt_s;
        self.is_held(link) || self.overrun[link] || q - reach < low || q + reach > high
    }

    /// Adds the joints that leave their ranges when they move by the velocities `v` and were not near an end; whether there
    /// were any.
    pub(in crate::dynamics) fn hold_more(&mut self, dt_s: f64, v: &[f64]) -> bool {
        let mut more = false;
        for i in 0..self.links.len() {
            let Some([low, high]) = self.links[i].joint.axis().and_then(|axis| axis.range) else { continue };
            let next = self.q[i] + dt_s * v[self.layout.first_dof[i]];
            let beyond = next < low - MOST_BEYOND || next > high + MOST_BEYOND;
            if beyond && !self.range_is_row(i, dt_s) {
                self.overrun[i] = true;
                more = true;
            }
        }
        more
    }
}

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
            let (dof, q) = (tree.layout.first_dof[i], tree.q[i]);
            let range = axis.range.filter(|_| tree.range_is_row(i, dt_s));
            if !tree.is_held(i) && range.is_none() {
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
                mass: inverse_mass.recip(),
                drive: tree.bounded[i].then(|| BoundedDrive::new(tree, i, dt_s)),
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
            let impulse = row.dry.impulse + row.drive.as_ref().map_or(0.0, |drive| drive.impulse);
            if impulse != 0.0 {
                self.rows.push_impulse(group, &[impulse], w);
            }
        }
    }

    /// The greatest velocity (rad/s or m/s) that an end of a range, or a motor that is turned too fast, took back.
    pub fn sweep(&mut self, pass: Pass, w: &mut [f64]) -> f64 {
        let mut greatest = 0.0f64;
        for (group, row) in self.all.iter_mut().enumerate() {
            let [before] = self.rows.velocity(group, w);
            let mut v = before;
            let (inverse_mass, mass) = (row.inverse_mass, row.mass);
            if let Some(drive) = &mut row.drive {
                drive.update(inverse_mass, &mut v);
                if v.abs() > drive.law.speed_limit {
                    greatest = greatest.max((v - before).abs());
                }
            }
            row.dry.update(inverse_mass, mass, &mut v);
            if let Some(range) = &mut row.range {
                let pushed = v;
                range.update(pass, inverse_mass, mass, &mut v);
                greatest = greatest.max((v - pushed).abs());
            }
            if v != before {
                self.rows.push_impulse(group, &[(v - before) * mass], w);
            }
        }
        greatest
    }

    /// Gives the trees the impulses of dry friction and the efforts of bounded drives.
    pub fn commit(&self, trees: &mut [Tree], dt_s: f64) {
        for row in &self.all {
            let tree = &mut trees[row.tree];
            tree.dry_friction[row.link] = row.dry.impulse;
            if let Some(drive) = &row.drive {
                tree.effort[row.link] = drive.impulse / dt_s;
            }
        }
    }
}

/// Velocity towards an end of the range that is allowed at a distance: up to the end within the step; beyond the end
/// backwards, or none while relaxing.
fn approach(distance: f64, settings: &Settings) -> [f64; 2] {
    let open = distance.max(0.0) / settings.dt_s;
    let correcting = if distance < 0.0 { distance * settings.joint_correction_per_s } else { open };
    [correcting, open]
}

impl BoundedDrive {
    /// Begins with the effort of the last step.
    fn new(tree: &Tree, link: usize, dt_s: f64) -> BoundedDrive {
        let law = tree.laws[link];
        let impulse = tree.effort[link] * dt_s;
        BoundedDrive { law, impulse }
    }

    fn update(&mut self, inverse_mass: f64, v: &mut f64) {
        let impulse = self.law.meet(inverse_mass, *v, self.impulse);
        *v += inverse_mass * (impulse - self.impulse);
        self.impulse = impulse;
    }
}

impl DryFriction {
    fn update(&mut self, inverse_mass: f64, mass: f64, v: &mut f64) {
        if self.most > 0.0 {
            let impulse = (self.impulse - *v * mass).clamp(-self.most, self.most);
            *v += inverse_mass * (impulse - self.impulse);
            self.impulse = impulse;
        }
    }
}

impl Range {
    fn update(&mut self, pass: Pass, inverse_mass: f64, mass: f64, v: &mut f64) {
        let at = match pass {
            Pass::Correcting => 0,
            Pass::Relaxing => 1,
        };
        let up = (self.impulse_up - (*v + self.down[at]) * mass).max(0.0);
        *v += inverse_mass * (up - self.impulse_up);
        self.impulse_up = up;
        let down = (self.impulse_down - (*v - self.up[at]) * mass).min(0.0);
        *v += inverse_mass * (down - self.impulse_down);
        self.impulse_down = down;
    }
}
