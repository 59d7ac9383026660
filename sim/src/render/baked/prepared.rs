//! Cache of prepared sceneries: renderers of equal worlds share one.

use std::sync::{Arc, Mutex, PoisonError};

use super::prepare;
use crate::render::Scenery;
use crate::render::scene::prepared::Prepared;

/// Maximum number of cached sceneries, and of their triangles, of about 100 bytes each. The latest scenery is
/// always kept.
const MAX_KEPT: usize = 8;
const MAX_KEPT_TRIANGLES: usize = 1_500_000;

/// Prepared sceneries, each with its source scenery; the latest first.
static KEPT: Mutex<Vec<(Scenery, Arc<Prepared>)>> = Mutex::new(Vec::new());

/// Returns the scenery as [`prepare`] prepares it for renderers.
pub fn lit(scenery: Scenery) -> Arc<Prepared> {
    // Every call leaves the cache consistent, so a poisoned lock is safe to use.
    let kept = || KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, prepared)) = kept().iter().find(|(own, _)| *own == scenery) {
        return prepared.clone();
    }
    let prepared = Arc::new(prepare(scenery.clone()));
    let mut kept = kept();
    kept.insert(0, (scenery, prepared.clone()));
    kept.truncate(MAX_KEPT);
    let mut triangles = 0;
    let mut fits = |(_, prepared): &(Scenery, Arc<Prepared>)| {
        triangles += prepared.patch_of.len();
        triangles <= MAX_KEPT_TRIANGLES
    };
    let fitting = kept.iter().take_while(|kept| fits(kept)).count();
    kept.truncate(fitting.max(1));
    prepared
}
