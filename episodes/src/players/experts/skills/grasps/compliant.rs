//! Compliant grasp and release of objects that partners also hold. Hands yield to the sensed forces, so that
//! no robot is pulled.

use tandem_sim::Vector;

use super::grasp::HandGrasp;
use crate::players::PlayerError;
use crate::players::experts::skills::commander::{Commander, HandMove};
use crate::scoring::{Facts, Grip};

const ATTEMPTS: usize = 4;
/// Durations of the hands' motions: to their first stop, to the next stop, and from the last stop to the
/// place where they close.
const TO_FIRST_STOP_S: f32 = 0.9;
const BETWEEN_STOPS_S: f32 = 0.6;
const FROM_LAST_STOP_S: f32 = 0.5;
/// Time for hands to come to rest before they close. The goals then compensate the wrists' remaining error.
const SETTLE_S: f32 = 0.2;
/// Time that hands take to leave, all stops together.
const LEAVE_S: f32 = 1.2;
/// Duration of one step of a soft grasp; fingers close over the first `CLOSING_GIVES` steps.
const GIVE_S: f32 = 0.1;
const GIVES: usize = 16;
const CLOSING_GIVES: usize = 6;
/// Stiffness against which a wrist yields in each step; `MAX_GIVE_M` limits the distance.
const STIFFNESS_N_M: f32 = 300.0;
const MAX_GIVE_M: f32 = 0.01;
/// Maximum distance of a wrist's goal from the wrist.
const LEASH_M: f32 = 0.03;

/// Closes all hands on their places at once. All grasps have the same hold. Hands that miss try again while
/// the others hold on.
pub fn grasp_compliantly(commander: &mut Commander, grasps: &[HandGrasp]) -> Result<(), PlayerError> {
    grasp_from(commander, grasps, 0)
}

/// Closes hands that have already reached out to their first stops; see [`grasp_compliantly`].
pub fn grasp_reached(commander: &mut Commander, grasps: &[HandGrasp]) -> Result<(), PlayerError> {
    grasp_from(commander, grasps, 1)
}

/// Closes hands from stop number `first_stop` on; hands that miss start over from the first stop.
fn grasp_from(commander: &mut Commander, grasps: &[HandGrasp], first_stop: usize) -> Result<(), PlayerError> {
    let mut missing = grasps.to_vec();
    for attempt in 0..ATTEMPTS {
        let next_stop = if attempt == 0 { first_stop } else { 0 };
        for stop in next_stop..stops(&missing) {
            let before = each(commander, &missing, |grasp, commander| grasp.at_stop(commander, stop))?;
            commander.perform(if stop == 0 { TO_FIRST_STOP_S } else { BETWEEN_STOPS_S }, &before)?;
        }
        let around = each(commander, &missing, |grasp, commander| grasp.around(commander))?;
        commander.perform(FROM_LAST_STOP_S, &around)?;
        commander.perform(SETTLE_S, &around)?;
        close_compliantly(commander, &missing, &around)?;
        let facts = commander.facts()?;
        missing = grasps.iter().copied().filter(|grasp| !grasp.is_held(&facts)).collect();
        if missing.is_empty() {
            return Ok(());
        }
        open_in_place(commander, &missing)?;
    }
    Err(PlayerError::GaveUp("not every hand could take hold".into()))
}

