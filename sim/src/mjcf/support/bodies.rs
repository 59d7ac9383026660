//! Elements of `<worldbody>` and `<body>`, and their defaults.

use super::{
    AMOUNT, Attribute, BOOLEAN, CLASS, COLOR, Element, MAYBE, NAME, NUMBER, POSE, Sign, Support, Takes, USER,
    approximated, attribute, ignored, mapped, numbers, only, refused,
};

const TREE: &[&str] = &["worldbody", "body", "frame"];
/// Elements that contain bodies and their parts, or defaults for them.
const TREE_OR_DEFAULT: &[&str] = &["worldbody", "body", "frame", "default"];

pub(super) const ELEMENTS: &[Element] = &[
    Element {
        name: "worldbody",
        within: &["mujoco"],
        support: Support::Mapped,
        kind: None,
        attributes: &[],
        note: "",
    },
    Element {
        name: "body",
        within: TREE,
        support: Support::Mapped,
        kind: Some("body"),
        attributes: &[&[NAME, CHILDCLASS], POSE, BODY],
        note: "a body without a joint is a part of the body that carries it; of a robot's file there is one in the worldbody, and it is free",
    },
    Element {
        name: "frame",
        within: TREE,
        support: Support::Mapped,
        kind: Some("frame"),
        attributes: &[&[NAME, CHILDCLASS], POSE],
        note: "",
    },
    Element {
        name: "replicate",
        within: TREE,
        support: Support::Mapped,
        kind: None,
        attributes: &[REPLICATE],
        note: "excludes, pairs, equalities and actuators that name something in it are copied, too, behind all others; equalities with something outside are refused, because MuJoCo leaves them out",
    },
    Element {
        name: "inertial",
        within: &["body"],
        support: Support::Mapped,
        kind: None,
        attributes: &[
            POSE,
            &[
                mapped(&["mass"], AMOUNT),
                mapped(&["diaginertia"], Takes::Numbers { least: 3, most: 3, sign: Sign::NotNegative }),
                mapped(&["fullinertia"], numbers(6, 6)),
            ],
        ],
        note: "without it, mass and inertia are those of the geoms",
    },
    Element {
        name: "joint",
        within: &["body", "default"],
        support: Support::Mapped,
        kind: Some("joint"),
        attributes: &[&[NAME, CLASS], JOINT],
        note: "limits are hard; of a robot's file there is one a body, and all are hinges at their body's origin, without springs and damping",
    },
    Element {
        name: "freejoint",
        within: &["body"],
        support: Support::Mapped,
        kind: Some("joint"),
        attributes: &[&[
            NAME,
            attribute(
                Support::Approximated,
                &["align"],
                Takes::Only(&["false", "auto"]),
                "the frame of a free body is where the file has it",
            ),
            ignored(&["group"], "joints are not drawn"),
        ]],
        note: "of a body that stands in the worldbody",
    },
    Element {
        name: "geom",
        within: TREE_OR_DEFAULT,
        support: Support::Mapped,
        kind: Some("geom"),
        attributes: &[&[NAME, CLASS], POSE, GEOM],
        note: "",
    },
    Element {
        name: "site",
        within: TREE_OR_DEFAULT,
        support: Support::Mapped,
        kind: Some("site"),
        attributes: &[&[NAME, CLASS], POSE, SITE],
        note: "a named point, or a region; it is not drawn",
    },
    Element {
        name: "camera",
        within: &["worldbody", "body"],
        support: Support::Mapped,
        kind: Some("camera"),
        attributes: &[CAMERA],
        note: "on a body that has a name, or in the worldbody",
    },
    Element {
        name: "camera",
        within: &["frame", "default"],
        support: Support::Ignored,
        kind: None,
        attributes: &[],
        note: "nobody looks through it; `third_person` and `egocentric` state everything on themselves, outside of frames",
    },
    Element {
        name: "light",
        within: TREE_OR_DEFAULT,
        support: Support::Mapped,
        kind: Some("light"),
        attributes: &[&[NAME, CLASS], LIGHT],
        note: "of a scene, its first seven; a scene without lights and headlight has lamps under its ceiling or a sun, and lights of robots and objects are ignored; of a frame around a light, pos and quat count",
    },
    Element {
        name: "plugin",
        within: &["worldbody", "body", "frame", "geom", "mesh", "actuator", "sensor", "extension"],
        support: Support::Refused,
        kind: None,
        attributes: &[],
        note: "plugins of MuJoCo are not run",
    },
    refused_in_tree("composite", "write its bodies out"),
    refused_in_tree("flexcomp", "nothing bends or stretches here"),
    refused_in_tree("attach", "include the file, or let MuJoCo save the whole"),
];

