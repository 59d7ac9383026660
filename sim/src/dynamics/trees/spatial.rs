//! Spatial vectors and inertias in f64, in world axes and about one reference point per tree.
//!
//! Source: Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 2.

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use rapier3d::glamx::{DMat3, DPose3, DQuat, DVec3};
use rapier3d::math::Pose;

/// Velocity, acceleration or joint axis: `angular` [rad/s], and `linear` [m/s] of the body's point at the
/// reference.
#[derive(Clone, Copy, Default, Debug)]
pub struct MotionVector {
    pub angular: DVec3,
    pub linear: DVec3,
}

/// Force or momentum: `linear` [N] and the moment `angular` [N m] about the reference.
#[derive(Clone, Copy, Default, Debug)]
pub struct ForceVector {
    pub angular: DVec3,
    pub linear: DVec3,
}

impl MotionVector {
    /// Computes v x m, the rate of change of a motion vector that moves with v.
    #[inline]
    pub fn cross(self, m: MotionVector) -> MotionVector {
        MotionVector {
            angular: self.angular.cross(m.angular),
            linear: self.angular.cross(m.linear) + self.linear.cross(m.angular),
        }
    }

    /// Computes v x* f, the rate of change of a force vector that moves with v.
    #[inline]
    pub fn cross_force(self, f: ForceVector) -> ForceVector {
        ForceVector {
            angular: self.angular.cross(f.angular) + self.linear.cross(f.linear),
            linear: self.angular.cross(f.linear),
        }
    }

    #[inline]
    pub fn dot(self, f: ForceVector) -> f64 {
        self.angular.dot(f.angular) + self.linear.dot(f.linear)
    }

    /// Returns the velocity of the body's point at `point_m`, relative to the reference.
    #[inline]
    pub fn at(self, point_m: DVec3) -> DVec3 {
        self.linear + self.angular.cross(point_m)
    }
}

impl ForceVector {
    /// Creates a force that acts at `point_m`, relative to the reference.
    #[inline]
    pub fn at(point_m: DVec3, force_n: DVec3) -> ForceVector {
        ForceVector { angular: point_m.cross(force_n), linear: force_n }
    }

    pub fn moment(moment_n_m: DVec3) -> ForceVector {
        ForceVector { angular: moment_n_m, linear: DVec3::ZERO }
    }
}

macro_rules! vector_space {
    ($type:ident) => {
        impl Add for $type {
            type Output = $type;
            #[inline]
            fn add(self, o: $type) -> $type {
                $type { angular: self.angular + o.angular, linear: self.linear + o.linear }
            }
        }
        impl Sub for $type {
            type Output = $type;
            #[inline]
            fn sub(self, o: $type) -> $type {
                self + -o
            }
        }
        impl Neg for $type {
            type Output = $type;
            #[inline]
            fn neg(self) -> $type {
                $type { angular: -self.angular, linear: -self.linear }
            }
        }
        impl Mul<f64> for $type {
            type Output = $type;
            #[inline]
            fn mul(self, k: f64) -> $type {
                $type { angular: self.angular * k, linear: self.linear * k }
            }
        }
        impl AddAssign for $type {
            #[inline]
            fn add_assign(&mut self, o: $type) {
                *self = *self + o;
            }
        }
        impl SubAssign for $type {
            #[inline]
            fn sub_assign(&mut self, o: $type) {
                *self = *self - o;
            }
        }
    };
}
vector_space!(MotionVector);
vector_space!(ForceVector);

/// Symmetric 3 x 3 matrix.
#[derive(Clone, Copy, Default, Debug)]
pub struct Symmetric {
    pub xx: f64,
    pub yy: f64,
    pub zz: f64,
    pub xy: f64,
    pub xz: f64,
    pub yz: f64,
}

impl Symmetric {
    pub fn of(m: &DMat3) -> Symmetric {
        let half = |a: f64, b: f64| 0.5 * (a + b);
        Symmetric {
            xx: m.x_axis.x,
            yy: m.y_axis.y,
            zz: m.z_axis.z,
            xy: half(m.y_axis.x, m.x_axis.y),
            xz: half(m.z_axis.x, m.x_axis.z),
            yz: half(m.z_axis.y, m.y_axis.z),
        }
    }

