//! Cache of baked light: in the process for all renderers of a room, and on disk for later processes.

use std::fs;
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use rapier3d::math::{Pose, Vector};
use xxhash_rust::xxh3::Xxh3Default;

use super::bake::bake;
use crate::render::path::walls_m;
use crate::render::shading::baked::BakedLight;
use crate::render::{Part, Pattern, Scenery};

/// Version of the baking method. It is part of the key, since other versions give different light.
const VERSION: u32 = 2;
/// Maximum number of rooms whose light a process caches, and maximum number of files.
const MAX_ROOMS: usize = 16;
const MAX_FILES: usize = 100;
/// Maximum number of texels of an image that enter the hash.
const MAX_HASHED_TEXELS: usize = 4096;

/// Baked light of a room, once it has been computed.
#[derive(Clone)]
struct KeptLight {
    /// Hash of everything that the light depends on.
    key: u64,
    light: Arc<OnceLock<Arc<BakedLight>>>,
}

/// Returns the baked light of an empty room. Returns `None` outdoors, where the sun shines. The first call
/// computes the light or reads it from disk.
pub(super) fn light_of(room: &Arc<Scenery>) -> Option<Arc<BakedLight>> {
    let walls_m = walls_m(room)?;
    let KeptLight { key, light } = kept(key(room));
    let find = || {
        let path = folder().map(|folder| folder.join(format!("{key:016x}.light")));
        if let Some(light) = path.as_deref().and_then(read) {
            return Arc::new(light);
        }
        let light = bake(room, walls_m);
        if let Some(path) = path {
            write(&path, &light);
        }
        Arc::new(light)
    };
    Some(light.get_or_init(find).clone())
}

/// Returns the cache entry of a key.
fn kept(key: u64) -> KeptLight {
    static KEPT: Mutex<Vec<KeptLight>> = Mutex::new(Vec::new());
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = kept.iter().find(|known| known.key == key) {
        return known.clone();
    }
    let light = KeptLight { key, light: Arc::default() };
    if kept.len() == MAX_ROOMS {
        kept.remove(0);
    }
    kept.push(light.clone());
    light
}

/// Returns the folder of the cache files, in the user's cache directory. Returns `None` without such a
/// directory.
fn folder() -> Option<PathBuf> {
    Some(dirs::cache_dir()?.join("tandem").join("light"))
}

fn read(path: &Path) -> Option<BakedLight> {
    let bytes = fs::read(path).ok()?;
    postcard::from_bytes(&bytes).ok().filter(BakedLight::is_whole)
}

/// Writes the light to a file atomically. If that fails, for example on a full disk, it only has to be
/// computed again.
fn write(path: &Path, light: &BakedLight) {
    let Some(folder) = path.parent() else { return };
    let Ok(bytes) = postcard::to_allocvec(light) else { return };
    let unfinished = path.with_extension(std::process::id().to_string());
    let written = fs::create_dir_all(folder)
        .and_then(|()| fs::write(&unfinished, bytes))
        .and_then(|()| fs::rename(&unfinished, path));
    if written.is_err() {
        let _ = fs::remove_file(&unfinished);
    }
    remove_oldest(folder);
}

fn remove_oldest(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let modified = |entry: fs::DirEntry| Some((entry.metadata().ok()?.modified().ok()?, entry.path()));
    let mut files: Vec<_> = entries.flatten().filter_map(modified).collect();
    files.sort();
    for (_, path) in files.iter().take(files.len().saturating_sub(MAX_FILES)) {
        let _ = fs::remove_file(path);
    }
}

/// Returns a hash of a room and of the method's version.
fn key(room: &Scenery) -> u64 {
    let mut hasher = Xxh3Default::new();
    VERSION.hash(&mut hasher);
    for part in &room.parts {
        hash_part(part, &mut hasher);
    }
    let light = &room.light;
    for rgb in [light.sun_rgb, light.sun_direction, light.below_rgb, light.above_rgb] {
        hash_vector(rgb, &mut hasher);
    }
    hasher.finish()
}

fn hash_part(part: &Part, hasher: &mut Xxh3Default) {
    for vertex in &part.mesh.vertices {
        hash_vector(vertex.position_m, hasher);
        hash_vector(vertex.normal, hasher);
        vertex.uv.map(f32::to_bits).hash(hasher);
    }
    part.mesh.triangles.hash(hasher);
    let Pose { rotation, translation, .. } = part.carrier_from_mesh;
    rotation.to_array().map(f32::to_bits).hash(hasher);
    hash_vector(translation, hasher);
    part.rgb.map(f32::to_bits).hash(hasher);
    part.alpha.to_bits().hash(hasher);
    part.casts_shadow.hash(hasher);
    std::mem::discriminant(&part.pattern).hash(hasher);
    if let Pattern::Checker(second) = part.pattern {
        second.map(f32::to_bits).hash(hasher);
    }
    if let Some(image) = &part.image {
        let small = image.texture.levels.iter().find(|level| level.texels.len() <= MAX_HASHED_TEXELS);
        small.map(|level| &level.texels).hash(hasher);
        format!("{:?}", image.mapping).hash(hasher);
    }
}

fn hash_vector(values: Vector, hasher: &mut Xxh3Default) {
    values.to_array().map(f32::to_bits).hash(hasher);
}
