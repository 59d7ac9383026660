// Light of a file's lamps, like in `shading/lamps.rs`, and the sky.

fn power(value: f32, exponent: f32) -> f32 {
    return pow(max(value, 1e-12), exponent);
}

// Column and row on a lamp's map of shadows, each times the depth for those that are not directional, and nearness
// or depth.
fn on_lamp_map(lamp: Lamp, point_m: vec3f) -> vec3f {
    let point = vec4f(point_m, 1.0);
    return vec3f(dot(lamp.column, point), dot(lamp.row, point), dot(lamp.nearness, point));
}

// Place of a corner on a map of shadows.
fn cast_by_lamp(lamp: Lamp, point_m: vec3f) -> vec4f {
    let place = on_lamp_map(lamp, point_m);
    if lamp.position.w == 0.0 {
        let share = place / vec3f(TEXELS, TEXELS, 2.0 * SUN_DISTANCE_M);
        return vec4f(2.0 * share.x - 1.0, 1.0 - 2.0 * share.y, share.z, 1.0);
    }
    return vec4f(2.0 * place.x / TEXELS - place.z, place.z - 2.0 * place.y / TEXELS, NEAR_M, place.z);
}

// 1 in the light of a spot or a point, 0 in the shadow: a bilinear filter three texels wide.
fn in_cone(lamp: Lamp, layer: i32, point_m: vec3f, normal: vec3f) -> f32 {
    let distance_m = max(on_lamp_map(lamp, point_m).z, 0.0);
    let place = on_lamp_map(lamp, point_m + normal * (LAMP_NORMAL_TEXELS * lamp.specular.w * distance_m));
    if place.z <= 0.0 {
        return 1.0;
    }
    let texel = place.xy / place.z - 0.5;
    if any(texel < vec2f(1.0)) || any(texel >= vec2f(TEXELS - 3.0)) {
        return 1.0;
    }
    let low = floor(texel);
    let part = texel - low;
    let nearer_m = place.z * (1.0 - LAMP_BIAS_SHARE);
    var sum = 0.0;
    for (var j = -1; j <= 2; j++) {
        let down = select(select(1.0, part.y, j == 2), 1.0 - part.y, j == -1);
        for (var i = -1; i <= 2; i++) {
            let across = select(select(1.0, part.x, i == 2), 1.0 - part.x, i == -1);
            let occluder_1_m = textureLoad(shadow, vec2i(low) + vec2i(i, j), layer, 0) / NEAR_M;
            sum += select(0.0, across * down, occluder_1_m * nearer_m <= 1.0);
        }
    }
    return sum / 9.0;
}

// Values of sRGB, in which files store colours, for linear light.
fn encoded(linear: vec3f) -> vec3f {
    let curve = 1.055 * pow(max(linear, vec3f(1e-12)), vec3f(1.0 / 2.4)) - 0.055;
    return select(curve, 12.92 * linear, linear <= vec3f(0.0031308));
}

// Surface in the light of lamps; linear colours.
struct LampSurface {
    // Result of `gloss_at`.
    gloss: vec4f,
    base: vec3f,
    // Colour of its image alone; 1 without an image.
    image: vec3f,
    emitted: vec3f,
    ambient_share: f32,
}

// Linear colour of a surface.
fn lit_by_lamps(surface: LampSurface, point_m: vec3f, normal: vec3f, to_eye: vec3f) -> vec3f {
    let gloss = surface.gloss;
    let exponent = gloss.z * SHININESS;
    let back = view.back.xyz;
    let facing_head = dot(normal, back);
    let head_ambient = view.head_ambient.xyz * surface.ambient_share;
    var lit = vec3f(gloss.x) + head_ambient + view.head_diffuse.xyz * max(facing_head, 0.0);
    var glossy = vec3f(0.0);
    if facing_head > 0.0 {
        let shine = power(max(dot(normal, normalize(back + to_eye)), 0.0), exponent);
        glossy = view.head_specular.xyz * (gloss.y * shine);
    }
    let own = encoded(surface.base);
    let most = encoded(surface.image);
    let tint = mix(most, own, gloss.w);
    var shown = vec3f(0.0);
    for (var i = 0u; i < view.counts.x; i++) {
        let lamp = view.lamps[i];
        var towards = -lamp.direction.xyz;
        var share = 1.0;
        if lamp.position.w > 0.0 {
            let towards_m = lamp.position.xyz - point_m;
            let distance_m = length(towards_m) + 1e-6;
            towards = towards_m / distance_m;
            let fall = dot(lamp.attenuation.xyz, vec3f(1.0, distance_m, distance_m * distance_m));
            share = 1.0 / max(fall, 1e-6);
            let along = -dot(towards, lamp.direction.xyz);
            if lamp.position.w == 1.0 {
                share *= select(power(max(along, 0.0), lamp.ambient.w), 0.0, along < lamp.direction.w);
            }
        }
        let facing = dot(normal, towards);
        let layer = i32(lamp.diffuse.w);
        if share > 0.0 && layer >= 0 {
            if lamp.position.w == 0.0 {
                share *= on_map(on_lamp_map(lamp, point_m + normal * view.extra.x), layer);
            } else {
                share *= in_cone(lamp, layer, point_m, normal);
            }
        }
        var own_lit = lamp.ambient.xyz * (share * surface.ambient_share);
        var own_glossy = vec3f(0.0);
        if facing > 0.0 {
            let shine = power(max(dot(normal, normalize(towards + to_eye)), 0.0), exponent);
            own_lit += lamp.diffuse.xyz * (share * facing);
            own_glossy = lamp.specular.xyz * (share * gloss.y * shine);
        }
        // The light of each lamp with shadows is limited separately.
        if layer >= 0 {
            shown += min(own * own_lit + own_glossy * tint, most);
        } else {
            lit += own_lit;
            glossy += own_glossy;
        }
    }
    let seen = shown + min(own * lit + glossy * tint, most) + encoded(surface.emitted);
    return decoded(min(seen, vec3f(1.0)));
}

// Colour of pixels without a surface.
fn sky_at(ray: vec3f) -> vec3f {
    if view.counts.z == 0u {
        return SKY;
    }
    let step_x = 2.0 * view.right_ray.xyz;
    let step_y = 2.0 * view.down_ray.xyz;
    let place = on_cube(around(ray), around(step_x), around(step_y));
    return image_rgba(view.counts.z, place).xyz;
}

// Direction on the cube of the sky, whose y is up.
fn around(ray: vec3f) -> vec3f {
    return vec3f(ray.x, ray.z, -ray.y);
}