    pub fn matrix(&self) -> DMat3 {
        DMat3::from_cols(
            DVec3::new(self.xx, self.xy, self.xz),
            DVec3::new(self.xy, self.yy, self.yz),
            DVec3::new(self.xz, self.yz, self.zz),
        )
    }

    #[inline]
    pub fn mul(&self, v: DVec3) -> DVec3 {
        DVec3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }

    /// Computes R I R^T.
    #[inline]
    pub fn rotated(&self, r: &DMat3) -> Symmetric {
        let a = r.x_axis * self.xx + r.y_axis * self.xy + r.z_axis * self.xz;
        let b = r.x_axis * self.xy + r.y_axis * self.yy + r.z_axis * self.yz;
        let c = r.x_axis * self.xz + r.y_axis * self.yz + r.z_axis * self.zz;
        let (p, q, s) = (r.x_axis, r.y_axis, r.z_axis);
        Symmetric {
            xx: a.x * p.x + b.x * q.x + c.x * s.x,
            yy: a.y * p.y + b.y * q.y + c.y * s.y,
            zz: a.z * p.z + b.z * q.z + c.z * s.z,
            xy: a.x * p.y + b.x * q.y + c.x * s.y,
            xz: a.x * p.z + b.x * q.z + c.x * s.z,
            yz: a.y * p.z + b.y * q.z + c.y * s.z,
        }
    }

    /// Computes m (c.c 1 - c c^T), the contribution of a point mass about the reference.
    #[inline]
    pub fn of_point(mass_kg: f64, c: DVec3) -> Symmetric {
        Symmetric {
            xx: mass_kg * (c.y * c.y + c.z * c.z),
            yy: mass_kg * (c.x * c.x + c.z * c.z),
            zz: mass_kg * (c.x * c.x + c.y * c.y),
            xy: -mass_kg * c.x * c.y,
            xz: -mass_kg * c.x * c.z,
            yz: -mass_kg * c.y * c.z,
        }
    }
}

impl AddAssign for Symmetric {
    #[inline]
    fn add_assign(&mut self, o: Symmetric) {
        self.xx += o.xx;
        self.yy += o.yy;
        self.zz += o.zz;
        self.xy += o.xy;
        self.xz += o.xz;
        self.yz += o.yz;
    }
}

/// Spatial inertia about the reference: mass m, first moment h = m c, second moment.
#[derive(Clone, Copy, Default, Debug)]
pub struct Inertia {
    pub mass_kg: f64,
    pub first_kg_m: DVec3,
    pub second_kg_m2: Symmetric,
}

impl Inertia {
    /// Computes I v: the momentum for a velocity, or the force for an acceleration.
    #[inline]
    pub fn mul(&self, v: MotionVector) -> ForceVector {
        ForceVector {
            angular: self.second_kg_m2.mul(v.angular) + self.first_kg_m.cross(v.linear),
            linear: v.linear * self.mass_kg - self.first_kg_m.cross(v.angular),
        }
    }
}

impl AddAssign for Inertia {
    #[inline]
    fn add_assign(&mut self, o: Inertia) {
        self.mass_kg += o.mass_kg;
        self.first_kg_m += o.first_kg_m;
        self.second_kg_m2 += o.second_kg_m2;
    }
}

/// Returns a rotation turned further by the rotation vector `turn_rad`, in world axes.
#[inline]
pub fn turned(rotation: DQuat, turn_rad: DVec3) -> DQuat {
    if turn_rad == DVec3::ZERO {
        return rotation;
    }
    (DQuat::from_scaled_axis(turn_rad) * rotation).normalize()
}

/// Converts the pose to single precision, which colliders and all modules outside `dynamics` use.
pub(crate) fn rounded(pose: &DPose3) -> Pose {
    Pose::from_parts(pose.translation.as_vec3(), pose.rotation.as_quat())
}
