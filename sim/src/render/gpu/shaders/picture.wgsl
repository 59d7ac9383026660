// The constants that both renderers share stand before this text.

struct View {
    // Rows from directions of the world to the camera's frame.
    right: vec4f,
    up: vec4f,
    back: vec4f,
    eye_m: vec4f,
    // Rays of the world, 1 m deep: through the picture's top left corner, and from a sample to the next.
    corner_ray: vec4f,
    right_ray: vec4f,
    down_ray: vec4f,
    // Column, row and nearness on the shadow's map: scalar product with a point of the world, and a number more.
    sun_column: vec4f,
    sun_row: vec4f,
    sun_nearness: vec4f,
    // Twice the focal length by width and by height; width and height in pixels.
    scale: vec4f,
    // Of the map of contacts: world coordinates of its corner, and texels per metre.
    contact: vec4f,
    // What lights the scenery, as `Light` in `shading/mod.rs` has it.
    sun: vec4f,
    to_sun: vec4f,
    from_below: vec4f,
    from_above: vec4f,
    // Number of lamps, number of layers of blended surfaces, where the sky's head is in `texels` or 0, and the lamp
    // that casts a shadow, if it is not the sun.
    counts: vec4u,
    // Offset along the normal of the sun's shadows, and whether lamps, or baked light, light the scenery.
    extra: vec4f,
    head_ambient: vec4f,
    head_diffuse: vec4f,
    head_specular: vec4f,
    lamps: array<Lamp, MAX_LIGHTS>,
}

// A light of the scene's file in the world, as `FileLight` has it.
struct Lamp {
    // With 0 for a directional light, 1 for a spot, 2 for a point.
    position: vec4f,
    // With the cosine of the cutoff.
    direction: vec4f,
    // With the exponent.
    ambient: vec4f,
    // With the layer of its shadow, or -1.
    diffuse: vec4f,
    // With the width of a texel of its map at 1 m.
    specular: vec4f,
    attenuation: vec4f,
    // Map of its shadows.
    column: vec4f,
    row: vec4f,
    nearness: vec4f,
}

struct Part {
    // Rows from its mesh to the world.
    x: vec4f,
    y: vec4f,
    z: vec4f,
    // Linear colours, with the pattern between them and the axis of the mesh that its grain runs along.
    rgb: vec4f,
    second_rgb: vec4f,
    // Emission, specular strength, shininess and alpha.
    gloss: vec4f,
    // Id; bits: it casts a shadow, is blended, is cut out by its image's alpha, its image has alpha; whether things
    // stand on it; and where its image's head is in `texels`, 0 without an image.
    flags: vec4u,
    // Where the heads of the numbers for gloss and for normals are in `texels`, 0 without; bits of the roughness, -1
    // without, and of the metallic share.
    maps: vec4u,
}

struct Face {
    normal: vec4f,
    // Columns: how the normal changes with the point, per metre.
    bend_x: vec4f,
    bend_y: vec4f,
    bend_z: vec4f,
    // Baked light: rows from the world to the texels of a map; kind, first number in `baked`, width and height.
    light_u: vec4f,
    light_v: vec4f,
    light: vec4u,
}

@group(0) @binding(0) var<uniform> view: View;
// Three for each triangle: the bits of its coordinates in its mesh's frame, and the number of its part.
@group(0) @binding(1) var<storage, read> corners: array<vec4u>;
@group(0) @binding(2) var<storage, read> faces: array<Face>;
@group(0) @binding(3) var<storage, read> parts: array<Part>;
// Heights of what carries things, and how dark it is there.
@group(0) @binding(4) var<storage, read> contacts: array<vec2f>;

// Of each triangle, for images: gradients of its three coordinates in its mesh's frame, with their values at the
// first corner.
struct Coordinates {
    u: vec4f,
    v: vec4f,
    w: vec4f,
}
@group(0) @binding(5) var<storage, read> coordinates: array<Coordinates>;
// Of each image: width, height, number of levels, and 0, or on a cube its number of images, 1 or 6 (+x, -x, +y, -y,
// +z, -z); then the levels, the largest first.
@group(0) @binding(6) var<storage, read> texels: array<u32>;

