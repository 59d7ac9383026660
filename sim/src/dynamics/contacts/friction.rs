//! Friction of colliders as in MJCF, and contacts as rows: one normal, and friction in a cone.
//!
//! A contact has N lanes. Lane 0 is the normal impulse n >= 0, and lanes 1 and 2 are the tangents. Lane
//! 3 is the spin about the normal, and lanes 4 and 5 are the roll about the tangents (N = 4 leaves them
//! out). Friction satisfies
//!   sum_c (f_c / mu_c)^2 <= n^2,   mu_c the coefficient of lane c: 1 for the tangents, m for spin and roll,
//! the elliptic cone of MuJoCo, which for sliding and spin is the limit surface of Howe and Cutkosky
//! 1996. Within the cone friction stops the motion. On its surface it dissipates most, f_c ~ -mu_c^2 v_c:
//! no direction is preferred.

use serde::{Deserialize, Serialize};

use crate::dynamics::settings::Pass;
use crate::dynamics::trees::rows::{ConstraintRows, Whitened};

/// Directions in which friction acts: MJCF's `condim` 1, 3, 4 and 6.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Directions {
    None,
    Slide,
    SlideSpin,
    SlideSpinRoll,
}

impl Directions {
    /// Parses MJCF's `condim`. Returns `None` for a number that MJCF does not define.
    pub(crate) fn from_condim(condim: u32) -> Option<Directions> {
        match condim {
            1 => Some(Directions::None),
            3 => Some(Directions::Slide),
            4 => Some(Directions::SlideSpin),
            6 => Some(Directions::SlideSpinRoll),
            _ => None,
        }
    }
}

/// Friction of a collider.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    pub directions: Directions,
    /// Friction force per normal force.
    pub slide: f64,
    /// Moment about the normal per normal force.
    pub spin_m: f64,
    /// Moment about a tangent per normal force.
    pub roll_m: f64,
    pub priority: i32,
    /// Remaining share of friction for the condition of the surface: 1 as manufactured, less if it is wet or
    /// greasy.
    pub left: f64,
}

impl Friction {
    /// Combines the friction of two colliders. The values are those of the collider with the higher priority;
    /// at equal priority, the larger of each. They are multiplied by the `left` of both surfaces. Source:
    /// MuJoCo, "Contact parameters" in the chapter on modelling.
    pub fn between(a: &Friction, b: &Friction) -> Friction {
        Friction::as_made(a, b).worn(a, b)
    }

    /// Multiplies friction by the `left` of both surfaces.
    pub fn worn(&self, a: &Friction, b: &Friction) -> Friction {
        let Friction { directions, slide, spin_m, roll_m, priority, .. } = *self;
        let left = a.left * b.left;
        Friction {
            directions,
            slide: slide * left,
            spin_m: spin_m * left,
            roll_m: roll_m * left,
            priority,
            left: 1.0,
        }
    }

    fn as_made(a: &Friction, b: &Friction) -> Friction {
        match a.priority.cmp(&b.priority) {
            std::cmp::Ordering::Greater => *a,
            std::cmp::Ordering::Less => *b,
            std::cmp::Ordering::Equal => Friction {
                directions: a.directions.max(b.directions),
                slide: a.slide.max(b.slide),
                spin_m: a.spin_m.max(b.spin_m),
                roll_m: a.roll_m.max(b.roll_m),
                priority: a.priority,
                left: 1.0,
            },
        }
    }

    /// Returns the coefficients of the lanes of a contact (see the module's text). The coefficient is 0 for a
    /// lane without effect.
    pub(in crate::dynamics) fn lanes(&self) -> [f64; 6] {
        let [slide, spin, roll] = match self.directions {
            Directions::None => [0.0; 3],
            Directions::Slide => [self.slide, 0.0, 0.0],
            Directions::SlideSpin => [self.slide, self.spin_m, 0.0],
            Directions::SlideSpinRoll => [self.slide, self.spin_m, self.roll_m],
        };
        [1.0, slide, slide, spin, roll, roll]
    }
}

pub struct Contacts<const N: usize> {
    pub rows: ConstraintRows<N>,
    pub all: Vec<Contact<N>>,
}

/// Parameters of a contact besides its rows.
pub struct Terms<const N: usize> {
    /// Velocities added to the normal velocity, with and without correction of the position.
    pub bias_m_s: [f64; 2],
    /// Compliance as a share of the effective mass.
    pub softness: f64,
    /// Lower bound of the normal's inverse mass.
    pub least_inverse_mass: f64,
    /// Coefficients mu_c; the normal's is not used.
    pub friction: [f64; N],
    /// Initial impulses.
    pub impulse: [f64; N],
}

