//! Elements beside the bodies: settings, defaults, assets, contacts, equalities, actuators and keys.

use super::{
    AMOUNT, ANY_NUMBERS, Attribute, BOOLEAN, CLASS, COLOR, Element, MAYBE, NAME, NUMBER, Sign, Support,
    Takes, USER, approximated, attribute, ignored, mapped, numbers, only, refused,
};

pub(super) const ELEMENTS: &[Element] = &[
    element(
        Support::Mapped,
        "mujoco",
        &[""],
        &[&[ignored(&["model"], "files are called by their names")]],
        "",
    ),
    element(
        Support::Mapped,
        "include",
        &["mujoco", "any"],
        &[&[mapped(&["file"], Takes::Text)]],
        "beside the file that includes it, or else beside the first; every file once, as in MuJoCo",
    ),
    element(Support::Mapped, "compiler", &["mujoco"], &[COMPILER], ""),
    element(Support::Ignored, "lengthrange", &["compiler"], &[], "it is for muscles"),
    element(Support::Mapped, "option", &["mujoco"], &[OPTION], ""),
    element(Support::Mapped, "flag", &["option"], &[FLAG], ""),
    element(Support::Ignored, "size", &["mujoco"], &[], "memory is taken as it is needed"),
    element(Support::Ignored, "statistic", &["mujoco"], &[], "it is for MuJoCo's viewer"),
    element(Support::Mapped, "visual", &["mujoco"], &[], ""),
    element(
        Support::Mapped,
        "headlight",
        &["visual"],
        &[HEADLIGHT],
        "of a scene; a scene with lights and without this has MuJoCo's own",
    ),
    viewer("global"),
    viewer("quality"),
    viewer("map"),
    viewer("scale"),
    viewer("rgba"),
    element(Support::Mapped, "custom", &["mujoco"], &[], ""),
    named(
        Support::Mapped,
        "numeric",
        &["custom"],
        "numeric",
        &[NUMERIC],
        "one called `actuator_speed_limit` has the speeds (rad/s or m/s) at which motors can push no further, one for each actuator in their order: from 80 % of it on a motor pushes less, it brakes with all it has, and from 120 % on, where something else turns it, with more; MuJoCo's motors have no such limit; one called `drawn_groups` has the groups of geoms that are drawn; others are ignored",
    ),
    named(
        Support::Mapped,
        "text",
        &["custom"],
        "text",
        &[&[NAME, mapped(&["data"], Takes::Text)]],
        "one called `material_patterns` has names of materials, each with its pattern behind it: `wood`, `fabric`, `print` or `tiles`; others are ignored",
    ),
    element(Support::Ignored, "tuple", &["custom"], &[], "nobody asks for it"),
    element(
        Support::Ignored,
        "sensor",
        &["mujoco"],
        &[],
        "robots sense what a real one does, whatever the file",
    ),
    element(Support::Mapped, "extension", &["mujoco"], &[], "its plugins are refused"),
    element(
        Support::Mapped,
        "default",
        &["mujoco", "default"],
        &[&[mapped(&["class"], Takes::Text)]],
        "classes inherit as in MuJoCo",
    ),
    element(Support::Mapped, "asset", &["mujoco"], &[], ""),
    named(
        Support::Mapped,
        "mesh",
        &["asset", "default"],
        "mesh",
        &[&[NAME, CLASS], MESH],
        "files are OBJ, STL and MSH; they lie where the compiler says, or beside an included file",
    ),
    named(
        Support::Mapped,
        "texture",
        &["asset"],
        "texture",
        &[&[NAME], TEXTURE],
        "images are PNG, JPEG or KTX2 without block compression; the first of type `skybox` is drawn where no surface is",
    ),
    named(Support::Mapped, "material", &["asset", "default"], "material", &[&[NAME, CLASS], MATERIAL], ""),
    element(
        Support::Mapped,
        "layer",
        &["material"],
        &[&[mapped(&["texture"], Takes::NameOf("texture")), mapped(&["role"], Takes::Word(ROLES))]],
        "all roles but `rgb` and `rgba` on images that are no six of a cube; `normal` not on cubes at all",
    ),
    element(Support::Refused, "hfield", &["asset"], &[], "write a height field as boxes or as meshes"),
    element(Support::Refused, "skin", &["asset", "deformable"], &[], "nothing bends or stretches here"),
    element(Support::Refused, "model", &["asset"], &[], "include the file, or let MuJoCo save the whole"),
    element(Support::Mapped, "contact", &["mujoco"], &[], ""),
    named(
        Support::Mapped,
        "exclude",
        &["contact"],
        "exclude",
        &[&[NAME, mapped(&["body1", "body2"], Takes::Text)]],
        "",
    ),
    named(
        Support::Mapped,
        "pair",
        &["contact", "default"],
        "pair",
        &[&[NAME, CLASS], PAIR],
        "the two geoms touch whatever their masks, joints and excludes; in a robot's file it does nothing",
    ),
    element(Support::Refused, "deformable", &["mujoco"], &[], "nothing bends or stretches here"),
    element(Support::Refused, "tendon", &["mujoco"], &[], "couple joints with an equality"),
    element(Support::Ignored, "tendon", &["default"], &[], "there are no tendons"),
    element(Support::Mapped, "equality", &["mujoco"], &[], "they are hard; a robot's file has none"),
    element(
        Support::Mapped,
        "equality",
        &["default"],
        &[&[refused(&["active"], "state it on each"), SOFTNESS]],
        "",
    ),
    named(Support::Mapped, "connect", &["equality"], "equality", &[EQUALITY, CONNECT], ""),
    named(Support::Mapped, "weld", &["equality"], "equality", &[EQUALITY, WELD], ""),
    named(Support::Mapped, "joint", &["equality"], "equality", &[EQUALITY, COUPLING], ""),
    element(Support::Refused, "tendon", &["equality"], &[], "use joint, weld or connect"),
    element(Support::Refused, "flex", &["equality"], &[], "use joint, weld or connect"),
    element(Support::Refused, "flexvert", &["equality"], &[], "use joint, weld or connect"),
    element(Support::Refused, "flexstrain", &["equality"], &[], "use joint, weld or connect"),
    element(Support::Refused, "distance", &["equality"], &[], "use joint, weld or connect"),
    element(
        Support::Mapped,
        "actuator",
        &["mujoco"],
        &[],
        "one a joint; in a default they state the same for actuators of every kind, as in MuJoCo",
    ),
    named(Support::Mapped, "motor", ACTUATORS, "actuator", &[ACTUATOR], "not in a robot's file"),
    named(
        Support::Mapped,
        "position",
        ACTUATORS,
        "actuator",
        &[ACTUATOR, POSITION],
        "of a robot's file all are of this kind",
    ),
    named(
        Support::Mapped,
        "general",
        ACTUATORS,
        "actuator",
        &[ACTUATOR, GENERAL],
        "with a fixed gain and no bias it is a motor, with a gain of k and a bias of `0 -k -d` a position; all others do nothing",
    ),
    other_actuator("velocity"),
    other_actuator("intvelocity"),
    other_actuator("damper"),
    other_actuator("orientation"),
    other_actuator("pid"),
    other_actuator("cylinder"),
    other_actuator("muscle"),
    other_actuator("adhesion"),
    other_actuator("dcmotor"),
    element(Support::Mapped, "keyframe", &["mujoco"], &[], ""),
    named(
        Support::Mapped,
        "key",
        &["keyframe"],
        "key",
        &[KEY],
        "a scene begins as its key `start` has it; actuators do what that key tells them, and from the `time` of every later key what that one does; a robot begins in the `qpos` of its file's first key",
    ),
];

