//! Meshes that an MJCF file refers to: OBJ, STL and MSH.

use std::fmt;
use std::io::{self, Cursor};
use std::path::Path;
use std::sync::{Arc, OnceLock};

use mjcf_rs::assets::MeshInertia;
use rapier3d::math::{Rotation, Vector};
use rapier3d::prelude::{MassProperties, SharedShape};
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

use crate::mjcf::{Document, pose, vector};
use crate::{
    SimError, mass,
    user_file::{read_bytes, with_own_separators},
};

/// Maximum size of a mesh or an image.
pub(in crate::mjcf) const MAX_FILE_BYTES: u64 = 1 << 30;
/// Size of the header of a binary STL file, and of each triangle after it.
const STL_HEAD_BYTES: usize = 84;
const STL_TRIANGLE_BYTES: usize = 50;

/// Triangles of a file, in metres, counter-clockwise seen from outside.
#[derive(Clone, Default)]
pub struct Mesh {
    pub vertices_m: Vec<Vector>,
    pub triangles: Vec<[u32; 3]>,
    /// Normals at the corners of each triangle; empty if the file gives none.
    pub corner_normal: Vec<[Vector; 3]>,
    /// Texture coordinates at the corners of each triangle: 0 at an image's top left corner, 1 at the right
    /// or lower edge. Empty if the file gives none.
    pub corner_uv: Vec<[[f32; 2]; 3]>,
    /// True if mass and inertia are those of the volume inside the triangles, and not of the hull.
    pub weighs_exactly: bool,
    hull: OnceLock<Option<SharedShape>>,
    content: OnceLock<u128>,
}

impl PartialEq for Mesh {
    fn eq(&self, other: &Mesh) -> bool {
        self.vertices_m == other.vertices_m
            && self.triangles == other.triangles
            && self.corner_normal == other.corner_normal
            && self.corner_uv == other.corner_uv
            && self.weighs_exactly == other.weighs_exactly
    }
}

/// Input of the fingerprint. It omits `weighs_exactly`, which is an attribute of the asset, and data that
/// only images use.
impl fmt::Debug for Mesh {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Mesh { vertices_m, triangles, .. } = self;
        f.debug_struct("Mesh").field("vertices_m", vertices_m).field("triangles", triangles).finish()
    }
}

impl Mesh {
    /// Returns the convex hull, which is computed once; `None` for points in one plane.
    pub(crate) fn hull(&self) -> Option<SharedShape> {
        self.hull.get_or_init(|| SharedShape::convex_hull(&self.vertices_m)).clone()
    }

    /// Returns a hash of the numbers of the mesh, which is computed once.
    pub(crate) fn content_hash(&self) -> u128 {
        *self.content.get_or_init(|| {
            let mut hash = Xxh3::new();
            let mut points = |points: &[Vector]| {
                hash.update(&points.len().to_ne_bytes());
                let numbers = points.iter().flat_map(|point| point.to_array());
                numbers.for_each(|number| hash.update(&number.to_bits().to_ne_bytes()));
            };
            points(&self.vertices_m);
            points(self.corner_normal.as_flattened());
            let corners = self.triangles.iter().flatten().copied();
            let uvs = self.corner_uv.as_flattened().as_flattened().iter().map(|uv| uv.to_bits());
            corners.chain(uvs).for_each(|number| hash.update(&number.to_ne_bytes()));
            hash.digest128()
        })
    }

    /// Returns the mass properties at a density of 1.
    pub(crate) fn mass_properties(&self) -> Option<MassProperties> {
        let of_hull =
            || self.hull().map(|hull| mass::at_unit_density(|density| hull.mass_properties(density)));
        let exact = self
            .weighs_exactly
            .then(|| {
                mass::at_unit_density(|density| {
                    MassProperties::from_trimesh(density, &self.vertices_m, &self.triangles)
                })
            })
            // A surface with holes may enclose no volume.
            .filter(|exact| exact.mass() > 0.0);
        exact.or_else(of_hull)
    }

