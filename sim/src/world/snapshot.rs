//! Saving, restoring and hashing a world.

use rapier3d::prelude::PhysicsWorld;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::Xxh3;

use super::World;
use crate::SimError;

/// A world at one instant. It fits only a world made from the same specification by the same binary.
#[derive(Clone, Serialize, Deserialize)]
pub struct Snapshot {
    physics: Vec<u8>,
    robots: Vec<Vec<u8>>,
    control_steps: u64,
}

impl World {
    /// About half a megabyte for two robots.
    pub fn snapshot(&self) -> Result<Snapshot, SimError> {
        let robots = self.robots.iter().map(|robot| robot.save()).collect::<Result<_, _>>()?;
        Ok(Snapshot {
            physics: postcard::to_stdvec(&self.physics)?,
            robots,
            control_steps: self.control_steps,
        })
    }

    /// Takes the world back to a snapshot. On an error the world is as it was.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SimError> {
        let physics: PhysicsWorld = postcard::from_bytes(&snapshot.physics)?;
        let before = self.snapshot()?;
        for index in 0..self.robots.len() {
            let bytes = snapshot.robots.get(index).map(Vec::as_slice).unwrap_or_default();
            if let Err(error) = self.robots[index].load(bytes) {
                for (robot, bytes) in self.robots.iter_mut().zip(&before.robots) {
                    robot.load(bytes)?;
                }
                return Err(error);
            }
        }
        self.physics = physics;
        self.control_steps = snapshot.control_steps;
        Ok(())
    }

    /// Hash of everything that decides the future: poses and velocities of all bodies, controllers, step count.
    pub fn state_hash(&self) -> u64 {
        let mut hash = Xxh3::new();
        hash.update(&self.control_steps.to_le_bytes());
        let mut floats =
            |values: &[f32]| values.iter().for_each(|value| hash.update(&value.to_bits().to_le_bytes()));
        for (_, body) in self.physics.bodies.iter() {
            floats(&body.position().translation.to_array());
            floats(&body.position().rotation.to_array());
            floats(&body.linvel().to_array());
            floats(&body.angvel().to_array());
        }
        for robot in &self.robots {
            // Serialising plain data to memory does not fail.
            hash.update(&robot.save().unwrap_or_default());
        }
        hash.digest()
    }
}
