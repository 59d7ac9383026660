//! Tests of trees, equalities and actuators of small files.

mod refusals;

use rapier3d::glamx::{DPose3, DQuat, DVec3};
use rapier3d::math::Vector;

use super::{
    Actuator, ActuatorKind, AxisJoint, BodyTree, Document, EqualityConstraint, EqualityKind, LinkJoint,
};
use crate::dynamics::{Axis, Directions, Friction};

fn document(inside: &str) -> Document {
    let xml = format!("<mujoco><compiler angle=\"radian\" autolimits=\"true\"/>{inside}</mujoco>");
    Document::parse("test.xml", &xml).expect("valid MJCF")
}

fn trees(inside: &str) -> Vec<BodyTree> {
    document(inside).trees().expect("trees")
}

const DOOR: &str = r#"
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    <body name="frame" pos="1 0 0">
      <geom type="box" pos="0 0 1" size="0.05 0.05 1"/>
      <body name="leaf" pos="0 0 1">
        <joint name="hinge" pos="0.1 0 0" axis="0 0 2" range="0 1.5" damping="2" stiffness="0.5" springref="0.1"
          armature="0.01" frictionloss="0.3"/>
        <geom type="box" pos="0.4 0 0" size="0.4 0.02 0.9" mass="20"/>
        <body name="plate" pos="0.7 0 0" quat="0 0 0 1">
          <geom type="sphere" size="0.05" mass="1"/>
          <site name="keyhole" pos="0.1 0 0"/>
          <body name="bolt" pos="0.05 0 0">
            <joint name="bolt" type="slide" axis="1 0 0" limited="false" range="0 1"/>
            <geom type="sphere" size="0.01" mass="0.1"/>
          </body>
        </body>
      </body>
    </body>
    <body name="mat" pos="0 0 0.1"><freejoint name="mat"/><geom type="box" size="0.1 0.2 0.3" density="500"/></body>
  </worldbody>
  <equality>
    <joint name="latch" joint1="bolt" joint2="hinge" polycoef="0 0.5 0 0 0" active="false"/>
    <weld body1="mat" body2="plate"/>
    <connect body1="leaf" anchor="0 0 1"/>
  </equality>
  <actuator>
    <motor joint="hinge" ctrlrange="-5 5"/>
    <position joint="bolt" kp="20" kv="3" forcerange="-4 4"/>
  </actuator>"#;

#[test]
fn bodies_without_a_joint_belong_to_the_link_that_carries_them() {
    let trees = trees(DOOR);
    let names: Vec<Vec<&str>> =
        trees.iter().map(|tree| tree.links.iter().map(|link| link.name.as_str()).collect()).collect();
    assert_eq!(names, [vec!["world"], vec!["frame", "leaf", "bolt"], vec!["mat"]]);
    let parents: Vec<Option<usize>> = trees[1].links.iter().map(|link| link.parent).collect();
    assert_eq!(parents, [None, Some(0), Some(1)]);
    assert_eq!(trees.iter().map(BodyTree::is_fixed).collect::<Vec<_>>(), [true, false, false]);

    let leaf = &trees[1].links[1];
    assert_eq!(leaf.bodies[1].name, "plate");
    assert_eq!(leaf.bodies[1].link_from_body.translation, DVec3::new(0.7, 0.0, 0.0));
    // The plate is rotated by half a turn, so its x axis is the leaf's -x.
    assert!((leaf.sites[0].position_m().x - 0.6).abs() < 1e-6);
    let bolt = &trees[1].links[2];
    assert!((bolt.parent_from_link.translation - DVec3::new(0.65, 0.0, 0.0)).length() < 1e-9);
}

#[test]
fn masses_come_from_all_geoms_of_a_link() {
    let trees = trees(DOOR);
    let leaf = &trees[1].links[1].mass;
    assert!((leaf.mass() - 21.0).abs() < 1e-4);
    assert!((leaf.local_com.x - (20.0 * 0.4 + 0.7) / 21.0).abs() < 1e-6);
    let mat = &trees[2].links[0].mass;
    let (mass_kg, x, y, z) = (500.0 * 0.2 * 0.4 * 0.6, 0.1f32, 0.2f32, 0.3f32);
    assert!((mat.mass() - mass_kg).abs() < 1e-4);
    let expected = [y * y + z * z, x * x + z * z, x * x + y * y].map(|sum| mass_kg / 3.0 * sum);
    let have = mat.reconstruct_inertia_matrix().diagonal().to_array();
    for (have, expected) in have.into_iter().zip(expected) {
        assert!((have - expected).abs() < 1e-4 * expected, "{have} instead of {expected}");
    }
}

