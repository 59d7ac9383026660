//! Baking: the path tracer computes the light of a room once, and rasterisers look it up.
//!
//! Flat surfaces of the room have light maps. Everything else is lit by ambient cubes, interpolated in a grid
//! of probes: curved surfaces of the room patch by patch, moving bodies part by part. Moving bodies cast
//! shadows through the rasterisers' shadow map. The share of light that these shadows remove is baked, too.

mod bake;
mod kept;
mod maps;
mod prepared;
#[cfg(test)]
mod tests;

pub use prepared::lit;

use super::scene::prepared::Prepared;
use super::{Carrier, Scenery};

/// Prepares a scenery for a renderer, with the baked light of its room. This light contains the room's
/// shadows, so the room casts no others.
fn prepare(mut scenery: Scenery) -> Prepared {
    let baked = scenery.room.as_ref().and_then(kept::light_of);
    if baked.is_some() {
        let room = scenery.parts.iter_mut().filter(|part| part.carrier == Carrier::Room);
        room.for_each(|part| part.casts_shadow = false);
    }
    let mut prepared = Prepared::new(scenery);
    prepared.baked = baked;
    prepared
}