const NUMERIC: &[Attribute] =
    &[NAME, mapped(&["data"], ANY_NUMBERS), ignored(&["size"], "there are as many as there are")];
const ACTUATORS: &[&str] = &["actuator", "default"];
const SOFTNESS: Attribute = approximated(&["solref", "solimp"], "equalities are hard");

const fn element(
    support: Support,
    name: &'static str,
    within: &'static [&'static str],
    attributes: &'static [&'static [Attribute]],
    note: &'static str,
) -> Element {
    Element { name, within, support, kind: None, attributes, note }
}

const fn named(
    support: Support,
    name: &'static str,
    within: &'static [&'static str],
    kind: &'static str,
    attributes: &'static [&'static [Attribute]],
    note: &'static str,
) -> Element {
    Element { name, within, support, kind: Some(kind), attributes, note }
}

const fn viewer(name: &'static str) -> Element {
    element(Support::Ignored, name, &["visual"], &[], "it is for MuJoCo's viewer")
}

const fn other_actuator(name: &'static str) -> Element {
    element(Support::Approximated, name, ACTUATORS, &[], "it does nothing; motor and position act")
}

const COMPILER: &[Attribute] = &[
    mapped(&["angle"], Takes::Word(&["degree", "radian"])),
    mapped(&["autolimits", "strippath"], BOOLEAN),
    mapped(&["eulerseq"], Takes::AxisSequence),
    mapped(&["meshdir", "texturedir", "assetdir"], Takes::Text),
    only(&["coordinate"], &["local"], "let MuJoCo 2.3.3 save the file"),
    mapped(&["inertiafromgeom"], MAYBE),
    attribute(
        Support::Mapped,
        &["inertiagrouprange"],
        numbers(2, 2),
        "where it is `0 0` and geoms of group 1 touch nothing, as in robosuite's and RoboCasa's files, group 0 is not drawn",
    ),
    mapped(&["settotalmass"], NUMBER),
    only(&["fitaabb", "alignfree"], &["false"], "shapes and frames are as the file states them"),
    only(&["convexhull"], &["true"], "meshes collide as their hulls"),
    attribute(
        Support::Approximated,
        &["balanceinertia"],
        Takes::Only(&["false"]),
        "masses and inertias stay as the file states them",
    ),
    attribute(
        Support::Approximated,
        &["boundmass", "boundinertia"],
        Takes::Only(&["0"]),
        "masses and inertias stay as the file states them",
    ),
    mapped(&["exactmeshinertia"], BOOLEAN),
    ignored(
        &["discardvisual", "usethread", "fusestatic", "saveinertial", "conflict"],
        "they change how MuJoCo computes, not what",
    ),
];

