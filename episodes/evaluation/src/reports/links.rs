//! Links in reports: paths relative to the report's folder, which stay valid if the folders are moved
//! together.

use std::path::{Component, Path, PathBuf};

/// Returns the link from a file in `folder` to `target`. Returns `None` if either does not exist, or they are
/// on different drives.
pub fn relative(folder: &Path, target: &Path) -> Option<String> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let (folder, target) = (folder.canonicalize().ok()?, target.canonicalize().ok()?);
    let shared = folder.components().zip(target.components()).take_while(|(one, other)| one == other).count();
    let is_on_drive = |part: Component| matches!(part, Component::RootDir | Component::Prefix(_));
    let mut below = target.components().skip(shared);
    if folder.components().skip(shared).chain(below.clone()).any(is_on_drive) {
        return None;
    }
    let up = folder.components().skip(shared).map(|_| PathBuf::from(".."));
    let path: PathBuf = up.chain(below.by_ref().map(|part| PathBuf::from(part.as_os_str()))).collect();
    Some(encoded(&path.to_string_lossy().replace('\\', "/")))
}

/// Percent-encodes a path for a link.
pub fn encoded(path: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.~/".contains(&byte);
    let encode = |byte: u8| match plain(byte) {
        true => char::from(byte).to_string(),
        false => format!("%{byte:02X}"),
    };
    path.bytes().map(encode).collect()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn links_lead_from_folder_to_folder() {
        let place = tempfile::tempdir().unwrap();
        let [run, page] = ["runs/a b", "runs/other/page.html"].map(|path| place.path().join(path));
        fs::create_dir_all(&run).unwrap();
        fs::create_dir_all(page.parent().unwrap()).unwrap();
        fs::write(&page, "").unwrap();
        fs::write(run.join("page.html"), "").unwrap();
        let check = |folder: &Path, target: &Path, expected: Option<&str>| {
            assert_eq!(relative(folder, target).as_deref(), expected, "{folder:?} to {target:?}");
        };
        check(&run, &page, Some("../other/page.html"));
        check(&run, &run.join("page.html"), Some("page.html"));
        check(place.path(), &run.join("page.html"), Some("runs/a%20b/page.html"));
        check(&run, &place.path().join("absent"), None);
    }
}
