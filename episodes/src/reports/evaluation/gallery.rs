//! Failures with their key moments, as small pictures.

use std::path::Path;

use image::imageops::{self, FilterType};

use super::load::{FoundEpisode, LoadedEpisodes};
use super::policy::{PolicyGroup, failure_cause, first_missed_phase, groups, succeeded};
use crate::output::webp;

/// One failed episode.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    pub policy: String,
    pub task: &'static str,
    pub seed: u32,
    /// Number of the first phase that counts and was not reached.
    pub phase: String,
    pub why: String,
    /// `None` where its strip cannot be read.
    pub picture: Option<FailurePicture>,
}

/// The strip of a failed episode, made small.
#[derive(Clone, Debug, PartialEq)]
pub struct FailurePicture {
    pub webp: Vec<u8>,
    pub width: u32,
    pub height: u32,
}

/// Columns of a strip are 400 pixels wide; on the page they need no more than this.
const SCALE: f64 = 0.5;

/// The failures that have a picture, `most` of them at most, by turns from every policy and task; those without one are
/// left out.
pub fn gallery(loaded: &LoadedEpisodes, most: usize) -> Vec<Failure> {
    let groups = groups(&loaded.episodes);
    let all: Vec<(Failure, &FoundEpisode)> = groups.iter().flat_map(failed).collect();
    let total = all.len();
    let turn = |index: usize| {
        let (failure, _) = &all[index];
        let earlier = all[..index].iter().filter(|(other, found)| {
            (&other.policy, other.task) == (&failure.policy, failure.task) && found.strip.is_some()
        });
        earlier.count()
    };
    let mut order: Vec<usize> = (0..total).filter(|index| all[*index].1.strip.is_some()).collect();
    order.sort_by_key(|index| turn(*index));
    order.truncate(most);
    order.sort_unstable();
    let pictured = order.into_iter().map(|index| {
        let (failure, found) = &all[index];
        Failure { picture: found.strip.as_deref().and_then(scaled_picture), ..failure.clone() }
    });
    pictured.collect()
}

fn failed<'a>(group: &PolicyGroup<'a>) -> Vec<(Failure, &'a FoundEpisode)> {
    let found = group.episodes.iter().filter(|found| !succeeded(&found.played));
    found.map(|found| (failure(group, found), *found)).collect()
}

fn failure(group: &PolicyGroup, found: &FoundEpisode) -> Failure {
    let spec = &found.played.spec;
    Failure {
        policy: group.name.clone(),
        task: spec.task.id,
        seed: spec.seed,
        phase: first_missed_phase(&found.played),
        why: failure_cause(&found.played),
        picture: None,
    }
}

/// `None` where the file is no picture.
fn scaled_picture(strip: &Path) -> Option<FailurePicture> {
    let strip = image::open(strip).ok()?.into_rgb8();
    let [width, height] =
        [strip.width(), strip.height()].map(|px| (f64::from(px) * SCALE).round().max(1.0) as u32);
    let small = imageops::resize(&strip, width, height, FilterType::Triangle);
    let webp = webp::picture(width, height, small.as_raw()).ok()?;
    Some(FailurePicture { webp, width, height })
}
