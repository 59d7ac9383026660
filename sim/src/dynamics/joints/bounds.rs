//! Rows of single joints: drives at their limits, dry friction and limits of position, all along one degree of freedom.

use pulp::Simd;

use super::DriveLaw;
use super::units::{UnitRow, UnitRows};
use crate::dynamics::settings::{Pass, Settings};
use crate::dynamics::trees::Trees;
use crate::dynamics::trees::rows::{ConstraintRows, Whitened};
use crate::dynamics::trees::tree::Tree;

#[derive(Default)]
pub struct JointRows {
    rows: ConstraintRows<1>,
    all: Vec<JointRow>,
    units: UnitRows,
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
    /// Rows of the joints that may need one. The trees are factorised. The rows of each tree are in the order of its links; those of
    /// several trees, which have no part in each other, take turns, so that a processor works on them at the same time.
    #[inline(always)]
    pub fn prepare<S: Simd>(&mut self, simd: S, trees: &Trees, settings: &Settings) {
        self.rows.clear();
        self.all.clear();
        let mut units = std::mem::take(&mut self.units);
        units.make(simd, trees, |tree, link| tree.is_held(link) || tree.range_is_row(link, settings.dt_s));
        for unit in &units.all {
            self.push(trees, unit, units.y(unit), settings);
        }
        self.units = units;
    }

    #[inline(always)]
    fn push(&mut self, trees: &Trees, unit: &UnitRow, y: impl Iterator<Item = f64>, settings: &Settings) {
        let (tree, link, dt_s) = (&trees.all[unit.tree], unit.link, settings.dt_s);
        let Some(axis) = tree.links[link].joint.axis() else { return };
        let offset = trees.offset[unit.tree] as u16;
        self.rows.begin();
        for (column, y) in tree.layout.path(tree.layout.first_dof[link]).iter().zip(y) {
            self.rows.push(column + offset, [y]);
        }
        let [[inverse_mass]] = self.rows.close();
        let (most, q) = (axis.friction_loss * dt_s, tree.q[link]);
        let range = axis.range.filter(|_| tree.range_is_row(link, dt_s));
        self.all.push(JointRow {
            tree: unit.tree,
            link,
            inverse_mass,
            mass: inverse_mass.recip(),
            drive: tree.bounded[link].then(|| BoundedDrive::new(tree, link, dt_s)),
            dry: DryFriction { most, impulse: tree.dry_friction[link].clamp(-most, most) },
            range: range.map(|[low, high]| Range {
                down: approach(q - low, settings),
                up: approach(high - q, settings),
                impulse_up: 0.0,
                impulse_down: 0.0,
            }),
        });
    }

    pub fn warm_start(&self, w: &mut Whitened) {
        for (group, row) in self.all.iter().enumerate() {
            let impulse = row.dry.impulse + row.drive.as_ref().map_or(0.0, |drive| drive.impulse);
            if impulse != 0.0 {
                self.rows.push_impulse(group, &[impulse], w);
            }
        }
    }

    /// The greatest velocity (rad/s or m/s) that an end of a range, or a motor that is turned too fast, took back.
    #[inline(always)]
    pub fn sweep(&mut self, pass: Pass, w: &mut Whitened) -> f64 {
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
            if let Some(range) = row.range.as_mut().filter(|range| range.acts(pass, v)) {
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

    #[inline(always)]
    fn update(&mut self, inverse_mass: f64, v: &mut f64) {
        let impulse = self.law.meet(inverse_mass, *v, self.impulse);
        *v += inverse_mass * (impulse - self.impulse);
        self.impulse = impulse;
    }
}

impl DryFriction {
    #[inline(always)]
    fn update(&mut self, inverse_mass: f64, mass: f64, v: &mut f64) {
        if self.most > 0.0 {
            let impulse = (self.impulse - *v * mass).clamp(-self.most, self.most);
            *v += inverse_mass * (impulse - self.impulse);
            self.impulse = impulse;
        }
    }
}

impl Range {
    /// Velocities towards both ends that are allowed.
    #[inline(always)]
    fn allowed(&self, pass: Pass) -> [f64; 2] {
        let at = match pass {
            Pass::Correcting => 0,
            Pass::Relaxing => 1,
        };
        [self.down[at], self.up[at]]
    }

    /// Whether one of the ends has something to do. Most joints are far from both, which is soon seen.
    #[inline(always)]
    fn acts(&self, pass: Pass, v: f64) -> bool {
        let [down, up] = self.allowed(pass);
        let rests = self.impulse_up == 0.0 && self.impulse_down == 0.0 && v + down >= 0.0 && v - up <= 0.0;
        !rests
    }

    #[inline(always)]
    fn update(&mut self, pass: Pass, inverse_mass: f64, mass: f64, v: &mut f64) {
        let [most_down, most_up] = self.allowed(pass);
        let up = (self.impulse_up - (*v + most_down) * mass).max(0.0);
        *v += inverse_mass * (up - self.impulse_up);
        self.impulse_up = up;
        let down = (self.impulse_down - (*v - most_up) * mass).min(0.0);
        *v += inverse_mass * (down - self.impulse_down);
        self.impulse_down = down;
    }
}
