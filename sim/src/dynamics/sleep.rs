//! Sleep: free bodies at rest are left out of steps until a moving body comes near.
//!
//! A body falls asleep, together with all bodies near it, when all of them have been still for a while. It
//! keeps its contacts, and its velocity is exactly zero. It wakes when its bounds meet those of an awake
//! body, or when its state is set. All of this depends on the state alone, so a restored world continues
//! exactly like the original.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::Dynamics;
use super::contacts::collision::Manifold;
use super::contacts::{ContactPoint, colliders_of};
use super::rest::Rest;
use super::trees::TreeId;
use super::trees::tree::Tree;

/// Contacts of sleeping bodies, in the order of their colliders.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SleepingContacts {
    manifolds: Vec<Manifold>,
    pub(super) touches: Vec<ContactPoint>,
}

impl Dynamics {
    /// Lets a tree sleep if it is a lone free body without equalities. Call it before the first step.
    pub fn let_sleep(&mut self, id: TreeId) {
        let tree = &mut self.trees.all[id.index()];
        if tree.is_lone() && !self.solver.equalities.hold(id) {
            tree.rest = Some(Rest::default());
        }
    }

    /// Wakes a body and all sleeping bodies that it touches, directly or through others.
    pub(super) fn wake(&mut self, id: TreeId) {
        let mut woken = BTreeSet::from([id]);
        loop {
            let before = woken.len();
            for manifold in &self.sleeping.manifolds {
                let trees = self.collision.trees_of(manifold.colliders);
                if trees.iter().flatten().any(|tree| woken.contains(tree)) {
                    woken.extend(trees.into_iter().flatten());
                }
            }
            if woken.len() == before {
                break;
            }
        }
        for tree in &woken {
            if let Some(rest) = &mut self.trees.all[tree.index()].rest {
                *rest = Rest::default();
            }
        }
        let Dynamics { collision, solver, sleeping, .. } = self;
        let is_woken =
            |colliders| collision.trees_of(colliders).iter().flatten().any(|id| woken.contains(id));
        let manifolds: Vec<Manifold> =
            sleeping.manifolds.extract_if(.., |manifold| is_woken(manifold.colliders)).collect();
        solver.touches.extend(sleeping.touches.extract_if(.., |touch| is_woken(touch.colliders)));
        solver.touches.sort_by_key(colliders_of);
        collision.manifolds.extend(manifolds);
        collision.manifolds.sort_by_key(|manifold| manifold.colliders);
    }

    /// Wakes all sleeping bodies whose bounds meet those of an awake body. All surfaces must be placed.
    pub(super) fn wake_near(&mut self) {
        if !self.trees.all.iter().any(Tree::is_asleep) {
            return;
        }
        loop {
            let found = self.collision.meeting_trees().find_map(|pair| self.sleeper_beside_awake(pair));
            let Some(id) = found else { return };
            self.wake(id);
        }
    }

    /// Returns the sleeping one of two bodies if the other is awake.
    fn sleeper_beside_awake(&self, pair: [TreeId; 2]) -> Option<TreeId> {
        let [a, b] = pair.map(|id| self.trees.all[id.index()].is_asleep());
        (a != b).then(|| if a { pair[0] } else { pair[1] })
    }

    /// Counts still steps at the end of a step. Bodies that are ready fall asleep, together with all bodies
    /// near them.
    pub(super) fn fall_asleep(&mut self) {
        let mut is_ready = false;
        let (moving_v, final_v) = (&self.moving_v, &self.final_v);
        for (tree, range) in self.trees.ranges() {
            let Some(rest) = tree.rest.as_mut().filter(|rest| !rest.is_asleep) else { continue };
            let speeds = moving_v[range.clone()].iter().chain(&final_v[range]);
            rest.count(speeds.fold(0.0, |most, v| v.abs().max(most)));
            is_ready |= rest.is_ready();
        }
        if is_ready {
            let sleepers = self.sleepers();
            self.put_to_sleep(&sleepers);
        }
    }

