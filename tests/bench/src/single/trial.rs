//! A trial: one case with one seed.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use tandem_sim::{
    BaseCommand, BaseVelocity, CONTROL_DT_S as DT_S, RobotCommand, RobotModel, RobotPlacement, RobotTruth,
    Sensing, Side, Sides, SimError, SplitMix64, Vector, World, WorldSpec, heading_rad, wrapped_rad,
};

use super::Subject;
use super::cases::{Case, Disturbance, PULL_RISE_S, Plan, PulledHands, STOP_S, pulse};
use super::measure::{SETTLE_S, Sample, measure};
use super::motion::ArmMotion;
use super::tour::{self, Leg};
use crate::report::CaseFigures;

const PUSH_S: f32 = 1.0;
/// Start of pulls at a standing robot, whose arms are held out by then.
const PULLS_AT_S: f32 = 4.0;

/// Runs the case for its whole duration. Returns `None` if the robot falls.
pub(super) fn run(
    case: &Case,
    seed: u32,
    model: &Arc<RobotModel>,
    subject: Subject,
    sensing: Sensing,
) -> Result<Option<CaseFigures>, SimError> {
    let case = &case.of_size(&model.scale);
    let placement = RobotPlacement { name: "A".into(), position_m: [0.0, 0.0], yaw_rad: 0.0 };
    let spec = WorldSpec { scene: "floor".into(), robots: vec![placement], objects: vec![] };
    let mut world = World::with_robot(&spec, model.clone())?;
    let (choice, mut motors) = match subject {
        Subject::Base(choice) => (choice, None),
        Subject::Motors(choice) => (choice, Some(choice.motor_controller()?)),
    };
    world.set_locomotion(0, choice.controller());
    world.set_sensing(sensing, seed);
    let mut random = SplitMix64(seed.into());
    let arms = ArmMotion::new(case.arms, model, &mut random);
    let legs = if let Plan::Tour(tour) = &case.plan { tour::legs(tour, &mut random) } else { Vec::new() };
    let direction = pull_direction(&mut random);
    for side in Side::BOTH {
        world.load_hand(0, side, case.hand_load_kg, model.hands[side].palm_in_wrist_m);
    }
    let rest = world.rest_command(0);
    let feet = world.robots()[0].model.soles.each_ref().map(|sole| sole.link);
    let mut robot = world.present().robots.remove(0);
    let mut log: Vec<Sample> = Vec::new();
    let mut work_j = 0.0;
    for step in 0..(case.duration_s / DT_S) as usize {
        let time_s = step as f32 * DT_S;
        if robot.truth.fallen {
            return Ok(None);
        }
        let heading_rad =
            unwrap(heading_rad(&robot.truth.world_from_pelvis()), log.last().map_or(0.0, |s| s.heading_rad));
        let base = match &case.plan {
            Plan::Pulse(axis) => pulse_command(pulse(*axis, seed, &model.scale), time_s, rest.base),
            _ => base_command(case, &world, &robot.truth, heading_rad, &legs, time_s, rest.base),
        };
        disturb(case, &mut world, seed, direction, &legs, time_s);
        let upper_rad = arms.at(&rest.upper_rad, time_s);
        work_j += robot.sensed.power_w() * DT_S;
        log.push(sample(&robot.truth, feet, heading_rad, base));
        if let Some(motors) = &mut motors {
            let setpoints = motors.act(world.robots()[0].body(), &upper_rad, &base);
            world.drive_motors(0, &[setpoints]);
        }
        robot = world.control_step(&[RobotCommand { upper_rad, base }])?.robots.remove(0);
    }
    let mut figures = CaseFigures { power_w: work_j / (log.len() as f32 * DT_S), ..CaseFigures::default() };
    measure(case, seed, &model.scale, &log, &legs, &mut figures);
    Ok(Some(figures))
}

fn sample(truth: &RobotTruth, feet: Sides<usize>, heading_rad: f32, command: BaseCommand) -> Sample {
    let pelvis = truth.world_from_pelvis();
    Sample {
        feet_m: feet.map(|link| truth.world_from_link[link].translation),
        pelvis_m: pelvis.translation,
        pelvis_tilt_rad: (pelvis.rotation * Vector::Z).z.min(1.0).acos(),
        heading_rad,
        command,
    }
}

/// Returns the command of a pulse that begins once the arms are held out.
fn pulse_command((velocity, pulse_s): (BaseVelocity, f32), time_s: f32, rest: BaseCommand) -> BaseCommand {
    let told = (SETTLE_S..SETTLE_S + pulse_s - 0.5 * DT_S).contains(&time_s);
    let BaseVelocity { vx_m_s, vy_m_s, yaw_rate_rad_s } = if told { velocity } else { BaseVelocity::STILL };
    BaseCommand { vx_m_s, vy_m_s, yaw_rate_rad_s, ..rest }
}