pub struct Contact<const N: usize> {
    bias_m_s: [f64; 2],
    /// 1 / (1 + softness) with correction and 1 without. Both are lower for a normal that can hardly move,
    /// see [`propped`].
    firmness: [f64; 2],
    inverse_friction: [f64; N],
    /// Y Y^T, the inverses of its diagonal, and of its blocks over the tangents and over the rolls.
    inverse_mass: [[f64; N]; N],
    mass: [f64; N],
    pair_mass: [Symmetric2; 2],
    /// s mu_c^2, with s below the inverse of the largest eigenvalue of  diag(mu) A diag(mu)  over the
    /// friction lanes.
    slide_gain: [f64; N],
    pub impulse: [f64; N],
}

impl<const N: usize> Default for Contacts<N> {
    fn default() -> Self {
        Contacts { rows: ConstraintRows::default(), all: Vec::new() }
    }
}

impl<const N: usize> Contacts<N> {
    pub fn clear(&mut self) {
        self.rows.clear();
        self.all.clear();
    }

    /// Adds a contact. Its rows must have been pushed just before, with this inverse mass.
    #[inline(always)]
    pub fn push(&mut self, inverse_mass: [[f64; N]; N], terms: Terms<N>) {
        let mu = terms.friction;
        let mut most = 0.0;
        for lane in [1, 4].into_iter().filter(|lane| lane + 1 < N) {
            most += mu[lane] * mu[lane] * largest_of_pair(&inverse_mass, lane);
        }
        if N > 3 {
            most += mu[3] * mu[3] * inverse_mass[3][3];
        }
        let step = if most > 0.0 { 1.0 / most } else { 0.0 };
        let mut mass: [f64; N] = std::array::from_fn(|lane| inverse(inverse_mass[lane][lane]));
        let mut firmness = [1.0 / (1.0 + terms.softness), 1.0];
        if inverse_mass[0][0] < terms.least_inverse_mass {
            (mass[0], firmness) = propped(inverse_mass[0][0], &terms);
        }
        self.all.push(Contact {
            bias_m_s: terms.bias_m_s,
            firmness,
            inverse_friction: mu.map(|mu| if mu > 0.0 { 1.0 / mu } else { 0.0 }),
            mass,
            pair_mass: [1, 4].map(|lane| Symmetric2::inverse_of(&inverse_mass, lane)),
            inverse_mass,
            slide_gain: mu.map(|mu| step * mu * mu),
            impulse: terms.impulse,
        });
    }

    /// Adds the effect of the current impulses to `w`.
    pub fn push_impulses(&self, w: &mut Whitened) {
        for (group, contact) in self.all.iter().enumerate() {
            if contact.impulse != [0.0; N] {
                self.rows.push_impulse(group, &contact.impulse, w);
            }
        }
    }

    /// Runs one Gauss-Seidel sweep, contact by contact. Each impulse changes by `share` of its full update.
    #[inline(always)]
    pub fn sweep(&mut self, pass: Pass, share: f64, w: &mut Whitened) {
        for (group, contact) in self.all.iter_mut().enumerate() {
            let velocity = self.rows.velocity(group, w);
            let mut impulse = contact.update(pass, velocity);
            if share < 1.0 {
                for (new, old) in impulse.iter_mut().zip(contact.impulse) {
                    *new = old + share * (*new - old);
                }
            }
            let mut change = impulse;
            for (change, old) in change.iter_mut().zip(contact.impulse) {
                *change -= old;
            }
            if change != [0.0; N] {
                contact.impulse = impulse;
                self.rows.push_impulse(group, &change, w);
            }
        }
    }
}

impl<const N: usize> Contact<N> {
    /// Returns the impulses of this contact that solve it alone at the velocities `v` along its lanes.
    #[inline(always)]
    fn update(&self, pass: Pass, mut v: [f64; N]) -> [f64; N] {
        let (a, old) = (&self.inverse_mass, &self.impulse);
        let (bias_m_s, firmness) = match pass {
            Pass::Correcting => (self.bias_m_s[0], self.firmness[0]),
            Pass::Relaxing => (self.bias_m_s[1], self.firmness[1]),
        };
        let normal = (firmness * (old[0] - (v[0] + bias_m_s) * self.mass[0])).max(0.0);
        if normal == 0.0 {
            return [0.0; N];
        }
        for c in 1..N {
            v[c] += a[0][c] * (normal - old[0]);
        }
        let mut stuck = self.stick(v);
        stuck[0] = normal;
        if self.fullness(&stuck) <= normal * normal {
            return stuck;
        }
        let slid = self.slide(old, &v, normal);
        if N < 6 {
            return slid;
        }
        // The step size suits the tangents. Rolls have less inertia and friction, and need a second step to
        // follow a ball that accelerates.
        for c in 1..N {
            v[c] += (1..N).map(|d| a[d][c] * (slid[d] - old[d])).sum::<f64>();
        }
        self.slide(&slid, &v, normal)
    }

