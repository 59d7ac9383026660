//! Files that an MJCF file refers to: meshes (OBJ and STL), and images of materials, of which only the
//! colour is used.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::Arc;

use image::ImageReader;
use rapier3d::math::Vector;

use super::{Document, vector};
use crate::{
    SimError,
    user_file::{open_regular, with_own_separators},
};

/// Triangles of a file, in metres, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    pub vertices_m: Vec<Vector>,
    pub triangles: Vec<[u32; 3]>,
}

impl Document {
    /// Reads the meshes of assets that name a file, scaled as the assets specify.
    pub(super) fn read_meshes(&self) -> Result<BTreeMap<String, Arc<Mesh>>, SimError> {
        let mut found = BTreeMap::new();
        for asset in &self.model.assets.meshes {
            if let Some(path) = self.model.resolve_mesh_file(asset, &self.folder) {
                let name = asset.name.clone().unwrap_or_default();
                found.insert(name, Arc::new(self.read_mesh(asset, &with_own_separators(path))?));
            }
        }
        Ok(found)
    }

    /// Reads the mean colours of textures that name a file.
    pub(super) fn read_textures(&self) -> Result<BTreeMap<String, [f32; 3]>, SimError> {
        let mut found = BTreeMap::new();
        for asset in &self.model.assets.textures {
            if let Some(path) = self.model.resolve_texture_file(asset, &self.folder) {
                found.insert(asset.name.clone().unwrap_or_default(), mean_rgb(&with_own_separators(path))?);
            }
        }
        Ok(found)
    }

    fn read_mesh(&self, asset: &mjcf_rs::assets::Mesh, path: &Path) -> Result<Mesh, SimError> {
        if asset.refpose != mjcf_rs::Pose::default() {
            let what = "refpos and refquat of a mesh are not read; place the geom instead";
            return Err(self.unsupported(format!("mesh `{}`: {what}", path.display())));
        }
        let mut mesh = read(path)?;
        if mesh.triangles.is_empty() {
            return Err(self.unsupported(format!("mesh `{}` has no triangles", path.display())));
        }
        let scale = vector(asset.scale);
        mesh.vertices_m.iter_mut().for_each(|vertex_m| *vertex_m *= scale);
        // A reflection turns surfaces inside out.
        if scale.x * scale.y * scale.z < 0.0 {
            mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        Ok(mesh)
    }
}

/// Reads a file of the kind given by its extension.
fn read(path: &Path) -> Result<Mesh, SimError> {
    let kind = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let open = || open_regular(path).map(BufReader::new).map_err(|source| unreadable(path, source));
    match kind.as_str() {
        "obj" => read_obj(path, open()?),
        "stl" => read_stl(path, open()?),
        _ => Err(SimError::MeshKind { path: path.display().to_string() }),
    }
}

fn read_obj(path: &Path, mut file: BufReader<File>) -> Result<Mesh, SimError> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..tobj::LoadOptions::default()
    };
    // Colours are those of the MJCF file.
    let without_materials = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut file, &options, without_materials)
        .map_err(|source| SimError::Mesh { path: path.display().to_string(), source: Box::new(source) })?;
    let mut found = Mesh::default();
    for tobj::Model { mesh, .. } in models {
        let first = found.vertices_m.len() as u32;
        found.vertices_m.extend(mesh.positions.chunks_exact(3).map(Vector::from_slice));
        let corners = mesh.indices.chunks_exact(3);
        found.triangles.extend(corners.map(|corner| [corner[0], corner[1], corner[2]].map(|i| first + i)));
    }
    Ok(found)
}

fn read_stl(path: &Path, mut file: BufReader<File>) -> Result<Mesh, SimError> {
    let mesh = stl_io::read_stl(&mut file)
        .map_err(|source| SimError::Mesh { path: path.display().to_string(), source: Box::new(source) })?;
    Ok(Mesh {
        vertices_m: mesh.vertices.iter().map(|v| Vector::new(v[0], v[1], v[2])).collect(),
        triangles: mesh.faces.iter().map(|face| face.vertices.map(|corner| corner as u32)).collect(),
    })
}

fn mean_rgb(path: &Path) -> Result<[f32; 3], SimError> {
    let name = || path.display().to_string();
    let file = open_regular(path).map_err(|source| unreadable(path, source))?;
    let reader = ImageReader::new(BufReader::new(file)).with_guessed_format();
    let reader = reader.map_err(|source| unreadable(path, source))?;
    let picture = reader.decode().map_err(|source| SimError::Texture { path: name(), source })?.into_rgb8();
    let mut sum = [0.0f64; 3];
    for pixel in picture.pixels() {
        for (sum, value) in sum.iter_mut().zip(pixel.0) {
            *sum += f64::from(value) / 255.0;
        }
    }
    Ok(sum.map(|sum| (sum / picture.pixels().len().max(1) as f64) as f32))
}

fn unreadable(path: &Path, source: std::io::Error) -> SimError {
    SimError::Read { path: path.display().to_string(), source }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mjcf::Primitive;

    /// A unit square of two triangles, and one side of a tent over it.
    const OBJ: &str =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1\nvn 0 0 1\nf 4//1 3//1 2//1 1//1\nf -5 -4 -1\n";
    const STL: &str = "solid tent\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid tent\n";

    fn read_geom(file: &str, content: &str, scale: &str) -> Result<Arc<Mesh>, SimError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::create_dir(folder.path().join("meshes")).expect("a folder");
        std::fs::write(folder.path().join("meshes").join(file), content).expect("a mesh");
        let xml = format!(
            r#"<mujoco><compiler meshdir="meshes"/><asset><mesh name="tent" file="{file}" scale="{scale}"/></asset>
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
        let mesh = read_geom("tent.obj", OBJ, "1 2 1").expect("an OBJ file");
        assert_eq!((mesh.vertices_m.len(), mesh.triangles.len()), (5, 3));
        // The reader numbers vertices in the order in which the faces use them.
        let corners_m = mesh.triangles[2].map(|corner| mesh.vertices_m[corner as usize]);
        assert_eq!(corners_m, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 1.0, 1.0]].map(Vector::from));

        let mesh = read_geom("tent.STL", STL, "1 1 -1").expect("an STL file");
        // The reflection keeps the outside outside.
        assert_eq!((mesh.vertices_m.len(), mesh.triangles.as_slice()), (3, [[0, 2, 1]].as_slice()));
    }

    #[test]
    fn files_that_are_no_meshes_are_named() {
        for (file, content, expected) in [
            ("tent.ply", "ply", "tent.ply` is of a kind that is not read; use .obj or .stl"),
            ("tent.obj", "f 1 2 3\n", "tent.obj` is not a mesh that can be read"),
            ("tent.obj", "# nothing\n", "tent.obj` has no triangles"),
            ("tent.stl", "solid", "tent.stl` is not a mesh that can be read"),
        ] {
            let text = read_geom(file, content, "1 1 1").expect_err(file).to_string();
            assert!(text.contains(expected), "{text}");
        }
    }
}