// Baked light: the cubes of all parts, those of the room, and the texels of its maps; irradiance, and the share of it
// that things shadow.
@group(0) @binding(7) var<storage, read> baked: array<vec4f>;

// One layer for the sun, or for each lamp.
@group(1) @binding(0) var shadow: texture_depth_2d_array;
@group(1) @binding(1) var samples: texture_2d<u32>;
@group(1) @binding(2) var centres: texture_2d<u32>;
// Colours, then depths, then ids.
@group(1) @binding(3) var<storage, read_write> picture: array<u32>;
// Blended surfaces at samples and centres, the nearest first.
@group(1) @binding(4) var veils: texture_2d_array<u32>;
@group(1) @binding(5) var veil_centres: texture_2d_array<u32>;

// Nearness of solid surfaces, and of the layer of blended ones before.
@group(2) @binding(0) var solid: texture_depth_2d;
@group(2) @binding(1) var before: texture_depth_2d;

fn corner_m(number: u32) -> vec3f {
    return bitcast<vec3f>(corners[number].xyz);
}

fn part_of(triangle: u32) -> Part {
    return parts[corners[3u * triangle].w];
}

fn turned(part: Part, direction: vec3f) -> vec3f {
    return vec3f(dot(part.x.xyz, direction), dot(part.y.xyz, direction), dot(part.z.xyz, direction));
}

fn turned_back(part: Part, direction: vec3f) -> vec3f {
    return part.x.xyz * direction.x + part.y.xyz * direction.y + part.z.xyz * direction.z;
}

fn in_world(part: Part, point_m: vec3f) -> vec3f {
    return turned(part, point_m) + vec3f(part.x.w, part.y.w, part.z.w);
}

fn on_sun_map(point_m: vec3f) -> vec3f {
    let point = vec4f(point_m, 1.0);
    return vec3f(dot(view.sun_column, point), dot(view.sun_row, point), dot(view.sun_nearness, point));
}

@vertex
fn cast_shadow(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    let part = parts[corners[vertex].w];
    if (part.flags.y & 1u) == 0u {
        return vec4f(0.0, 0.0, 0.0, 1.0);
    }
    if view.counts.w != NOTHING {
        return cast_by_lamp(view.lamps[view.counts.w], in_world(part, corner_m(vertex)));
    }
    let place = on_sun_map(in_world(part, corner_m(vertex))) / vec3f(TEXELS, TEXELS, 2.0 * SUN_DISTANCE_M);
    return vec4f(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y, place.z, 1.0);
}

struct Seen {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat, either) triangle: u32,
}

@vertex
fn see(@builtin(vertex_index) vertex: u32) -> Seen {
    return seen_if(vertex, 0u);
}

@vertex
fn see_veils(@builtin(vertex_index) vertex: u32) -> Seen {
    return seen_if(vertex, 2u);
}

// A corner, if its part is solid or blended.
fn seen_if(vertex: u32, blended: u32) -> Seen {
    let part = parts[corners[vertex].w];
    if (part.flags.y & 2u) != blended {
        return Seen(vec4f(0.0, 0.0, 0.0, 1.0), vertex / 3u);
    }
    let from_eye_m = in_world(part, corner_m(vertex)) - view.eye_m.xyz;
    let across = vec2f(dot(view.right.xyz, from_eye_m), dot(view.up.xyz, from_eye_m));
    let depth_m = -dot(view.back.xyz, from_eye_m);
    return Seen(vec4f(across * view.scale.xy, NEAR_M, depth_m), vertex / 3u);
}

@fragment
fn mark(seen: Seen) -> @location(0) u32 {
    return seen.triangle;
}

@fragment
fn mark_first(seen: Seen) -> @location(0) u32 {
    if seen.position.z <= textureLoad(solid, vec2i(seen.position.xy), 0) {
        discard;
    }
    return seen.triangle;
}

@fragment
fn mark_next(seen: Seen) -> @location(0) u32 {
    let place = vec2i(seen.position.xy);
    let z = seen.position.z;
    if z <= textureLoad(solid, place, 0) || z >= textureLoad(before, place, 0) {
        discard;
    }
    return seen.triangle;
}