#[test]
fn frames_move_geoms_between_two_ends() {
    let geoms = r#"<frame pos="1 0 0" euler="0 1.5707963 0"><geom type="capsule" size="0.1" fromto="0 0 1 0 0 3"/></frame>
        <replicate count="2" offset="0 5 0"><geom type="capsule" size="0.1" fromto="0 0 1 0 0 3"/></replicate>"#;
    let trees = trees(&format!("<worldbody><body><freejoint/>{geoms}</body></worldbody>"));
    let middles_m = [[3.0, 0.0, 0.0], [0.0, 0.0, 2.0], [0.0, 5.0, 2.0]].map(Vector::from);
    let body = trees.iter().find(|tree| !tree.links[0].geoms.is_empty()).expect("the body");
    for (geom, middle_m) in body.links[0].geoms.iter().zip(middles_m) {
        assert!((geom.body_from_geom.translation - middle_m).length() < 1e-6, "{:?}", geom.body_from_geom);
    }
    assert_eq!(body.links[0].geoms.len(), middles_m.len());
    assert!((body.links[0].geoms[0].body_from_geom.rotation * Vector::Z - Vector::X).length() < 1e-6);
}

#[test]
fn joints_keep_everything_the_file_says() {
    let trees = trees(DOOR);
    let axis = Axis {
        anchor_m: DVec3::new(0.1, 0.0, 0.0),
        armature: 0.01,
        friction_loss: 0.3,
        damping: 2.0,
        stiffness: 0.5,
        spring_rest: 0.1,
        range: Some([0.0, 1.5]),
        ..Axis::along(DVec3::Z)
    };
    let hinge = AxisJoint { name: "hinge".into(), axis, placed_at: 0.0 };
    assert_eq!(trees[1].links[1].joint, LinkJoint::Hinge(hinge));
    let bolt = trees[1].links[2].joint.axis().expect("a slide");
    assert_eq!(bolt.range, None, "`limited` is false");
    assert_eq!(trees[2].links[0].joint, LinkJoint::Free { name: "mat".into() });
}

#[test]
fn equalities_and_actuators_are_read() {
    let document = document(DOOR);
    let unnamed = |kind| EqualityConstraint { name: String::new(), active: true, kind };
    let coupling = EqualityKind::Coupling {
        joint: "bolt".into(),
        other: Some("hinge".into()),
        coefficients: [0.0, 0.5, 0.0, 0.0, 0.0],
    };
    let weld = EqualityKind::Weld { body: "mat".into(), other: Some("plate".into()), body_from_other: None };
    let pin = EqualityKind::Pin { body: "leaf".into(), other: None, anchor_in_body_m: DVec3::Z };
    assert_eq!(
        document.equalities().expect("equalities"),
        [
            EqualityConstraint { name: "latch".into(), active: false, kind: coupling },
            unnamed(weld),
            unnamed(pin)
        ]
    );
    let motor = Actuator {
        joint: "hinge".into(),
        kind: ActuatorKind::Motor,
        control_range: Some([-5.0, 5.0]),
        effort_range: None,
        speed_limit: None,
        gear: 1.0,
        placed_at: 0.0,
        index: 0,
    };
    let position = Actuator {
        joint: "bolt".into(),
        kind: ActuatorKind::Position { kp: 20.0, kd: 3.0 },
        control_range: None,
        effort_range: Some([-4.0, 4.0]),
        speed_limit: None,
        gear: 1.0,
        placed_at: 0.0,
        index: 1,
    };
    assert_eq!(document.actuators().expect("actuators"), [motor, position]);
}