const HEADLIGHT: &[Attribute] =
    &[mapped(&["ambient", "diffuse", "specular"], numbers(3, 3)), mapped(&["active"], NUMBER)];

const OPTION: &[Attribute] = &[
    attribute(
        Support::Approximated,
        &["timestep"],
        Takes::Only(&["0.005"]),
        "every world is stepped by 5 ms",
    ),
    attribute(
        Support::Mapped,
        &["gravity"],
        numbers(3, 3),
        "of a scene; robots take things to weigh what they weigh on earth, whatever it is",
    ),
    attribute(Support::Approximated, &["wind"], Takes::Only(&["0 0 0"]), "there is no medium"),
    attribute(Support::Approximated, &["density", "viscosity"], Takes::Only(&["0"]), "there is no medium"),
    refused(&["actuatorgroupdisable"], "leave out actuators that should do nothing"),
    ignored(&["magnetic"], "nothing senses it"),
    ignored(&["o_margin", "o_solref", "o_solimp", "o_friction"], "the flag that would use them is refused"),
    ignored(
        &[
            "integrator",
            "cone",
            "impratio",
            "jacobian",
            "solver",
            "iterations",
            "tolerance",
            "ls_iterations",
            "ls_tolerance",
            "noslip_iterations",
            "noslip_tolerance",
            "ccd_iterations",
            "ccd_tolerance",
            "sdf_iterations",
            "sdf_initpoints",
            "sleep_tolerance",
            "apirate",
        ],
        "the solver is our own, with elliptic friction cones",
    ),
];