// Of where a ray, 1 m deep, meets the plane of a triangle: 1 / depth.
fn nearness_1_m(triangle: u32, ray: vec3f) -> f32 {
    let part = part_of(triangle);
    let corner = corner_m(3u * triangle);
    let first = corner_m(3u * triangle + 1u) - corner;
    let second = corner_m(3u * triangle + 2u) - corner;
    let across = turned(part, cross(first, second));
    return dot(across, ray) / dot(across, in_world(part, corner) - view.eye_m.xyz);
}

// 1 in the sun, 0 in the shadow: a bilinear filter three texels wide.
fn sunlit(point_m: vec3f, normal: vec3f) -> f32 {
    return on_map(on_sun_map(point_m + normal * view.extra.x), 0);
}

fn on_map(place: vec3f, layer: i32) -> f32 {
    let texel = place.xy - 0.5;
    if any(texel < vec2f(1.0)) || any(texel >= vec2f(TEXELS - 3.0)) {
        return 1.0;
    }
    let low = floor(texel);
    let part = texel - low;
    let nearness_m = place.z + BIAS_M;
    var sum = 0.0;
    for (var j = -1; j <= 2; j++) {
        let down = select(select(1.0, part.y, j == 2), 1.0 - part.y, j == -1);
        for (var i = -1; i <= 2; i++) {
            let across = select(select(1.0, part.x, i == 2), 1.0 - part.x, i == -1);
            let occluder_m = textureLoad(shadow, vec2i(low) + vec2i(i, j), layer, 0) * 2.0 * SUN_DISTANCE_M;
            sum += select(0.0, across * down, nearness_m >= occluder_m);
        }
    }
    let border = min(texel, TEXELS - 1.0 - texel);
    return 1.0 - (1.0 - sum / 9.0) * min(min(border.x, border.y) / FADE_TEXELS, 1.0);
}

// How dark contacts make a point of what carries things.
fn darkness(point_m: vec3f) -> f32 {
    let place = (point_m.xy - view.contact.xy) * view.contact.z - 0.5;
    if any(place < vec2f(0.0)) || any(place >= vec2f(f32(CONTACT_TEXELS - 1u))) {
        return 0.0;
    }
    let low = vec2u(place);
    let part = place - vec2f(low);
    let first = low.y * CONTACT_TEXELS + low.x;
    let nearest = first + select(0u, CONTACT_TEXELS, part.y >= 0.5) + select(0u, 1u, part.x >= 0.5);
    if abs(point_m.z - contacts[nearest].x) > SINK_M {
        return 0.0;
    }
    let below = first + CONTACT_TEXELS;
    return mix(
        mix(contacts[first].y, contacts[first + 1u].y, part.x),
        mix(contacts[below].y, contacts[below + 1u].y, part.x),
        part.y,
    );
}

// Up and down between 0 and 1 with a period of 1.
fn wave(x: f32) -> f32 {
    return abs(2.0 * fract(x) - 1.0);
}

// How much of the second colour there is at a point.
fn second_share(part: Part, point_m: vec3f) -> f32 {
    if part.rgb.w == 0.0 {
        return 0.0;
    }
    if part.rgb.w == 1.0 {
        let square = vec2i(floor(point_m.xy * CHECKER_PER_M));
        return select(0.0, 1.0, ((square.x + square.y) & 1) == 0);
    }
    let in_mesh = turned_back(part, point_m - vec3f(part.x.w, part.y.w, part.z.w));
    var p = in_mesh;
    if part.second_rgb.w == 1.0 {
        p = in_mesh.yzx;
    } else if part.second_rgb.w == 2.0 {
        p = in_mesh.zxy;
    }
    if part.rgb.w == 2.0 {
        let across = p.y + p.z;
        let band = wave(across * BANDS_PER_M + STRAY * wave(p.x * 1.1 + across));
        return 0.7 * band * band + 0.3 * wave(across * LINES_PER_M + p.x);
    }
    if part.rgb.w == 4.0 {
        let line = p.z * TEXT_PER_M;
        let word = wave((p.x + p.y) * WORDS_PER_M + WORD_STRAY * floor(line));
        return select(0.0, 1.0, wave(line) > TEXT_GAP && word > WORD_GAP);
    }
    let thread = p * THREADS_PER_M;
    return wave(thread.x + thread.z) * wave(thread.y + thread.z);
}

