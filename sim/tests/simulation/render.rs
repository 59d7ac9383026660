//! Images against closed forms: depth, projection, ids, shadow, anti-aliasing, and bit-identical reruns.

use std::f32::consts::{FRAC_PI_3, PI};

use tandem_sim::mjcf::Gloss;
use tandem_sim::render::{Camera, Carrier, Frame, Part, Pattern, Scenery, TriangleMesh, cpu, encode_png};
use tandem_sim::{ObjectState, ObjectStep, Pose, Rotation, Step, Vector};

const GREY: [f32; 3] = [0.6, 0.6, 0.6];

/// Returns parts around the origin that do not move; the first has id 1.
fn scenery(parts: Vec<(TriangleMesh, Pose)>) -> Scenery {
    let part = |((mesh, carrier_from_mesh), id): ((TriangleMesh, Pose), u32)| Part {
        mesh: mesh.into(),
        carrier: Carrier::Room,
        carrier_from_mesh,
        rgb: GREY,
        alpha: 1.0,
        gloss: Gloss::default(),
        image: None,
        pattern: Pattern::Plain,
        id,
        casts_shadow: true,
    };
    Scenery {
        parts: parts.into_iter().zip(1..).map(part).collect(),
        focus_radius_m: 1.0,
        ..Scenery::default()
    }
}

/// Returns a floor and a moving object.
fn floor_and(mesh: TriangleMesh) -> Scenery {
    let mut scenery = scenery(vec![floor(), (mesh, Pose::IDENTITY)]);
    scenery.parts[1].carrier = Carrier::Object(0);
    scenery
}

fn step(objects: &[Pose]) -> Step {
    let object = |world_from_object: &Pose| {
        let (velocity_m_s, angular_velocity_rad_s) = (Vector::ZERO, Vector::ZERO);
        let state =
            ObjectState { world_from_object: *world_from_object, velocity_m_s, angular_velocity_rad_s };
        ObjectStep { name: "thing".into(), state }
    };
    let objects = objects.iter().map(object).collect();
    Step { control_step: 0, time_s: 0.0, robots: vec![], objects, touches: vec![], body_touches: vec![] }
}

fn at(x: f32, y: f32, z: f32) -> Pose {
    Pose::from_translation(Vector::new(x, y, z))
}

fn floor() -> (TriangleMesh, Pose) {
    (TriangleMesh::plane([0.0, 0.0]), Pose::IDENTITY)
}

fn camera(world_from_camera: Pose) -> Camera {
    Camera { world_from_camera, vertical_fov_rad: FRAC_PI_3, width: 160, height: 120, blur_px: 0.0 }
}

/// Returns a camera that looks straight down from above the origin.
fn overhead(height_m: f32) -> Camera {
    camera(at(0.0, 0.0, height_m))
}

fn look_at(eye_m: Vector, target_m: Vector) -> Camera {
    camera(Pose::look_at_rh(eye_m, target_m, Vector::Z).inverse())
}

/// Renders an image of fixed things.
fn render(scenery: &Scenery, camera: &Camera) -> Frame {
    cpu(scenery.clone()).render(&step(&[]), camera)
}

/// Returns the index of the pixel that shows a point of the world.
fn pixel_at(camera: &Camera, point_m: Vector) -> usize {
    let ([u, v], _) = camera.project(point_m).expect("the point is in front of the camera");
    v as usize * camera.width as usize + u as usize
}

fn rgb(frame: &Frame, pixel: usize) -> [u8; 3] {
    [frame.rgb[3 * pixel], frame.rgb[3 * pixel + 1], frame.rgb[3 * pixel + 2]]
}

