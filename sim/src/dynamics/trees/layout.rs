//! Memory layout of a tree: degrees of freedom and the packed rows of its sparse matrices.

use super::link::Link;

/// Layout of packed matrices. Row k holds the columns on the path from the world to degree of freedom k,
/// k itself last: the non-zero columns of M and its factor L (Featherstone 2008, chapter 8). Degrees of
/// freedom of one joint are adjacent.
#[derive(PartialEq)]
pub struct Layout {
    /// First degree of freedom of each link's joint. For a fixed joint it is that of the next moving link.
    pub first_dof: Vec<usize>,
    /// Last degree of freedom on the path to each link; `None` if the link cannot move.
    pub last_dof: Vec<Option<usize>>,
    pub link_of: Vec<usize>,
    /// For each link, the first link that it is rigidly connected to, and the same for the link's parent.
    rigid: Vec<usize>,
    rigid_parent: Vec<Option<usize>>,
    start: Vec<usize>,
    path: Vec<u16>,
}

impl Layout {
    pub fn of(links: &[Link]) -> Layout {
        let mut layout = Layout {
            first_dof: Vec::new(),
            last_dof: Vec::new(),
            link_of: Vec::new(),
            rigid: Vec::new(),
            rigid_parent: Vec::new(),
            start: vec![0],
            path: Vec::new(),
        };
        for (index, link) in links.iter().enumerate() {
            let mut before = link.parent.and_then(|parent| layout.last_dof[parent]);
            layout.first_dof.push(layout.dofs());
            for _ in 0..link.joint.dofs() {
                let dof = layout.dofs();
                if let Some(before) = before {
                    layout.path.extend_from_within(layout.start[before]..layout.start[before + 1]);
                }
                layout.path.push(u16::try_from(dof).expect("a tree of more than 65535 degrees of freedom"));
                layout.start.push(layout.path.len());
                layout.link_of.push(index);
                before = Some(dof);
            }
            layout.last_dof.push(before);
            let (rigid, parent) = match link.parent {
                Some(parent) if link.joint.dofs() == 0 => (layout.rigid[parent], layout.rigid_parent[parent]),
                parent => (index, parent.map(|parent| layout.rigid[parent])),
            };
            layout.rigid.push(rigid);
            layout.rigid_parent.push(parent);
        }
        layout
    }

    /// Returns true if two links are rigidly connected, or one joint is between them.
    pub fn are_neighbours(&self, a: usize, b: usize) -> bool {
        let (ra, rb) = (self.rigid[a], self.rigid[b]);
        ra == rb || self.rigid_parent[a] == Some(rb) || self.rigid_parent[b] == Some(ra)
    }

    pub fn dofs(&self) -> usize {
        self.link_of.len()
    }

    /// Returns the total length of all packed rows.
    pub fn packed(&self) -> usize {
        self.path.len()
    }

    /// Returns the range of row `dof` in a packed matrix.
    #[inline]
    pub fn row(&self, dof: usize) -> std::ops::Range<usize> {
        self.start[dof]..self.start[dof + 1]
    }

    /// Returns the columns of row `dof`.
    #[inline]
    pub fn path(&self, dof: usize) -> &[u16] {
        &self.path[self.row(dof)]
    }
}