fn albedo(part: Part, point_m: vec3f) -> vec3f {
    return mix(part.rgb.xyz, part.second_rgb.xyz, second_share(part, point_m));
}

// Place on an image, and its derivatives in the picture's x and y.
struct ImagePlace {
    uv: vec2f,
    by_x: vec2f,
    by_y: vec2f,
    // Number of the face of a cube.
    face: u32,
}

fn coordinates_of(triangle: u32, direction: vec3f) -> vec3f {
    let rows = coordinates[triangle];
    return vec3f(dot(rows.u.xyz, direction), dot(rows.v.xyz, direction), dot(rows.w.xyz, direction));
}

// Step on a surface's plane for a step of the ray.
fn surface_step_m(ray: vec3f, ray_step: vec3f, depth_m: f32, normal: vec3f) -> vec3f {
    let towards = dot(normal, ray);
    let along = select(dot(normal, ray_step) / towards, 0.0, towards == 0.0);
    return (ray_step - ray * along) * depth_m;
}

fn on_cube(at: vec3f, by_x: vec3f, by_y: vec3f) -> ImagePlace {
    let size = abs(at);
    let sides = select(vec3f(1.0), vec3f(-1.0), at < vec3f(0.0));
    var across = vec3f(sides.z, 0.0, 0.0);
    var down = vec3f(0.0, -1.0, 0.0);
    var along = vec3f(0.0, 0.0, sides.z);
    var axis = 2u;
    if size.x >= size.y && size.x >= size.z {
        across = vec3f(0.0, 0.0, -sides.x);
        along = vec3f(sides.x, 0.0, 0.0);
        axis = 0u;
    } else if size.y >= size.z {
        across = vec3f(1.0, 0.0, 0.0);
        down = vec3f(0.0, 0.0, sides.y);
        along = vec3f(0.0, sides.y, 0.0);
        axis = 1u;
    }
    let per_along = 1.0 / max(dot(along, at), 1e-30);
    let place = vec2f(dot(across, at), dot(down, at)) * per_along;
    let step_x = vec2f(dot(across, by_x), dot(down, by_x)) - place * dot(along, by_x);
    let step_y = vec2f(dot(across, by_y), dot(down, by_y)) - place * dot(along, by_y);
    let face = 2u * axis + select(0u, 1u, sides[axis] < 0.0);
    return ImagePlace(0.5 * place + 0.5, 0.5 * step_x * per_along, 0.5 * step_y * per_along, face);
}

// sRGB values and alpha of a texel, 0 to 1.
fn values_of(texel: u32) -> vec4f {
    return vec4f(vec4u(texel, texel >> 8u, texel >> 16u, texel >> 24u) & vec4u(255u)) / 255.0;
}

fn decoded(value: vec3f) -> vec3f {
    return select(pow((value + 0.055) / 1.055, vec3f(2.4)), value / 12.92, value <= vec3f(0.04045));
}

// sRGB values and alpha at a place on one level, whose first texel has this number.
fn blend(first: u32, size: vec2u, place: vec2f, is_cube: bool) -> vec4f {
    var at = place * vec2f(size) - 0.5;
    if is_cube {
        at = clamp(at, vec2f(0.0), vec2f(size - 1u));
    }
    let low = floor(at);
    let share = at - low;
    let corner = vec2i(low);
    let left = vec2u(corner) & (size - 1u);
    let right = vec2u(corner + 1) & (size - 1u);
    let upper = first + left.y * size.x;
    let lower = first + right.y * size.x;
    return mix(
        mix(values_of(texels[upper + left.x]), values_of(texels[upper + right.x]), share.x),
        mix(values_of(texels[lower + left.x]), values_of(texels[lower + right.x]), share.x),
        share.y,
    );
}

// Binary logarithm, linear between powers of two.
fn stepped_log2(x: f32) -> f32 {
    return f32(bitcast<u32>(x)) / 8388608.0 - 127.0;
}

// Linear colour and alpha.
fn image_rgba(head: u32, place: ImagePlace) -> vec4f {
    let values = image_values(head, place);
    return vec4f(decoded(values.xyz), values.w);
}

