//! A test that names of physical quantities include their unit.

use std::path::Path;

use syn::{
    Field, FnArg, GenericArgument, Item, Pat, PathArguments, Signature, Type,
    visit::{self, Visit},
};

use super::{modules::modules, sources::expect_none};

/// Crates in which numbers are physical quantities. `ik` is omitted: its vectors hold joint coordinates in
/// rad or m, and its costs and errors are weighted.
const CRATES: [&str; 6] =
    ["tools_spec", "sim", "episodes", "episodes/evaluation", "gateway/policies", "gateway"];

/// Files with joint coordinates in rad or m, or with rows of a solver or a filter, which mix units.
const GENERALISED: [&str; 7] = [
    "sim/src/dynamics/",
    "sim/src/estimate/covariance.rs",
    "sim/src/mechanism/machinery.rs",
    "sim/src/mjcf/constraints/equality.rs",
    "sim/src/mjcf/joints.rs",
    "sim/src/mjcf/key.rs",
    "sim/src/mjcf/support/",
];

/// Types that hold a quantity.
const QUANTITIES: [&str; 5] = ["f32", "f64", "Vector", "Vector3", "Vec3"];

/// Types that contain quantities of another type.
const CONTAINERS: [&str; 6] = ["Option", "Vec", "Box", "Sides", "Range", "RangeInclusive"];

/// Allowed suffixes of a quantity's name.
const UNITS: &[&str] = &[
    "m",
    "m2",
    "m3",
    "1_m",
    "rad",
    "deg",
    "s",
    "ms",
    "us",
    "hz",
    "1_s",
    "kg",
    "n",
    "w",
    "j",
    "px",
    "steps",
    "m_s",
    "m_s2",
    "m_s3",
    "rad_s",
    "rad_s2",
    "n_s",
    "n_m",
    "n_m_s",
    "n_m_rad",
    "n_m_s_rad",
    "n_m2",
    "kg_m",
    "kg_m2",
    "kg_m3",
];

/// Allowed suffixes of a number without a unit, or of numbers in several units with a documented order.
const DIMENSIONLESS: &[&str] = &[
    // Unit vectors and orientations.
    "axis",
    "normal",
    "direction",
    "ray",
    "ahead",
    "outside",
    "gravity_in_pelvis",
    "wxyz",
    // Colours.
    "rgb",
    "rgba",
    "albedo",
    "colour",
    "alpha",
    // Texture coordinates; also per metre.
    "uv",
    "uv_1_m",
    // Fractions, multiples and tangents.
    "share",
    "tan",
    "fraction",
    "ratio",
    "factor",
    "friction",
    "slide",
    "closure",
    "pace",
    "level",
    "deviation",
    "disturb",
    "waves",
    "gain",
    "caution",
    // Rewards, counted in phases.
    "reward",
    "progress",
    // Arbitrary numbers in conversions and checks, and in ranges whose names include the unit.
    "value",
    "values",
    "median",
    "quartiles",
    "min",
    "max",
    // An action row of the tool interface: joints in rad, then the base in m/s, m/s, rad/s and m.
    "row",
    "rows",
    "command",
    // Units without a prefix, for example in notes.
    "usd",
    "seconds",
    // Corners in an image: column and row in pixels, followed by the interpolated values.
    "corners",
    // A camera's intrinsics in pixels, and its distortion, under their usual names.
    "fx",
    "fy",
    "cx",
    "cy",
    "k1",
    "k2",
    "p1",
    "p2",
    "coefficients",
];

fn has_unit(name: &str) -> bool {
    let ends = |end: &&str| name == *end || name.strip_suffix(*end).is_some_and(|stem| stem.ends_with('_'));
    DIMENSIONLESS.iter().any(ends) || UNITS.iter().any(|unit| ends(unit) && name != *unit)
}

fn is_quantity(kind: &Type) -> bool {
    match kind {
        Type::Reference(inner) => is_quantity(&inner.elem),
        Type::Slice(inner) => is_quantity(&inner.elem),
        Type::Array(inner) => is_quantity(&inner.elem),
        Type::Path(path) => {
            let Some(last) = path.path.segments.last() else { return false };
            let inner = match &last.arguments {
                PathArguments::AngleBracketed(list) => list.args.iter().any(|argument| match argument {
                    GenericArgument::Type(kind) => is_quantity(kind),
                    _ => false,
                }),
                PathArguments::None | PathArguments::Parenthesized(_) => false,
            };
            let name = last.ident.to_string();
            QUANTITIES.contains(&name.as_str()) || (CONTAINERS.contains(&name.as_str()) && inner)
        }
        _ => false,
    }
}

/// Fields and parameters that are quantities and whose names have no unit.
#[derive(Default)]
struct Unnamed {
    found: Vec<(String, usize)>,
}

impl Unnamed {
    fn check(&mut self, name: &syn::Ident, kind: &Type) {
        if is_quantity(kind) && !has_unit(&name.to_string()) {
            self.found.push((name.to_string(), name.span().start().line));
        }
    }
}

impl<'ast> Visit<'ast> for Unnamed {
    fn visit_field(&mut self, field: &'ast Field) {
        if let Some(name) = &field.ident {
            self.check(name, &field.ty);
        }
    }

    fn visit_signature(&mut self, signature: &'ast Signature) {
        for input in &signature.inputs {
            if let FnArg::Typed(typed) = input
                && let Pat::Ident(name) = &*typed.pat
            {
                self.check(&name.ident, &typed.ty);
            }
        }
        visit::visit_signature(self, signature);
    }
}

fn unnamed(items: &[Item]) -> Vec<(String, usize)> {
    let mut unnamed = Unnamed::default();
    items.iter().for_each(|item| unnamed.visit_item(item));
    unnamed.found
}

#[test]
fn quantities_say_their_unit() {
    let mut found = Vec::new();
    let generalised = |path: &Path| GENERALISED.iter().any(|start| path.to_string_lossy().starts_with(start));
    for module in CRATES.iter().flat_map(|member| modules(member)).filter(|found| !generalised(&found.path)) {
        for (name, line) in unnamed(&module.items) {
            found.push(format!("{}:{line} `{name}`", module.path.display()));
        }
    }
    let rule = format!(
        "the name of a number that is a field or a parameter ends in its unit, one of {}, or says that it has none, by one of {}",
        UNITS.join(" "),
        DIMENSIONLESS.join(" ")
    );
    expect_none(&found, &rule);
}

#[test]
fn fields_and_parameters_without_a_unit_are_found() {
    let check = |text: &str, expected: &[&str]| {
        let found = unnamed(&syn::parse_file(text).expect("Rust").items);
        let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, expected, "{text}");
    };
    check("struct A { height: f32, height_m: f32, count: u32 }", &["height"]);
    check("struct A { speeds: Vec<[f64; 3]>, reach: Option<Vector>, dt_s: f64 }", &["speeds", "reach"]);
    check("fn f(forces: &[f32], force_n: &[f32], s: f32) {}", &["forces", "s"]);
    check("impl A { fn f(&self, at: Vector3<f64>, axis: Vector) {} }", &["at"]);
    check("trait A { fn f(quaternion_wxyz: [f32; 4], quaternion: [f32; 4]); }", &["quaternion"]);
    check("enum A { B { turn: f32 } }", &["turn"]);
}