/// Compares the depth of each pixel with that of its ray (camera frame, 1 m deep), if there is one.
/// `too_deep_m` is the distance of a faceted shape inside the true one. Returns the number of compared
/// pixels.
fn check_depth(
    scenery: &Scenery,
    camera: &Camera,
    too_deep_m: f32,
    expected_m: impl Fn(Vector) -> Option<f32>,
) -> usize {
    let frame = render(scenery, camera);
    let mut compared = 0;
    for (pixel, depth_m) in frame.depth_m.iter().enumerate() {
        let (u, v) = (pixel as u32 % camera.width, pixel as u32 / camera.width);
        let Some(expected_m) = expected_m(camera.unproject([u as f32 + 0.5, v as f32 + 0.5], 1.0)) else {
            continue;
        };
        let error_m = depth_m - expected_m;
        assert!(
            (-1e-4..=too_deep_m + 1e-4).contains(&error_m),
            "pixel ({u}, {v}): depth {depth_m} m, expected {expected_m} m"
        );
        compared += 1;
    }
    compared
}

#[test]
fn floor_depth_is_that_of_the_ray() {
    // A large floor extends behind every one of these cameras, and is cut at the near plane; the last
    // camera is almost in it.
    for (eye, target) in [
        (Vector::new(0.0, 0.0, 1.2), Vector::new(1.0, 0.0, 0.7)),
        (Vector::new(0.3, -2.0, 1.6), Vector::new(0.0, 0.5, 0.0)),
        (Vector::new(1.0, 2.0, 0.05), Vector::new(0.0, 0.0, 0.0)),
    ] {
        let camera = look_at(eye, target);
        let compared = check_depth(&scenery(vec![floor()]), &camera, 0.0, |ray| {
            let down = -(camera.world_from_camera.rotation * ray).z;
            (down > 0.0).then(|| eye.z / down).filter(|depth_m| *depth_m < 5.0)
        });
        assert!(compared > 5000, "from {eye} only {compared} pixels show the floor within 5 m");
    }
}

#[test]
fn sphere_depth_is_that_of_the_ray() {
    let (radius_m, distance_m) = (0.1, 0.5);
    let compared = check_depth(
        &scenery(vec![(TriangleMesh::sphere(radius_m), at(0.0, 0.0, 0.0))]),
        &overhead(distance_m),
        0.008,
        |ray| {
            // |depth * ray + distance * z|^2 = radius^2, the nearer solution;
            // Rays that graze the sphere are left out.
            let (a, b) = (ray.length_squared(), -distance_m);
            let discriminant = b * b - a * (distance_m * distance_m - radius_m * radius_m);
            (discriminant > 0.5 * radius_m * radius_m).then(|| (-b - discriminant.sqrt()) / a)
        },
    );
    assert!(compared > 500, "only {compared} pixels show the sphere");
}

#[test]
fn what_nothing_covers_is_infinitely_far() {
    let frame = render(&scenery(vec![(TriangleMesh::sphere(0.1), at(0.0, 0.0, 5.0))]), &overhead(1.0));
    assert!(frame.depth_m.iter().all(|depth_m| *depth_m == f32::INFINITY));
    assert!(frame.ids.iter().all(|id| *id == 0));
}

#[test]
fn unproject_inverts_project() {
    let camera = look_at(Vector::new(0.2, -1.5, 1.4), Vector::new(0.0, 0.3, 0.7));
    for point_m in [Vector::new(0.0, 0.3, 0.7), Vector::new(-0.5, 0.1, 0.9), Vector::new(0.4, 1.0, 0.0)] {
        let (uv_px, depth_m) = camera.project(point_m).expect("in front");
        let back_m = camera.world_from_camera * camera.unproject(uv_px, depth_m);
        assert!((back_m - point_m).length() < 1e-5, "{point_m} came back as {back_m}");
    }
    assert_eq!(camera.project(Vector::new(0.2, -3.0, 1.4)), None, "a point behind the camera has no picture");
}

#[test]
fn the_optical_axis_meets_the_middle() {
    let camera = overhead(2.0);
    let ([u, v], depth_m) = camera.project(Vector::ZERO).expect("in front");
    assert_eq!(([u, v], depth_m), (camera.principal_point_px(), 2.0));
    // +x of the world is to the right, +y is up.
    let ([right, up], _) = camera.project(Vector::new(0.1, 0.1, 0.0)).expect("in front");
    assert!(right > u && up < v);
}

