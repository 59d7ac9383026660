//! The pace of a team along its path: from rest to rest, slower or at a stop where a robot lags.

/// Speed along a path, its acceleration, and its minimum.
const PACE_M_S: f64 = 0.2;
const ACCELERATION_M_S2: f64 = 0.2;
const CREEP_M_S: f64 = 0.02;
/// Lag of walking robots behind their commands, in commands.
const BEHIND_COMMANDS: usize = 2;

/// Progress along a path, and its speed.
#[derive(Debug, Default)]
pub struct PathPace {
    /// Distance that bases have been commanded to travel.
    pub gone_m: f64,
    /// That distance after each of the latest commands, the oldest first.
    latest_m: [f64; BEHIND_COMMANDS + 1],
    pub pace_m_s: f64,
    pub waited: u32,
}

impl PathPace {
    /// Advances for `time_s` along a path of `length_m`, at a fraction of the normal speed.
    pub fn go(&mut self, length_m: f64, share: f64, time_s: f64) {
        let left_m = length_m - self.gone_m;
        if share > 0.0 {
            let can_stop_m_s = (2.0 * ACCELERATION_M_S2 * left_m).sqrt().max(CREEP_M_S);
            let most_m_s = (PACE_M_S * share).max(CREEP_M_S);
            self.pace_m_s = (self.pace_m_s + ACCELERATION_M_S2 * time_s).min(can_stop_m_s).min(most_m_s);
            self.waited = 0;
        } else {
            (self.pace_m_s, self.waited) = (0.5 * self.pace_m_s, self.waited + 1);
        }
        self.pace_m_s = self.pace_m_s.min(left_m / time_s);
        self.gone_m += self.pace_m_s * time_s;
        self.follow();
    }

    /// Waits for one command, while robots catch up with earlier commands.
    pub fn stand(&mut self) {
        self.pace_m_s = 0.0;
        self.follow();
    }

    fn follow(&mut self) {
        self.latest_m.rotate_left(1);
        self.latest_m[BEHIND_COMMANDS] = self.gone_m;
    }

    /// Returns the distance that robots are expected to have travelled.
    pub fn expected_m(&self) -> f64 {
        self.latest_m[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_gone_from_rest_to_rest_and_waits() {
        let mut pace = PathPace::default();
        let mut paces = Vec::new();
        while 1.0 - pace.gone_m > 1e-9 {
            pace.go(1.0, 1.0, 0.26);
            paces.push(pace.pace_m_s);
        }
        assert!((pace.gone_m - 1.0).abs() < 1e-9 && paces.len() < 40, "{paces:?}");
        assert!(pace.expected_m() < 0.99, "robots are behind: {pace:?}");
        (0..BEHIND_COMMANDS).for_each(|_| pace.stand());
        assert!((pace.expected_m() - 1.0).abs() < 1e-9, "and catch up: {pace:?}");
        assert!(paces[0] < 0.06 && paces.iter().all(|pace| *pace <= PACE_M_S), "{paces:?}");
        let mut slowed = PathPace { gone_m: 0.3, pace_m_s: 0.2, ..PathPace::default() };
        slowed.go(1.0, 0.4, 0.26);
        assert!((slowed.pace_m_s - 0.4 * PACE_M_S).abs() < 1e-9, "{}", slowed.pace_m_s);
        let mut held_up = PathPace { gone_m: 0.5, pace_m_s: 0.2, ..PathPace::default() };
        for _ in 0..10 {
            held_up.go(1.0, 0.0, 0.26);
        }
        assert!(held_up.waited == 10 && held_up.gone_m < 0.56, "{}", held_up.gone_m);
    }
}