    /// Returns the share of its hull that the mesh fills; 1 without a hull.
    pub(in crate::mjcf) fn hull_share(&self) -> f32 {
        let Some(hull) = self.hull() else { return 1.0 };
        let middle_m = self.vertices_m.first().copied().unwrap_or_default();
        let six_times_m3 = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|corner| (self.vertices_m[corner as usize] - middle_m).as_dvec3());
            a.cross(b).dot(c)
        };
        let volume_m3 = self.triangles.iter().map(six_times_m3).sum::<f64>().abs() / 6.0;
        volume_m3 as f32 / hull.mass_properties(1.0).mass()
    }
}

impl Document {
    /// Reads the meshes of assets that name a file, scaled as the assets specify.
    pub(in crate::mjcf) fn read_meshes(&mut self) -> Result<(), SimError> {
        let mut refused = Vec::new();
        for asset in &self.model.assets.meshes {
            let Some(path) = self.model.resolve_mesh_file(asset, &self.folder) else { continue };
            let path = self.source.beside_including(with_own_separators(path));
            let bytes = check_kind(&path)
                .and_then(|()| read_mesh_bytes(&path).map_err(|source| SimError::unreadable(&path, source)));
            match bytes.and_then(|bytes| Ok((self.read_mesh(asset, &path, &bytes)?, xxh3_64(&bytes)))) {
                Ok((mesh, hash)) => {
                    self.files.push((path, hash));
                    self.meshes.insert(asset.name.clone().unwrap_or_default(), Arc::new(mesh));
                }
                Err(error) => refused.push(error),
            }
        }
        SimError::of_all(refused).map_or(Ok(()), Err)
    }

    fn read_mesh(&self, asset: &mjcf_rs::assets::Mesh, path: &Path, bytes: &[u8]) -> Result<Mesh, SimError> {
        let mut mesh = read(path, bytes)?;
        if mesh.triangles.is_empty() {
            return Err(self.unsupported(format!("mesh `{}` has no triangles", path.display())));
        }
        let scale = vector(asset.scale);
        let reference = pose(&asset.refpose);
        let turn: Rotation = reference.rotation.inverse();
        if asset.refpose != mjcf_rs::Pose::default() {
            let place = |vertex_m: &mut Vector| *vertex_m = turn * (*vertex_m - reference.translation);
            mesh.vertices_m.iter_mut().for_each(place);
        }
        mesh.vertices_m.iter_mut().for_each(|vertex_m| *vertex_m *= scale);
        let normals = mesh.corner_normal.as_flattened_mut().iter_mut();
        normals.for_each(|normal| *normal = (turn * *normal / scale).normalize_or_zero());
        // A reflection turns surfaces inside out.
        if scale.x * scale.y * scale.z < 0.0 {
            mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
            mesh.corner_normal.iter_mut().for_each(|corners| corners.swap(1, 2));
            mesh.corner_uv.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        mesh.weighs_exactly = asset.inertia == MeshInertia::Exact || self.model.compiler.exact_mesh_inertia;
        Ok(mesh)
    }
}

/// Reads the bytes of a file that an MJCF file names.
pub(in crate::mjcf) fn read_mesh_bytes(path: &Path) -> io::Result<Vec<u8>> {
    read_bytes(path, MAX_FILE_BYTES)
}

/// Refuses a file whose extension is not that of a mesh, even if the file is missing.
fn check_kind(path: &Path) -> Result<(), SimError> {
    match kind(path).as_str() {
        "obj" | "stl" | "msh" => Ok(()),
        _ => Err(SimError::MeshKind { path: path.display().to_string() }),
    }
}

/// Returns the extension of a file in lower case.
fn kind(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Parses a file of the kind given by its extension.
fn read(path: &Path, bytes: &[u8]) -> Result<Mesh, SimError> {
    match kind(path).as_str() {
        "obj" => read_obj(path, bytes),
        "stl" => read_stl(path, bytes),
        "msh" => read_msh(bytes).ok_or_else(|| {
            let source = "it is no MSH file of MuJoCo's, or it ends too early".into();
            SimError::Mesh { path: path.display().to_string(), source }
        }),
        _ => Err(SimError::MeshKind { path: path.display().to_string() }),
    }
}

fn read_obj(path: &Path, mut bytes: &[u8]) -> Result<Mesh, SimError> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..tobj::LoadOptions::default()
    };
    // Colours are those of the MJCF file.
    let without_materials = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut bytes, &options, without_materials)
        .map_err(|source| SimError::Mesh { path: path.display().to_string(), source: Box::new(source) })?;
    let mut found = Mesh::default();
    for tobj::Model { mesh, .. } in &models {
        let first = found.vertices_m.len() as u32;
        found.vertices_m.extend(mesh.positions.chunks_exact(3).map(Vector::from_slice));
        let corners = mesh.indices.chunks_exact(3);
        found.triangles.extend(corners.map(|corner| [corner[0], corner[1], corner[2]].map(|i| first + i)));
    }
    found.corner_normal = corners(&models, |mesh| (&mesh.normal_indices, &mesh.normals), Vector::from_array);
    let downwards = |[u, v]: [f32; 2]| [u, 1.0 - v];
    found.corner_uv = corners(&models, |mesh| (&mesh.texcoord_indices, &mesh.texcoords), downwards);
    Ok(found)
}