#[test]
fn ids_name_the_nearest_thing() {
    let camera = overhead(2.0);
    let frame = render(
        &scenery(vec![
            floor(),
            (TriangleMesh::cuboid(Vector::splat(0.1)), at(0.3, 0.0, 0.1)),
            (TriangleMesh::sphere(0.05), at(0.3, 0.0, 0.5)),
        ]),
        &camera,
    );
    for (point_m, id) in [
        (Vector::new(-0.3, 0.0, 0.0), 1),
        (Vector::new(0.24, 0.06, 0.2), 2),
        (Vector::new(0.3, 0.0, 0.55), 3),
        // This pixel is below the sphere, which hides the box.
        (Vector::new(0.3, 0.0, 0.2), 2),
    ] {
        let hidden = id == 2 && point_m.x == 0.3;
        let seen = frame.ids[pixel_at(&camera, point_m)];
        assert_eq!(seen, if hidden { 3 } else { id }, "at {point_m}");
    }
}

#[test]
fn neighbouring_triangles_leave_no_gap() {
    // Within the image of a closed shape no part of the floor behind it may show, from any direction.
    for step in 0..24 {
        let rotation =
            Rotation::from_rotation_x(0.37 * step as f32) * Rotation::from_rotation_z(0.61 * step as f32);
        for mesh in [
            TriangleMesh::sphere(0.3),
            TriangleMesh::cuboid(Vector::splat(0.3)),
            TriangleMesh::cylinder(0.3, 0.3),
        ] {
            let shape = (mesh, Pose::from_parts(Vector::new(0.0, 0.0, 0.5), rotation));
            let camera = overhead(1.2);
            let frame = render(&scenery(vec![floor(), shape]), &camera);
            for (pixel, id) in frame.ids.iter().enumerate() {
                let (u, v) = ((pixel % 160) as f32 + 0.5, (pixel / 160) as f32 + 0.5);
                // The image of the sphere that fits into all three, less a margin for facets.
                let from_axis = camera.unproject([u, v], 1.0).truncate().length();
                if from_axis < 0.9 * (0.3f32 / 0.7).asin().tan() {
                    assert_eq!(*id, 2, "step {step}: gap at ({u}, {v})");
                }
            }
        }
    }
}

#[test]
fn a_thing_in_the_sun_darkens_the_floor() {
    let camera = overhead(2.0);
    let block_at = |x: f32, z: f32| step(&[at(x, 0.0, z)]);
    // One renderer for all three images: shadows must follow the step. The first block is below the floor.
    let mut renderer = cpu(floor_and(TriangleMesh::cuboid(Vector::splat(0.05))));
    let empty = renderer.render(&block_at(0.0, -5.0), &camera);
    let left = renderer.render(&block_at(-0.3, 0.3), &camera);
    let right = renderer.render(&block_at(0.3, 0.3), &camera);
    // The sun is at (-0.306, 0.354, 0.884): from 0.3 m up, the shadow falls 0.104 m to +x and 0.12 m to -y.
    for (x, shaded, lit) in [(-0.3, &left, &right), (0.3, &right, &left)] {
        let pixel = pixel_at(&camera, Vector::new(x + 0.104, -0.12, 0.0));
        let [empty, shaded, lit] = [&empty, shaded, lit].map(|frame| rgb(frame, pixel));
        assert_eq!(lit, empty, "the floor is in the sun where the block is not");
        assert!(f32::from(shaded[0]) < 0.8 * f32::from(lit[0]), "shadow {shaded:?} against {lit:?}");
    }
}