#[test]
fn motors_have_the_speed_limits_that_a_numeric_states() {
    let with = |forcerange: &str, data: &str| {
        let joint = |name: &str| format!(r#"<body><joint name="{name}"/><geom size="0.1"/></body>"#);
        let motors = format!(r#"<motor joint="a" forcerange="-1 1"/><motor joint="b" {forcerange}/>"#);
        let numeric =
            format!(r#"<numeric name="other" data="7"/><numeric name="actuator_speed_limit" {data}/>"#);
        let (a, b) = (joint("a"), joint("b"));
        document(&format!(
            "<worldbody>{a}{b}</worldbody><actuator>{motors}</actuator><custom>{numeric}</custom>"
        ))
        .actuators()
        .map(|motors| motors.iter().map(|motor| motor.speed_limit).collect::<Vec<_>>())
        .map_err(|error| error.to_string())
    };
    let limited = r#"forcerange="-2 2""#;
    assert_eq!(with(limited, r#"size="2" data="3.5 20""#), Ok(vec![Some(3.5), Some(20.0)]));
    for (forcerange, data, expected) in [
        (limited, r#"data="20""#, "has 1 numbers; it takes 2, one for each actuator"),
        (limited, "", "has 0 numbers; it takes 2"),
        (limited, r#"data="20 0""#, "joint `b`: a speed limit of 0; it has to be above 0"),
        (limited, r#"data="-1 20""#, "joint `a`: a speed limit of -1; it has to be above 0"),
        (
            "",
            r#"data="20 20""#,
            "joint `b`: a speed limit of 20; it has to be above 0, and needs a forcerange",
        ),
    ] {
        let error = with(forcerange, data).expect_err(expected);
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_weld_keeps_the_pose_it_states() {
    let bodies = r#"<worldbody><body name="a"><freejoint/><geom size="1"/></body></worldbody>"#;
    let weld = |relpose: &str| {
        let inside = format!("{bodies}<equality><weld body1=\"a\" relpose=\"{relpose}\"/></equality>");
        match document(&inside).equalities().expect("equalities").remove(0).kind {
            EqualityKind::Weld { body_from_other, .. } => body_from_other,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(weld("0 1 0 0 0 0 0"), None, "MuJoCo's default");
    let turned = DPose3::from_parts(DVec3::new(1.0, 2.0, 3.0), DQuat::from_xyzw(0.0, 0.0, 1.0, 0.0));
    assert_eq!(weld("1 2 3 0 0 0 1"), Some(turned));
}

#[test]
fn geoms_have_mujocos_friction_unless_they_state_it() {
    let friction = |attributes: &str| {
        let inside = format!("<worldbody><geom type=\"plane\" size=\"1 1 1\" {attributes}/></worldbody>");
        trees(&inside)[0].links[0].geoms[0].friction
    };
    let usual = Friction {
        directions: Directions::Slide,
        slide: 1.0,
        spin_m: 0.005,
        roll_m: 0.0001,
        priority: 0,
        left: 1.0,
    };
    assert_eq!(friction(""), usual);
    let stated = Friction {
        directions: Directions::SlideSpinRoll,
        slide: 0.6,
        spin_m: 0.01,
        roll_m: 0.002,
        priority: 2,
        left: 1.0,
    };
    assert_eq!(friction(r#"friction="0.6 0.01 0.002" condim="6" priority="2""#), stated);
}

#[test]
fn masks_say_what_touches_what() {
    let geoms = r#"<geom size="1" contype="4" conaffinity="3"/><geom size="1" conaffinity="0"/>
        <geom size="1" contype="0" conaffinity="0"/>"#;
    let geoms = trees(&format!("<worldbody>{geoms}</worldbody>"))[0].links[0].geoms.clone();
    assert_eq!(geoms.iter().map(|geom| geom.collides).collect::<Vec<_>>(), [true, true, false]);
    assert_eq!((geoms[0].touches.kinds, geoms[0].touches.touched), (4, 3));
    assert!(geoms[0].touches.meets(geoms[1].touches) && geoms[1].touches.meets(geoms[0].touches));
    assert!(!geoms[1].touches.meets(geoms[1].touches), "it touches nothing of its own kind");
}

/// Joint positions are 0 where the file places the bodies, for any `ref`.
#[test]
fn a_joint_may_be_placed_elsewhere_than_at_0() {
    let body = r#"<worldbody><body><joint name="h" ref="0.5" range="0 2" springref="0.7"/>
        <geom size="1"/></body></worldbody>"#;
    let driven =
        r#"<actuator><position joint="h"/></actuator><keyframe><key name="start" qpos="1"/></keyframe>"#;
    let found = document(&format!("{body}{driven}"));
    let trees = found.trees().expect("trees");
    let axis = trees[1].links[0].joint.axis().expect("a hinge");
    assert_eq!((axis.range, axis.spring_rest), (Some([-0.5, 1.5]), 0.7 - 0.5));
    assert_eq!(found.keys().expect("keys")[0].positions, [0.5]);
    assert_eq!(found.actuators().expect("actuators")[0].placed_at, 0.5);
}

#[test]
fn settings_of_a_file_hold_for_all_of_it() {
    let mass_kg = |compiler: &str| {
        let geoms = r#"<geom size="1" mass="2" group="0"/><geom size="1" mass="3" group="1"/>"#;
        let stated = r#"<inertial pos="0 0 0" mass="7" diaginertia="1 1 1"/>"#;
        let body = |stated: &str| format!("<body><freejoint/>{stated}{geoms}</body>");
        let bodies = body(stated) + &body("");
        let trees = trees(&format!("{compiler}<worldbody>{bodies}</worldbody>"));
        [1, 2].map(|tree: usize| trees[tree].links[0].mass.mass().round())
    };
    assert_eq!(mass_kg(""), [7.0, 5.0]);
    assert_eq!(mass_kg(r#"<compiler inertiagrouprange="0 0"/>"#), [7.0, 2.0]);
    assert_eq!(mass_kg(r#"<compiler inertiafromgeom="true"/>"#), [5.0, 5.0]);
    assert_eq!(mass_kg(r#"<compiler settotalmass="24"/>"#), [14.0, 10.0]);
    let flags = r#"<option><flag contact="disable" gravity="disable"/></option>"#;
    let none = document(&format!("{flags}<worldbody><geom size=\"1\"/></worldbody>"));
    assert!(!none.trees().expect("trees")[0].links[0].geoms[0].collides);
    assert_eq!(none.gravity_m_s2(), [0.0; 3]);
    assert_eq!(document(r#"<option gravity="0 0 -1.62"/>"#).gravity_m_s2(), [0.0, 0.0, -1.62]);
}

/// Every embedded file is read, and has the same meaning as in MuJoCo.
#[test]
fn our_own_files_have_nothing_that_is_approximated() {
    let folder = |path: &str| std::path::Path::new(env!("TANDEM_SIM_ASSETS")).join(path);
    let folders = ["objects", "scenes", "robots/g1_dex3", "../../tests/peers/scenes"];
    let mut count = 0;
    for entry in folders.iter().flat_map(|path| std::fs::read_dir(folder(path)).expect("a folder")) {
        let path = entry.expect("an entry of a folder").path();
        if path.extension().is_some_and(|extension| extension == "xml") {
            let document = Document::read(&path).unwrap_or_else(|error| panic!("{error}"));
            document.trees().unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(document.approximations(), [""; 0]);
            count += 1;
        }
    }
    assert!(count > 50, "{count} files");
}

#[test]
fn what_is_approximated_is_named_once() {
    let geoms = r#"<geom size="1" solref="0.01 1"/><geom size="1" solref="0.02 1" margin="1"/>"#;
    let ball = r#"<body><joint type="ball"/><geom size="1"/></body>"#;
    let free = r#"<body><joint type="free" damping="1"/><geom size="1"/></body>"#;
    let knee = r#"<body><joint range="0.6 2"/><geom size="1"/></body>"#;
    let within = r#"<body><joint range="0.6 2" ref="0.6"/><geom size="1"/></body>"#;
    let document = document(&format!("<worldbody>{geoms}{ball}{free}{within}{knee}{knee}</worldbody>"));
    let told = document.approximations().join("\n");
    assert_eq!(document.approximations().len(), 5, "{told}");
    assert!(told.contains("joint: it begins 34 degrees beyond its range (and 1 more joints do)"), "{told}");
    assert!(told.contains("joint: a ball is three hinges"), "{told}");
    assert!(told.contains("joint: nothing holds or slows a free body"), "{told}");
    assert!(told.contains("`test.xml:1`: geom in <worldbody> has solref: every contact"), "{told}");
}

#[test]
fn classes_are_those_of_the_file() {
    let with = |defaults: &str, geom: &str| {
        let inside = format!("<default>{defaults}</default><worldbody>{geom}</worldbody>");
        let xml = format!("<mujoco>{inside}</mujoco>");
        Document::parse("test.xml", &xml).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let pads = r#"<default class="pad"><geom friction="0.8 0.003 0" pos="1 0 0" size="1"/></default>"#;
    assert_eq!(with(pads, r#"<geom class="pad" friction="1 0 0"/>"#), "");
    for (geom, expected) in [
        (r#"<geom class="pod"/>"#, "class=\"pod\"; use the class of a <default>"),
        (r#"<geom class="pad" material="wood"/>"#, "material=\"wood\"; use the name of a material"),
        (r#"<geom class="pad" colour="red"/>"#, "<geom> has no attribute `colour` that is read"),
    ] {
        let error = with(pads, geom);
        assert!(error.contains(expected), "{error}");
    }
    for (defaults, expected) in [
        ("<default><geom/></default>", "a class inside another needs a name"),
        (r#"<default class="main"><geom/></default>"#, "there is a class of this name already"),
    ] {
        let error = with(defaults, "");
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn included_files_keep_their_lines_and_are_read_once() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, xml: &str| std::fs::write(folder.path().join(name), xml).expect("a file");
    write(
        "lid.xml",
        "<mujoco>\n<worldbody>\n<body name=\"lid\"><geom size=\"1\"/></body></worldbody></mujoco>",
    );
    write(
        "jar.xml",
        "<mujoco>\n<include file=\"lid.xml\"/>\n<worldbody><body name=\"jar\"/></worldbody></mujoco>",
    );
    let read = |name: &str| Document::read(&folder.path().join(name));
    let bodies = read("jar.xml").expect("a jar").model.bodies.len();
    assert_eq!(bodies, 3, "the world, the lid and the jar");

    write(
        "lid.xml",
        "<mujoco>\n<worldbody>\n<body name=\"lid\"><geom size=\"-1\"/></body></worldbody></mujoco>",
    );
    let error = read("jar.xml").expect_err("a negative size").to_string();
    assert!(error.contains("lid.xml:3`: geom in body `lid`: size=\"-1\""), "{error}");
    write("lid.xml", "<mujoco><include file=\"jar.xml\"/></mujoco>");
    let error = read("lid.xml").expect_err("a circle").to_string();
    assert!(error.contains("is included already"), "{error}");
    write("box.xml", "<mujoco><include file=\"lid.xml\"><include file=\"jar.xml\"/></include></mujoco>");
    let error = read("box.xml").expect_err("an include in an include").to_string();
    assert!(error.contains("holds elements"), "{error}");
    write("root.xml", "<include file=\"jar.xml\"> </include>");
    write("box.xml", "<mujoco><include file=\"root.xml\"/></mujoco>");
    let error = read("box.xml").expect_err("an include that is an include").to_string();
    assert!(error.contains("root.xml:1`: an included file is no <include> itself"), "{error}");
}

/// The effort limit of a joint applies together with that of its actuators. A position actuator may inherit
/// its control range from the joint. The attribute may be on the element, on its class, or on a class around
/// that one.
#[test]
fn limits_are_those_of_joint_and_actuator_together() {
    let found = document(
        r#"<default>
             <position inheritrange="1"/>
             <default class="leg"><joint actuatorfrcrange="-20 20"/>
               <default class="shin"><joint armature="0.1"/></default></default>
           </default>
           <worldbody><body childclass="shin"><joint name="knee" range="-1 2"/><geom size="0.1"/>
             <body><joint name="ankle" class="leg" range="0 1" actuatorfrcrange="-30 30"/><geom size="0.1"/></body>
           </body></worldbody>
           <actuator>
             <position joint="knee" kp="1" kv="1" forcerange="-50 50"/>
             <position joint="ankle" kp="1" kv="1" forcerange="-5 5" inheritrange="0.5"/>
           </actuator>"#,
    );
    let ranges: Vec<_> = found
        .actuators()
        .expect("actuators")
        .into_iter()
        .map(|actuator| (actuator.effort_range, actuator.control_range))
        .collect();
    let expected = [(Some([-20.0, 20.0]), Some([-1.0, 2.0])), (Some([-5.0, 5.0]), Some([0.25, 0.75]))];
    assert_eq!(ranges, expected);
}
