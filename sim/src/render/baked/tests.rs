//! Tests of baked light: its plausibility, its equality from cache, disk and computation, and its similarity
//! to path tracing.

use rapier3d::math::Vector;

use super::bake::bake;
use crate::render::made::{cuboid, world};
use crate::render::path::walls_m;
use crate::render::shading::baked::{BakedLight, LightMap, LightTexel, map_light};
use crate::render::{Camera, Cameras, Frame, Part, Scenery, cpu, path};

/// The rooms of the tasks that have walls.
const ROOMS: [&str; 10] = [
    "dining_046",
    "gallery_136",
    "grocery_102",
    "home_098",
    "kitchen_084",
    "kitchen_085",
    "laboratory_147",
    "laundromat_143",
    "office_115",
    "restaurant_110",
];
/// Minimum structural similarity of images to path tracing in each room, which the mean without baked light
/// does not reach; and the minimum gain from baked light in each room.
const MIN_SIMILARITY: f64 = 0.85;
const MIN_GAIN: f64 = 0.0;
/// Half of the sides of the test room, and its height.
const HALF_M: f32 = 2.0;
const HEIGHT_M: f32 = 2.6;

/// Returns a closed room with a red wall in the direction of x, and a table in the middle.
fn room() -> Scenery {
    let (grey, thin_m) = ([0.7; 3], 0.05);
    let wall = |x: f32, y: f32, rgb: [f32; 3]| {
        let half_m = Vector::new(
            if x == 0.0 { HALF_M } else { thin_m },
            if y == 0.0 { HALF_M } else { thin_m },
            0.5 * HEIGHT_M,
        );
        cuboid(half_m, Vector::new(x * HALF_M, y * HALF_M, 0.5 * HEIGHT_M), rgb)
    };
    let slab = |z_m: f32| cuboid(Vector::new(HALF_M, HALF_M, thin_m), Vector::new(0.0, 0.0, z_m), grey);
    let table = cuboid(Vector::new(0.5, 0.5, 0.02), Vector::new(0.0, 0.0, 0.7), grey);
    let walls = [(1.0, 0.0, [0.9, 0.1, 0.1]), (-1.0, 0.0, grey), (0.0, 1.0, grey), (0.0, -1.0, grey)];
    let mut parts: Vec<Part> = walls.into_iter().map(|(x, y, rgb)| wall(x, y, rgb)).collect();
    parts.extend([slab(-thin_m), slab(HEIGHT_M + thin_m), table]);
    Scenery { parts, focus_radius_m: 1.25, ..Scenery::default() }
}

fn baked_room() -> BakedLight {
    let room = room();
    let walls_m = walls_m(&room).expect("it has walls");
    bake(&room, walls_m)
}

/// Returns the light at a point, from the light map nearest to it.
fn on_map(light: &BakedLight, point_m: Vector) -> LightTexel {
    let distance = |map: &&LightMap| {
        let [u, v] = map.place(point_m.to_array());
        let outside = |at: f32, count: u32| (-at).max(at - (count - 1) as f32).max(0.0);
        outside(u, map.width) + outside(v, map.height)
    };
    let map = light.maps.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("there are maps");
    let [u, v] = map.place(point_m.to_array());
    map_light(map, &light.texels, [u, v])
}

#[test]
fn surfaces_are_darker_under_a_table_and_redder_beside_a_red_wall() {
    let light = baked_room();
    let sum = |point_m: Vector| on_map(&light, point_m)[..3].iter().sum::<f32>();
    let below = sum(Vector::new(0.0, 0.0, 0.0));
    let open = sum(Vector::new(1.2, 1.2, 0.0));
    assert!(below < 0.5 * open, "{below} under the table, {open} beside it");
    let redness = |x_m: f32| {
        let [red, _, blue, _] = on_map(&light, Vector::new(x_m, 0.0, 0.0));
        red / blue
    };
    assert!(redness(1.85) > 1.1 * redness(-1.85), "{} and {}", redness(1.85), redness(-1.85));
}

#[test]
fn light_is_the_same_each_time_and_from_a_file() {
    let bytes = || postcard::to_allocvec(&baked_room()).expect("numbers");
    let first = bytes();
    assert!(first == bytes(), "another computation gives other light");
    let mut read: BakedLight = postcard::from_bytes(&first).expect("the same format");
    assert!(postcard::to_allocvec(&read).expect("numbers") == first);
    assert!(read.is_whole());
    read.texels.pop();
    assert!(!read.is_whole(), "a texel is missing");
}

/// Returns the mean structural similarity of the brightness of two images, over squares of 8 x 8 pixels.
/// Source: Wang et al. 2004, equation 13.
fn similarity(one: &Frame, other: &Frame) -> f64 {
    const SIDE: usize = 8;
    const STABLE: [f64; 2] = [6.5025, 58.5225];
    let (width, height) = (one.width as usize, one.height as usize);
    let grey = |frame: &Frame, x: usize, y: usize| {
        frame.rgb[(y * width + x) * 3..][..3].iter().map(|value| f64::from(*value) / 3.0).sum::<f64>()
    };
    let (mut sum, mut squares) = (0.0, 0.0);
    for (top, left) in (0..height / SIDE).flat_map(|y| (0..width / SIDE).map(move |x| (y * SIDE, x * SIDE))) {
        let places = || (0..SIDE * SIDE).map(|i| (left + i % SIDE, top + i / SIDE));
        let mean = |value: &dyn Fn(usize, usize) -> f64| {
            places().map(|(x, y)| value(x, y)).sum::<f64>() / (SIDE * SIDE) as f64
        };
        let means = [one, other].map(|frame| mean(&|x, y| grey(frame, x, y)));
        let moment = |a: usize, b: usize| {
            let frames = [one, other];
            mean(&|x, y| (grey(frames[a], x, y) - means[a]) * (grey(frames[b], x, y) - means[b]))
        };
        let (own, across) = (moment(0, 0) + moment(1, 1), moment(0, 1));
        let brightness =
            (2.0 * means[0] * means[1] + STABLE[0]) / (means[0].powi(2) + means[1].powi(2) + STABLE[0]);
        sum += brightness * (2.0 * across + STABLE[1]) / (own + STABLE[1]);
        squares += 1.0;
    }
    sum / squares
}

#[test]
fn images_are_near_to_path_tracing() {
    let mut sum = 0.0;
    for scene in ROOMS {
        let world = world(scene, Vec::new());
        let step = world.present();
        let cameras = Cameras::of(&world);
        let scenery = Scenery::of(&world);
        let mut renderers =
            [path(scenery.clone()), cpu(scenery.clone()), cpu(Scenery { room: None, ..scenery })];
        let views = [cameras.egocentric(&step, 0), cameras.egocentric(&step, 1), cameras.third_person()];
        let (mut baked, mut plain) = (0.0, 0.0);
        for camera in views.map(|camera| Camera { width: 160, height: 120, ..camera }) {
            let [traced, drawn, without] =
                renderers.each_mut().map(|renderer| renderer.render(&step, &camera));
            baked += similarity(&traced, &drawn) / 3.0;
            plain += similarity(&traced, &without) / 3.0;
        }
        println!("{scene}: {baked:.3}, without {plain:.3}");
        assert!(baked >= MIN_SIMILARITY, "{scene}: {baked:.3}");
        assert!(plain < baked - MIN_GAIN, "{scene}: {baked:.3}, and {plain:.3} without baked light");
        sum += plain / ROOMS.len() as f64;
    }
    assert!(sum < MIN_SIMILARITY, "{sum:.3} without baked light");
}
