//! Generation of random bodies from schemas, and of random changes that make them hostile.

use serde_json::{Map, Value, json};

/// A generator of random numbers that are the same in every run (Steele, Lea and Flood 2014).
pub struct SplitMix64(pub u64);

impl SplitMix64 {
    /// Returns a number below `end`, which must not be 0.
    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) % end as u64) as usize
    }

    /// Returns true with a probability of `percent` percent.
    pub fn percent(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    /// Picks one of `choices`.
    pub fn of<'a, T>(&mut self, choices: &'a [T]) -> &'a T {
        &choices[self.below(choices.len())]
    }
}

/// Returns a value that a schema allows, as far as this generator supports the schema.
pub fn allowed(schema: &Value, random: &mut SplitMix64) -> Value {
    if let Some(choices) = schema["anyOf"].as_array().filter(|_| schema["type"].is_null()) {
        return allowed(random.of(choices), random);
    }
    if let Some(names) = schema["enum"].as_array() {
        return random.of(names).clone();
    }
    if let Some(names) = schema["oneOf"].as_array().filter(|_| schema["properties"].is_null()) {
        return random.of(names)["const"].clone();
    }
    let kind = match &schema["type"] {
        Value::Array(kinds) => random.of(kinds).clone(),
        kind => kind.clone(),
    };
    match kind.as_str().unwrap_or_default() {
        "object" => object(schema, random),
        "array" => array(schema, random),
        "string" => json!(*random.of(&["A", "B", "A", "B", "C", "handover"])),
        "integer" => json!(random.below(4)),
        "number" => json!(random.below(200) as f64 / 100.0 - 1.0),
        "boolean" => json!(random.percent(50)),
        _ => Value::Null,
    }
}

fn object(schema: &Value, random: &mut SplitMix64) -> Value {
    let required: Vec<&Value> = schema["required"].as_array().into_iter().flatten().collect();
    let fields = schema["properties"].as_object().into_iter().flatten();
    let mut made = Map::new();
    for (name, field) in fields {
        if required.iter().any(|required| **required == *name) || random.percent(40) {
            made.insert(name.clone(), allowed(field, random));
        }
    }
    made.into()
}

fn array(schema: &Value, random: &mut SplitMix64) -> Value {
    let bound = |name: &str, default: u64| schema[name].as_u64().unwrap_or(default) as usize;
    let (least, most) = (bound("minItems", 1), bound("maxItems", 3));
    let length = least + random.below(most.saturating_sub(least).min(3) + 1);
    let places = schema["prefixItems"].as_array();
    let item = |index: usize| places.and_then(|places| places.get(index)).unwrap_or(&schema["items"]);
    (0..length).map(|index| allowed(item(index), random)).collect()
}

/// Replaces one value or one name below `value`.
pub fn spoil(value: &mut Value, random: &mut SplitMix64) {
    let inner = match value {
        Value::Object(fields) if !fields.is_empty() && random.percent(85) => {
            let name = fields.keys().nth(random.below(fields.len())).cloned().unwrap_or_default();
            if random.percent(10) {
                let moved = fields.shift_remove(&name).unwrap_or_default();
                fields.insert(text(random), moved);
                return;
            }
            fields.get_mut(&name)
        }
        Value::Array(items) if !items.is_empty() && random.percent(85) => {
            let index = random.below(items.len());
            if random.percent(10) {
                let copy = items[index].clone();
                items.extend(vec![copy; *random.of(&[1, 60, 300])]);
                return;
            }
            items.get_mut(index)
        }
        _ => None,
    };
    match inner {
        Some(inner) => spoil(inner, random),
        None => *value = hostile(random),
    }
}

/// Returns a value that a hostile caller might send.
fn hostile(random: &mut SplitMix64) -> Value {
    match random.below(12) {
        0 => Value::Null,
        1 => json!(random.percent(50)),
        2 => json!(*random.of(&[i64::MIN, -1, 0, 26, 51, 1 << 32, i64::MAX])),
        3 => json!(u64::MAX),
        4 => json!(*random.of(&[f64::MAX, -f64::MAX, 1e39, 5e-324, 1e6 + 1.0, -0.0, 0.5])),
        5 => json!({}),
        6 => json!([]),
        7 => json!([[[[[[]]]]]]),
        8 => (0..random.below(100)).fold(json!(1), |inner, _| json!([inner])),
        9 => (0..random.below(100)).fold(json!(1), |inner, _| json!({ "robot": inner })),
        10 => json!(vec![0.1; random.below(500)]),
        _ => json!(text(random)),
    }
}

/// Returns a text that a hostile caller might send.
pub fn text(random: &mut SplitMix64) -> String {
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
    if random.percent(10) {
        return "x".repeat(random.below(20_000));
    }
    (*random.of(&TEXTS)).into()
}

/// Serializes a body as a server may receive it: mostly JSON, sometimes corrupted.
pub fn bytes(value: &Value, random: &mut SplitMix64) -> Vec<u8> {
    let mut bytes = value.to_string().into_bytes();
    if random.percent(85) {
        return bytes;
    }
    match random.below(6) {
        0 => bytes.truncate(random.below(bytes.len() + 1)),
        1 => {
            let at = random.below(bytes.len());
            bytes[at] = random.below(256) as u8;
        }
        2 => {
            let at = random.below(bytes.len());
            let broken: &[&[u8]] = &[b"NaN", b"1e999", b"\xff", b"\\ud800", b"\xef\xbb\xbf", b",", b"}"];
            let broken = *random.of(broken);
            bytes.splice(at..at, broken.iter().copied());
        }
        3 => bytes = [b"[".repeat(random.below(5000)), bytes].concat(),
        4 => bytes = [&b"{\"steps\": 1, \"steps\": "[..], &bytes, b"}"].concat(),
        _ => bytes = (0..random.below(300)).map(|_| random.below(256) as u8).collect(),
    }
    bytes
}