// The values of an image's texels.
fn image_values(head: u32, place: ImagePlace) -> vec4f {
    var size = vec2u(texels[head], texels[head + 1u]);
    let images = texels[head + 3u];
    let is_cube = images != 0u;
    // Images before that of the face, on every level.
    let before = select(0u, place.face, images > 1u);
    let by_x = place.by_x * vec2f(size);
    let by_y = place.by_y * vec2f(size);
    let last = f32(texels[head + 2u] - 1u);
    let level = clamp(0.5 * stepped_log2(max(dot(by_x, by_x), dot(by_y, by_y))), 0.0, last);
    var first = head + 4u;
    for (var i = 0u; i < u32(level); i++) {
        first += max(images, 1u) * size.x * size.y;
        size = max(size / 2u, vec2u(1u));
    }
    let nearer = blend(first + before * size.x * size.y, size, place.uv, is_cube);
    let share = clamp((fract(level) - 0.5) / BLENDED_SHARE + 0.5, 0.0, 1.0);
    if share == 0.0 {
        return nearer;
    }
    first += max(images, 1u) * size.x * size.y;
    size = max(size / 2u, vec2u(1u));
    let farther = blend(first + before * size.x * size.y, size, place.uv, is_cube);
    return mix(nearer, farther, share);
}

// Place on the image of a triangle, where a ray meets it.
fn place_at(triangle: u32, part: Part, ray: vec3f, depth_m: f32, normal: vec3f, from_corner_m: vec3f) -> ImagePlace {
    let step_x = turned_back(part, surface_step_m(ray, 2.0 * view.right_ray.xyz, depth_m, normal));
    let step_y = turned_back(part, surface_step_m(ray, 2.0 * view.down_ray.xyz, depth_m, normal));
    let rows = coordinates[triangle];
    let at = coordinates_of(triangle, from_corner_m) + vec3f(rows.u.w, rows.v.w, rows.w.w);
    let by_x = coordinates_of(triangle, step_x);
    let by_y = coordinates_of(triangle, step_y);
    if texels[part.flags.w + 3u] != 0u {
        return on_cube(at, by_x, by_y);
    }
    return ImagePlace(at.xy, by_x.xy, by_y.xy, 0u);
}

// Linear colour of the image of a part, and alpha.
fn image_at(part: Part, place: ImagePlace) -> vec4f {
    let rgba = image_rgba(part.flags.w, place);
    return vec4f(rgba.xyz, select(1.0, rgba.w, (part.flags.y & 8u) != 0u));
}

// How a surface shines: emission, specular strength, shininess and the metallic share.
fn gloss_at(part: Part, place: ImagePlace) -> vec4f {
    var gloss = vec4f(part.gloss.xyz, bitcast<f32>(part.maps.w));
    if part.maps.x == 0u {
        return gloss;
    }
    let numbers = image_values(part.maps.x, place);
    gloss.w *= numbers.z;
    let roughness = bitcast<f32>(part.maps.z);
    if roughness >= 0.0 {
        let width = pow(clamp(roughness * numbers.y, MIN_ROUGHNESS, 1.0), 2.0);
        let exponent = min(2.0 / (width * width) - 2.0, SHININESS);
        gloss.y *= (exponent + 2.0) / (USUAL_EXPONENT + 2.0);
        gloss.z = exponent / SHININESS;
    }
    return gloss;
}

fn along_surface(gradient: vec3f, normal: vec3f) -> vec3f {
    let along = gradient - normal * dot(normal, gradient);
    return along / max(length(along), 1e-12);
}

// The normal of a part's relief, if it faces the eye.
fn bent_normal(triangle: u32, part: Part, place: ImagePlace, normal: vec3f, to_eye: vec3f) -> vec3f {
    if part.maps.y == 0u {
        return normal;
    }
    let right = along_surface(turned(part, coordinates[triangle].u.xyz), normal);
    let down = along_surface(turned(part, coordinates[triangle].v.xyz), normal);
    let numbers = 2.0 * image_values(part.maps.y, place).xyz - 1.0;
    let bent = normalize(right * numbers.x - down * numbers.y + normal * max(numbers.z, MIN_UPRIGHT_SHARE));
    return select(normal, bent, dot(bent, to_eye) > 0.0);
}