    /// Returns the bodies that are ready to sleep and are not near any body that is not ready.
    fn sleepers(&self) -> BTreeSet<TreeId> {
        let rest = |id: &TreeId| self.trees.all[id.index()].rest;
        let is_ready = |id: &TreeId| rest(id).is_some_and(Rest::is_ready);
        let mut ready: BTreeSet<TreeId> = self
            .trees
            .ids()
            .filter(|id| is_ready(id) && !rest(id).is_some_and(|rest| rest.is_asleep))
            .collect();
        loop {
            let before = ready.len();
            for pair in self.collision.meeting_trees() {
                if ready.contains(&pair[0]) != ready.contains(&pair[1]) {
                    ready.remove(&pair[0]);
                    ready.remove(&pair[1]);
                }
            }
            if ready.len() == before {
                return ready;
            }
        }
    }

    fn put_to_sleep(&mut self, sleepers: &BTreeSet<TreeId>) {
        for id in sleepers {
            let tree = &mut self.trees.all[id.index()];
            if let Some(rest) = &mut tree.rest {
                rest.is_asleep = true;
            }
            tree.v.fill(0.0);
            tree.kinematics();
        }
        let Dynamics { collision, solver, sleeping, .. } = self;
        let manifolds = std::mem::take(&mut collision.manifolds);
        let sleeps =
            |colliders| collision.trees_of(colliders).iter().flatten().any(|tree| sleepers.contains(tree));
        sleeping.touches.extend(solver.touches.extract_if(.., |touch| sleeps(touch.colliders)));
        // Points of one pair of colliders keep their order.
        sleeping.touches.sort_by_key(colliders_of);
        let (asleep, awake): (Vec<_>, Vec<_>) =
            manifolds.into_iter().partition(|manifold| sleeps(manifold.colliders));
        collision.manifolds = awake;
        sleeping.manifolds.extend(asleep);
        sleeping.manifolds.sort_by_key(|manifold| manifold.colliders);
    }

    /// Returns the state of bodies that may sleep, in the order of the trees.
    pub(super) fn rests(&self) -> Vec<Rest> {
        self.trees.all.iter().filter_map(|tree| tree.rest).collect()
    }

    /// Returns a view of the state of all bodies that may sleep, for immediate serialisation. Returns `None`
    /// in a world without such bodies.
    pub fn resting(&self) -> Option<impl Serialize> {
        let rests = self.rests();
        (!rests.is_empty()).then_some((rests, &self.sleeping))
    }
}

#[cfg(test)]
mod tests {
    use rapier3d::glamx::{DPose3, DVec3};

    use crate::dynamics::tests::bench::{Bench, DOWN, sliding};
    use crate::dynamics::{DynamicsState, TreeId};

    const HALF_M: f64 = 0.1;

    /// Builds boxes on a floor, each at a height and a position along x.
    fn boxes(places_m: &[[f64; 2]]) -> (Bench, Vec<TreeId>) {
        let mut bench = Bench::with_floor(DOWN, sliding(0.6));
        let add = |place: &[f64; 2]| {
            let at = DPose3::from_translation(DVec3::new(place[0], 0.0, place[1]));
            let id = bench.add_box(1.0, DVec3::splat(HALF_M), at, sliding(0.6));
            bench.dynamics.let_sleep(id);
            id
        };
        let ids = places_m.iter().map(add).collect();
        (bench, ids)
    }

    fn asleep(bench: &Bench, ids: &[TreeId]) -> Vec<bool> {
        ids.iter().map(|id| bench.dynamics.tree(*id).is_asleep()).collect()
    }

    fn bits(bench: &Bench) -> Vec<u8> {
        postcard::to_stdvec(&bench.dynamics.state()).expect("plain numbers")
    }

    fn kick(bench: &mut Bench, id: TreeId, velocity_m_s: DVec3) {
        let tree = bench.dynamics.tree_mut(id);
        let at = tree.world_from_link(0);
        tree.set_base(at, velocity_m_s, DVec3::ZERO);
    }

