//! Taking and letting go of bars that partners hold, too: hands give way to what they feel, so that nobody is pulled.

use tandem_sim::{Pose, Vector};

use super::bar::BarGrasp;
use super::commander::{Commander, HandMove};
use crate::players::PlayerError;
use crate::scoring::{Facts, Grip};

const ATTEMPTS: usize = 4;
/// How far from a bar hands begin to come at it.
const STANDOFF_M: f32 = 0.08;
/// One step of a soft grasp; fingers close over the first of them.
const GIVE_S: f32 = 0.1;
const GIVES: usize = 16;
const CLOSING_GIVES: usize = 6;
/// A wrist gives way by a metre for so many newtons in each step, and by no more than this.
const STIFFNESS_N_M: f32 = 300.0;
const MOST_GIVE_M: f32 = 0.01;
/// A wrist's goal is never farther than this from the wrist.
const LEASH_M: f32 = 0.03;

/// Closes all hands on their bars at once; hands that miss try again, while the others hold on.
pub fn grasp_compliantly(commander: &mut Commander, grasps: &[BarGrasp]) -> Result<(), PlayerError> {
    let mut missing = grasps.to_vec();
    for _ in 0..ATTEMPTS {
        let before = each(commander, &missing, |grasp, commander| grasp.before(commander, STANDOFF_M))?;
        commander.perform(0.9, &before)?;
        let around = each(commander, &missing, |grasp, commander| grasp.around(commander))?;
        commander.perform(0.5, &around)?;
        close_compliantly(commander, &missing, &around)?;
        let facts = commander.facts()?;
        missing = grasps.iter().copied().filter(|grasp| !grasp.is_held(&facts)).collect();
        if missing.is_empty() {
            return Ok(());
        }
        open_in_place(commander, &missing)?;
    }
    Err(PlayerError::GaveUp("not every hand could take its bar".into()))
}

/// Closes hands whose palms are at the bars, as `around` has them. Each wrist's goal makes up for what it is off, as the
/// hands of a robot are that has given way to partners, and gives way to what the hand feels.
fn close_compliantly(
    commander: &mut Commander,
    grasps: &[BarGrasp],
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
            // Up and down, a hand feels its weight.
            felt_n.z = 0.0;
            let given_m = goal.translation + (felt_n / STIFFNESS_N_M).clamp_length_max(MOST_GIVE_M);
            goal.translation = wrist.translation + (given_m - wrist.translation).clamp_length_max(LEASH_M);
            moves.push(HandMove { world_from_wrist: Some(*goal), ..grasp.closing(closed) });
        }
        commander.glide(GIVE_S, &moves)?;
    }
    Ok(())
}

fn all_hold(facts: &Facts, grasps: &[BarGrasp]) -> bool {
    grasps.iter().all(|grasp| grasp.is_held(facts))
}

/// Hands open where they are, for opening fingers push; then they rise. Those that still touch try it again, and give way
/// to what they are caught on.
pub fn let_go(commander: &mut Commander, grasps: &[BarGrasp]) -> Result<(), PlayerError> {
    open_in_place(commander, grasps)?;
    let away = each(commander, grasps, |grasp, commander| {
        let wrist = commander.world_from_wrist(grasp.robot, grasp.side)?;
        let raised = Pose::from_parts(wrist.translation + Vector::Z * 0.10, wrist.rotation);
        Ok(HandMove::reach(grasp.robot, grasp.side, raised))
    })?;
    commander.perform(1.0, &away)?;
    for attempt in 0..ATTEMPTS {
        let facts = commander.facts()?;
        let hooked: Vec<BarGrasp> = grasps
            .iter()
            .copied()
            .filter(|grasp| facts.object(grasp.object).hands[grasp.robot][grasp.side] != Grip::Off)
            .collect();
        if hooked.is_empty() {
            break;
        }
        // Back into the gap behind the bar, and out again, farther.
        let around = each(commander, &hooked, |grasp, commander| {
            Ok(HandMove { fingers_rad: grasp.open().fingers_rad, ..grasp.around(commander)? })
        })?;
        commander.perform(0.6, &around)?;
        let standoff_m = 0.10 + 0.02 * attempt as f32;
        let before = each(commander, &hooked, |grasp, commander| grasp.before(commander, standoff_m))?;
        commander.perform(0.8, &before)?;
    }
    for grasp in grasps {
        commander.set_compliance(grasp.robot, None);
    }
    let open: Vec<HandMove> = grasps.iter().map(BarGrasp::open).collect();
    commander.perform(0.5, &open)
}

/// Opens hands; the wrists stay wherever the fingers push them.
fn open_in_place(commander: &mut Commander, grasps: &[BarGrasp]) -> Result<(), PlayerError> {
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
    grasps: &[BarGrasp],
    part: impl Fn(&BarGrasp, &mut Commander) -> Result<HandMove, PlayerError>,
) -> Result<Vec<HandMove>, PlayerError> {
    grasps.iter().map(|grasp| part(grasp, commander)).collect()
}
