//! Bodies made of schemas by chance, and what makes them hostile.

use serde_json::{Map, Value, json};

/// Chance that is the same in every run (SplitMix64).
pub struct Chance(pub u64);

impl Chance {
    /// A number below `end`, which is not 0.
    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) % end as u64) as usize
    }

    /// True so many times in a hundred.
    pub fn percent(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    /// One of several.
    pub fn of<'a, T>(&mut self, choices: &'a [T]) -> &'a T {
        &choices[self.below(choices.len())]
    }
}

/// A value that a schema allows, as far as this generator understands it.
pub fn allowed(schema: &Value, chance: &mut Chance) -> Value {
    if let Some(choices) = schema["anyOf"].as_array().filter(|_| schema["type"].is_null()) {
        return allowed(chance.of(choices), chance);
    }
    if let Some(names) = schema["enum"].as_array() {
        return chance.of(names).clone();
    }
    if let Some(names) = schema["oneOf"].as_array().filter(|_| schema["properties"].is_null()) {
        return chance.of(names)["const"].clone();
    }
    let kind = match &schema["type"] {
        Value::Array(kinds) => chance.of(kinds).clone(),
        kind => kind.clone(),
    };
    match kind.as_str().unwrap_or_default() {
        "object" => object(schema, chance),
        "array" => array(schema, chance),
        "string" => json!(*chance.of(&["A", "B", "A", "B", "C", "handover"])),
        "integer" => json!(chance.below(4)),
        "number" => json!(chance.below(200) as f64 / 100.0 - 1.0),
        "boolean" => json!(chance.percent(50)),
        _ => Value::Null,
    }
}

fn object(schema: &Value, chance: &mut Chance) -> Value {
    let required: Vec<&Value> = schema["required"].as_array().into_iter().flatten().collect();
    let fields = schema["properties"].as_object().into_iter().flatten();
    let mut made = Map::new();
    for (name, field) in fields {
        if required.iter().any(|required| **required == *name) || chance.percent(40) {
            made.insert(name.clone(), allowed(field, chance));
        }
    }
    made.into()
}

fn array(schema: &Value, chance: &mut Chance) -> Value {
    let bound = |name: &str, default: u64| schema[name].as_u64().unwrap_or(default) as usize;
    let (least, most) = (bound("minItems", 1), bound("maxItems", 3));
    let length = least + chance.below(most.saturating_sub(least).min(3) + 1);
    let places = schema["prefixItems"].as_array();
    let item = |index: usize| places.and_then(|places| places.get(index)).unwrap_or(&schema["items"]);
    (0..length).map(|index| allowed(item(index), chance)).collect()
}

/// Puts something else in the place of one value, or of one name, below `value`.
pub fn spoil(value: &mut Value, chance: &mut Chance) {
    let inner = match value {
        Value::Object(fields) if !fields.is_empty() && chance.percent(85) => {
            let name = fields.keys().nth(chance.below(fields.len())).cloned().unwrap_or_default();
            if chance.percent(10) {
                let moved = fields.shift_remove(&name).unwrap_or_default();
                fields.insert(text(chance), moved);
                return;
            }
            fields.get_mut(&name)
        }
        Value::Array(items) if !items.is_empty() && chance.percent(85) => {
            let index = chance.below(items.len());
            if chance.percent(10) {
                let copy = items[index].clone();
                items.extend(vec![copy; *chance.of(&[1, 60, 300])]);
                return;
            }
            items.get_mut(index)
        }
        _ => None,
    };
    match inner {
        Some(inner) => spoil(inner, chance),
        None => *value = hostile(chance),
    }
}

/// Something that no caller means well with.
fn hostile(chance: &mut Chance) -> Value {
    match chance.below(12) {
        0 => Value::Null,
        1 => json!(chance.percent(50)),
        2 => json!(*chance.of(&[i64::MIN, -1, 0, 26, 51, 1 << 32, i64::MAX])),
        3 => json!(u64::MAX),
        4 => json!(*chance.of(&[f64::MAX, -f64::MAX, 1e39, 5e-324, 1e6 + 1.0, -0.0, 0.5])),
        5 => json!({}),
        6 => json!([]),
        7 => json!([[[[[[]]]]]]),
        8 => (0..chance.below(100)).fold(json!(1), |inner, _| json!([inner])),
        9 => (0..chance.below(100)).fold(json!(1), |inner, _| json!({ "robot": inner })),
        10 => json!(vec![0.1; chance.below(500)]),
        _ => json!(text(chance)),
    }
}

/// A text that somebody might try.
pub fn text(chance: &mut Chance) -> String {
    const TEXTS: [&str; 12] = [
        "",
        "A",
        "a",
        "steps",
        "../../../etc/passwd",
        "\u{0}",
        "\u{202e}\u{feff}\u{1f916}",
        "'; DROP TABLE episodes; --",
        "<script>alert(1)</script>",
        "{{7*7}}%s%n${jndi:ldap://x}",
        "\r\nset-cookie: a=b",
        "__proto__",
    ];
    if chance.percent(10) {
        return "x".repeat(chance.below(20_000));
    }
    (*chance.of(&TEXTS)).into()
}

/// A body as it may come over a wire: most are JSON, some are broken on the way.
pub fn bytes(value: &Value, chance: &mut Chance) -> Vec<u8> {
    let mut bytes = value.to_string().into_bytes();
    if chance.percent(85) {
        return bytes;
    }
    match chance.below(6) {
        0 => bytes.truncate(chance.below(bytes.len() + 1)),
        1 => {
            let at = chance.below(bytes.len());
            bytes[at] = chance.below(256) as u8;
        }
        2 => {
            let at = chance.below(bytes.len());
            let broken: &[&[u8]] = &[b"NaN", b"1e999", b"\xff", b"\\ud800", b"\xef\xbb\xbf", b",", b"}"];
            let broken = *chance.of(broken);
            bytes.splice(at..at, broken.iter().copied());
        }
        3 => bytes = [b"[".repeat(chance.below(5000)), bytes].concat(),
        4 => bytes = [&b"{\"steps\": 1, \"steps\": "[..], &bytes, b"}"].concat(),
        _ => bytes = (0..chance.below(300)).map(|_| chance.below(256) as u8).collect(),
    }
    bytes
}