/// Closes hands at the poses in `around`. Each wrist's goal compensates for its position error, for example
/// after it has yielded to partners. It also yields to the forces that the hand senses.
fn close_compliantly(
    commander: &mut Commander,
    grasps: &[HandGrasp],
    around: &[HandMove],
) -> Result<(), PlayerError> {
    let mut goals = Vec::with_capacity(grasps.len());
    for (grasp, reach) in grasps.iter().zip(around) {
        let now = commander.world_from_wrist(grasp.robot, grasp.side)?;
        let mut goal = reach.world_from_wrist.unwrap_or(now);
        goal.translation += goal.translation - now.translation;
        goals.push(goal);
    }
    for step in 1..=GIVES {
        let facts = commander.facts()?;
        if step > CLOSING_GIVES + 1 && all_hold(&facts, grasps) {
            break;
        }
        let closed = (step as f32 / CLOSING_GIVES as f32).min(1.0);
        let mut moves = Vec::with_capacity(grasps.len());
        for (grasp, goal) in grasps.iter().zip(&mut goals) {
            let wrist = commander.world_from_wrist(grasp.robot, grasp.side)?;
            let mut felt_n = facts.robots[grasp.robot].hand_force_n[grasp.side];
            // The vertical force includes the hand's weight.
            felt_n.z = 0.0;
            let given_m = goal.translation + (felt_n / STIFFNESS_N_M).clamp_length_max(MAX_GIVE_M);
            goal.translation = wrist.translation + (given_m - wrist.translation).clamp_length_max(LEASH_M);
            moves.push(HandMove { world_from_wrist: Some(*goal), ..grasp.closing(closed) });
        }
        commander.glide(GIVE_S, &moves)?;
    }
    Ok(())
}

fn all_hold(facts: &Facts, grasps: &[HandGrasp]) -> bool {
    grasps.iter().all(|grasp| grasp.is_held(facts))
}

/// Returns the number of stops on the hands' way in; all grasps have the same hold.
fn stops(grasps: &[HandGrasp]) -> usize {
    grasps.first().map_or(0, |grasp| grasp.hold.stops_m.len())
}

/// Opens hands in place, because opening fingers push. The hands then leave by the stops by which they came.
/// Hands that still touch an object repeat this once, and yield to the obstacle.
pub fn let_go(commander: &mut Commander, grasps: &[HandGrasp]) -> Result<(), PlayerError> {
    open_in_place(commander, grasps)?;
    for stop in (0..stops(grasps)).rev() {
        let away = each(commander, grasps, |grasp, commander| {
            let nearer_m = grasp.hold.stops_m.get(stop + 1).copied().unwrap_or(Vector::ZERO);
            grasp.off(commander, grasp.hold.stops_m[stop] - nearer_m)
        })?;
        commander.perform(LEAVE_S / stops(grasps) as f32, &away)?;
    }
    for _ in 0..ATTEMPTS {
        let facts = commander.facts()?;
        let hooked: Vec<HandGrasp> = grasps
            .iter()
            .copied()
            .filter(|grasp| facts.object(grasp.object).hands[grasp.robot][grasp.side] != Grip::Off)
            .collect();
        if hooked.is_empty() {
            break;
        }
        let around = each(commander, &hooked, |grasp, commander| {
            Ok(HandMove { fingers_rad: grasp.open().fingers_rad, ..grasp.around(commander)? })
        })?;
        commander.perform(0.6, &around)?;
        for stop in (0..stops(&hooked)).rev() {
            let away = each(commander, &hooked, |grasp, commander| grasp.at_stop(commander, stop))?;
            commander.perform(BETWEEN_STOPS_S, &away)?;
        }
    }
    for grasp in grasps {
        commander.set_compliance(grasp.robot, None);
    }
    let open: Vec<HandMove> = grasps.iter().map(HandGrasp::open).collect();
    commander.perform(0.5, &open)
}

/// Opens hands; the wrists stay wherever the fingers push them.
fn open_in_place(commander: &mut Commander, grasps: &[HandGrasp]) -> Result<(), PlayerError> {
    for _ in 0..6 {
        let moves = each(commander, grasps, |grasp, commander| {
            let wrist = commander.world_from_wrist(grasp.robot, grasp.side)?;
            Ok(HandMove { world_from_wrist: Some(wrist), ..grasp.open() })
        })?;
        commander.perform(0.1, &moves)?;
    }
    Ok(())
}

fn each(
    commander: &mut Commander,
    grasps: &[HandGrasp],
    part: impl Fn(&HandGrasp, &mut Commander) -> Result<HandMove, PlayerError>,
) -> Result<Vec<HandMove>, PlayerError> {
    grasps.iter().map(|grasp| part(grasp, commander)).collect()
}