/// Returns a property of the corners of all triangles, given by indices into values of `N` numbers. Returns
/// an empty vector if no model has the property. Models without it get zero.
fn corners<T: Copy + Default, const N: usize>(
    models: &[tobj::Model],
    of: fn(&tobj::Mesh) -> (&Vec<u32>, &Vec<f32>),
    convert: fn([f32; N]) -> T,
) -> Vec<[T; 3]> {
    if models.iter().all(|model| of(&model.mesh).0.is_empty()) {
        return Vec::new();
    }
    let mut found = Vec::new();
    for tobj::Model { mesh, .. } in models {
        let (indices, numbers) = of(mesh);
        if indices.is_empty() {
            found.resize(found.len() + mesh.indices.len() / 3, [T::default(); 3]);
        }
        let values = numbers.as_chunks::<N>().0;
        let value = |index: &u32| values.get(*index as usize).map_or(T::default(), |value| convert(*value));
        found.extend(indices.as_chunks::<3>().0.iter().map(|corners| corners.each_ref().map(value)));
    }
    found
}

fn read_stl(path: &Path, bytes: &[u8]) -> Result<Mesh, SimError> {
    let mut bytes = bytes.to_vec();
    // The header of a binary file may begin like a text file; the length identifies it.
    if let Some(count) = number(&bytes, STL_HEAD_BYTES - 4)
        && bytes.len() == STL_HEAD_BYTES + STL_TRIANGLE_BYTES * count as usize
    {
        bytes[..STL_HEAD_BYTES - 4].fill(0);
    }
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes))
        .map_err(|source| SimError::Mesh { path: path.display().to_string(), source: Box::new(source) })?;
    Ok(Mesh {
        vertices_m: mesh.vertices.iter().map(|v| Vector::new(v[0], v[1], v[2])).collect(),
        triangles: mesh.faces.iter().map(|face| face.vertices.map(|corner| corner as u32)).collect(),
        ..Mesh::default()
    })
}

