// Shadows of the sun, and contacts of objects.

// 1 in the sun, 0 in the shadow: a bilinear filter three texels wide.
fn sunlit(point_m: vec3f, normal: vec3f) -> f32 {
    return on_map(on_sun_map(point_m + normal * view.extra.x), 0);
}

fn on_map(place: vec3f, layer: i32) -> f32 {
    let share = on_map_share(place);
    if share <= 0.0 {
        return 1.0;
    }
    return 1.0 - blocked(place, layer).x * share;
}

// Surfaces that block the sun from a place on a map of shadows: their share in a bilinear filter three texels
// wide, and the sum of their heights above the place, each times its share.
fn blocked(place: vec3f, layer: i32) -> vec2f {
    let texel = place.xy - 0.5;
    let low = floor(texel);
    let part = texel - low;
    let nearness_m = place.z + BIAS_M;
    var sums = vec2f(0.0);
    for (var j = -1; j <= 2; j++) {
        let down = select(select(1.0, part.y, j == 2), 1.0 - part.y, j == -1) / 3.0;
        for (var i = -1; i <= 2; i++) {
            let across = select(select(1.0, part.x, i == 2), 1.0 - part.x, i == -1) / 3.0;
            let occluder_m = textureLoad(shadow, vec2i(low) + vec2i(i, j), layer, 0) * 2.0 * SUN_DISTANCE_M;
            let share = select(across * down, 0.0, nearness_m >= occluder_m);
            sums += share * vec2f(1.0, occluder_m - nearness_m);
        }
    }
    return sums;
}

// 1 on a map of shadows, less at its border, and 0 beyond.
fn on_map_share(place: vec3f) -> f32 {
    let texel = place.xy - 0.5;
    if any(texel < vec2f(1.0)) || any(texel >= vec2f(TEXELS - 3.0)) {
        return 0.0;
    }
    let border = min(texel, TEXELS - 1.0 - texel);
    return min(min(border.x, border.y) / FADE_TEXELS, 1.0);
}

// Darkness at contacts for a point of a support.
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
