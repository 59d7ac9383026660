//! Materials for other renderers, and texture coordinates where Tandem computes them from points.

use tandem_sim::mjcf::{Gloss, SHININESS, SurfaceImage, TextureMapping};
use tandem_sim::render::{Part, Pattern, TriangleMesh, Vertex};
use tandem_sim::{Vector, linear_light};

use crate::live::SceneTextures;

/// Alpha from which a surface is solid.
const SOLID_ALPHA: f32 = 0.999;
/// Minimum of the mean colour of an image, by which its tint is divided.
const MIN_MEAN: f32 = 1e-3;

/// Material of a surface: metallic-roughness, as in glTF and USD's preview surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Linear colour, which multiplies the image if there is one.
    pub base_rgb: [f32; 3],
    pub alpha: f32,
    pub roughness_factor: f32,
    pub metallic_factor: f32,
    pub emitted_rgb: [f32; 3],
    pub images: Option<SurfaceImages>,
}

/// Numbers of a surface's images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceImages {
    pub colour: usize,
    pub has_alpha: bool,
    /// Occlusion, roughness and metal, in the order of glTF.
    pub gloss: Option<usize>,
    pub relief: Option<usize>,
    pub emitted: Option<usize>,
}

impl Surface {
    /// Returns the material of a part, whose images are added to `textures`. A pattern that the renderers
    /// compute becomes its mean colour.
    pub fn of(part: &Part, textures: &mut SceneTextures) -> Surface {
        let Part { alpha, gloss, .. } = part;
        let rgb = match part.pattern {
            Pattern::Checker(second) => (linear(part.rgb) + linear(second)) * 0.5,
            _ => linear(part.rgb),
        };
        let tint = |image: &SurfaceImage| rgb / linear(image.texture.mean_rgb).max(Vector::splat(MIN_MEAN));
        let base_rgb = part.image.as_ref().map_or(rgb, tint);
        let images = part.image.as_ref().map(|image| SurfaceImages {
            colour: textures.number(&image.texture),
            has_alpha: image.texture.has_alpha,
            gloss: image.gloss.as_ref().map(|texture| textures.number(texture)),
            relief: image.relief.as_ref().map(|texture| textures.number(texture)),
            emitted: image.emitted.as_ref().map(|texture| textures.number(texture)),
        });
        let has_layer = images.is_some_and(|images| images.emitted.is_some());
        let emitted_rgb = if has_layer { Vector::ONE } else { base_rgb } * gloss.emission_factor;
        Surface {
            base_rgb: base_rgb.min(Vector::ONE).to_array(),
            alpha: *alpha,
            roughness_factor: roughness_factor(gloss),
            metallic_factor: gloss.metallic_factor,
            emitted_rgb: emitted_rgb.min(Vector::ONE).to_array(),
            images,
        }
    }

    /// Returns true if light passes through the surface.
    pub fn is_clear(&self) -> bool {
        self.alpha < SOLID_ALPHA
    }
}

/// Returns the stated roughness, or the one whose highlights are as wide as the shininess says. Source: Walter
/// et al. 2007, section 5.2.
fn roughness_factor(gloss: &Gloss) -> f32 {
    let of_shininess = (2.0 / (SHININESS * gloss.shininess_factor + 2.0)).sqrt().sqrt();
    gloss.roughness_factor.unwrap_or(of_shininess)
}

fn linear(rgb: [f32; 3]) -> Vector {
    rgb.map(linear_light).into()
}

/// Returns a mesh with the texture coordinates of an image. Triangles have their own corners where the
/// coordinates are computed from points.
pub fn mapped(mesh: &TriangleMesh, image: &SurfaceImage) -> TriangleMesh {
    match image.mapping {
        TextureMapping::Corners => mesh.clone(),
        TextureMapping::Along { scale_1_m, centre_m } => with_uvs(mesh, |corners_m| {
            let at = |point_m: Vector, axis: usize| scale_1_m[axis] * (point_m[axis] - centre_m[axis]) - 0.5;
            corners_m.map(|point_m| [at(point_m, 0), at(point_m, 1)])
        }),
        TextureMapping::Cube { scale_1_m, centre_m } => with_uvs(mesh, |corners_m| {
            on_cube(corners_m.map(|point_m| scale_1_m * (point_m - centre_m)), image.texture.images())
        }),
    }
}

/// Returns the triangles of a mesh, with the texture coordinates that `uvs` gives for the corners of each.
fn with_uvs(mesh: &TriangleMesh, uvs: impl Fn([Vector; 3]) -> [[f32; 2]; 3]) -> TriangleMesh {
    let mut own = TriangleMesh::default();
    for triangle in &mesh.triangles {
        let corners = triangle.map(|corner| mesh.vertices[corner as usize]);
        let first = own.vertices.len() as u32;
        own.triangles.push([first, first + 1, first + 2]);
        let uvs = uvs(corners.map(|corner| corner.position_m));
        own.vertices.extend(corners.into_iter().zip(uvs).map(|(corner, uv)| Vertex { uv, ..corner }));
    }
    own
}

/// Returns the texture coordinates of a triangle on the face of a cube that its middle points to. The six
/// images of a cube are below one another. Source of the faces' axes: MuJoCo's `render_gl3.c`.
fn on_cube(corner_direction: [Vector; 3], images: usize) -> [[f32; 2]; 3] {
    let middle = corner_direction.iter().sum::<Vector>();
    let axis = middle.abs().max_position();
    let sign = if middle[axis] < 0.0 { -1.0 } else { 1.0 };
    let (across, down) = match axis {
        0 => (Vector::NEG_Z * sign, Vector::NEG_Y),
        1 => (Vector::X, Vector::Z * sign),
        _ => (Vector::X * sign, Vector::NEG_Y),
    };
    let face = if images > 1 { 2 * axis + usize::from(sign < 0.0) } else { 0 };
    corner_direction.map(|direction| {
        let along = (direction[axis] * sign).max(f32::MIN_POSITIVE);
        let [u, v] = [across, down].map(|axis| (0.5 * axis.dot(direction) / along + 0.5).clamp(0.0, 1.0));
        [u, (face as f32 + v) / images as f32]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_face_of_a_cube_shows_an_image_of_its_own() {
        for (face, direction) in
            [Vector::X, Vector::NEG_X, Vector::Y, Vector::NEG_Y, Vector::Z, Vector::NEG_Z]
                .into_iter()
                .enumerate()
        {
            let [[u, v], ..] = on_cube([direction; 3], 6);
            assert_eq!([u, v], [0.5, (face as f32 + 0.5) / 6.0], "{direction}");
            assert_eq!(on_cube([direction; 3], 1)[0], [0.5, 0.5]);
        }
        // To the right on the front of a cube is x, and down is -y, as the renderers have it.
        let corner = Vector::new(0.5, 0.25, 1.0);
        let [u, v] = on_cube([corner; 3], 1)[0];
        assert_eq!([u, v], [0.75, 0.375]);
    }

    #[test]
    fn highlights_have_the_roughness_of_their_shininess() {
        let of = |shininess_factor: f32| roughness_factor(&Gloss { shininess_factor, ..Gloss::default() });
        assert_eq!(of(0.0), 1.0);
        assert!((of(0.5) - 0.417).abs() < 1e-3 && of(1.0) < of(0.5));
        let stated = Gloss { roughness_factor: Some(0.3), ..Gloss::default() };
        assert_eq!(roughness_factor(&stated), 0.3);
    }
}