// Linear colour of what a ray sees, and its alpha.
fn colour(triangle: u32, ray: vec3f) -> vec4f {
    let part = part_of(triangle);
    let face = faces[triangle];
    let depth_m = 1.0 / nearness_1_m(triangle, ray);
    let point_m = view.eye_m.xyz + ray * depth_m;
    let from_corner_m = turned_back(part, point_m - in_world(part, corner_m(3u * triangle)));
    let bend = mat3x3f(face.bend_x.xyz, face.bend_y.xyz, face.bend_z.xyz);
    let eye_direction = -normalize(ray);
    let outwards = normalize(turned(part, face.normal.xyz + bend * from_corner_m));
    let towards_eye = dot(outwards, eye_direction);
    var normal = outwards * select(1.0, -1.0, towards_eye < 0.0);
    var gloss = vec4f(part.gloss.xyz, bitcast<f32>(part.maps.w));
    var base = vec3f(0.0);
    var image = vec3f(1.0);
    var alpha = part.gloss.w;
    if part.flags.w != 0u {
        let place = place_at(triangle, part, ray, depth_m, normal, from_corner_m);
        let rgba = image_at(part, place);
        gloss = gloss_at(part, place);
        normal = bent_normal(triangle, part, place, normal, eye_direction);
        image = rgba.xyz;
        base = part.rgb.xyz * image;
        alpha *= rgba.w;
    } else {
        base = albedo(part, point_m);
    }
    let open = select(1.0, 1.0 - CONTACT * darkness(point_m), part.flags.z != 0u);
    if view.extra.y > 0.0 {
        return vec4f(lit_by_lamps(gloss, base, image, point_m, normal, eye_direction) * open, alpha);
    }
    if view.extra.z > 0.0 {
        let light = baked_light(corners[3u * triangle].w, face, point_m, normal);
        return vec4f(lit_by_baked(light, base, point_m, normal, eye_direction) * open, alpha);
    }
    let ambient = mix(view.from_below.xyz, view.from_above.xyz, normal.z * 0.5 + 0.5);
    let unlit = base * (ambient + LAMP * abs(dot(normal, eye_direction)));
    let facing_sun = dot(normal, view.to_sun.xyz);
    if facing_sun <= 0.0 {
        return vec4f(unlit * open, alpha);
    }
    let half_way = normalize(eye_direction + view.to_sun.xyz);
    let highlight = HIGHLIGHT * pow(max(dot(normal, half_way), 0.0), 40.0);
    let sunlight = (base * view.sun.xyz + highlight) * (facing_sun * sunlit(point_m, normal));
    return vec4f((unlit + sunlight) * open, alpha);
}

fn ray_at(sample: vec2u) -> vec3f {
    let middle = vec2f(sample) + 0.5;
    return view.corner_ray.xyz + view.right_ray.xyz * middle.x + view.down_ray.xyz * middle.y;
}

// Whether neighbouring samples show different things at different depths.
fn differ(a: u32, a_at: vec2u, b_at: vec2u) -> bool {
    let b = textureLoad(samples, b_at, 0).x;
    if a == b || a == NOTHING || b == NOTHING || part_of(a).flags.x == part_of(b).flags.x {
        return false;
    }
    let near_a = nearness_1_m(a, ray_at(a_at));
    let near_b = nearness_1_m(b, ray_at(b_at));
    return abs(near_a - near_b) > OUTLINE_DEPTH_STEP * max(near_a, near_b);
}

// How many of the neighbours to the right and below are outlined against a sample.
fn outlines(triangle: u32, at: vec2u, size: vec2u) -> f32 {
    if any(at + 1u >= size) {
        return 0.0;
    }
    return select(0.0, 1.0, differ(triangle, at, at + vec2u(1u, 0u)))
        + select(0.0, 1.0, differ(triangle, at, at + vec2u(0u, 1u)));
}

