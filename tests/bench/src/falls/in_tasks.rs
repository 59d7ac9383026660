//! Bench of falls: robots that stagger through the worlds of the tasks, and other causes of falls.

use tandem_episodes::{EpisodeSpec, build_world, tasks};
use tandem_tools_spec::Protocol;

use super::{FALL_CASES, FallCase, FallPlace, FallTrial, FallsCase, FallsReport};
use crate::error::BenchError;
use crate::seeds::{is_asked, over_seeds};

/// First seed. No table of results uses this seed or a later one.
const FIRST_SEED: u32 = 2000;

/// Plays `episodes` episodes, spread evenly over the cases whose names contain one of the comma-separated
/// words of `filter`. Calls `done` after each case.
///
/// # Errors
///
/// Returns an error if no case matches `filter`, or a world cannot be built.
pub fn falls(
    episodes: usize,
    filter: &str,
    mut done: impl FnMut(&FallsCase),
) -> Result<FallsReport, BenchError> {
    let asked: Vec<(usize, &FallCase)> =
        FALL_CASES.iter().enumerate().filter(|(_, case)| is_asked(filter, case.name)).collect();
    if asked.is_empty() {
        let have = FALL_CASES.map(|case| case.name).join(", ");
        return Err(BenchError::NoCase { asked: filter.into(), have });
    }
    if episodes == 0 {
        return Err(BenchError::NoEpisodes);
    }
    let mut report = FallsReport { cases: Vec::new(), floor: Vec::new() };
    for (place, (number, case)) in asked.iter().enumerate() {
        let count = episodes / asked.len() + usize::from(place < episodes % asked.len());
        let seeds = FIRST_SEED..=FIRST_SEED - 1 + count as u32;
        let trials = over_seeds(&seeds, |seed| trial(case, *number, seed));
        let mut trials = trials.into_iter().collect::<Result<Vec<FallTrial>, _>>()?;
        let figures = FallsCase::of(case.name, &trials);
        done(&figures);
        report.cases.push(figures);
        for trial in &mut trials {
            let told = trial.floor.take();
            report.floor.extend(told.map(|told| (trial.clone(), told)));
        }
    }
    Ok(report)
}

/// Plays one episode of a case. Cases in the worlds of tasks cycle through all tasks, each case from a
/// different first task.
fn trial(case: &FallCase, number: usize, seed: u32) -> Result<FallTrial, BenchError> {
    let episode = seed - FIRST_SEED;
    let (mut world, budget_steps, place) = match case.place {
        FallPlace::Task | FallPlace::TaskFromAbove => {
            let task = &tasks::cohub()[(number + episode as usize) % tasks::cohub().len()];
            let built = build_world(&EpisodeSpec::new(task, seed, Protocol::Benchmark)).map_err(Box::new)?;
            (built.world, task.benchmark_steps, task.id.as_str())
        }
        FallPlace::Floor | FallPlace::OnRobot | FallPlace::TableOnRobot | FallPlace::Door => {
            (case.world()?, 0, case.name)
        }
    };
    let trial = case.play(&mut world, budget_steps, u64::from(seed));
    Ok(FallTrial { played: format!("{place} seed {seed}"), ..trial })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_measures_no_falls_is_refused() {
        let refusal = |episodes, filter| falls(episodes, filter, |_| ()).expect_err("refused").to_string();
        let unknown = refusal(60, "nonsense");
        assert!(unknown.contains("`nonsense`") && unknown.contains("table_on_robot"), "{unknown}");
        assert!(refusal(0, "door").contains("at least 1"));
    }

    /// Plays four episodes of every case; episodes in tasks use the whole step budget. `tandem bench falls
    /// --episodes 1000` plays more.
    #[test]
    fn falls_stay_finite_slow_shallow_and_make_no_energy() {
        let report = falls(60, "", |case| println!("{case}")).expect("worlds");
        assert!(report.cases.iter().map(|case| case.fallen).sum::<usize>() > 30, "robots fell");
        for case in report.cases {
            let greatest = format!("{}: {:#?}", case.case, case.greatest);
            assert_eq!(case.diverged_at, Vec::<String>::new(), "{greatest}");
            assert_eq!(case.broken, Default::default(), "speed, energy, depth, range of {greatest}");
        }
    }

    /// Regression test. In the first episode, the solver added 25.8 J to 190 J, because its sweeps had not
    /// converged. In the next three, a crushed finger left its range by up to 0.46 rad. In the last, waist
    /// and shoulder swing an arm, which accelerates wrist and finger to two and three times the speed limits
    /// of their motors. The tip reached 26.8 m/s when motors braked with no more than their driving torque.
    #[test]
    fn hard_falls_keep_to_the_limits() {
        let hard = [
            ("drop_on_furniture", 2050),
            ("stagger_1.0_500ms", 2056),
            ("stagger_jumps", 2030),
            ("drop_on_robot", 2040),
            ("stagger_jumps", 2055),
        ];
        for (name, seed) in hard {
            let mut cases = FALL_CASES.iter().enumerate();
            let (number, case) = cases.find(|(_, case)| case.name == name).expect("a case");
            let trial = trial(case, number, seed).expect("a world");
            assert_eq!(trial.extremes.broken(), [false; 4], "speed, energy, depth, range of {trial:#?}");
        }
    }
}
