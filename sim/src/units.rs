//! Time steps and gravity, which are the same in every room.

/// Control steps per second; every control step runs [`PHYSICS_STEPS_PER_CONTROL`] physics steps.
pub const CONTROL_HZ: f64 = 50.0;
/// Length of one control step: 20 ms.
pub const CONTROL_DT_S: f32 = PHYSICS_DT_S * PHYSICS_STEPS_PER_CONTROL as f32;
/// Number of physics steps per control step: physics runs at 200 Hz.
pub const PHYSICS_STEPS_PER_CONTROL: u32 = 4;
/// Length of one physics step.
pub const PHYSICS_DT_S: f32 = 1.0 / 200.0;
/// Gravity, downwards along -z.
pub const GRAVITY_M_S2: f32 = 9.81;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_steps_are_whole_physics_steps() {
        assert_eq!(CONTROL_DT_S, (1.0 / CONTROL_HZ) as f32);
    }
}
