//! Normals of meshes whose files give none: smooth, with sharp edges.

use rapier3d::math::Vector;

use crate::mjcf::Mesh;

/// Cosine of the angle between faces up to which the edge between them is smooth, as in MuJoCo.
const SMOOTH_COSINE: f32 = 0.8;
/// Number of faces at a vertex beyond which its edges stay sharp: each face is compared with all others.
const MAX_FACES: usize = 64;

/// Returns the normals at the corners of each triangle. A normal is the area-weighted mean of the faces at
/// the vertex, without faces that meet the triangle's own in a sharp edge. It is zero for triangles without
/// area.
pub fn smooth_normals(file: &Mesh) -> Vec<[Vector; 3]> {
    let across = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|corner| file.vertices_m[corner as usize]);
        (b - a).cross(c - a)
    };
    let faces: Vec<Vector> = file.triangles.iter().map(across).collect();
    let around = FacesOfVertices::of(file);
    let corner_normal = |face: usize, vertex: u32| {
        let own = faces[face].normalize_or_zero();
        let others = around.at(vertex);
        if others.len() > MAX_FACES {
            return own;
        }
        let others = others.iter().map(|other| faces[*other as usize]);
        let smooth = others.filter(|other| other.dot(own) >= SMOOTH_COSINE * other.length());
        smooth.sum::<Vector>().normalize_or(own)
    };
    let of_face = |(face, corners): (usize, &[u32; 3])| corners.map(|vertex| corner_normal(face, vertex));
    file.triangles.iter().enumerate().map(of_face).collect()
}

/// The faces at each vertex, vertex by vertex.
struct FacesOfVertices {
    /// Index of the first face of each vertex, and the end.
    first: Vec<usize>,
    faces: Vec<u32>,
}

impl FacesOfVertices {
    fn of(file: &Mesh) -> FacesOfVertices {
        let mut first = vec![0; file.vertices_m.len() + 1];
        for vertex in file.triangles.as_flattened() {
            first[*vertex as usize + 1] += 1;
        }
        for vertex in 0..file.vertices_m.len() {
            first[vertex + 1] += first[vertex];
        }
        let (mut next, mut faces) = (first.clone(), vec![0; file.triangles.len() * 3]);
        for (face, corners) in (0..).zip(&file.triangles) {
            for vertex in corners {
                faces[next[*vertex as usize]] = face;
                next[*vertex as usize] += 1;
            }
        }
        FacesOfVertices { first, faces }
    }

    fn at(&self, vertex: u32) -> &[u32] {
        &self.faces[self.first[vertex as usize]..self.first[vertex as usize + 1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns two unit squares that meet in the y axis, folded by an angle.
    fn folded(angle_rad: f32) -> Mesh {
        let (sin, cos) = angle_rad.sin_cos();
        let corners = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, 1.0, 0.0]];
        let folded = [[cos, 0.0, -sin], [cos, 1.0, -sin]];
        let mut mesh = Mesh::default();
        mesh.vertices_m = corners.iter().chain(&folded).copied().map(Vector::from).collect();
        mesh.triangles = vec![[2, 0, 3], [0, 1, 3], [0, 4, 1], [4, 5, 1]];
        mesh
    }

    #[test]
    fn slight_edges_are_smooth_and_steep_ones_sharp() {
        let slight = smooth_normals(&folded(0.4));
        let middle = slight[1][0];
        assert!(middle.z > 0.9 && (0.1..0.3).contains(&middle.x), "{middle}");
        assert_eq!(slight[0][0], Vector::Z, "away from the edge it is the face's");
        let steep = smooth_normals(&folded(1.2));
        assert!(steep[..2].as_flattened().iter().all(|normal| *normal == Vector::Z));
    }
}
