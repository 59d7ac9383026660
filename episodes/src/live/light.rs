//! Lights of a scene's file, for pages.

use serde_json::{Value, json};
use tandem_sim::mjcf::{FileLight, Headlight, LightKind};
use tandem_sim::render::{Lamp, Lamps};

use super::geometry::carrier_row;

/// Returns the lights of a file. Their colours multiply the file's surface colours directly, without
/// conversion to linear light.
pub fn lights(lamps: &Lamps) -> Value {
    let Lamps { headlight, lamps } = lamps;
    let Headlight { ambient_rgb, diffuse_rgb, specular_rgb } = headlight;
    json!({
        "headlight": {
            "ambient": ambient_rgb.to_array(), "diffuse": diffuse_rgb.to_array(),
            "specular": specular_rgb.to_array(),
        },
        "lamps": lamps.iter().map(lamp_row).collect::<Vec<_>>(),
    })
}

fn lamp_row(Lamp { carrier, light }: &Lamp) -> Value {
    let FileLight { position_m, direction, ambient_rgb, diffuse_rgb, specular_rgb, .. } = light;
    let kind = match light.kind {
        LightKind::Directional => "directional",
        LightKind::Spot => "spot",
        LightKind::Point => "point",
    };
    json!({
        "kind": kind, "carrier": carrier_row(*carrier), "position_m": position_m.to_array(),
        "direction": direction.to_array(), "ambient": ambient_rgb.to_array(),
        "diffuse": diffuse_rgb.to_array(), "specular": specular_rgb.to_array(),
        "attenuation": light.attenuation_values, "cutoff_rad": light.cutoff_rad,
        "exponent": light.exponent_value, "casts_shadow": light.casts_shadow,
    })
}