const FLAG: &[Attribute] = &[
    mapped(&["contact", "gravity"], Takes::Word(&["enable", "disable"])),
    only(
        &[
            "constraint",
            "equality",
            "frictionloss",
            "limit",
            "passive",
            "spring",
            "damper",
            "clampctrl",
            "actuation",
            "filterparent",
        ],
        &["enable"],
        "physics has all its parts",
    ),
    only(&["override", "ipc"], &["disable"], "contacts are those of the geoms"),
    ignored(
        &[
            "warmstart",
            "refsafe",
            "sensor",
            "midphase",
            "eulerdamp",
            "autoreset",
            "nativeccd",
            "island",
            "multiccd",
            "energy",
            "fwdinv",
            "invdiscrete",
            "sleep",
            "diagexact",
        ],
        "the solver is our own",
    ),
];

const MESH: &[Attribute] = &[
    mapped(&["file"], Takes::Text),
    attribute(Support::Mapped, &["vertex"], ANY_NUMBERS, "drawn as its hull"),
    approximated(&["face"], "a mesh of vertices is drawn as its hull"),
    mapped(&["scale"], numbers(3, 3)),
    mapped(&["refpos"], numbers(3, 3)),
    mapped(&["refquat"], Takes::Quaternion),
    attribute(
        Support::Approximated,
        &["inertia"],
        Takes::Only(&["convex", "exact"]),
        "a mesh weighs what its hull weighs, unless this is `exact`",
    ),
    approximated(&["maxhullvert"], "a hull has all the corners it needs"),
    refused(&["builtin", "params"], "write the mesh to a file"),
    refused(&["material"], "state it on the geoms"),
    ignored(&["content_type"], "the file's name says it"),
    ignored(&["normal", "texcoord"], "those of files are drawn"),
    attribute(
        Support::Approximated,
        &["smoothnormal"],
        Takes::Only(&["false"]),
        "without normals in the file, edges of up to 37 degrees are smooth, and others sharp",
    ),
];

const TEXTURE: &[Attribute] = &[
    mapped(&["file"], Takes::Text),
    mapped(&["type"], Takes::Word(&["2d", "cube", "skybox"])),
    attribute(
        Support::Mapped,
        &["builtin"],
        Takes::Word(&["none", "gradient", "checker", "flat"]),
        "drawn as MuJoCo draws it",
    ),
    mapped(&["rgb1", "rgb2", "markrgb"], numbers(3, 3)),
    mapped(&["mark"], Takes::Word(&["none", "edge", "cross", "random"])),
    mapped(&["random"], numbers(1, 1)),
    mapped(&["width", "height"], numbers(1, 1)),
    mapped(&["fileright", "fileleft", "fileup", "filedown", "filefront", "fileback"], Takes::Text),
    mapped(&["gridsize"], numbers(2, 2)),
    mapped(&["gridlayout"], Takes::Text),
    attribute(
        Support::Mapped,
        &["nchannel"],
        Takes::Word(&["1", "2", "3", "4"]),
        "with `4`, the alpha of images is blended; in MuJoCo only if the material's alpha is below 0.995, too",
    ),
    attribute(
        Support::Mapped,
        &["colorspace"],
        Takes::Word(&["auto", "linear", "sRGB"]),
        "in scenes with lights or a headlight, values of sRGB are converted to linear light, as in MuJoCo",
    ),
    ignored(&["class", "content_type", "hflip", "vflip"], "images are drawn as they are"),
];

const MATERIAL: &[Attribute] = &[
    mapped(&["texture"], Takes::NameOf("texture")),
    mapped(&["rgba"], COLOR),
    mapped(&["texrepeat"], numbers(1, 2)),
    mapped(&["texuniform"], BOOLEAN),
    attribute(
        Support::Mapped,
        &["emission", "specular", "shininess"],
        AMOUNT,
        "in scenes with lights or a headlight",
    ),
    attribute(
        Support::Mapped,
        &["roughness"],
        NUMBER,
        "by path tracing; elsewhere the highlights of materials without `shininess`",
    ),
    attribute(Support::Mapped, &["metallic"], NUMBER, "highlights and reflections in the surface's colour"),
    attribute(
        Support::Approximated,
        &["reflectance"],
        Takes::Only(&["0"]),
        "path tracing alone draws the mirror image, on solid planes and upper sides of boxes, without shadows in it",
    ),
];

