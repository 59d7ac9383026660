// Surfaces without light: patterns, and images with their layers.

// Triangle wave between 0 and 1 with a period of 1.
fn wave(x: f32) -> f32 {
    return abs(2.0 * fract(x) - 1.0);
}

// Share of the second colour at a point.
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

// Gloss of a surface: emission, specular strength, shininess and the metallic share. The second and third of
// `numbers` are roughness and metallic share.
fn gloss_at(part: Part, numbers: vec3f) -> vec4f {
    var gloss = vec4f(part.gloss.xyz, bitcast<f32>(part.maps.w));
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

// Linear colour that a part emits at a place of its image.
fn emitted_at(part: Part, place: ImagePlace) -> vec3f {
    return decoded(image_values(part.emitted.x, place).xyz) * bitcast<f32>(part.emitted.y);
}
