//! Videos for each task: one of a successful episode and one of a failed episode. A missing video is replaced
//! by the reason.

use std::path::PathBuf;

use tandem_episodes::{html::escape, pages::moments, tasks};

use crate::reports::evaluation::load::{FoundEpisode, LoadedEpisodes};
use crate::reports::evaluation::policy::{failure_cause, groups};

/// A place for a video on the page.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmPlace {
    pub task: String,
    /// True for the video of a successful episode.
    pub success: bool,
    /// The episode to show, or the reason why no episode can be shown.
    pub episode: Result<FilmedEpisode, String>,
}

/// An episode with a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmedEpisode {
    pub policy: String,
    pub seed: u32,
    /// Reason of its failure; `None` if it succeeded.
    pub why: Option<String>,
    pub recording: PathBuf,
}

/// A video with its place on the page.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    pub place: FilmPlace,
    /// The video, or the reason why it could not be made.
    pub content: Result<FilmContent, String>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct FilmContent {
    pub webp: Vec<u8>,
    pub speed_ratio: f64,
}

/// Returns two places for each played task. Each place has the first recorded episode of the first policy
/// that has a suitable one.
pub fn film_places(loaded: &LoadedEpisodes) -> Vec<FilmPlace> {
    let groups = groups(loaded.episodes.iter());
    let episodes: Vec<(&str, &FoundEpisode)> = groups
        .iter()
        .flat_map(|group| group.episodes.iter().map(|found| (group.name.as_str(), *found)))
        .collect();
    let mut places = Vec::new();
    for task in tasks::in_order(episodes.iter().map(|(_, found)| &found.played.spec.task)) {
        let played: Vec<_> =
            episodes.iter().copied().filter(|(_, found)| found.played.spec.task == *task).collect();
        if played.is_empty() {
            continue;
        }
        for success in [true, false] {
            let such = played.iter().copied().filter(|(_, found)| found.played.succeeded() == success);
            places.push(FilmPlace { task: task.id.clone(), success, episode: choose(success, such) });
        }
    }
    places
}

fn choose<'a>(
    success: bool,
    mut such: impl Iterator<Item = (&'a str, &'a FoundEpisode)> + Clone,
) -> Result<FilmedEpisode, String> {
    let what = if success { "succeeded" } else { "failed" };
    if such.clone().next().is_none() {
        return Err(format!("No episode {what}."));
    }
    let film = such.find_map(|(policy, found)| {
        Some(FilmedEpisode {
            policy: policy.into(),
            seed: found.played.spec.seed,
            why: (!success).then(|| failure_cause(&found.played)),
            recording: found.recording.clone()?,
        })
    });
    film.ok_or_else(|| {
        format!("No recording of an episode that {what} was kept; evaluate --record keeps them.")
    })
}

/// Renders the videos as a section of the page; empty if there are none.
pub fn html(films: &[Film]) -> String {
    if films.is_empty() {
        return String::new();
    }
    let mut cards = String::new();
    for of_task in films.chunk_by(|one, other| one.place.task == other.place.task) {
        let pair: String = of_task.iter().map(figure).collect();
        let task = of_task.first().map_or("", |film| film.place.task.as_str());
        cards += &format!(
            r#"<section class="card"><h3>{}</h3><div class="pair">{pair}</div></section>"#,
            escape(task)
        );
    }
    let faster = |film: &Film| film.content.as_ref().is_ok_and(|content| content.speed_ratio > 1.0);
    let speed = match films.iter().filter(|film| film.content.is_ok()).all(faster) {
        true => ", faster than it was",
        false => "",
    };
    format!(
        r#"<h2>One success and one failure of each task</h2><p class="soft">From the side{speed}.</p><div class="films">{cards}</div>"#
    )
}

fn figure(Film { place, content }: &Film) -> String {
    let (class, what) = if place.success { ("good", "success") } else { ("bad", "failure") };
    let (episode, film) = match (&place.episode, content) {
        (Ok(episode), Ok(film)) => (episode, film),
        (Err(reason), _) | (_, Err(reason)) => {
            return format!(r#"<p class="soft">No film of a {what}. {}</p>"#, escape(reason));
        }
    };
    let of = format!("{}, seed {}", escape(&episode.policy), episode.seed);
    let why = episode.why.as_ref().map(|why| format!(": {}", escape(why))).unwrap_or_default();
    let picture = moments::picture(&film.webp, &format!("A {what} at {}, {of}", escape(&place.task)));
    format!(
        r#"<figure>{picture}<figcaption><span class="{class}">{what}</span> <span class="soft">{of}{why} ({} times as fast)</span></figcaption></figure>"#,
        (10.0 * film.speed_ratio).round() / 10.0
    )
}
