//! Notes on meshes that are not convex. They collide as their hulls, as in MuJoCo, but their masses differ
//! from MuJoCo's.

use std::collections::BTreeMap;

use mjcf_rs::body::{Geom, GeomType};

use crate::mjcf::Document;

/// Share of its hull below which a mesh gets a note on its mass.
const CONVEX_SHARE: f32 = 0.95;
/// Share of its hull below which a mesh gets a note on its collision shape.
const HOLLOW_SHARE: f32 = 0.6;

impl Document {
    /// Adds notes on meshes that are far from convex but whose hulls collide or have mass. There is one note
    /// of each kind, with the first mesh.
    pub(in crate::mjcf) fn note_concave_meshes(&mut self) {
        let (mut weighing, mut hollow) = (Vec::new(), Vec::new());
        let mut shares: BTreeMap<&str, f32> = BTreeMap::new();
        for (body, geom, byte) in self.mesh_geoms() {
            let name = geom.mesh.as_deref().unwrap_or_default();
            let (weighs, collides) = (self.weighs(body, geom), geom.contype != 0 || geom.conaffinity != 0);
            let Some(mesh) = self.meshes.get(name).filter(|_| weighs || collides) else { continue };
            if shares.contains_key(name) {
                continue;
            }
            let share = *shares.entry(name).or_insert_with(|| mesh.hull_share());
            if weighs && share < CONVEX_SHARE && !mesh.weighs_exactly {
                weighing.push((name, share, byte));
            }
            if collides && share < HOLLOW_SHARE {
                hollow.push((name, share, byte));
            }
        }
        let weighs = "it weighs what its hull weighs, which is neither MuJoCo's `legacy` nor `exact`; inertia=\"exact\" is the same in both";
        let collides =
            "it collides as its hull, as in MuJoCo; cut it into convex pieces where something is to be in it";
        let notes = [(weighing, weighs), (hollow, collides)].into_iter().filter_map(|(found, what)| {
            let (name, share, byte) = found.first()?;
            let (line, percent) = (self.source.line(*byte), (100.0 * share).round());
            let more = match found.len() - 1 {
                0 => String::new(),
                more => format!(" (and {more} other meshes)"),
            };
            Some(format!("`{line}`: mesh `{name}`{more} fills {percent} % of its hull: {what}"))
        });
        let notes: Vec<String> = notes.collect();
        self.checked.approximated.extend(notes);
    }

    /// Returns all geoms that are meshes, each with the index of its body and its position in the text.
    fn mesh_geoms(&self) -> impl Iterator<Item = (usize, &Geom, usize)> {
        let bodies = self.model.bodies.iter().zip(&self.checked.bodies).enumerate();
        let geoms = bodies.flat_map(|(body, (entry, bytes))| {
            entry.body.geoms.iter().zip(&bytes.geoms).map(move |(geom, byte)| (body, geom, *byte))
        });
        geoms.filter(|(_, geom, _)| geom.type_ == GeomType::Mesh)
    }

    /// Returns true if a geom contributes mass or inertia to a moving body.
    fn weighs(&self, body: usize, geom: &Geom) -> bool {
        let mut above = std::iter::successors(Some(body), |body| self.model.bodies[*body].parent);
        self.takes_mass_of_geoms(body)
            && self.settings.inertia_groups.contains(&geom.group)
            && geom.mass != Some(0.0)
            && geom.density != Some(0.0)
            && above.any(|body| !self.model.bodies[body].body.joints.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a mesh of two cubes of 1 m with a gap of 1 m between them: 2 m^3 in a hull of 3 m^3.
    fn pair_of_cubes() -> String {
        let mut obj = String::new();
        for (cube, x) in [0.0, 2.0].into_iter().enumerate() {
            for corner in 0..8 {
                let at = |bit: usize| f64::from(u8::from(corner >> bit & 1 == 1));
                obj += &format!("v {} {} {}\n", x + at(0), at(1), at(2));
            }
            for [a, b, c, d] in
                [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]]
            {
                let first = 8 * cube;
                obj += &format!("f {} {} {} {}\n", first + a, first + b, first + c, first + d);
            }
        }
        obj
    }

    fn read(mesh: &str, body: &str) -> Document {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("cubes.obj"), pair_of_cubes()).expect("a mesh");
        let xml = format!(
            r#"<mujoco><asset><mesh name="cubes" file="cubes.obj" {mesh}/></asset>
            <worldbody><body>{body}<geom type="mesh" mesh="cubes" density="1"/></body></worldbody></mujoco>"#
        );
        let path = folder.path().join("scene.xml");
        std::fs::write(&path, xml).expect("a scene");
        Document::read(&path).expect("a scene")
    }

    #[test]
    fn a_mesh_weighs_its_hull_with_a_note_or_exactly_what_it_fills() {
        let mass = |document: &Document| document.trees().expect("trees")[1].links[0].mass.mass();
        let hull = read("", "<freejoint/>");
        assert!((mass(&hull) - 3.0).abs() < 1e-4, "{} kg", mass(&hull));
        let told = hull.approximations().join("\n");
        assert!(told.contains("mesh `cubes` fills 67 % of its hull: it weighs"), "{told}");
        let exact = read(r#"inertia="exact""#, "<freejoint/>");
        assert!((mass(&exact) - 2.0).abs() < 1e-4, "{} kg", mass(&exact));
        assert_eq!(exact.approximations(), [""; 0]);
        let fixed = read("", "");
        assert_eq!(fixed.approximations(), [""; 0], "nobody feels its weight");
    }
}
