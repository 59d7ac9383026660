//! The text of a file with all its includes in place, and the source line of each part.

use std::ops::Range;
use std::path::{Path, PathBuf};

use roxmltree::Node;
use xxhash_rust::xxh3::xxh3_64;

use crate::{
    SimError,
    user_file::{MAX_TEXT_BYTES, read_text, with_own_separators},
};

/// XML text without `<include>`.
#[derive(Clone, Debug)]
pub(in crate::mjcf) struct MjcfText {
    pub text: String,
    files: Vec<SourceFile>,
    /// Pieces in order of position; together they are the text.
    pieces: Vec<Piece>,
    /// Folder in which included files are searched if they are not in the folder of the including file.
    folder: PathBuf,
}

#[derive(Clone, Debug)]
struct SourceFile {
    name: String,
    text: String,
    /// Canonical path, which identifies files that are included by different names.
    path: Option<PathBuf>,
}

/// A contiguous part of the text from one file.
#[derive(Clone, Copy, Debug)]
struct Piece {
    start: usize,
    file: usize,
    start_in_file: usize,
}

impl MjcfText {
    /// Reads a text and inserts included files as MuJoCo does: the content of their root element
    /// replaces the `<include>`.
    pub fn read(file: &str, xml: &str, folder: &Path) -> Result<MjcfText, SimError> {
        let mut source =
            MjcfText { text: String::new(), files: Vec::new(), pieces: Vec::new(), folder: folder.into() };
        source.files.push(SourceFile { name: file.into(), text: xml.into(), path: None });
        source.append(0, folder, false)?;
        Ok(source)
    }

    /// Returns the same files with empty texts.
    pub(super) fn without_text(&self) -> MjcfText {
        let (files, folder) = (self.files.clone(), self.folder.clone());
        MjcfText { text: String::new(), files, pieces: Vec::new(), folder }
    }

    /// Appends a range of another text of the same files.
    pub(super) fn push_of(&mut self, other: &MjcfText, range: Range<usize>) {
        let first = other.pieces.partition_point(|piece| piece.start <= range.start).saturating_sub(1);
        for piece in other.pieces[first..].iter().take_while(|piece| piece.start < range.end) {
            let skipped = range.start.saturating_sub(piece.start);
            let start = self.text.len() + piece.start.saturating_sub(range.start);
            self.pieces.push(Piece { start, start_in_file: piece.start_in_file + skipped, ..*piece });
        }
        self.text.push_str(&other.text[range]);
    }

    /// Appends text that is in no file, with the line of a byte of another text of the same files.
    pub(super) fn push_made(&mut self, other: &MjcfText, byte: usize, text: &str) {
        let piece = other.piece(byte);
        let start_in_file = piece.start_in_file + byte - piece.start;
        self.pieces.push(Piece { start: self.text.len(), start_in_file, ..*piece });
        self.text.push_str(text);
    }

    /// Returns the included files, each with a hash of its text.
    pub fn included(&self) -> Vec<(PathBuf, u64)> {
        let hashed = |file: &SourceFile| Some((file.path.clone()?, xxh3_64(file.text.as_bytes())));
        self.files.iter().filter_map(hashed).collect()
    }

    /// Returns the path of a file. A path that does not exist is searched relative to the included files.
    pub fn beside_including(&self, path: PathBuf) -> PathBuf {
        if path.exists() {
            return path;
        }
        let named = path.strip_prefix(&self.folder).unwrap_or(&path);
        let folders = self.files.iter().filter_map(|file| file.path.as_ref()?.parent());
        let mut beside = folders.map(|folder| with_own_separators(folder.join(named)));
        beside.find(|beside| beside.exists()).unwrap_or(path)
    }