/// Parses MuJoCo's MSH format, little-endian. It has the numbers of vertices, normals, texture coordinates
/// and faces (i32). Then follow 3, 3 and 2 f32 and 3 i32 for each.
fn read_msh(bytes: &[u8]) -> Option<Mesh> {
    const COUNTS_BYTES: usize = 16;
    let mut counts = [0; 4];
    for (index, count) in counts.iter_mut().enumerate() {
        *count = number(bytes, 4 * index)? as usize;
    }
    let [vertices, normals, coordinates, faces] = counts;
    let first_face = COUNTS_BYTES + 4 * (3 * vertices + 3 * normals + 2 * coordinates);
    if bytes.len() != first_face + 12 * faces {
        return None;
    }
    let coordinate = |index: usize| Some(f32::from_bits(number(bytes, COUNTS_BYTES + 4 * index)?));
    let vertex =
        |i: usize| Some(Vector::new(coordinate(3 * i)?, coordinate(3 * i + 1)?, coordinate(3 * i + 2)?));
    let corner =
        |index: usize| number(bytes, first_face + 4 * index).filter(|corner| (*corner as usize) < vertices);
    let triangle = |i: usize| Some([corner(3 * i)?, corner(3 * i + 1)?, corner(3 * i + 2)?]);
    let triangles = (0..faces).map(triangle).collect::<Option<Vec<_>>>()?;
    // Normals and texture coordinates are those of the vertices.
    let numbers =
        |first: usize, count: usize| (0..count).map(|i| coordinate(first + i)).collect::<Option<Vec<f32>>>();
    let normals = numbers(3 * vertices, 3 * normals)?;
    let normals: Vec<Vector> = normals.as_chunks::<3>().0.iter().copied().map(Vector::from_array).collect();
    let uvs = numbers(3 * vertices + normals.len() * 3, 2 * coordinates)?;
    Some(Mesh {
        vertices_m: (0..vertices).map(vertex).collect::<Option<_>>()?,
        corner_normal: of_corners(&triangles, &normals, vertices),
        corner_uv: of_corners(&triangles, uvs.as_chunks::<2>().0, vertices),
        triangles,
        ..Mesh::default()
    })
}

/// Returns values of vertices for the corners of triangles. Returns an empty vector unless each vertex has a
/// value.
fn of_corners<T: Copy>(triangles: &[[u32; 3]], values: &[T], vertices: usize) -> Vec<[T; 3]> {
    if values.len() != vertices {
        return Vec::new();
    }
    triangles.iter().map(|corners| corners.map(|corner| values[corner as usize])).collect()
}