    /// The box beside the tower is too far away to touch it.
    const TOWER: [[f64; 2]; 3] = [[0.0, 0.101], [0.0, 0.302], [1.0, 0.101]];

    #[test]
    fn bodies_at_rest_sleep_where_they_rest_and_keep_their_contacts() {
        let (mut bench, ids) = boxes(&TOWER);
        assert_eq!(asleep(&bench, &ids), [false; 3], "a body that has only just been put there falls first");
        bench.run_s(1.0);
        assert_eq!(asleep(&bench, &ids), [true; 3]);
        let before: Vec<DVec3> = ids.iter().map(|id| bench.position_m(*id)).collect();
        assert!((before[1].z - 3.0 * HALF_M).abs() < 0.002, "{before:?}");
        bench.run_s(1.0);
        assert_eq!(ids.iter().map(|id| bench.position_m(*id)).collect::<Vec<_>>(), before);
        let pressed = bench.dynamics.touches().map(|touch| touch.normal_impulse_n_s).sum::<f64>() * 200.0;
        let weights_n = [1.0, 2.0, 1.0].iter().sum::<f64>() * 9.81;
        assert!((pressed - weights_n).abs() < 0.05 * weights_n, "{pressed} N");
    }

    #[test]
    fn a_body_that_is_hit_wakes_with_all_that_it_touches() {
        let (mut bench, ids) = boxes(&TOWER);
        bench.run_s(1.0);
        kick(&mut bench, ids[2], DVec3::new(-4.0, 0.0, 0.0));
        assert_eq!(asleep(&bench, &ids), [true, true, false]);
        bench.run_s(0.4);
        assert_eq!(asleep(&bench, &ids), [false; 3]);
        assert!(bench.position_m(ids[0]).x < -0.05, "{}", bench.position_m(ids[0]));
        bench.run_s(4.0);
        assert_eq!(asleep(&bench, &ids), [true; 3]);
    }

    #[test]
    fn a_body_falls_when_what_it_stands_on_is_taken_away() {
        let (mut bench, ids) = boxes(&TOWER);
        bench.run_s(1.0);
        let away = DPose3::from_translation(DVec3::new(-2.0, 0.0, 0.1));
        bench.dynamics.tree_mut(ids[0]).set_base(away, DVec3::ZERO, DVec3::ZERO);
        bench.run_s(1.0);
        assert!((bench.position_m(ids[1]).z - HALF_M).abs() < 0.002, "{}", bench.position_m(ids[1]));
    }

    /// One of two boxes side by side may not sleep. The other one then does not sleep either.
    #[test]
    fn a_body_stays_awake_beside_one_that_is() {
        let (mut bench, mut ids) = boxes(&[[0.0, 0.1]]);
        let beside = DPose3::from_translation(DVec3::new(0.2005, 0.0, 0.1));
        ids.push(bench.add_box(1.0, DVec3::splat(HALF_M), beside, sliding(0.6)));
        bench.run_s(1.0);
        assert_eq!(asleep(&bench, &ids), [false; 2]);
    }

    #[test]
    fn restored_sleepers_go_on_as_they_would_have() {
        for kept_s in [0.1, 0.5, 1.0, 1.3] {
            let (mut first, ids) = boxes(&TOWER);
            let go_on = |bench: &mut Bench| {
                bench.run_s(0.3);
                kick(bench, ids[2], DVec3::new(-4.0, 0.0, 0.0));
                bench.run_s(3.0);
            };
            first.run_s(kept_s);
            let state = postcard::to_stdvec(&first.dynamics.state()).unwrap();
            go_on(&mut first);
            let (mut second, _) = boxes(&TOWER);
            kick(&mut second, ids[0], DVec3::X);
            second.run_s(2.0);
            let state: DynamicsState = postcard::from_bytes(&state).unwrap();
            second.dynamics.restore(&state).unwrap();
            go_on(&mut second);
            assert_eq!(bits(&first), bits(&second), "kept after {kept_s} s");
        }
    }
}