const fn refused_in_tree(name: &'static str, note: &'static str) -> Element {
    Element { name, within: TREE, support: Support::Refused, kind: None, attributes: &[], note }
}

const CHILDCLASS: Attribute = mapped(&["childclass"], Takes::Class);

const REPLICATE: &[Attribute] = &[
    attribute(Support::Mapped, &["count"], AMOUNT, "at most 100000, and 16 MB of text"),
    mapped(&["offset", "euler"], numbers(3, 3)),
    attribute(Support::Mapped, &["sep"], Takes::Text, "between names and the numbers of copies"),
    CHILDCLASS,
];

const BODY: &[Attribute] = &[
    attribute(
        Support::Approximated,
        &["mocap"],
        Takes::Only(&["false"]),
        "it stays where it is: nothing is moved from outside",
    ),
    attribute(Support::Approximated, &["gravcomp"], Takes::Only(&["0"]), "everything has its whole weight"),
    ignored(&["sleep"], "every free body of a scene may sleep at rest"),
    ignored(&["simple", "fuse"], "they change how MuJoCo computes, not what"),
    USER,
];

const JOINT: &[Attribute] = &[
    attribute(
        Support::Mapped,
        &["type"],
        Takes::Word(&["free", "hinge", "slide", "ball"]),
        "a `ball` becomes three hinges, about x, y and z, without limits; a `free` one has neither springs nor damping",
    ),
    mapped(&["pos"], numbers(3, 3)),
    mapped(&["axis"], Takes::Direction(3)),
    mapped(&["range"], numbers(2, 2)),
    mapped(&["limited"], MAYBE),
    mapped(&["stiffness", "damping", "frictionloss", "armature"], AMOUNT),
    mapped(&["springref"], NUMBER),
    attribute(Support::Mapped, &["ref"], NUMBER, "not in a robot's file"),
    attribute(
        Support::Mapped,
        &["springdamper"],
        Takes::Numbers { least: 2, most: 2, sign: Sign::NotNegative },
        "of the inertia that the joint moves at first; not in a robot's file",
    ),
    attribute(Support::Approximated, &["margin"], Takes::Only(&["0"]), "a limit acts at the limit"),
    approximated(
        &["solreflimit", "solimplimit", "solreffriction", "solimpfriction"],
        "limits and friction of joints are hard",
    ),
    attribute(
        Support::Mapped,
        &["actuatorfrcrange"],
        numbers(2, 2),
        "of the form `-x x`; others are refused",
    ),
    mapped(&["actuatorfrclimited"], MAYBE),
    attribute(
        Support::Approximated,
        &["actuatorgravcomp"],
        Takes::Only(&["false"]),
        "everything has its whole weight",
    ),
    ignored(&["group"], "joints are not drawn"),
    USER,
];