fn base_command(
    case: &Case,
    world: &World,
    truth: &RobotTruth,
    heading_rad: f32,
    legs: &[Leg],
    time_s: f32,
    rest: BaseCommand,
) -> BaseCommand {
    match &case.plan {
        Plan::Hold | Plan::Pulse(_) => rest,
        Plan::Move(velocity) if time_s > SETTLE_S && time_s < case.duration_s - STOP_S => {
            let BaseVelocity { vx_m_s, vy_m_s, yaw_rate_rad_s } = *velocity;
            BaseCommand { vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m: rest.pelvis_height_m }
        }
        Plan::Move(_) => rest,
        Plan::Squat { high_m, low_m } => {
            let middle = (case.duration_s / 3.0..case.duration_s * 2.0 / 3.0).contains(&time_s);
            BaseCommand { pelvis_height_m: if middle { *low_m } else { *high_m }, ..rest }
        }
        Plan::Tour(tour) => {
            let leg = ((time_s / tour.leg_s) as usize).min(legs.len() - 1);
            let pelvis_m = truth.world_from_pelvis().translation;
            let away_m = legs[leg].target_m - Vector::new(pelvis_m.x, pelvis_m.y, 0.0);
            tour::command(away_m, heading_rad, &world.robots()[0].base_limits(), rest.pelvis_height_m)
        }
    }
}

fn disturb(case: &Case, world: &mut World, seed: u32, direction: Vector, legs: &[Leg], time_s: f32) {
    let pulled_s =
        time_s - if matches!(case.plan, Plan::Hold | Plan::Pulse(_)) { PULLS_AT_S } else { 0.5 * SETTLE_S };
    let risen = (pulled_s / PULL_RISE_S).min(1.0);
    match &case.disturbance {
        Disturbance::Pull { force_n } if pulled_s > 0.0 => {
            pull(world, &Side::BOTH, direction * (force_n * risen));
        }
        Disturbance::LevelPull { force_n, hands, end_s } if pulled_s > 0.0 && time_s < *end_s => {
            let angle = TAU * seed as f32 / 10.0;
            let sides: &[Side] = match hands {
                PulledHands::Both => &Side::BOTH,
                PulledHands::One if seed.is_multiple_of(2) => &[Side::Left],
                PulledHands::One => &[Side::Right],
            };
            let towards = Vector::new(angle.cos(), angle.sin(), 0.0);
            pull(world, sides, towards * (force_n * risen));
        }
        Disturbance::Push { force_n } if (5.0..5.0 + PUSH_S).contains(&time_s) => {
            let angle = TAU * seed as f32 / 8.0;
            let force_n = Vector::new(angle.cos(), angle.sin(), 0.0) * *force_n;
            let point_m = Vector::new(0.0, 0.0, world.robots()[0].model.scale.length_m(0.1));
            push_published(world, "torso_link", point_m, force_n);
        }
        _ => {}
    }
    if let Plan::Tour(tour) = &case.plan {
        let leg = ((time_s / tour.leg_s) as usize).min(legs.len() - 1);
        let within_s = time_s - leg as f32 * tour.leg_s - legs[leg].punch_at_s;
        if (0.0..tour.punch_s - 0.5 * DT_S).contains(&within_s) {
            push_published(world, legs[leg].punched_link, Vector::ZERO, legs[leg].punch_n);
        }
    }
}

/// Pushes the link that has this name in the embedded robot's file during the next control step.
fn push_published(world: &mut World, name: &str, point_in_link_m: Vector, force_n: Vector) {
    let model = &world.robots()[0].model;
    let link = &model.links[model.published_link(name).unwrap_or_default()];
    let link = link.name.clone();
    world.push(0, &link, point_in_link_m, force_n);
}

/// Pulls at the palms of these hands during the next control step.
fn pull(world: &mut World, sides: &[Side], force_n: Vector) {
    for side in sides {
        let model = &world.robots()[0].model;
        let hand = &model.hands[*side];
        let (link, palm_m) = (model.links[hand.wrist].name.clone(), hand.palm_in_wrist_m);
        world.push(0, &link, palm_m, force_n);
    }
}

/// Returns a random direction at most 45 degrees above or below the horizontal.
fn pull_direction(random: &mut SplitMix64) -> Vector {
    let (angle, rise) = (random.uniform([0.0, TAU]), random.uniform([-PI / 4.0, PI / 4.0]));
    Vector::new(angle.cos() * rise.cos(), angle.sin() * rise.cos(), rise.sin())
}

fn unwrap(angle_rad: f32, last_rad: f32) -> f32 {
    last_rad + wrapped_rad(angle_rad - last_rad)
}
