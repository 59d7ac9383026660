//! The benchmark's published numbers in their published units; degrees stay degrees. Nothing here is read
//! from a task.

/// Published numbers of a task.
pub struct Published {
    pub id: &'static str,
    pub robots: usize,
    /// Number of the scene in its source collection.
    pub scene: &'static str,
    pub episode_steps: u32,
    pub moves: &'static [Moves<'static>],
    /// True for each of the phases p1, p2 and p3 that requires more than one robot. Published only for tasks
    /// with two robots.
    pub collaborative: Option<[bool; 3]>,
}

/// Ranges from which one displacement is drawn uniformly for a group of objects.
#[derive(Debug, PartialEq)]
pub struct Moves<'a> {
    pub objects: &'a [&'a str],
    pub x_m: [f32; 2],
    pub y_m: [f32; 2],
    pub z_m: [f32; 2],
    pub yaw_deg: [f32; 2],
}

const fn moves(objects: &'static [&'static str], x_m: [f32; 2], y_m: [f32; 2]) -> Moves<'static> {
    Moves { objects, x_m, y_m, z_m: [0.0, 0.0], yaw_deg: [0.0, 0.0] }
}

const fn apple_in_tub(apple: &'static [&'static str]) -> Moves<'static> {
    moves(apple, [-0.008, 0.008], [-0.008, 0.008])
}

/// Published numbers of all tasks. Stacks move together with the containers on them; containers and trolleys
/// move together with their contents.
pub const TASKS: [Published; 10] = [
    Published {
        id: "handover",
        robots: 2,
        scene: "084",
        episode_steps: 1000,
        moves: &[
            moves(&["bottle"], [-0.025, 0.025], [-0.025, 0.025]),
            moves(&["target_pad"], [-0.025, 0.025], [-0.025, 0.025]),
        ],
        collaborative: Some([false, true, false]),
    },
    Published {
        id: "pouring",
        robots: 2,
        scene: "085",
        episode_steps: 1000,
        moves: &[
            Moves { yaw_deg: [-30.0, 30.0], ..moves(&["cup", "marble"], [-0.03, 0.03], [-0.06, 0.06]) },
            Moves { yaw_deg: [-30.0, 30.0], ..moves(&["glass"], [-0.03, 0.03], [-0.06, 0.06]) },
            moves(&["marble"], [-0.006, 0.006], [-0.006, 0.006]),
        ],
        collaborative: Some([false, false, true]),
    },
    Published {
        id: "frame_hang",
        robots: 2,
        scene: "136",
        episode_steps: 1000,
        moves: &[
            moves(&["frame", "frame_rack", "wall_peg"], [-0.05, 0.05], [-0.025, 0.025]),
            Moves { z_m: [-0.04, 0.0], ..moves(&["wall_peg"], [0.0, 0.0], [0.0, 0.0]) },
            moves(&["frame", "frame_rack"], [-0.03, 0.03], [-0.01, 0.01]),
        ],
        collaborative: Some([false, true, true]),
    },
    Published {
        id: "co_pouring",
        robots: 2,
        scene: "102",
        episode_steps: 1000,
        moves: &[
            moves(
                &["tub", "tub_stack", "apple_1", "apple_2", "apple_3", "apple_4", "apple_5", "apple_6"],
                [-0.02, 0.02],
                [-0.01, 0.01],
            ),
            moves(&["crate", "crate_stack"], [-0.06, 0.06], [-0.005, 0.005]),
            apple_in_tub(&["apple_1"]),
            apple_in_tub(&["apple_2"]),
            apple_in_tub(&["apple_3"]),
            apple_in_tub(&["apple_4"]),
            apple_in_tub(&["apple_5"]),
            apple_in_tub(&["apple_6"]),
        ],
        collaborative: Some([true, true, true]),
    },
    Published {
        id: "trash_collection",
        robots: 2,
        scene: "147",
        episode_steps: 1000,
        moves: &[
            moves(&["bin"], [-0.15, 0.15], [-0.15, -0.04]),
            moves(&["pet_bottle"], [-0.10, 0.10], [-0.04, 0.12]),
        ],
        collaborative: Some([false, false, true]),
    },
    Published {
        id: "cart_service",
        robots: 2,
        scene: "110",
        episode_steps: 2000,
        moves: &[
            moves(&["service_trolley", "bottle"], [-0.10, 0.10], [-0.30, 0.08]),
            moves(&["serving_patch"], [0.0, 0.0], [-0.16, -0.12]),
        ],
        collaborative: Some([false, false, false]),
    },
    Published {
        id: "co_carry",
        robots: 2,
        scene: "143",
        episode_steps: 1000,
        moves: &[moves(&["basket"], [-0.05, 0.05], [-0.05, 0.05])],
        collaborative: Some([true, true, true]),
    },
    Published {
        id: "table_align",
        robots: 2,
        scene: "115",
        episode_steps: 1100,
        moves: &[moves(&["office_table"], [-0.05, 0.05], [-0.05, 0.05])],
        collaborative: Some([true, true, true]),
    },
    Published {
        id: "move_house",
        robots: 3,
        scene: "098",
        episode_steps: 1500,
        moves: &[moves(&["console_table"], [-0.05, 0.05], [-0.05, 0.05])],
        collaborative: None,
    },
    Published {
        id: "big_table",
        robots: 3,
        scene: "046",
        episode_steps: 1000,
        moves: &[Moves { yaw_deg: [-4.0, 4.0], ..moves(&["round_table"], [-0.04, 0.04], [-0.04, 0.04]) }],
        collaborative: None,
    },
];