#[test]
fn fingers_cast_shadows() {
    // 16 mm thick and 40 mm above a counter, like a finger over a table.
    let camera = overhead(1.0);
    let finger = (
        TriangleMesh::capsule(0.008, 0.04),
        Pose::from_parts(Vector::new(0.0, 0.0, 0.04), Rotation::from_rotation_y(PI / 2.0)),
    );
    let pixel = pixel_at(&camera, Vector::new(0.014, -0.016, 0.0));
    let mut scenery = scenery(vec![floor(), finger]);
    scenery.focus_radius_m = 1.25;
    let shaded = render(&scenery, &camera);
    assert_eq!(shaded.ids[pixel], 1, "the pixel shows the counter");
    scenery.parts.truncate(1);
    let lit = render(&scenery, &camera);
    let (shaded, lit) = (rgb(&shaded, pixel)[0], rgb(&lit, pixel)[0]);
    assert!(f32::from(shaded) < 0.85 * f32::from(lit), "{shaded} against {lit}");
}

#[test]
fn what_stands_darkens_the_floor_beside_it_and_what_hovers_leaves_it_bright() {
    let camera = look_at(Vector::new(-0.4, 0.0, 0.3), Vector::ZERO);
    let mut renderer = cpu(floor_and(TriangleMesh::cuboid(Vector::new(0.05, 0.05, 0.005))));
    // Brightness of the floor on the sunlit side.
    let mut brightness = |height_m: f32, x: f32| {
        let frame = renderer.render(&step(&[at(0.0, 0.0, height_m)]), &camera);
        let pixel = pixel_at(&camera, Vector::new(x, 0.02, 0.0));
        assert_eq!(frame.ids[pixel], 1, "the pixel shows the floor");
        f32::from(rgb(&frame, pixel)[0])
    };
    // A board at -5 m is invisible.
    assert!(brightness(0.005, -0.058) < 0.95 * brightness(-5.0, -0.058), "beside it");
    assert_eq!(brightness(0.005, -0.12), brightness(-5.0, -0.12), "further away");
    assert_eq!(brightness(0.1, -0.03), brightness(-5.0, -0.03), "below a board in the air");
}

#[test]
fn textures_darken_parts_of_a_surface_and_leave_depth_and_ids_as_they_are() {
    let camera = overhead(1.5);
    let mut scenery = scenery(vec![(TriangleMesh::cuboid(Vector::new(1.0, 0.5, 0.01)), Pose::IDENTITY)]);
    let plain = render(&scenery, &camera);
    for pattern in [Pattern::Wood, Pattern::Fabric, Pattern::Checker([0.1, 0.1, 0.1])] {
        scenery.parts[0].pattern = pattern;
        let textured = render(&scenery, &camera);
        assert_eq!((&textured.depth_m, &textured.ids), (&plain.depth_m, &plain.ids));
        let pairs = || textured.rgb.iter().zip(&plain.rgb).map(|(a, b)| (f32::from(*a), f32::from(*b)));
        let darkened = pairs().filter(|(textured, plain)| *textured < 0.95 * plain).count();
        assert!(20 * darkened > plain.rgb.len(), "{pattern:?} darkens {darkened} values");
        let kept = pairs().filter(|(textured, plain)| *textured > 0.97 * plain).count();
        assert!(20 * kept > plain.rgb.len(), "{pattern:?} keeps {kept} values");
        assert!(pairs().all(|(textured, plain)| textured <= plain), "{pattern:?} makes something brighter");
    }
}

#[test]
fn an_edge_is_the_mean_of_both_sides_in_linear_light() {
    // A wall whose edge runs through the middle of the image's column 80, half a pixel to the right.
    let camera = overhead(1.0);
    let half_pixel_m = 0.5 / camera.focal_px();
    let frame =
        render(&scenery(vec![(TriangleMesh::plane([1.0, 1.0]), at(-1.0 + half_pixel_m, 0.0, 0.0))]), &camera);
    let row = 60 * camera.width as usize;
    let linear = |value: u8| ((f32::from(value) / 255.0 + 0.055) / 1.055).powf(2.4);
    let [wall, edge, sky] = [79, 80, 81].map(|column| rgb(&frame, row + column).map(linear));
    for channel in 0..3 {
        let mean = 0.5 * (wall[channel] + sky[channel]);
        assert!((edge[channel] - mean).abs() < 0.01, "channel {channel}: {wall:?}, {edge:?}, {sky:?}");
    }
}