    /// Parses the text as a tree of elements.
    pub fn xml(&self) -> Result<roxmltree::Document<'_>, SimError> {
        let file = || self.files[0].name.clone();
        roxmltree::Document::parse(&self.text).map_err(|source| SimError::Xml { file: file(), source })
    }

    /// Returns the error that refuses an element, with its line and the names around it.
    pub fn refuse(&self, node: &Node, what: impl AsRef<str>) -> SimError {
        let what = format!("{}: {}", describe(node), what.as_ref());
        SimError::Unsupported { file: self.line(node.range().start), what }
    }

    /// Returns the error that refuses the element that begins at a byte of the text.
    pub fn refuse_at(&self, byte: usize, what: &str) -> SimError {
        let xml = match self.xml() {
            Ok(xml) => xml,
            Err(error) => return error,
        };
        let node = xml.descendants().find(|node| node.is_element() && node.range().start >= byte);
        self.refuse(&node.unwrap_or(xml.root_element()), what)
    }

    /// Returns the file and line of a byte of the text, for example `scene.xml:12`.
    pub fn line(&self, byte: usize) -> String {
        let piece = self.piece(byte);
        self.files[piece.file].line(piece.start_in_file + byte - piece.start)
    }

    /// Returns the piece that a byte of the text is in.
    fn piece(&self, byte: usize) -> &Piece {
        let after = self.pieces.partition_point(|piece| piece.start <= byte);
        &self.pieces[after.saturating_sub(1)]
    }

    /// Appends a whole file, or the content of its root element.
    fn append(&mut self, file: usize, folder: &Path, inside_only: bool) -> Result<(), SimError> {
        let SourceFile { name, text, .. } = &self.files[file];
        let (name, text) = (name.clone(), text.clone());
        let xml = roxmltree::Document::parse(&text)
            .map_err(|source| SimError::Xml { file: name.clone(), source })?;
        let whole = match (inside_only, inside(&xml.root_element())) {
            (false, _) => 0..text.len(),
            (true, Some(inside)) => inside,
            (true, None) => {
                return Err(SimError::Unsupported { file: name, what: "there is nothing to include".into() });
            }
        };
        let mut from = whole.start;
        for include in xml.descendants().filter(|node| node.has_tag_name("include")) {
            if include.range().start < from {
                let file = self.files[file].line(include.range().start);
                let what = "an included file is no <include> itself; put that into a <mujoco>".into();
                return Err(SimError::Unsupported { file, what });
            }
            self.push(file, from..include.range().start);
            from = include.range().end;
            let (included, folder) = self.open(file, &include, folder)?;
            self.append(included, &folder, true)?;
        }
        self.push(file, from..whole.end);
        Ok(())
    }

    fn push(&mut self, file: usize, range: Range<usize>) {
        self.pieces.push(Piece { start: self.text.len(), file, start_in_file: range.start });
        self.text.push_str(&self.files[file].text[range]);
    }

    /// Reads the file that an `<include>` of another file names. Returns its index and its folder.
    fn open(&mut self, by: usize, include: &Node, folder: &Path) -> Result<(usize, PathBuf), SimError> {
        let refuse =
            |what: String| SimError::Unsupported { file: self.files[by].line(include.range().start), what };
        let name = include.attribute("file").ok_or_else(|| refuse("<include> needs a `file`".into()))?;
        if include.children().any(|child| child.is_element()) {
            return Err(refuse("<include> holds elements; put them behind it".into()));
        }
        let beside = with_own_separators(folder.join(name));
        let path = if beside.exists() { beside } else { with_own_separators(self.folder.join(name)) };
        let shown = path.display().to_string();
        let text = read_text(&path, MAX_TEXT_BYTES)
            .map_err(|source| SimError::Read { path: shown.clone(), source })?;
        let path = path.canonicalize().unwrap_or(path);
        if self.files.iter().any(|file| file.path.as_ref() == Some(&path)) {
            return Err(refuse(format!("`{shown}` is included already; a file can be included once")));
        }
        let folder = path.parent().unwrap_or(Path::new(".")).to_path_buf();
        self.files.push(SourceFile { name: shown, text, path: Some(path) });
        Ok((self.files.len() - 1, folder))
    }
}

/// Returns true if a text names other files. A text that is not XML names none.
pub(in crate::mjcf) fn names_files(xml: &str) -> bool {
    roxmltree::Document::parse(xml).is_ok_and(|tree| naming(&tree).is_some())
}

/// Returns the first element that names a file.
fn naming<'a, 'input>(tree: &'a roxmltree::Document<'input>) -> Option<Node<'a, 'input>> {
    tree.descendants().find(|node| node.attributes().any(|one| one.name().starts_with("file")))
}

/// Refuses a text that names other files.
pub(in crate::mjcf) fn refuse_files(file: &str, xml: &str) -> Result<(), SimError> {
    let tree =
        roxmltree::Document::parse(xml).map_err(|source| SimError::Xml { file: file.into(), source })?;
    let Some(naming) = naming(&tree) else { return Ok(()) };
    let line = 1 + xml[..naming.range().start].matches('\n').count();
    let what = format!(
        "{}: MJCF inside of another file names no other file; use shapes such as box and cylinder, or put it into a file of its \
         own beside the task's",
        describe(&naming)
    );
    Err(SimError::Unsupported { file: format!("{file}:{line}"), what })
}

impl SourceFile {
    fn line(&self, byte: usize) -> String {
        // Text that is in no file may be longer than its line.
        let before = &self.text.as_bytes()[..byte.min(self.text.len())];
        format!("{}:{}", self.name, 1 + before.iter().filter(|byte| **byte == b'\n').count())
    }
}

/// Returns the range of an element's content.
pub(super) fn inside(node: &Node) -> Option<Range<usize>> {
    Some(node.first_child()?.range().start..node.last_child()?.range().end)
}

/// Describes an element by its name, or else by the nearest named element around it.
pub(in crate::mjcf) fn describe(node: &Node) -> String {
    let tag = |node: &Node| node.tag_name().name().to_string();
    let name = |node: &Node| {
        let class = node.attribute("class").filter(|_| node.has_tag_name("default"));
        node.attribute("name").or(class).map(String::from)
    };
    if let Some(name) = name(node) {
        return format!("{} `{name}`", tag(node));
    }
    let around: Vec<Node> = node.ancestors().skip(1).filter(Node::is_element).collect();
    let unnamed = around.first().is_some_and(|one| one.has_tag_name("body") && name(one).is_none());
    let of_unnamed = if unnamed { " of an unnamed body" } else { "" };
    match (around.iter().find_map(|one| Some((tag(one), name(one)?))), around.as_slice()) {
        (Some((around, name)), _) => format!("{}{of_unnamed} in {around} `{name}`", tag(node)),
        (None, [.., section, _]) => format!("{}{of_unnamed} in <{}>", tag(node), tag(section)),
        (None, _) => format!("<{}>", tag(node)),
    }
}