pub const HANDOVER_LIFT_M: f32 = 0.03;
pub const HANDOVER_PLACE_M: f32 = 0.06;
pub const POURING_LIFT_M: f32 = 0.03;
pub const POURING_TIP_DEG: f32 = 60.0;
pub const POURING_INSIDE_S: f64 = 0.5;
pub const FRAME_LIFT_M: f32 = 0.10;
pub const TUB_LIFT_M: f32 = 0.03;
pub const TUB_TIP_DEG: f32 = 25.0;
pub const BIN_LIFT_M: f32 = 0.02;
pub const BIN_DELIVERED_M: f32 = 0.25;
pub const BIN_RIM_ABOVE_BENCH_M: f32 = 0.01;
pub const TROLLEY_PARKED_M: f32 = 0.35;
pub const WINE_LIFT_M: f32 = 0.10;
pub const WINE_CARRIED_M: f32 = 0.15;
pub const WINE_PLACE_M: f32 = 0.06;
pub const BASKET_LIFT_M: f32 = 0.03;
pub const BASKET_BOUNDS_M: f32 = 0.15;
pub const BASKET_CLEAR_M: f32 = 0.01;
pub const BASKET_HEIGHT_M: f32 = 0.06;
pub const TABLE_LIFT_M: f32 = 0.03;
pub const TABLE_CLEAR_M: f32 = 0.01;
pub const TABLE_BEFORE_CHAIR_M: [f32; 2] = [0.335, 0.465];
pub const TABLE_ACROSS_M: f32 = 0.13;
pub const TABLE_HEIGHT_M: f32 = 0.04;
pub const TABLE_SQUARE_DEG: f32 = 4.0;
pub const CONSOLE_LIFT_M: f32 = 0.03;
pub const CONSOLE_CARRIED_M: f32 = 0.15;
/// Side length of the square floor mark for each foot.
pub const CONSOLE_MARK_M: f32 = 0.10;
pub const CONSOLE_HEIGHT_M: f32 = 0.04;
pub const DOOR_OPEN_RAD: f32 = 1.45;
pub const DOOR_OPEN_S: f64 = 0.5;
pub const ROUND_LIFT_M: f32 = 0.03;
pub const ROUND_CLEAR_M: f32 = 0.01;
pub const ROUND_HEIGHT_M: f32 = 0.05;

/// Limits on the final state of an object that stands or hangs.
pub struct AtRest {
    pub tilt_deg: f32,
    pub speed_m_s: f32,
    pub turning_rad_s: f32,
    pub released_s: f64,
}

pub const PLACED: AtRest = AtRest { tilt_deg: 15.0, speed_m_s: 0.05, turning_rad_s: 0.15, released_s: 0.2 };
pub const HUNG: AtRest = AtRest { tilt_deg: 35.0, speed_m_s: 0.20, turning_rad_s: 0.80, released_s: 0.2 };

pub const PHYSICS_HZ: f64 = 200.0;
pub const CONTROL_HZ: f64 = 50.0;
pub const CAMERA_PX: [u32; 2] = [320, 240];
pub const CAMERA_HORIZONTAL_FOV_DEG: f64 = 102.0;
pub const CAMERA_DOWN_DEG: f64 = 25.0;

/// Number of joints by group in a robot's state.
pub const STATE: [(&str, usize); 4] = [("leg", 12), ("waist", 3), ("arm", 14), ("hand", 14)];
/// Columns of an action row, in order: joints by group, then the base.
pub const ACTION: [(&str, usize); 3] = [("arm", 14), ("hand", 14), ("waist", 3)];
pub const ACTION_BASE: [&str; 4] = ["vx_m_s", "vy_m_s", "yaw_rate_rad_s", "pelvis_height_m"];

pub const AGENTIC_STEPS_PER_COMMAND: u32 = 25;
pub const AGENTIC_EPISODE_STEPS: u32 = 6000;
pub const AGENTIC_HOLD_STEPS: u32 = 300;
pub const AGENTIC_THINKING_S: u64 = 30 * 60;
pub const AGENTIC_SEEDS: (u32, u32) = (0, 9);
/// Maximum number of steps that a policy of the benchmark executes between observations.
pub const BENCHMARK_STEPS_PER_COMMAND: u32 = 50;
pub const BENCHMARK_SEEDS: (u32, u32) = (1, 100);