    /// Takes one step of projected gradient descent from the impulses `from`, at the velocities `v`.
    #[inline(always)]
    fn slide(&self, from: &[f64; N], v: &[f64; N], normal: f64) -> [f64; N] {
        let mut slid = [normal; N];
        for c in 1..N {
            slid[c] = from[c] - self.slide_gain[c] * v[c];
        }
        let fullness = self.fullness(&slid);
        if fullness > normal * normal {
            let scale = normal / fullness.sqrt();
            slid[1..].iter_mut().for_each(|impulse| *impulse *= scale);
        }
        slid
    }

    /// Returns sum_c (f_c / mu_c)^2 over the friction lanes.
    #[inline(always)]
    fn fullness(&self, impulse: &[f64; N]) -> f64 {
        (1..N).map(|c| impulse[c] * self.inverse_friction[c]).map(|share| share * share).sum()
    }

    /// Returns impulses that stop all lanes: the two tangents together, then the spin, then the two
    /// rolls together.
    #[inline(always)]
    fn stick(&self, mut v: [f64; N]) -> [f64; N] {
        let (a, old) = (&self.inverse_mass, &self.impulse);
        let mut new = *old;
        self.stop_pair(1, &self.pair_mass[0], &v, &mut new);
        if N > 3 {
            v[3] += a[1][3] * (new[1] - old[1]) + a[2][3] * (new[2] - old[2]);
            new[3] = if self.inverse_friction[3] > 0.0 { old[3] - v[3] * self.mass[3] } else { 0.0 };
        }
        if N > 5 {
            for c in 4..6 {
                v[c] += (1..4).map(|d| a[d][c] * (new[d] - old[d])).sum::<f64>();
            }
            self.stop_pair(4, &self.pair_mass[1], &v, &mut new);
        }
        new
    }

    /// Solves for two lanes together.
    #[inline(always)]
    fn stop_pair(&self, lane: usize, mass: &Symmetric2, v: &[f64; N], impulse: &mut [f64; N]) {
        if self.inverse_friction[lane] == 0.0 {
            (impulse[lane], impulse[lane + 1]) = (0.0, 0.0);
            return;
        }
        impulse[lane] -= mass.first * v[lane] + mass.across * v[lane + 1];
        impulse[lane + 1] -= mass.across * v[lane] + mass.second * v[lane + 1];
    }
}

/// Symmetric 2 x 2 matrix.
#[derive(Default)]
struct Symmetric2 {
    first: f64,
    across: f64,
    second: f64,
}

impl Symmetric2 {
    /// Inverts the block of two lanes that begins at `lane`. Returns zero if there is no such block. Two
    /// dependent lanes are each inverted alone, and each takes half of the impulse.
    fn inverse_of<const N: usize>(a: &[[f64; N]; N], lane: usize) -> Symmetric2 {
        if lane + 1 >= N {
            return Symmetric2::default();
        }
        let (p, q, r) = (a[lane][lane], a[lane][lane + 1], a[lane + 1][lane + 1]);
        let determinant = p * r - q * q;
        if determinant > DEPENDENT * p * r {
            Symmetric2 { first: r / determinant, across: -q / determinant, second: p / determinant }
        } else {
            Symmetric2 { first: 0.5 * inverse(p), across: 0.0, second: 0.5 * inverse(r) }
        }
    }
}

/// Returns mass and firmness of a normal whose inverse mass `a` is below the least `e`. An impulse with
///   n = f (n - (v + b) / a),   f / a = 1 / (e + softness a)
/// yields by the difference:  a n + v + b = -(e + (softness - 1) a) n. Without this, overlapping links would
/// be torn apart if their joints hardly let them move in the direction of the overlap.
fn propped<const N: usize>(inverse_mass: f64, terms: &Terms<N>) -> (f64, [f64; 2]) {
    let least = terms.least_inverse_mass;
    let a = inverse_mass.max(SMALLEST_SHARE * least);
    (a.recip(), [terms.softness, 0.0].map(|softness| a / (least + softness * a)))
}

/// Share of the least inverse mass below which an inverse mass counts as rounding error.
const SMALLEST_SHARE: f64 = 1e-9;

/// Inverts an inverse mass. Returns 0 if no body can move.
fn inverse(inverse_mass: f64) -> f64 {
    if inverse_mass > 0.0 { inverse_mass.recip() } else { 0.0 }
}

/// Threshold on the relative determinant, below which two directions count as one.
const DEPENDENT: f64 = 1e-12;

/// Returns the larger eigenvalue of the 2 x 2 block that begins at `lane`.
fn largest_of_pair<const N: usize>(a: &[[f64; N]; N], lane: usize) -> f64 {
    let (p, q, r) = (a[lane][lane], a[lane][lane + 1], a[lane + 1][lane + 1]);
    let half = 0.5 * (p - r);
    0.5 * (p + r) + (half * half + q * q).sqrt()
}