const GEOM: &[Attribute] = &[
    attribute(
        Support::Mapped,
        &["type"],
        Takes::Word(&["plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf"]),
        "`hfield` and `sdf` are refused; meshes and ellipsoids collide as their hulls, planes as slabs 2 m thick without an end, whatever is drawn of them; planes are refused on what a joint moves",
    ),
    mapped(&["size"], Takes::Numbers { least: 1, most: 3, sign: Sign::NotNegative }),
    mapped(&["fromto"], numbers(6, 6)),
    mapped(&["mass", "density"], AMOUNT),
    only(&["shellinertia"], &["false"], "geoms are filled evenly"),
    mapped(&["friction"], Takes::Numbers { least: 1, most: 3, sign: Sign::NotNegative }),
    mapped(&["condim"], Takes::Word(&["1", "3", "4", "6"])),
    mapped(&["priority"], NUMBER),
    mapped(&["contype", "conaffinity"], AMOUNT),
    attribute(
        Support::Approximated,
        &["margin", "gap"],
        Takes::Only(&["0"]),
        "contacts begin where surfaces meet",
    ),
    approximated(
        &["solref", "solimp", "solmix"],
        "every contact is as soft as a hundred times the lighter body's weight makes it sink 9 mm",
    ),
    only(&["surfacevel"], &["0 0 0"], "surfaces do not run"),
    only(&["adhesion"], &["0"], "nothing sticks"),
    mapped(&["mesh"], Takes::NameOf("mesh")),
    refused(&["hfield"], "write a height field as boxes or as meshes"),
    ignored(&["fitscale"], "it is for shapes fitted to meshes, which are refused"),
    mapped(&["material"], Takes::NameOf("material")),
    attribute(
        Support::Mapped,
        &["rgba"],
        COLOR,
        "with an alpha below 0.995 it is blended as in MuJoCo; depth and ids are those of what is behind",
    ),
    attribute(
        Support::Mapped,
        &["group"],
        NUMBER,
        "groups above 2 are not drawn, as in MuJoCo, unless the `<numeric>` `drawn_groups` chooses others",
    ),
    ignored(&["fluidshape", "fluidcoef"], "there is no medium"),
    USER,
];

const SITE: &[Attribute] = &[
    mapped(&["type"], Takes::Word(&["sphere", "capsule", "ellipsoid", "cylinder", "box"])),
    mapped(&["size"], Takes::Numbers { least: 1, most: 3, sign: Sign::NotNegative }),
    refused(&["fromto"], "state pos, a rotation and size"),
    refused(&["mesh"], "use another type"),
    ignored(&["group", "material", "rgba"], "sites are not drawn"),
    USER,
];

const LIGHT: &[Attribute] = &[
    mapped(&["pos"], numbers(3, 3)),
    mapped(&["dir"], Takes::Direction(3)),
    attribute(
        Support::Mapped,
        &["type"],
        Takes::Word(&["spot", "directional", "point", "image"]),
        "`image` gives no light",
    ),
    mapped(&["directional", "active"], BOOLEAN),
    attribute(
        Support::Mapped,
        &["castshadow"],
        BOOLEAN,
        "directional lights: within 2.5 m of the robots; spots: up to 75 degrees from their direction, and so do points",
    ),
    mapped(&["ambient", "diffuse", "specular", "attenuation"], numbers(3, 3)),
    mapped(&["cutoff", "exponent"], AMOUNT),
    attribute(
        Support::Approximated,
        &["mode"],
        Takes::Only(&["fixed"]),
        "a light is fixed to its body, and shines at the first place of its target",
    ),
    mapped(&["target"], Takes::Text),
    ignored(&["texture", "intensity", "range", "bulbradius"], "MuJoCo's renderer does not read them either"),
    USER,
];

const CAMERA: &[Attribute] = &[
    NAME,
    mapped(&["pos"], numbers(3, 3)),
    mapped(&["quat"], Takes::Quaternion),
    mapped(&["xyaxes"], Takes::Axes),
    ignored(
        &["axisangle", "euler", "zaxis"],
        "nobody looks through it; `third_person` and `egocentric` use quat or xyaxes",
    ),
    mapped(&["fovy"], Takes::Numbers { least: 1, most: 1, sign: Sign::Positive }),
    mapped(&["resolution"], Takes::Numbers { least: 2, most: 2, sign: Sign::Positive }),
    ignored(
        &["focal", "focalpixel", "principal", "principalpixel", "sensorsize"],
        "nobody looks through it; `third_person` and `egocentric` use fovy",
    ),
    only(&["orthographic"], &["false"], "every camera has a perspective"),
    only(&["projection"], &["perspective"], "every camera has a perspective"),
    attribute(Support::Approximated, &["mode"], Takes::Only(&["fixed"]), "a camera is fixed to its body"),
    approximated(&["target"], "a camera is fixed to its body"),
    ignored(&["class", "ipd", "output"], "they say nothing of the picture"),
    USER,
];
