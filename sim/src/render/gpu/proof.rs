//! Test image that checks that a device draws like the embedded renderer.

use rapier3d::math::{Pose, Vector};

use crate::mjcf::Gloss;
use crate::render::cpu::CpuRenderer;
use crate::render::{Camera, Carrier, Frame, Part, Pattern, PlacedScenery, Scenery, TriangleMesh};

const SIDE_PX: u32 = 64;
/// Maximum share of pixels with another id: on edges, renderers may decide differently.
const STRAY_IDS: f32 = 0.02;
/// Maximum mean difference of colours, in steps of 1/255.
const MEAN_DIFFERENCE: f32 = 1.0;

/// Returns a ball over a checkered floor, with its shadow.
pub fn scenery() -> Scenery {
    let part = |mesh: TriangleMesh, rgb: [f32; 3], pattern: Pattern, id: u32| Part {
        mesh: mesh.into(),
        carrier: Carrier::Room,
        carrier_from_mesh: Pose::IDENTITY,
        rgb,
        alpha: 1.0,
        gloss: Gloss::default(),
        image: None,
        pattern,
        id,
        casts_shadow: true,
    };
    let floor = part(TriangleMesh::plane([1.0, 1.0]), [0.8, 0.7, 0.6], Pattern::Checker([0.5, 0.4, 0.4]), 1);
    let ball = part(TriangleMesh::sphere(0.2), [0.7, 0.2, 0.2], Pattern::Plain, 2);
    Scenery { parts: vec![floor, ball], focus_radius_m: 1.0, ..Scenery::default() }
}

pub fn placed() -> PlacedScenery {
    let ball = Pose::from_translation(Vector::new(0.0, 0.0, 0.3));
    PlacedScenery { world_from_mesh: vec![Pose::IDENTITY, ball], focus_m: Vector::ZERO, lights: Vec::new() }
}

pub fn camera() -> Camera {
    let eye_m = Vector::new(0.8, -1.2, 1.0);
    Camera {
        world_from_camera: Pose::look_at_rh(eye_m, Vector::ZERO, Vector::Z).inverse(),
        vertical_fov_rad: 1.0,
        width: SIDE_PX,
        height: SIDE_PX,
        blur_px: 0.0,
    }
}

/// Returns true if another renderer's image of the scenery matches.
pub fn accepts(drawn: &Frame) -> bool {
    let expected = CpuRenderer::new(scenery()).draw_placed(placed(), &[camera()]).swap_remove(0);
    let count = expected.ids.len() as f32;
    let stray = drawn.ids.iter().zip(&expected.ids).filter(|(drawn, expected)| drawn != expected).count();
    let differences = drawn.rgb.iter().zip(&expected.rgb).map(|(a, b)| f32::from(a.abs_diff(*b)));
    stray as f32 <= STRAY_IDS * count && differences.sum::<f32>() <= MEAN_DIFFERENCE * 3.0 * count
}