// Mean of a pixel's samples; a triangle that covers several of them is shaded once.
fn mean(pixel: vec2u, size: vec2u) -> vec3f {
    var triangles: array<u32, 4>;
    var sum = vec3f(0.0);
    var edges = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let at = pixel * 2u + vec2u(i % 2u, i / 2u);
        triangles[i] = textureLoad(samples, at, 0).x;
        edges += outlines(triangles[i], at, size * 2u);
    }
    for (var i = 0u; i < 4u; i++) {
        var covered = 0.0;
        var first = true;
        for (var j = 0u; j < 4u; j++) {
            let same = triangles[j] == triangles[i];
            first = first && !(same && j < i);
            covered += select(0.0, 1.0, same);
        }
        if first {
            if triangles[i] == NOTHING {
                sum += sky_at(ray_at(pixel * 2u + vec2u(i % 2u, i / 2u))) * covered;
            } else {
                sum += colour(triangles[i], ray_at(pixel * 2u + vec2u(i % 2u, i / 2u))).xyz * covered;
            }
        }
    }
    return blended(pixel, sum * (1.0 - OUTLINE * (1.0 - view.extra.z) * min(edges / 4.0, 1.0)) / 4.0);
}

// Colour of a pixel with the blended surfaces over it.
fn blended(pixel: vec2u, behind: vec3f) -> vec3f {
    var sum = behind;
    for (var layer = i32(view.counts.y) - 1; layer >= 0; layer--) {
        var triangles: array<u32, 4>;
        var veil = vec4f(0.0);
        for (var i = 0u; i < 4u; i++) {
            triangles[i] = textureLoad(veils, pixel * 2u + vec2u(i % 2u, i / 2u), layer, 0).x;
        }
        for (var i = 0u; i < 4u; i++) {
            var covered = 0.0;
            var first = triangles[i] != NOTHING;
            for (var j = 0u; j < 4u; j++) {
                let same = triangles[j] == triangles[i];
                first = first && !(same && j < i);
                covered += select(0.0, 0.25, same);
            }
            if first {
                let seen = colour(triangles[i], ray_at(pixel * 2u + vec2u(i % 2u, i / 2u)));
                let share = covered * (1.0 - (1.0 - seen.w) * (1.0 - seen.w));
                veil += vec4f(seen.xyz, 1.0) * share;
            }
        }
        if veil.w > 0.0 {
            sum = decoded(mix(encoded(sum), encoded(veil.xyz / veil.w), veil.w));
        }
    }
    return sum;
}

// The triangle that depth and id of a pixel are those of.
fn measured(pixel: vec2u, ray: vec3f) -> u32 {
    for (var layer = 0; layer < i32(view.counts.y); layer++) {
        let triangle = textureLoad(veil_centres, pixel, layer, 0).x;
        if triangle == NOTHING {
            break;
        }
        if (part_of(triangle).flags.y & 4u) != 0u && colour(triangle, ray).w >= MIN_SEEN_ALPHA {
            return triangle;
        }
    }
    return textureLoad(centres, pixel, 0).x;
}

// Linear light to sRGB bytes, in the steps of the embedded renderer's table.
fn bytes(linear: vec3f) -> u32 {
    let stepped = round(clamp(linear, vec3f(0.0), vec3f(1.0)) * (SRGB_STEPS - 1.0)) / (SRGB_STEPS - 1.0);
    let low = 12.92 * stepped;
    let high = 1.055 * pow(stepped, vec3f(1.0 / 2.4)) - 0.055;
    let byte = vec3u(select(high, low, stepped <= vec3f(0.0031308)) * 255.0 + 0.5);
    return byte.x | (byte.y << 8u) | (byte.z << 16u);
}

@compute @workgroup_size(8, 8)
fn resolve_colours(@builtin(global_invocation_id) place: vec3u) {
    let size = vec2u(view.scale.zw);
    if all(place.xy < size) {
        picture[place.y * size.x + place.x] = bytes(mean(place.xy, size));
    }
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) place: vec3u) {
    let size = vec2u(view.scale.zw);
    let pixel = place.xy;
    if any(pixel >= size) {
        return;
    }
    let count = size.x * size.y;
    let i = pixel.y * size.x + pixel.x;
    picture[i] = bytes(mean(pixel, size));
    // The pixel's centre is the corner between its samples.
    let ray = ray_at(pixel * 2u) + 0.5 * (view.right_ray.xyz + view.down_ray.xyz);
    let triangle = measured(pixel, ray);
    if triangle == NOTHING {
        picture[count + i] = INFINITY_BITS;
        picture[2u * count + i] = 0u;
    } else {
        picture[count + i] = bitcast<u32>(1.0 / nearness_1_m(triangle, ray));
        picture[2u * count + i] = part_of(triangle).flags.x;
    }
}
