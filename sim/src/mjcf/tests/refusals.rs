//! Errors for refused files.

use crate::mjcf::Document;

/// Returns the error for a refused file.
fn refusal(inside: &str) -> String {
    let xml = format!("<mujoco><compiler angle=\"radian\" autolimits=\"true\"/>\n{inside}</mujoco>");
    let read = || {
        let document = Document::parse("test.xml", &xml)?;
        document.trees()?;
        document.equalities()?;
        document.actuators()?;
        document.exclusions()?;
        document.keys()
    };
    read().err().unwrap_or_else(|| panic!("{inside} is accepted")).to_string()
}

#[test]
fn what_is_refused_says_what_would_work() {
    let body =
        |joints: &str| format!(r#"<worldbody><body name="a">{joints}<geom size="1"/></body></worldbody>"#);
    let hinge = r#"<joint name="h"/>"#;
    let check = |inside: String, told: &str| {
        let error = refusal(&inside);
        assert!(error.contains(told), "{error}");
    };
    check(body(r#"<body name="b"><freejoint/></body>"#), "move it to the top level");
    check(body(r#"<geom size="1" condim="2"/>"#), "use 1, 3, 4 or 6");
    let coupled = r#"<equality><joint joint1="h" joint2="i"/></equality>"#;
    check(format!("{}{coupled}", body(hinge)), "no hinge or slide `i`; have: h");
    let welded = r#"<equality><weld body1="b"/></equality>"#;
    check(format!("{}{welded}", body(hinge)), "unknown body `b`; have: a");
    let driven = r#"<actuator><motor joint="i"/></actuator>"#;
    check(format!("{}{driven}", body(hinge)), "no hinge or slide `i`; have: h");
    let late = r#"<default><geom euler="0 0 1"/></default><compiler angle="degree"/>"#;
    check(late.into(), "a <default> before it has angles; put it first");
}

#[test]
fn all_that_is_refused_of_a_file_is_told_at_once() {
    let told =
        refusal("<worldbody><geom size=\"-1\"/>\n<geom colour=\"red\" size=\"1\"/></worldbody>\n<tendon/>");
    assert_eq!(told.lines().count(), 4, "{told}");
    for line in [
        "3 things are not read:",
        "`test.xml:2`: geom in <worldbody>: size=\"-1\"; use 1 to 3 numbers of at least 0",
        "`test.xml:3`: geom in <worldbody>: <geom> has no attribute `colour` that is read",
        "`test.xml:4`: <tendon>: <tendon> is not read; couple joints with an equality",
    ] {
        assert!(told.lines().any(|told| told.trim() == line), "{told}");
    }
    let told = refusal(
        "<worldbody><geom type=\"box\" size=\"1\"/>\n<body><joint/><geom type=\"sdf\"/></body></worldbody>",
    );
    assert!(told.contains("`test.xml:2`") && told.contains("`test.xml:3`"), "{told}");
}

#[test]
fn a_refusal_names_the_line_and_what_is_around() {
    let check = |inside: &str, expected: &str| assert_eq!(refusal(inside), expected);
    check(
        "<worldbody>\n<body name=\"door\">\n<body>\n<inertial pos=\"0 0 0\" mass=\"-1\" diaginertia=\"1 1 1\"/></body></body></worldbody>",
        "`test.xml:5`: inertial of an unnamed body in body `door`: mass=\"-1\"; use 1 number of at least 0",
    );
    check(
        "<worldbody><body name=\"a\"><geom size=\"1\"/></body>\n<body name=\"b\" pos=\"nan 0 0\"><geom size=\"1\"/></body></worldbody>",
        "`test.xml:3`: body `b`: pos=\"nan 0 0\"; use 3 numbers",
    );
    check(
        "<worldbody><body name=\"a\" quat=\"0 0 0 0\"/></worldbody>",
        "`test.xml:2`: body `a`: quat=\"0 0 0 0\"; use 4 numbers (w x y z), not all 0",
    );
    check(
        "<worldbody><site name=\"task\"/>\n<site name=\"task\"/></worldbody>",
        "`test.xml:3`: site `task`: there is a site `task` already; name it otherwise",
    );
    check(
        "<worldbody><body name=\"a\">\n<flexcomp name=\"cloth\"/></body></worldbody>",
        "`test.xml:3`: flexcomp `cloth`: <flexcomp> is not read; nothing bends or stretches here",
    );
    check(
        "<worldbody><body name=\"a\"><plugin plugin=\"mujoco.elasticity.cable\"/></body></worldbody>",
        "`test.xml:2`: plugin in body `a`: <plugin> is not read; plugins of MuJoCo are not run",
    );
    check(
        "<extension><plugin plugin=\"mujoco.sdf.bolt\"/></extension>",
        "`test.xml:2`: plugin in <extension>: <plugin> is not read; plugins of MuJoCo are not run",
    );
    check(
        "<worldbody><body><joint name=\"h\"/></body></worldbody>",
        "`test.xml:2`: body in <worldbody>: its joint moves nothing that has mass; give it a mass or the joint an armature",
    );
    check(
        "<worldbody><body name=\"cart\"><freejoint/><geom size=\"1\"/><body name=\"top\">\n<geom type=\"plane\" size=\"1 1 1\"/></body></body></worldbody>",
        "`test.xml:3`: geom in body `top`: a plane has no end; use a box on what moves",
    );
}

#[test]
fn bodies_nested_too_deep_are_refused() {
    let nested = |count: usize| {
        let bodies = "<body>".repeat(count) + "<geom size=\"1\"/>" + &"</body>".repeat(count);
        Document::parse("test.xml", &format!("<mujoco><worldbody>{bodies}</worldbody></mujoco>"))
    };
    nested(190).expect("a long chain").trees().expect("trees");
    for count in [20_000, 1_000_000] {
        let error = nested(count).expect_err("too deep").to_string();
        assert!(error.contains("`test.xml:1`") && error.contains("nest fewer"), "{error}");
    }
}
