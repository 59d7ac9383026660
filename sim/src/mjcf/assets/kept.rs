//! Cache of parsed documents: a process reads a scene with meshes once for all its episodes, until one of
//! its files changes.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use xxhash_rust::xxh3::xxh3_64;

use super::files::read_mesh_bytes;
use crate::mjcf::Document;

/// Maximum number of cached documents; the latest are kept.
const MAX_KEPT: usize = 4;

static KEPT: Mutex<Vec<KeptDocument>> = Mutex::new(Vec::new());

struct KeptDocument {
    path: PathBuf,
    document: Document,
}

/// Returns the cached document of a file, if none of its files has changed since it was read.
pub(in crate::mjcf) fn find(path: &Path) -> Option<Document> {
    // Every call leaves the cache consistent, so a poisoned lock is safe to use.
    let kept = || KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let found = kept().iter().find(|kept| kept.path == path).map(|kept| kept.document.clone())?;
    let is_same =
        |(path, hash): &(PathBuf, u64)| read_mesh_bytes(path).is_ok_and(|bytes| xxh3_64(&bytes) == *hash);
    found.files.iter().all(is_same).then_some(found)
}

/// Caches a document that has meshes or images. All others are fast to read.
pub(in crate::mjcf) fn keep(path: &Path, document: &Document) {
    if document.meshes.is_empty()
        && document.textures.is_empty()
        && document.builtins.is_empty()
        && document.sky.is_none()
    {
        return;
    }
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    kept.retain(|kept| kept.path != path);
    kept.truncate(MAX_KEPT - 1);
    kept.insert(0, KeptDocument { path: path.into(), document: document.clone() });
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::sync::Arc;

    use super::*;

    const SCENE: &str = r#"<mujoco><asset><mesh name="tent" file="tent.obj"/></asset>
        <worldbody><geom type="mesh" mesh="tent"/></worldbody></mujoco>"#;

    #[test]
    fn a_file_is_read_again_if_it_or_one_that_it_names_has_changed() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("scene.xml");
        let write_tent = |height: &str| {
            let obj =
                format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 {height}\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n");
            fs::write(folder.path().join("tent.obj"), obj).expect("a mesh");
        };
        write_tent("1");
        fs::write(&path, SCENE).expect("a scene");
        let read = || Document::read(&path).expect("a scene");
        let (first, second) = (read(), read());
        assert!(Arc::ptr_eq(&first.meshes["tent"], &second.meshes["tent"]));
        assert_eq!(first.fingerprint(), second.fingerprint());
        write_tent("2");
        let third = read();
        assert_eq!(third.meshes["tent"].vertices_m.iter().map(|vertex| vertex.z).fold(0.0, f32::max), 2.0);
        assert_ne!(third.fingerprint(), first.fingerprint());
        fs::write(&path, SCENE.replace("<geom ", "<geom pos=\"0 0 1\" ")).expect("a scene");
        assert_ne!(read().fingerprint(), third.fingerprint());
    }
}