#[test]
fn things_at_different_depths_are_outlined() {
    let camera = overhead(1.0);
    let mut scenery = scenery(vec![floor(), (TriangleMesh::plane([0.2, 0.2]), at(0.0, 0.0, 0.3))]);
    let darkest = |scenery: &Scenery| {
        let frame = render(scenery, &camera);
        let row = 60 * camera.width as usize;
        (row..row + 80).map(|pixel| rgb(&frame, pixel)[0]).min()
    };
    let outlined = darkest(&scenery);
    scenery.parts[1].id = 1;
    assert!(outlined < darkest(&scenery), "parts of one thing have no outline between them");
}

#[test]
fn the_same_step_gives_the_same_bits() {
    let camera = look_at(Vector::new(0.8, -1.2, 1.0), Vector::ZERO);
    let scenery = floor_and(TriangleMesh::capsule(0.1, 0.2));
    let (first, other) = (step(&[at(0.0, 0.0, 0.3)]), step(&[at(0.1, 0.0, 0.3)]));
    let mut renderer = cpu(scenery.clone());
    let before = renderer.render(&first, &camera);
    let between = renderer.render(&other, &camera);
    assert_ne!(before, between);
    assert_eq!(before, renderer.render(&first, &camera));
    assert_eq!(before, cpu(scenery).render(&first, &camera));
}

#[test]
fn pictures_of_a_state_are_drawn_side_by_side() {
    let above = overhead(1.0);
    let cameras =
        [above, Camera { width: 64, ..overhead(0.5) }, look_at(Vector::new(0.8, -1.2, 1.0), Vector::ZERO)];
    let (scenery, step) = (floor_and(TriangleMesh::capsule(0.1, 0.2)), step(&[at(0.0, 0.0, 0.3)]));
    let alone: Vec<_> = cameras.iter().map(|camera| cpu(scenery.clone()).render(&step, camera)).collect();
    let mut renderer = cpu(scenery);
    assert_eq!(renderer.render_all(&step, &cameras), alone);
    assert_eq!(renderer.render_all(&step, &[]), []);
    assert_eq!(renderer.render(&step, &cameras[1]), alone[1]);
}

#[test]
fn colours_alone_are_those_of_the_whole_picture() {
    let camera = look_at(Vector::new(0.8, -1.2, 1.0), Vector::ZERO);
    let scenery = floor_and(TriangleMesh::capsule(0.1, 0.2));
    let steps = [0.3, 0.4].map(|height_m| step(&[at(0.0, 0.0, height_m)]));
    let mut renderer = cpu(scenery.clone());
    for step in &steps {
        let small = Camera { width: 32, height: 32, ..camera };
        for camera in [&camera, &small] {
            let whole = cpu(scenery.clone()).render(step, camera);
            assert_eq!(renderer.render_colours(step, camera), whole.rgb);
            assert_eq!(renderer.render(step, camera), whole, "depth is there again");
        }
    }
}