/// Reads a little-endian number of four bytes. Returns `None` beyond the end.
fn number(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mjcf::Primitive;

    /// A unit square of two triangles, and one slope of a tent over it.
    const OBJ: &str =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1\nvn 0 0 1\nf 4//1 3//1 2//1 1//1\nf -5 -4 -1\n";
    const STL: &str = "solid tent\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid tent\n";

    fn read_geom(file: &str, content: impl AsRef<[u8]>, asset: &str) -> Result<Arc<Mesh>, SimError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::create_dir(folder.path().join("meshes")).expect("a folder");
        std::fs::write(folder.path().join("meshes").join(file), content).expect("a mesh");
        let xml = format!(
            r#"<mujoco><compiler meshdir="meshes"/><asset><mesh name="tent" file="{file}" {asset}/></asset>
            <worldbody><geom type="mesh" mesh="tent"/></worldbody></mujoco>"#
        );
        let path = folder.path().join("scene.xml");
        std::fs::write(&path, xml).expect("a scene");
        match Document::read(&path)?.geoms(0)?.remove(0).primitive {
            Primitive::Mesh(mesh) => Ok(mesh),
            other => panic!("{other:?} is no mesh of a file"),
        }
    }

    #[test]
    fn files_of_both_kinds_are_read_and_scaled() {
        let mesh = read_geom("tent.obj", OBJ, r#"scale="1 2 1""#).expect("an OBJ file");
        assert_eq!((mesh.vertices_m.len(), mesh.triangles.len()), (5, 3));
        // The reader numbers vertices in the order in which the faces use them.
        let corners_m = mesh.triangles[2].map(|corner| mesh.vertices_m[corner as usize]);
        assert_eq!(corners_m, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 1.0, 1.0]].map(Vector::from));

        let mesh = read_geom("tent.STL", STL, r#"scale="1 1 -1""#).expect("an STL file");
        // The reflection preserves the outside.
        assert_eq!((mesh.vertices_m.len(), mesh.triangles.as_slice()), (3, [[0, 2, 1]].as_slice()));
    }

    /// One triangle in each binary format. The header of the STL file begins like that of a text file.
    #[test]
    fn binary_files_are_told_from_texts_by_their_length() {
        let corners = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let floats = corners.as_flattened().iter().flat_map(|number| number.to_le_bytes());
        let mut stl = b"solid made by a printer".to_vec();
        stl.resize(80, b' ');
        stl.extend(1u32.to_le_bytes());
        stl.extend([0; 12]);
        stl.extend(floats.clone());
        stl.extend([0; 2]);
        let mut msh: Vec<u8> = [3i32, 0, 0, 1].into_iter().flat_map(i32::to_le_bytes).collect();
        msh.extend(floats);
        msh.extend([0i32, 1, 2].into_iter().flat_map(i32::to_le_bytes));
        for (file, content) in [("tent.stl", stl), ("tent.msh", msh)] {
            let mesh = read_geom(file, content, "").unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(mesh.vertices_m, corners.map(Vector::from));
            assert_eq!(mesh.triangles, [[0, 1, 2]]);
        }
    }

    /// One triangle has corners with their own texture coordinates and normals, and the other has none.
    #[test]
    fn corners_have_the_texture_coordinates_and_normals_of_their_file() {
        let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.25 0.25\nvt 1 0\nvn 0 0 2\nvn 0 2 2\n\
            f 1/1/1 2/2/1 3/1/2\n";
        let mesh = read_geom("tent.obj", obj, r#"scale="1 2 -1""#).expect("an OBJ file");
        // The reflection swaps two corners. Rows of an image are counted downwards.
        assert_eq!(mesh.corner_uv, [[[0.25, 0.75], [0.25, 0.75], [1.0, 1.0]]]);
        let slanted = Vector::new(0.0, 0.5, -1.0).normalize();
        let [first, second, third] = mesh.corner_normal[0];
        assert_eq!([first, third], [Vector::NEG_Z; 2]);
        assert!((second - slanted).length() < 1e-6, "{second}");
        let plain = read_geom("tent.obj", OBJ, "").expect("an OBJ file");
        assert!(plain.corner_uv.is_empty() && plain.corner_normal.len() == 3);

        let mut msh: Vec<u8> = [3i32, 0, 3, 1].into_iter().flat_map(i32::to_le_bytes).collect();
        let floats: [f32; 15] = std::array::from_fn(|i| i as f32);
        msh.extend(floats.iter().flat_map(|number| number.to_le_bytes()));
        msh.extend([2i32, 1, 0].into_iter().flat_map(i32::to_le_bytes));
        let mesh = read_geom("tent.msh", msh, "").expect("an MSH file");
        assert_eq!(mesh.corner_uv, [[[13.0, 14.0], [11.0, 12.0], [9.0, 10.0]]]);
    }

    /// MuJoCo subtracts the reference position, rotates the mesh back, and then scales it.
    #[test]
    fn a_reference_pose_moves_the_mesh() {
        let asset = r#"refpos="1 0 0" refquat="0.70710678 0 0 0.70710678" scale="2 1 1""#;
        let mesh = read_geom("tent.stl", STL, asset).expect("a mesh");
        let expected_m = [[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [2.0, 1.0, 0.0]].map(Vector::from);
        for (found_m, expected_m) in mesh.vertices_m.iter().zip(expected_m) {
            assert!((*found_m - expected_m).length() < 1e-6, "{found_m} instead of {expected_m}");
        }
    }

    #[test]
    fn files_that_are_no_meshes_are_named() {
        for (file, content, expected) in [
            ("tent.ply", "ply", "tent.ply` is of a kind that is not read; use .obj, .stl or .msh"),
            ("tent.msh", "0123456789abcdef", "tent.msh` is not a mesh that can be read"),
            ("tent.obj", "f 1 2 3\n", "tent.obj` is not a mesh that can be read"),
            ("tent.obj", "# nothing\n", "tent.obj` has no triangles"),
            ("tent.stl", "solid", "tent.stl` is not a mesh that can be read"),
        ] {
            let text = read_geom(file, content, "").expect_err(file).to_string();
            assert!(text.contains(expected), "{text}");
        }
    }
}
