//! The facts available to expressions, one row each: name, parameters, value, and the book's description.
//! To add a fact, add its row here and its line in the book's table; a test compares the two.

use tandem_sim::{OpeningKind, Side, Vector};

use super::lacks;
use super::meaning::{Argument, Fact, Measure, Statement};
use crate::scoring::{Predicate, nearness, placement};

/// A fact that expressions refer to by name.
#[derive(Debug)]
pub struct Function {
    pub name: &'static str,
    pub parameters: &'static [Parameter],
    pub gives: Gives,
    /// Description for the book.
    pub help: &'static str,
}

/// Type of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// Name of a robot.
    Robot,
    /// List of robot names.
    Robots,
    /// "left" or "right".
    Side,
    /// Name of an object.
    Object,
    /// Name of an object, or of an object's part, whose joint is of this kind.
    Opening(OpeningKind),
    /// Name of a site on the object at argument `of`.
    Site {
        of: usize,
    },
    /// A number, with its name in the book.
    Number(&'static str),
    Numbers,
    Truth,
}

#[derive(Debug)]
pub enum Gives {
    Truth(Statement),
    Number(Measure),
}

const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
const NOT_NEGATIVE: [f64; 2] = [0.0, f64::INFINITY];
const PART: [f64; 2] = [0.0, 1.0];
const OBJECT: &[Parameter] = &[Parameter::Object];
const TWO_OBJECTS: &[Parameter] = &[Parameter::Object, Parameter::Object];
const SITE: &[Parameter] = &[Parameter::Object, Parameter::Site { of: 0 }];
const TWO_SITES: &[Parameter] =
    &[Parameter::Object, Parameter::Site { of: 0 }, Parameter::Object, Parameter::Site { of: 2 }];
const WITHIN: &[Parameter] = &[Parameter::Object, Parameter::Object, Parameter::Number("half_m")];

/// Facts that only a closing hand can make true.
pub const OF_FINGERS: [&str; 3] = ["holds", "holds_any", "held_by_all"];

