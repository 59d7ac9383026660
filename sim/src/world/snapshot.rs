//! Saving, restoring and hashing a world.

use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::Xxh3;

use super::World;
use crate::SimError;
use crate::dynamics::DynamicsState;

/// A world at one instant. It fits only a world made from the same specification by the same binary.
#[derive(Clone, Serialize, Deserialize)]
pub struct Snapshot {
    dynamics: DynamicsState,
    robots: Vec<Vec<u8>>,
    control_steps: u64,
}

/// Initial capacity for serialised dynamics. It is sufficient for three robots in a kitchen, so that a hash
/// allocates once.
const DYNAMICS_BYTES: usize = 1 << 16;

impl World {
    /// Takes a snapshot, which is about half a megabyte for two robots.
    ///
    /// # Errors
    ///
    /// Returns an error if a robot's state cannot be serialised.
    pub fn snapshot(&self) -> Result<Snapshot, SimError> {
        Ok(Snapshot {
            dynamics: self.dynamics.state(),
            robots: self.save_robots()?,
            control_steps: self.control_steps,
        })
    }

    /// Restores a snapshot.
    ///
    /// # Errors
    ///
    /// Returns an error if the snapshot does not fit; the world is then unchanged.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SimError> {
        let before = (self.dynamics.state(), self.save_robots()?);
        self.dynamics.restore(&snapshot.dynamics)?;
        if let Err(error) = self.load_robots(&snapshot.robots) {
            self.dynamics.restore(&before.0)?;
            self.load_robots(&before.1)?;
            return Err(error);
        }
        self.control_steps = snapshot.control_steps;
        self.cameras_before.clear();
        Ok(())
    }

    fn save_robots(&self) -> Result<Vec<Vec<u8>>, SimError> {
        self.robots.iter().map(|robot| robot.save()).collect()
    }

    fn load_robots(&mut self, saved: &[Vec<u8>]) -> Result<(), SimError> {
        for (index, robot) in self.robots.iter_mut().enumerate() {
            robot.load(&self.dynamics, saved.get(index).map(Vec::as_slice).unwrap_or_default())?;
        }
        Ok(())
    }

    /// Returns a hash of all state that determines the future, in full precision: positions, velocities
    /// and impulses of dynamics, controllers, step count.
    pub fn state_hash(&self) -> u64 {
        let mut hash = Xxh3::new();
        hash.update(&self.control_steps.to_le_bytes());
        // Serialising plain data to memory does not fail.
        let bytes = postcard::to_extend(&self.dynamics.present(), Vec::with_capacity(DYNAMICS_BYTES));
        hash.update(&bytes.unwrap_or_default());
        if let Some(resting) = self.dynamics.resting() {
            hash.update(&postcard::to_stdvec(&resting).unwrap_or_default());
        }
        for robot in &self.robots {
            hash.update(&robot.save().unwrap_or_default());
        }
        hash.digest()
    }
}