/// Renderers share buffers while they draw; light computed for one is not used by another.
#[test]
fn pictures_do_not_depend_on_who_else_draws() {
    let roof = |height_m: f32| {
        let slab = TriangleMesh::cuboid(Vector::new(0.4, 0.4, 0.02));
        let mut scenery = scenery(vec![
            floor(),
            (slab, at(0.0, 0.0, height_m)),
            (TriangleMesh::sphere(0.1), at(0.0, 0.0, 0.0)),
        ]);
        scenery.parts[2].carrier = Carrier::Object(0);
        scenery
    };
    let heights_m = [0.3, 0.5, 0.7, 0.9, 1.1];
    let mut renderers = heights_m.map(|height_m| cpu(roof(height_m)));
    let camera = look_at(Vector::new(1.2, -1.0, 1.4), Vector::ZERO);
    let steps = [0.2, 0.4].map(|x_m| step(&[at(x_m, 0.5, 0.1)]));
    let mut first: Vec<Frame> = Vec::new();
    for round in 0..6 {
        // Another renderer draws before each image, as often as there are other renderers.
        for turn in 0..heights_m.len() {
            let number = turn * (1 + round % 4) % heights_m.len();
            let frames = steps.each_ref().map(|step| renderers[number].render(step, &camera));
            let alone = steps.each_ref().map(|step| cpu(roof(heights_m[number])).render(step, &camera));
            assert_eq!(frames, alone, "renderer {number} in round {round}");
            match round {
                0 => first.extend(frames),
                _ => assert_eq!(first[2 * number..][..2], frames, "renderer {number} in round {round}"),
            }
        }
    }
    let [one, other] = [&first[0], &first[2]];
    assert_ne!(one.rgb, other.rgb, "they cast different shadows");
}

#[test]
fn meshes_have_the_volume_of_their_shapes_and_normals_that_point_out() {
    // A circle of twelve sides has 4.5 % less area, and one of eight, as in thin shapes, 10 %. A half
    // circle of six sides turned around its axis has 6.7 % less volume.
    let (round, thin, ball) = (0.046, 0.1, 0.11);
    let tetrahedron = [Vector::ZERO, Vector::X, Vector::Y, Vector::Z];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    for (name, mesh, volume_m3, tolerance) in [
        ("sphere", TriangleMesh::sphere(0.1), 4.0 / 3.0 * PI * 1e-3, ball),
        ("capsule", TriangleMesh::capsule(0.1, 0.3), 4.0 / 3.0 * PI * 1e-3 + PI * 1e-2 * 0.6, ball),
        ("ellipsoid", TriangleMesh::ellipsoid(Vector::new(0.1, 0.2, 0.3)), 4.0 / 3.0 * PI * 6e-3, ball),
        ("cylinder", TriangleMesh::cylinder(0.1, 0.3), PI * 1e-2 * 0.6, round),
        ("thin cylinder", TriangleMesh::cylinder(0.01, 0.3), PI * 1e-4 * 0.6, thin),
        ("box", TriangleMesh::cuboid(Vector::new(0.1, 0.2, 0.3)), 0.2 * 0.4 * 0.6, 1e-5),
        ("tetrahedron", TriangleMesh::faceted(&tetrahedron, &faces), 1.0 / 6.0, 1e-5),
    ] {
        let mut sum_m3 = 0.0;
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|corner| mesh.vertices[corner as usize]);
            let face = (b.position_m - a.position_m).cross(c.position_m - a.position_m).normalize();
            sum_m3 += a.position_m.dot(b.position_m.cross(c.position_m)) / 6.0;
            for corner in [a, b, c] {
                assert!(corner.normal.is_normalized(), "{name}: a normal is {} long", corner.normal.length());
                assert!(corner.normal.dot(face) > 0.5, "{name}: a normal points away from its face");
            }
        }
        let missing = 1.0 - sum_m3 / volume_m3;
        assert!((-1e-5..=tolerance).contains(&missing), "{name}: {sum_m3} m^3 of {volume_m3} m^3");
    }
}

#[test]
fn png_keeps_every_byte() {
    let frame =
        render(&scenery(vec![floor(), (TriangleMesh::sphere(0.2), at(0.0, 0.0, 0.2))]), &overhead(1.0));
    let png = encode_png(frame.width, frame.height, &frame.rgb).expect("the size fits");
    let decoded = image::load_from_memory(&png).expect("it is a PNG file").into_rgb8();
    assert_eq!((decoded.width(), decoded.height()), (frame.width, frame.height));
    assert_eq!(decoded.into_raw(), frame.rgb);
}
