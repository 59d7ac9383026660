// The constants that both renderers share are inserted before this text.

struct View {
    // Rows from directions of the world to the camera's frame.
    right: vec4f,
    up: vec4f,
    back: vec4f,
    eye_m: vec4f,
    // Rays in the world to a depth of 1 m: through the picture's top left corner, and from a sample to the next.
    corner_ray: vec4f,
    right_ray: vec4f,
    down_ray: vec4f,
    // Column, row and nearness on the shadow's map: scalar product with a point of the world, plus a constant.
    sun_column: vec4f,
    sun_row: vec4f,
    sun_nearness: vec4f,
    // Twice the focal length, divided by width and by height; width and height in pixels.
    scale: vec4f,
    // World coordinates of the corner of the map of contacts, and its texels per metre.
    contact: vec4f,
    // Light of the scenery, like `Light` in `shading/mod.rs`.
    sun: vec4f,
    to_sun: vec4f,
    from_below: vec4f,
    from_above: vec4f,
    // Number of lamps, number of layers of blended surfaces, place of the sky's head in `texels` or 0, and the lamp
    // that casts a shadow, if it is not the sun.
    counts: vec4u,
    // Offset of the sun's shadows along the normal; 1 if lamps light the scenery; 1 if baked light does.
    extra: vec4f,
    head_ambient: vec4f,
    head_diffuse: vec4f,
    head_specular: vec4f,
    lamps: array<Lamp, MAX_LIGHTS>,
}

// A light of the scene's file in the world, like `FileLight`.
struct Lamp {
    // Fourth number: 0 for a directional light, 1 for a spot, 2 for a point.
    position: vec4f,
    // Fourth number: cosine of the cutoff.
    direction: vec4f,
    // Fourth number: exponent.
    ambient: vec4f,
    // Fourth number: layer of its shadow, or -1.
    diffuse: vec4f,
    // Fourth number: width of a texel of its map at 1 m.
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
    // Id; bits: it casts a shadow, is blended, is cut out by its image's alpha, its image has alpha; whether objects
    // stand on it; and the place of its image's head in `texels`, 0 without an image.
    flags: vec4u,
    // Places of the heads of the numbers for gloss and for normals in `texels`, 0 without; bits of the roughness, -1
    // without, and of the metallic share.
    maps: vec4u,
    // Place of the head of the image for emitted light in `texels`, 0 without; bits of the factor on it.
    emitted: vec4u,
}

struct Face {
    normal: vec4f,
    // Columns: change of the normal with the point, per metre.
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
// Heights of supports of objects, and their darkness at contacts.
@group(0) @binding(4) var<storage, read> contacts: array<vec2f>;

// Gradients of each triangle's three coordinates for images in its mesh's frame, with their values at the
// first corner.
struct Coordinates {
    u: vec4f,
    v: vec4f,
    w: vec4f,
}
@group(0) @binding(5) var<storage, read> coordinates: array<Coordinates>;
// Numbers of each image: width, height, number of levels, and 0, or on a cube its number of images, 1 or 6 (+x, -x, +y, -y,
// +z, -z); then the levels, the largest first.
@group(0) @binding(6) var<storage, read> texels: array<u32>;

// Baked light: the cubes of all parts, those of the room, and the texels of its maps; irradiance, and the share of it
// that objects shadow.
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

// Corner of a triangle whose part is solid or blended.
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

// 1 / depth of the point at which a ray to a depth of 1 m meets the plane of a triangle.
fn nearness_1_m(triangle: u32, ray: vec3f) -> f32 {
    let part = part_of(triangle);
    let corner = corner_m(3u * triangle);
    let first = corner_m(3u * triangle + 1u) - corner;
    let second = corner_m(3u * triangle + 2u) - corner;
    let across = turned(part, cross(first, second));
    return dot(across, ray) / dot(across, in_world(part, corner) - view.eye_m.xyz);
}

// Linear colour of the surface that a ray meets, and its alpha.
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
    var ambient_share = 1.0;
    var emitted = vec3f(0.0);
    if part.flags.w != 0u {
        let place = place_at(triangle, part, ray, depth_m, normal, from_corner_m);
        let rgba = image_at(part, place);
        if part.maps.x != 0u {
            let numbers = image_values(part.maps.x, place).xyz;
            ambient_share = numbers.x;
            gloss = gloss_at(part, numbers);
        }
        if part.emitted.x != 0u {
            emitted = emitted_at(part, place);
            gloss.x = 0.0;
        }
        normal = bent_normal(triangle, part, place, normal, eye_direction);
        image = rgba.xyz;
        base = part.rgb.xyz * image;
        alpha *= rgba.w;
    } else {
        base = albedo(part, point_m);
    }
    let open = select(1.0, 1.0 - CONTACT * darkness(point_m), part.flags.z != 0u);
    if view.extra.y > 0.0 {
        let surface = LampSurface(gloss, base, image, emitted, ambient_share);
        return vec4f(lit_by_lamps(surface, point_m, normal, eye_direction) * open, alpha);
    }
    if view.extra.z > 0.0 {
        let light = baked_light(corners[3u * triangle].w, face, point_m, normal);
        let kept_out = base * light.xyz * ((1.0 - light.w) * (1.0 - ambient_share)) * baked_tint();
        let lit = lit_by_baked(light, base, point_m, normal, eye_direction) - kept_out;
        return vec4f(lit * open + emitted, alpha);
    }
    let ambient = mix(view.from_below.xyz, view.from_above.xyz, normal.z * 0.5 + 0.5);
    let unlit = base * (ambient * ambient_share + LAMP * abs(dot(normal, eye_direction)));
    let facing_sun = dot(normal, view.to_sun.xyz);
    if facing_sun <= 0.0 {
        return vec4f(unlit * open + emitted, alpha);
    }
    let half_way = normalize(eye_direction + view.to_sun.xyz);
    let highlight = HIGHLIGHT * pow(max(dot(normal, half_way), 0.0), 40.0);
    let sunlight = (base * view.sun.xyz + highlight) * (facing_sun * sunlit(point_m, normal));
    return vec4f((unlit + sunlight) * open + emitted, alpha);
}

fn ray_at(sample: vec2u) -> vec3f {
    let middle = vec2f(sample) + 0.5;
    return view.corner_ray.xyz + view.right_ray.xyz * middle.x + view.down_ray.xyz * middle.y;
}

// True if neighbouring samples show different objects at different depths.
fn differ(a: u32, a_at: vec2u, b_at: vec2u) -> bool {
    let b = textureLoad(samples, b_at, 0).x;
    if a == b || a == NOTHING || b == NOTHING || part_of(a).flags.x == part_of(b).flags.x {
        return false;
    }
    let near_a = nearness_1_m(a, ray_at(a_at));
    let near_b = nearness_1_m(b, ray_at(b_at));
    return abs(near_a - near_b) > OUTLINE_DEPTH_STEP * max(near_a, near_b);
}

// Number of neighbours to the right and below that are outlined against a sample.
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

// Triangle from which a pixel has its depth and id.
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