/// Roles of a material's layers.
const ROLES: &[&str] =
    &["rgb", "rgba", "opacity", "normal", "roughness", "metallic", "orm", "occlusion", "emissive"];

const PAIR: &[Attribute] = &[
    mapped(&["geom1", "geom2"], Takes::NameOf("geom")),
    mapped(&["condim"], Takes::Word(&["1", "3", "4", "6"])),
    attribute(
        Support::Mapped,
        &["friction"],
        Takes::Numbers { least: 1, most: 5, sign: Sign::NotNegative },
        "the same along both tangents: the larger of its first and of its last two numbers",
    ),
    approximated(&["solref", "solreffriction", "solimp"], "contacts are as soft as those of the geoms"),
    approximated(&["margin", "gap"], "contacts begin where surfaces meet"),
];
const EQUALITY: &[Attribute] = &[NAME, CLASS, mapped(&["active"], BOOLEAN), SOFTNESS];
const CONNECT: &[Attribute] = &[
    mapped(&["body1", "body2"], Takes::Text),
    mapped(&["anchor"], numbers(3, 3)),
    refused(&["site1", "site2"], "use bodies and an anchor"),
];
const WELD: &[Attribute] = &[
    mapped(&["body1", "body2"], Takes::Text),
    mapped(&["relpose"], numbers(7, 7)),
    approximated(&["anchor"], "welds are hard, wherever they hold"),
    attribute(
        Support::Approximated,
        &["torquescale"],
        Takes::Only(&["1"]),
        "welds are hard, wherever they hold",
    ),
    refused(&["site1", "site2"], "use bodies"),
];
const COUPLING: &[Attribute] =
    &[mapped(&["joint1", "joint2"], Takes::Text), mapped(&["polycoef"], numbers(1, 5))];

const ACTUATOR: &[Attribute] = &[
    NAME,
    CLASS,
    mapped(&["joint"], Takes::Text),
    mapped(&["ctrlrange"], numbers(2, 2)),
    attribute(Support::Mapped, &["forcerange"], numbers(2, 2), "of the form `-x x`; others are refused"),
    mapped(&["ctrllimited", "forcelimited"], MAYBE),
    attribute(
        Support::Mapped,
        &["gear"],
        Takes::Numbers { least: 1, most: 6, sign: Sign::Any },
        "its first number; not in a robot's file",
    ),
    only(&["damping", "armature"], &["0"], "state it on the joint"),
    only(&["nsample", "interp", "delay"], &["0"], "commands act at once"),
    approximated(
        &["jointinparent", "tendon", "site", "refsite", "body", "slidersite", "cranksite", "cranklength"],
        "actuators act on joints; this one does nothing",
    ),
    ignored(&["lengthrange"], "it is for muscles"),
    ignored(&["group"], "actuators are not drawn"),
    USER,
];
const GENERAL: &[Attribute] = &[
    mapped(&["gainprm", "biasprm"], ANY_NUMBERS),
    mapped(&["gaintype", "biastype", "dyntype"], Takes::Text),
    approximated(&["dynprm", "actlimited", "actrange", "actdim", "actearly"], "no actuator has a state"),
];
const POSITION: &[Attribute] = &[
    mapped(&["kp", "kv"], AMOUNT),
    approximated(&["dampratio"], "of a robot's gains; elsewhere state kv, or nothing damps"),
    only(&["timeconst"], &["0"], "commands act at once"),
    mapped(&["inheritrange"], AMOUNT),
];

const KEY: &[Attribute] = &[
    NAME,
    mapped(&["time"], NUMBER),
    mapped(&["qpos", "qvel", "ctrl"], ANY_NUMBERS),
    approximated(&["act", "mpos", "mquat"], "no actuator has a state, and nothing is moved from outside"),
];