/// All facts.
pub static FUNCTIONS: &[Function] = &[
    // Hands.
    coming(
        "holds",
        &[Parameter::Robot, Parameter::Side, Parameter::Object],
        |f| f.facts.holds(f.robot(0), f.side(1), f.object(2)),
        |f| nearness::grip(f.facts, f.robot(0), f.side(1), f.object(2)),
    )
    .lacks(|f| lacks::grip(f.facts, f.robot(0), &[f.side(1)], f.object(2)))
    .help("this hand of the robot holds the object"),
    coming(
        "holds_any",
        &[Parameter::Robot, Parameter::Object],
        |f| f.facts.holds_any(f.robot(0), f.object(1)),
        |f| nearness::grips(f.facts, &[f.robot(0)], f.object(1)),
    )
    .lacks(|f| lacks::grip(f.facts, f.robot(0), &Side::BOTH, f.object(1)))
    .help("a hand of the robot holds the object"),
    coming(
        "held_by_all",
        &[Parameter::Robots, Parameter::Object],
        |f| f.facts.held_by_all(f.robots(0), f.object(1)),
        |f| nearness::grips(f.facts, f.robots(0), f.object(1)),
    )
    .lacks(|f| {
        let of_robot = |robot: &usize| lacks::grip(f.facts, *robot, &Side::BOTH, f.object(1));
        f.robots(0).iter().flat_map(of_robot).collect()
    })
    .help("each of these robots holds the object with a hand"),
    truth("hands_off", &[Parameter::Robot, Parameter::Object], |f| f.facts.hands_off(f.robot(0), f.object(1)))
        .lacks(|f| lacks::hands_off(f.facts, f.robot(0), f.object(1)))
        .help("neither hand of the robot touches the object"),
    truth("fallen", &[Parameter::Robot], |f| f.facts.robots[f.robot(0)].fallen).help("the robot has fallen"),
    // Positions of objects.
    truth("inside", TWO_OBJECTS, |f| f.facts.inside_vessel(f.object(0), f.object(1)))
        .help("the first object's origin is between the walls of the second and over its floor"),
    truth("inside_box", &[Parameter::Object, Parameter::Object, Parameter::Site { of: 1 }], |f| {
        f.facts.inside_box(f.object(0), f.object(1), f.site(2))
    })
    .help("the first object's origin is inside a site of the second that is a box"),
    truth("within_box", WITHIN, |f| placement::within_box(f.facts, f.object(0), f.object(1), f.number_f32(2)))
        .lacks(|f| lacks::apart(f.facts, f.object(0), f.object(1), f.number_f32(2), true))
        .help("the objects' origins are so near on each of x, y and z"),
    truth("above_box", WITHIN, |f| placement::above_box(f.facts, f.object(0), f.object(1), f.number_f32(2)))
        .lacks(|f| lacks::apart(f.facts, f.object(0), f.object(1), f.number_f32(2), false))
        .help("the objects' origins are so near on x and y, at any height"),
    truth("within_mark", TWO_SITES, |f| {
        f.facts.within_mark(f.object(0), f.site(1), f.object(2), f.site(3))
    })
    .help("a site of the first object that is a box is, seen from above, within one of the second"),
    truth("threads", &THREADS, |f| {
        f.facts.threads(f.object(0), [f.site(1), f.site(2)], f.object(3), f.site(4))
    })
    .help("a rod of the first object, from site to site, passes through a ring of the second: a site with its axis along y"),
    // States of objects.
    truth("stands_released", OBJECT, |f| placement::stands_released(f.facts, f.object(0)))
        .lacks(|f| lacks::stands_released(f.facts, f.object(0)))
        .help("upright within 15 degrees, slower than 0.05 m/s and 0.15 rad/s, and untouched by robots for 0.2 s"),
    truth("stands_as_high", &[Parameter::Object, Parameter::Number("within_m")], |f| {
        placement::stands_as_high(f.facts, f.object(0), f.number_f32(1))
    })
    .lacks(|f| lacks::stands_as_high(f.facts, f.object(0), f.number_f32(1)))
    .help("the object's origin is as high as when the episode began, to so much"),
    number("lift_m", OBJECT, ANY, |f| f.facts.lift_m(f.object(0)).into())
        .help("how far the object's origin is above where it began"),
    number("clearance_m", OBJECT, ANY, |f| f.facts.clearance_m(f.object(0)).into())
        .help("how far its lowest point is above where its origin began"),
    number("lowest_m", OBJECT, ANY, |f| f.facts.lowest_m(f.object(0)).into())
        .help("height of its lowest point above the floor"),
    number("highest_m", OBJECT, ANY, |f| f.facts.highest_m(f.object(0)).into())
        .help("height of its highest point above the floor"),
    number("upright_deg", OBJECT, [0.0, 180.0], |f| f.facts.tilt_rad(f.object(0)).to_degrees().into())
        .help("how far it leans from upright"),
    number("released_for_s", OBJECT, NOT_NEGATIVE, |f| f.facts.untouched_s(f.object(0)))
        .help("how long no part of any robot has touched it"),
    number("speed_m_s", OBJECT, NOT_NEGATIVE, |f| f.facts.speed_m_s(f.object(0)).into()).help("how fast it moves"),
    number("turn_rate_deg_s", OBJECT, NOT_NEGATIVE, |f| {
        f.facts.turn_rate_rad_s(f.object(0)).to_degrees().into()
    })
    .help("how fast it turns"),
    number("x_m", OBJECT, ANY, |f| f.facts.position_m(f.object(0)).x.into()).help("its origin in the world"),
    number("y_m", OBJECT, ANY, |f| f.facts.position_m(f.object(0)).y.into()).help("its origin in the world"),
    number("z_m", OBJECT, ANY, |f| f.facts.position_m(f.object(0)).z.into()).help("its origin in the world"),
    number("opened_m", &[Parameter::Opening(OpeningKind::Slide)], ANY, |f| f.facts.opened(f.object(0)).into())
        .help("how far its slide has moved from its place in the file, towards the farther end of its range"),
    number("opened_deg", &[Parameter::Opening(OpeningKind::Hinge)], [-180.0, 180.0], |f| {
        f.facts.opened(f.object(0)).to_degrees().into()
    })
    .help("the same of its hinge, from -180 to 180"),
    number("apart_m", TWO_OBJECTS, NOT_NEGATIVE, |f| f.facts.apart_m(f.object(0), f.object(1)).into())
        .help("distance of the objects' origins on the floor's plane"),
    number("turned_deg", TWO_OBJECTS, [-180.0, 180.0], |f| {
        f.facts.turned_rad(f.object(0), f.object(1)).to_degrees().into()
    })
    .help("how far the second object is turned about the vertical against the first, from -180 to 180, positive to the left"),
    number("ahead_m", TWO_OBJECTS, ANY, |f| f.facts.seen_from_m(f.object(0), f.object(1)).x.into())
        .help("how far the second object's origin is ahead of the first's, along the first's own x axis"),
    number("aside_m", TWO_OBJECTS, ANY, |f| f.facts.seen_from_m(f.object(0), f.object(1)).y.into())
        .help("how far it is to the left, along the first's own y axis"),
    number("beyond_m", &[Parameter::Object, Parameter::Object, Parameter::Site { of: 1 }], ANY, |f| {
        let (back, plane_m) = behind(f, 1);
        (plane_m - f.facts.reach_m(f.object(0), back)).into()
    })
    .help("how far all of the first object is beyond a site of the second, along the second's own x axis"),
    number("robot_beyond_m", &[Parameter::Robot, Parameter::Object, Parameter::Site { of: 1 }], ANY, |f| {
        let (back, plane_m) = behind(f, 1);
        (plane_m - f.facts.robot_reach_m(f.robot(0), back)).into()
    })
    .help("how far all of the robot is beyond a site of the object, along the object's own x axis"),
    number("sites_apart_m", TWO_SITES, NOT_NEGATIVE, |f| {
        (f.facts.site_m(f.object(0), f.site(1)) - f.facts.site_m(f.object(2), f.site(3))).length().into()
    })
    .help("distance of two sites"),
    number("sites_apart_level_m", TWO_SITES, NOT_NEGATIVE, |f| {
        let apart_m = f.facts.site_m(f.object(0), f.site(1)) - f.facts.site_m(f.object(2), f.site(3));
        apart_m.truncate().length().into()
    })
    .help("distance of two sites on the floor's plane"),
    number("site_radius_m", SITE, NOT_NEGATIVE, |f| f.facts.site(f.object(0), f.site(1)).radius_m().into())
        .help("radius of a site that is a sphere or a cylinder"),
    number("robot_apart_m", &[Parameter::Robot, Parameter::Object], NOT_NEGATIVE, |f| {
        let pelvis_m = f.facts.robots[f.robot(0)].pelvis_in_world.translation;
        (pelvis_m - f.facts.position_m(f.object(1))).truncate().length().into()
    })
    .help("distance of the robot's pelvis and the object's origin on the floor's plane"),
    number("time_s", &[], NOT_NEGATIVE, |f| f.facts.time_s).help("simulated time since the episode began"),
    // Arithmetic.
    number("abs", &[Parameter::Number("x")], NOT_NEGATIVE, |f| f.number(0).abs()).help("its size, without its sign"),
    number("min", &[Parameter::Number("x"), Parameter::Number("y")], ANY, |f| f.number(0).min(f.number(1)))
        .help("the smaller of both"),
    number("max", &[Parameter::Number("x"), Parameter::Number("y")], ANY, |f| f.number(0).max(f.number(1)))
        .help("the greater of both"),
    // Facts for `near` only.
    number("coming", &COMING, PART, |f| come(f.number(0), f.number(1), f.number(2)))
        .help("how far a number has come on its way from one to another, from 0 to 1"),
    number("one_if", &[Parameter::Truth], PART, |f| f64::from(u8::from(f.truth(0)))).help("1 if it holds, else 0"),
    number("mean", &[Parameter::Numbers], ANY, |f| f.mean(0)).help("the mean of a list of numbers"),
    number("grip", &[Parameter::Robot, Parameter::Side, Parameter::Object], PART, |f| {
        nearness::grip(f.facts, f.robot(0), f.side(1), f.object(2)).into()
    })
    .help("how far a hand has come to holding the object, from 0 to 1"),
    number("grips", &[Parameter::Robots, Parameter::Object], PART, |f| {
        nearness::grips(f.facts, f.robots(0), f.object(1)).into()
    })
    .help("the same for several robots, each by its nearer hand"),
    number("standing", OBJECT, PART, |f| nearness::standing(f.facts, f.object(0)).into())
        .help("how far the object has come to standing upright, still and released, from 0 to 1"),
];

