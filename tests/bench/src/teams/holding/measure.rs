//! Drift of a team that was commanded to stand, and drift of its load.

use std::collections::VecDeque;

use tandem_sim::{CONTROL_HZ, Step, Vector};

/// Measurements of a team in which no robot fell.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct HoldResult {
    /// Largest horizontal distance of a pelvis from its position at the command to stand, or to set the
    /// object down.
    pub drift_m: f32,
    /// The same distance from the position [`RESTS_AFTER_S`] after the command.
    pub late_drift_m: f32,
    /// The same distance for the point at which the object is held, averaged over each second.
    pub load_drift_m: f32,
    /// Time after which all robots kept standing.
    pub standing_after_s: f32,
    /// Largest tilt of the object's vertical axis.
    pub tilt_deg: f32,
    /// Mean mechanical power of a robot.
    pub power_w: f32,
}

/// Time within which walking robots come to rest.
const RESTS_AFTER_S: f32 = 1.5;
const MEAN_STEPS: usize = CONTROL_HZ as usize;

/// Accumulator of the measurements, updated each control step.
pub(super) struct HoldMeasure<'a> {
    object: &'a str,
    team: &'a [usize],
    steps: u32,
    began_m: Vec<Vector>,
    rested_m: Vec<Vector>,
    /// Midpoint of the wrists at the command to stand, in the object's frame. A lower point would also
    /// measure the swing of a table.
    held_in_object_m: Vector,
    load_m: VecDeque<Vector>,
    load_rested_m: Option<Vector>,
    fell: bool,
    held: HoldResult,
}

impl<'a> HoldMeasure<'a> {
    /// Begins at the step of the command to stand. `began_m` has the pelvis positions from which drift is
    /// measured, if they differ from the positions in `begin`.
    pub(super) fn new(
        begin: &Step,
        object: &'a str,
        team: &'a [usize],
        began_m: Option<&[Vector]>,
    ) -> HoldMeasure<'a> {
        HoldMeasure {
            object,
            team,
            steps: 0,
            began_m: began_m.map_or_else(|| pelvises_m(begin, team), <[Vector]>::to_vec),
            rested_m: Vec::new(),
            held_in_object_m: held_in_object_m(begin, object, team),
            load_m: VecDeque::new(),
            load_rested_m: None,
            fell: false,
            held: HoldResult::default(),
        }
    }

    pub(super) fn add(&mut self, step: &Step) {
        self.steps += 1;
        let time_s = self.steps as f32 / CONTROL_HZ as f32;
        let at_m = pelvises_m(step, self.team);
        if time_s >= RESTS_AFTER_S && self.rested_m.is_empty() {
            self.rested_m.clone_from(&at_m);
        }
        self.held.drift_m = self.held.drift_m.max(farthest_m(&at_m, &self.began_m));
        self.held.late_drift_m = self.held.late_drift_m.max(farthest_m(&at_m, &self.rested_m));
        for robot in self.team {
            let robot = &step.robots[*robot];
            self.fell |= robot.truth.fallen;
            if robot.sensed.is_stepping == Some(true) {
                self.held.standing_after_s = time_s;
            }
            self.held.power_w += robot.sensed.power_w() / self.team.len() as f32;
        }
        if let Some(load) = step.object(self.object) {
            let upwards = load.world_from_object.rotation * Vector::Z;
            self.held.tilt_deg = self.held.tilt_deg.max(upwards.z.clamp(-1.0, 1.0).acos().to_degrees());
            self.add_load(time_s, load.world_from_object * self.held_in_object_m);
        }
    }

    fn add_load(&mut self, time_s: f32, at_m: Vector) {
        self.load_m.push_back(at_m);
        if self.load_m.len() > MEAN_STEPS {
            self.load_m.pop_front();
        }
        let mean_m = self.load_m.iter().copied().sum::<Vector>() / self.load_m.len() as f32;
        if time_s >= RESTS_AFTER_S + 1.0 {
            let rested_m = *self.load_rested_m.get_or_insert(mean_m);
            let away_m = (mean_m - rested_m).truncate().length();
            self.held.load_drift_m = self.held.load_drift_m.max(away_m);
        }
    }

    /// Returns the measurements, or `None` if a robot fell.
    pub(super) fn held(self) -> Option<HoldResult> {
        let power_w = self.held.power_w / self.steps.max(1) as f32;
        (!self.fell).then_some(HoldResult { power_w, ..self.held })
    }
}

fn held_in_object_m(step: &Step, object: &str, team: &[usize]) -> Vector {
    let wrists_m = team
        .iter()
        .flat_map(|robot| step.robots[*robot].truth.world_from_wrist.map(|wrist| wrist.translation));
    let wrists_m: Vec<Vector> = wrists_m.collect();
    let middle_m = wrists_m.iter().copied().sum::<Vector>() / wrists_m.len() as f32;
    step.object(object).map_or(middle_m, |load| load.world_from_object.inverse() * middle_m)
}

fn pelvises_m(step: &Step, team: &[usize]) -> Vec<Vector> {
    team.iter().map(|robot| step.robots[*robot].truth.world_from_pelvis().translation).collect()
}

/// Returns the largest horizontal distance between corresponding points.
fn farthest_m(at_m: &[Vector], from_m: &[Vector]) -> f32 {
    at_m.iter().zip(from_m).map(|(at, from)| (*at - *from).truncate().length()).fold(0.0, f32::max)
}
