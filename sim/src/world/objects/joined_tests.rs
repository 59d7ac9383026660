//! Tests of bodies in scenes that overlap where their joints or the file hold them.

use rapier3d::math::Pose;

use crate::World;
use crate::mjcf::Document;

/// Simulates a scene for one second without robots. Returns the maximum distance of any object from its
/// initial position.
fn farthest_m(inside: &str) -> f32 {
    let document = Document::parse("scene.xml", &format!("<mujoco>{inside}</mujoco>")).expect("a scene");
    let mut world = World::of_scene(document).expect("a world");
    let begin: Vec<Pose> =
        world.present().objects.iter().map(|object| object.state.world_from_object).collect();
    let mut farthest_m = 0.0f32;
    for _ in 0..50 {
        let step = world.control_step(&[]).unwrap_or_else(|error| panic!("{error}"));
        for (object, begin) in step.objects.iter().zip(&begin) {
            let moved = object.state.world_from_object.translation - begin.translation;
            farthest_m = farthest_m.max(moved.length());
        }
    }
    farthest_m
}

/// A drawer overlaps its fixed carcass, which is the base of the same tree, another tree, or the world
/// itself.
#[test]
fn what_moves_may_be_kept_apart_from_what_does_not() {
    let rail = r#"<joint type="slide" axis="0 -1 0" range="0 0.3" damping="5"/>"#;
    let drawer = format!(
        r#"<body name="drawer" pos="0 -0.15 0.5">{rail}<geom type="box" size=".2 .1 .1" mass="2"/></body>"#
    );
    let box_ = r#"<geom type="box" size=".3 .2 .3" pos="0 0 0.5"/>"#;
    let exclude = |body: &str| format!(r#"<contact><exclude body1="{body}" body2="drawer"/></contact>"#);
    for (scene, carcass) in [
        (format!(r#"<worldbody><body name="carcass">{box_}{drawer}</body></worldbody>"#), "carcass"),
        (format!(r#"<worldbody><body name="carcass">{box_}</body>{drawer}</worldbody>"#), "carcass"),
        (format!("<worldbody>{box_}{drawer}</worldbody>"), "world"),
    ] {
        assert!(farthest_m(&scene) > 0.05, "pushed out of {carcass}");
        let moved_m = farthest_m(&format!("{scene}{}", exclude(carcass)));
        assert!(moved_m < 1e-6, "{moved_m} m out of {carcass}, from which it is kept apart");
    }
}

/// Links that overlap along directions in which their joints cannot move them.
#[test]
fn what_no_joint_can_part_stays_together() {
    let floor = r#"<geom type="plane" size="5 5 .1"/>"#;
    let cart = r#"<geom type="capsule" fromto="-1 0 1 1 0 1" size="0.02"/>
        <body name="cart" pos="0 0 1"><joint type="slide" axis="1 0 0" range="-1 1"/>
          <geom type="capsule" fromto="-.1 0 0 .1 0 0" size="0.1" mass="1"/>
          <body name="pole"><joint axis="0 1 0" range="-90 90"/>
            <geom type="capsule" fromto="0 0 0 0.001 0 0.6" size="0.049" mass="1"/></body></body>"#;
    // In MuJoCo the pole falls, and the cart moves by its recoil.
    let moved_m = farthest_m(&format!("<worldbody>{floor}{cart}</worldbody>"));
    assert!(moved_m < 1.0, "{moved_m} m");
    let chain = r#"<body name="torso" pos="0 0 1"><freejoint/><geom type="sphere" size=".25" mass="3"/>
        <body name="leg" pos="0.2 0 0"><joint axis="0 0 1" range="-30 30" damping="1"/>
          <geom type="capsule" fromto="0 0 0 .3 0 0" size=".08" mass=".3"/>
          <body name="foot" pos="0.3 0 0"><joint axis="0 1 0" range="-60 60" damping="1"/>
            <geom type="capsule" fromto="-.2 0 0 .3 0 0" size=".08" mass=".3"/></body></body></body>"#;
    let moved_m = farthest_m(&format!("<worldbody>{floor}{chain}</worldbody>"));
    assert!(moved_m < 1.2, "{moved_m} m");
    // Neither drawer can move out of the way of the other.
    let drawer = |x: f64| {
        let joint = r#"<joint type="slide" axis="0 1 0"/>"#;
        format!(r#"<body pos="{x} 0 1">{joint}<geom type="box" size=".1 .1 .1"/></body>"#)
    };
    let moved_m = farthest_m(&format!("<worldbody>{floor}{}{}</worldbody>", drawer(0.0), drawer(0.19)));
    assert!(moved_m < 0.01, "{moved_m} m");
}

/// A body on two joints does not touch the body that carries it, just as with one joint.
#[test]
fn a_body_with_two_joints_does_not_touch_what_carries_it() {
    let scene = |joints: &str| {
        format!(
            r#"<worldbody><body pos="0 0 1"><freejoint/><geom type="box" size=".2 .2 .2" mass="5"/>
              <body name="lid" pos="0 0 0.15">{joints}<geom type="box" size=".1 .1 .1" mass="1"/></body></body>
              <geom type="box" size="1 1 .1" pos="0 0 0.7"/></worldbody>"#
        )
    };
    let one_m = farthest_m(&scene(r#"<joint type="slide" axis="1 0 0" damping="9"/>"#));
    let two_m = farthest_m(&scene(
        r#"<joint name="a" type="slide" axis="1 0 0" damping="9"/><joint name="b" type="slide" axis="0 1 0" damping="9"/>"#,
    ));
    assert!(one_m < 0.01 && two_m < 0.01, "{one_m} m and {two_m} m");
}

/// A box whose mask is not the floor's, in gravity that pulls it aside, too.
#[test]
fn pairs_touch_whatever_their_masks_and_slide_by_their_own_friction() {
    let scene = r#"<option gravity="3 0 -9.81"/><worldbody><geom name="floor" type="plane" size="5 5 .1"/>
        <body pos="0 0 0.1"><freejoint/>
          <geom name="box" type="box" size=".1 .1 .1" contype="2" conaffinity="2" friction="1"/></body></worldbody>"#;
    let pair = |rest: &str| format!(r#"{scene}<contact><pair geom1="box" geom2="floor"{rest}/></contact>"#);
    for (scene, least_m, most_m) in [
        (scene.into(), 4.5, 6.0),
        (pair(""), 0.0, 0.001),
        // s = (3 - 0.1 * 9.81) / 2
        (pair(r#" friction="0.1 0.1""#), 0.98, 1.04),
        (pair(r#" condim="1""#), 1.47, 1.53),
        (pair("").replace("<option", r#"<option><flag contact="disable"/></option><option"#), 4.5, 6.0),
    ] {
        let moved_m = farthest_m(&scene);
        assert!((least_m..=most_m).contains(&moved_m), "{moved_m} m in {scene}");
    }
}