const THREADS: [Parameter; 5] = [
    Parameter::Object,
    Parameter::Site { of: 0 },
    Parameter::Site { of: 0 },
    Parameter::Object,
    Parameter::Site { of: 3 },
];

const COMING: [Parameter; 3] = [Parameter::Number("x"), Parameter::Number("from"), Parameter::Number("to")];

const fn truth(name: &'static str, parameters: &'static [Parameter], holds: fn(&Fact) -> bool) -> Function {
    Function { name, parameters, gives: Gives::Truth(Statement { holds, near: None, lacks: None }), help: "" }
}

const fn coming(
    name: &'static str,
    parameters: &'static [Parameter],
    holds: fn(&Fact) -> bool,
    near: fn(&Fact) -> f32,
) -> Function {
    Function {
        name,
        parameters,
        gives: Gives::Truth(Statement { holds, near: Some(near), lacks: None }),
        help: "",
    }
}

const fn number(
    name: &'static str,
    parameters: &'static [Parameter],
    values: [f64; 2],
    value: fn(&Fact) -> f64,
) -> Function {
    Function { name, parameters, gives: Gives::Number(Measure { value, values }), help: "" }
}

impl Function {
    const fn help(self, help: &'static str) -> Function {
        let Function { name, parameters, gives, .. } = self;
        Function { name, parameters, gives, help }
    }

