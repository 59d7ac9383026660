//! Running episodes: their scenes, and their events over a WebSocket.

use std::{io, sync::Arc};

use axum::{
    extract::{Query, Request, State},
    http::header,
    response::{IntoResponse, Response},
};
use serde_json::{Value, json};
use tandem_episodes::live::{LiveEntry, LiveEvent, LiveScene};
use tandem_tools_spec::NextPhase;
use tokio::sync::{OwnedSemaphorePermit, broadcast::error::RecvError};

use super::{
    Wanted, blocking,
    socket::{PageSender, PageSocket, upgrade},
};
use crate::{
    hosting::{EpisodeThread, HostingError, LiveWatch},
    http::{app::AppState, problem::ApiError, watching::MAX_WATCHERS},
};

/// First number in an image message; a step message begins with 1.
const PICTURE_KIND: f32 = 2.0;

fn thread(app: &AppState, wanted: &Wanted) -> Result<Arc<EpisodeThread>, ApiError> {
    let id = wanted.episode.clone().unwrap_or_default();
    Ok(app.table.hosted(&id).map_err(|_| HostingError::UnknownEpisode { id })?.thread)
}

/// Returns the scene. Its header has the calls and phases so far.
pub async fn scene(State(app): State<AppState>, Query(wanted): Query<Wanted>) -> Result<Response, ApiError> {
    let LiveWatch { view, .. } = thread(&app, &wanted)?.watch().await?;
    app.textures.add(view.scene.textures());
    let message = blocking(move || {
        let story: Vec<&Value> = view.entries.iter().map(|entry| &entry.told).collect();
        let more = json!({
            "recorded": false, "story": story, "reached": view.phases, "result": view.result, "frames": 1,
        });
        let frame = view.now.frame(&view.scene);
        Ok(view.scene.message(more, &frame))
    });
    Ok(([(header::CONTENT_TYPE, "application/octet-stream")], message.await?).into_response())
}

/// Streams the events from now on.
pub async fn live(
    State(app): State<AppState>,
    Query(wanted): Query<Wanted>,
    request: Request,
) -> Result<Response, ApiError> {
    let thread = thread(&app, &wanted)?;
    let place = app.watchers.clone().try_acquire_owned();
    let place = place.map_err(|_| ApiError::Busy { limit: MAX_WATCHERS })?;
    let watch = thread.watch().await?;
    // A watcher must not keep the episode alive.
    drop(thread);
    upgrade(request, move |socket| serve(socket, watch, place))
}

async fn serve(socket: PageSocket, watch: LiveWatch, _place: OwnedSemaphorePermit) -> io::Result<()> {
    let PageSocket { mut sender, mut reader } = socket;
    tokio::select! {
        told = tell(&mut sender, watch) => {
            told?;
            sender.close().await
        }
        () = reader.gone() => Ok(()),
    }
}

/// Sends the events to a page until the episode ends. A slow page skips to the newest step.
async fn tell(sender: &mut PageSender, watch: LiveWatch) -> io::Result<()> {
    let LiveWatch { view, mut events } = watch;
    let scene = view.scene;
    let told_entries = view.entries.last().map_or(0, |entry| entry.entry);
    for entry in &view.entries {
        sender.text(entry.told.to_string()).await?;
    }
    for phase in &view.phases {
        sender.text(json!({ "kind": "phase", "phase": phase }).to_string()).await?;
    }
    if let Some(next) = &view.next_phase {
        tell_next(sender, next).await?;
    }
    sender.bytes(view.now.frame(&scene).to_vec()).await?;
    if let Some(result) = &view.result {
        sender.text(json!({ "kind": "ended", "result": result }).to_string()).await?;
    }
    loop {
        match events.recv().await {
            Ok(LiveEvent::Step(step)) => sender.bytes(step.frame(&scene).to_vec()).await?,
            Ok(LiveEvent::Entry(entry)) if entry.entry > told_entries => {
                tell_entry(sender, &scene, entry).await?
            }
            Ok(LiveEvent::Entry(_)) => {}
            Ok(LiveEvent::Phase(phase)) => {
                sender.text(json!({ "kind": "phase", "phase": phase }).to_string()).await?
            }
            Ok(LiveEvent::NextPhase(next)) => tell_next(sender, &next).await?,
            Ok(LiveEvent::Ended(result)) => {
                sender.text(json!({ "kind": "ended", "result": *result }).to_string()).await?
            }
            Err(RecvError::Lagged(_)) => {}
            Err(RecvError::Closed) => return Ok(()),
        }
    }
}

async fn tell_next(sender: &mut PageSender, next: &NextPhase) -> io::Result<()> {
    sender.text(json!({ "kind": "next_phase", "phase": next }).to_string()).await
}

async fn tell_entry(sender: &mut PageSender, scene: &LiveScene, entry: Arc<LiveEntry>) -> io::Result<()> {
    sender.text(entry.told.to_string()).await?;
    for (robot, picture) in &entry.pictures {
        let picture = picture.clone();
        let png = tokio::task::spawn_blocking(move || picture.png()).await.map_err(io::Error::other)?;
        let number = scene.robots().position(|name| name == robot).unwrap_or_default();
        let head = [PICTURE_KIND, entry.entry as f32, number as f32];
        let mut message: Vec<u8> = head.into_iter().flat_map(f32::to_le_bytes).collect();
        message.extend(png.map_err(io::Error::other)?.iter());
        sender.bytes(message).await?;
    }
    Ok(())
}

/// Renders a robot's current camera image.
pub async fn picture(app: AppState, wanted: Wanted) -> Result<Vec<u8>, ApiError> {
    let thread = thread(&app, &wanted)?;
    let LiveWatch { view, .. } = thread.watch().await?;
    let name = wanted.robot.unwrap_or_default();
    blocking(move || {
        let have = view.scene.robots().map(str::to_owned).collect();
        let drawn = view.scene.picture(&view.now.step, &name);
        let drawn = drawn
            .ok_or(tandem_episodes::EpisodeError::UnknownRobot { name, have })
            .map_err(HostingError::from)?;
        drawn.map_err(|failed| ApiError::Reply(failed.into()))
    })
    .await
}
