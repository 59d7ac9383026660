//! Drives and passive springs of joints, implicit in the step.
//!
//! A drive's effort at the end of the step, from the position q and velocity v at its beginning and v' at its end:
//!   tau = kp (target - q - dt v') - kd v' + feedforward.
//! Inserted into M (v' - v) = dt (tau - bias), the terms with v' move to the left:
//!   (M + dt kd + dt^2 kp) v' = M v + dt (kp (target - q) + feedforward - bias),
//! which is exact and costs nothing. Springs and dampers of the joint itself enter the same way. It knows no limit,
//! though: a drive near its limit is left out of the mass matrix and becomes a bounded row of the solver (`joint_rows`).
//! Which ones are near is guessed from the last step, and the step is repeated where the guess was wrong, so that no
//! effort, implicit parts included, is ever beyond its limit.

/// A drive's impulse in a step as a function of the velocity v' at its end:  rest - implicit v', within +-most.
#[derive(Clone, Copy, Debug)]
pub struct Law {
    pub rest: f64,
    pub implicit: f64,
    pub most: f64,
}