    /// Sets the function that explains why the fact does not hold.
    const fn lacks(self, lacks: fn(&Fact) -> Vec<String>) -> Function {
        let Function { name, parameters, gives, help } = self;
        let gives = match gives {
            Gives::Truth(Statement { holds, near, .. }) => {
                Gives::Truth(Statement { holds, near, lacks: Some(lacks) })
            }
            Gives::Number(measure) => Gives::Number(measure),
        };
        Function { name, parameters, gives, help }
    }

    /// Returns the signature for the book and messages, for example `holds(robot, side, object)`.
    pub fn signature(&self) -> String {
        let names: Vec<&str> = self.parameters.iter().map(|parameter| parameter.name()).collect();
        format!("{}({})", self.name, names.join(", "))
    }
}

impl Parameter {
    pub fn name(self) -> &'static str {
        match self {
            Parameter::Robot => "robot",
            Parameter::Robots => "[robots]",
            Parameter::Side => "side",
            Parameter::Object | Parameter::Opening(_) => "object",
            Parameter::Site { .. } => "site",
            Parameter::Number(name) => name,
            Parameter::Numbers => "[numbers]",
            Parameter::Truth => "condition",
        }
    }
}

/// Typed access to the arguments. `check` builds them by the function's parameters; a mismatch is a
/// mistake in the rows above.
impl Fact<'_> {
    fn robot(&self, place: usize) -> usize {
        match &self.arguments[place] {
            Argument::Robot(robot) => *robot,
            other => panic!("{other:?} is no robot"),
        }
    }

    fn robots(&self, place: usize) -> &[usize] {
        match &self.arguments[place] {
            Argument::Robots(robots) => robots,
            other => panic!("{other:?} is no list of robots"),
        }
    }

    fn side(&self, place: usize) -> Side {
        match &self.arguments[place] {
            Argument::Side(side) => *side,
            other => panic!("{other:?} is no side"),
        }
    }

    fn object(&self, place: usize) -> &str {
        match &self.arguments[place] {
            Argument::Object(name) => name,
            other => panic!("{other:?} is no object"),
        }
    }

    fn site(&self, place: usize) -> &str {
        match &self.arguments[place] {
            Argument::Site(name) => name,
            other => panic!("{other:?} is no site"),
        }
    }

    fn number(&self, place: usize) -> f64 {
        match &self.arguments[place] {
            Argument::Number(number) => number.value(self.facts),
            other => panic!("{other:?} is no number"),
        }
    }

    /// Returns a number in the precision of the value that it is compared with.
    fn number_f32(&self, place: usize) -> f32 {
        self.number(place) as f32
    }

    fn truth(&self, place: usize) -> bool {
        match &self.arguments[place] {
            Argument::Truth(truth) => truth.holds(self.facts),
            other => panic!("{other:?} is no condition"),
        }
    }

    fn mean(&self, place: usize) -> f64 {
        match &self.arguments[place] {
            Argument::Numbers(numbers) => {
                numbers.iter().map(|number| number.value(self.facts)).sum::<f64>() / numbers.len() as f64
            }
            other => panic!("{other:?} is no list of numbers"),
        }
    }
}

/// Returns the direction opposite to the x axis of the object at `place`. The second value is the
/// coordinate along it of the site in the next argument.
fn behind(f: &Fact, place: usize) -> (Vector, f32) {
    let object = f.object(place);
    let back = f.facts.object(object).pose_in_world.rotation * Vector::NEG_X;
    (back, f.facts.site_m(object, f.site(place + 1)).dot(back))
}

fn come(value: f64, from_value: f64, to_value: f64) -> f64 {
    let come = (value - from_value) / (to_value - from_value);
    if come.is_nan() { 0.0 } else { come.clamp(0.0, 1.0) }
}
