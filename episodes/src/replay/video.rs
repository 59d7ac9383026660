//! Video of a recording from one camera.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, DynamicImage, RgbImage};
use tandem_sim::CONTROL_HZ;
use tandem_sim::render::Frame;
use webp_animation::Encoder;

use super::{EpisodeCamera, EpisodeRenderer, PictureSize, ReplayError};
use crate::output::{OutputError, partial_path, put_in_place, webp, write_whole};
use crate::recording::Recording;

/// Format of a video, by the file's extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VideoFormat {
    Webp,
    Gif,
    Mp4,
}

/// Reason why a video cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    #[error("{} is no film that can be made; give a file that ends in .webp, .gif or .mp4", .0.display())]
    Format(PathBuf),
    #[error(
        "no ffmpeg to make {} with ({source}); install one, or give a file that ends in .webp or .gif",
        path.display()
    )]
    NoFfmpeg { path: PathBuf, source: io::Error },
    #[error("ffmpeg made no {}: {says}", path.display())]
    Ffmpeg { path: PathBuf, says: String },
    #[error("libwebp made no {}: {source:?}", path.display())]
    Webp { path: PathBuf, source: webp_animation::Error },
    #[error("no GIF can be made: {0}")]
    Gif(#[from] image::ImageError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Replay(Box<ReplayError>),
}

impl From<ReplayError> for VideoError {
    fn from(error: ReplayError) -> VideoError {
        VideoError::Replay(error.into())
    }
}

impl VideoFormat {
    /// Returns the format for the file's extension.
    pub fn of(path: &Path) -> Result<VideoFormat, VideoError> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("webp") => Ok(VideoFormat::Webp),
            Some("gif") => Ok(VideoFormat::Gif),
            Some("mp4") => Ok(VideoFormat::Mp4),
            _ => Err(VideoError::Format(path.into())),
        }
    }
}

/// Contents and speed of a video.
#[derive(Clone, Copy, Debug)]
pub struct FilmPlan {
    pub view: EpisodeCamera,
    /// Size of the frames; `None` for the camera's own size.
    pub size: Option<PictureSize>,
    /// Frames per second of simulated time.
    pub rate_hz: u32,
    /// Duration of the video, rounded to a frame; `None` for the episode's duration.
    pub duration_s: Option<u32>,
}

impl FilmPlan {
    /// Returns the frames per second of the video of an episode with this number of steps.
    fn played_hz(&self, steps: usize) -> f64 {
        let rate_hz = f64::from(self.rate_hz);
        self.duration_s.map_or(rate_hz, |video_s| rate_hz * steps as f64 / CONTROL_HZ / f64::from(video_s))
    }
}

/// Renders a whole recording as a video. Returns the number of frames.
///
/// # Errors
///
/// If the format is unknown, the recording cannot be replayed, or the video cannot be written.
pub fn film(recording: &Recording, plan: &FilmPlan, path: &Path) -> Result<usize, VideoError> {
    let format = VideoFormat::of(path)?;
    let mut scene = EpisodeRenderer::of(&recording.spec).map_err(ReplayError::from)?;
    let mut writer: Option<FilmWriter> = None;
    let mut pictures = 0;
    let played_hz = plan.played_hz(recording.state_hashes().count());
    for (index, step) in recording.steps().enumerate() {
        let step = step.map_err(ReplayError::from)?;
        if index < step_of_picture(pictures, plan.rate_hz) {
            continue;
        }
        let view = scene.view(plan.view, &step, plan.size);
        let frame = scene.draw(&step, &view);
        let writer = match &mut writer {
            Some(writer) => writer,
            unbegun => unbegun.insert(FilmWriter::begin(format, &frame, played_hz, path)?),
        };
        writer.add(&frame, pictures, played_hz, path)?;
        pictures += 1;
    }
    if let Some(writer) = writer {
        writer.finish(pictures, played_hz, path)?;
    }
    Ok(pictures)
}

/// A short video for a page, with at most `SHORT_PICTURES` frames for any length of episode. It lasts a few
/// seconds and has at most a quarter of a megabyte.
pub struct ShortFilm {
    pub webp: Vec<u8>,
    /// Ratio of the video's speed to the episode's.
    pub speed_ratio: f64,
}

const SHORT_PICTURES: usize = 60;
const SHORT_RATE_HZ: f64 = 10.0;
const SHORT_SIZE: PictureSize = PictureSize { width: 320, height: 240 };
/// Duration of the last frame.
const SHORT_END_MS: i32 = 1500;

/// Renders a whole recording from the third-person camera, as a [`ShortFilm`].
///
/// # Errors
///
/// If the recording cannot be replayed, or the video cannot be encoded.
pub fn short_film(recording: &Recording) -> Result<ShortFilm, VideoError> {
    let mut scene = EpisodeRenderer::of(&recording.spec).map_err(ReplayError::from)?;
    let failed = |error| webp_failed(recording.path(), error);
    let mut encoder = webp::encoder((SHORT_SIZE.width, SHORT_SIZE.height)).map_err(failed)?;
    let steps = recording.state_hashes().count();
    let stride = steps.div_ceil(SHORT_PICTURES).max(1);
    let mut pictures = 0;
    for (index, step) in recording.steps().enumerate() {
        let step = step.map_err(ReplayError::from)?;
        if index % stride == 0 || index + 1 == steps {
            let view = scene.view(EpisodeCamera::ThirdPerson, &step, Some(SHORT_SIZE));
            let frame = scene.draw(&step, &view);
            encoder.add_frame(&frame.rgb, time_ms(pictures, SHORT_RATE_HZ)).map_err(failed)?;
            pictures += 1;
        }
    }
    let webp = encoder.finalize(time_ms(pictures, SHORT_RATE_HZ) + SHORT_END_MS).map_err(failed)?.to_vec();
    Ok(ShortFilm { webp, speed_ratio: stride as f64 * SHORT_RATE_HZ / CONTROL_HZ })
}

/// Returns the index of the step, from the recording's first, that frame number `picture` shows.
pub fn step_of_picture(picture: usize, rate_hz: u32) -> usize {
    (picture as f64 * CONTROL_HZ / f64::from(rate_hz)).round() as usize
}

/// A video that is being written.
enum FilmWriter {
    Webp(Box<Encoder>),
    Gif { encoder: Box<GifEncoder<BufWriter<File>>>, file: File },
    Mp4(Child),
}

/// Speed of the GIF encoder, from 1, the slowest, to 30.
const GIF_SPEED: i32 = 10;

impl FilmWriter {
    /// Begins a video with frames of the size of `frame`.
    fn begin(
        format: VideoFormat,
        frame: &Frame,
        rate_hz: f64,
        path: &Path,
    ) -> Result<FilmWriter, VideoError> {
        let Frame { width, height, .. } = *frame;
        Ok(match format {
            VideoFormat::Webp => {
                FilmWriter::Webp(webp::encoder((width, height)).map_err(|e| webp_failed(path, e))?.into())
            }
            VideoFormat::Gif => {
                let file = File::create(partial_path(path)).map_err(|e| io_failed(path, e))?;
                let written = file.try_clone().map_err(|e| io_failed(path, e))?;
                let mut encoder = GifEncoder::new_with_speed(BufWriter::new(written), GIF_SPEED);
                encoder.set_repeat(Repeat::Infinite)?;
                FilmWriter::Gif { encoder: encoder.into(), file }
            }
            VideoFormat::Mp4 => FilmWriter::Mp4(ffmpeg([width, height], rate_hz, path)?),
        })
    }

    fn add(&mut self, frame: &Frame, picture: usize, rate_hz: f64, path: &Path) -> Result<(), VideoError> {
        match self {
            FilmWriter::Webp(encoder) => encoder
                .add_frame(&frame.rgb, time_ms(picture, rate_hz))
                .map_err(|source| webp_failed(path, source)),
            FilmWriter::Gif { encoder, .. } => {
                let picture = RgbImage::from_raw(frame.width, frame.height, frame.rgb.clone());
                let rgba = DynamicImage::from(picture.unwrap_or_default()).into_rgba8();
                let delay = Delay::from_saturating_duration(Duration::from_secs_f64(1.0 / rate_hz));
                Ok(encoder.encode_frame(image::Frame::from_parts(rgba, 0, 0, delay))?)
            }
            FilmWriter::Mp4(child) => {
                if let Some(pipe) = &mut child.stdin {
                    // If ffmpeg closes the pipe early, its messages at the end give the reason.
                    let _ = pipe.write_all(&frame.rgb);
                }
                Ok(())
            }
        }
    }

    fn finish(self, pictures: usize, rate_hz: f64, path: &Path) -> Result<(), VideoError> {
        match self {
            FilmWriter::Webp(encoder) => {
                let film = encoder.finalize(time_ms(pictures, rate_hz));
                Ok(write_whole(path, &film.map_err(|e| webp_failed(path, e))?)?)
            }
            FilmWriter::Gif { encoder, file } => {
                // The encoder writes the end of the file when it is dropped.
                drop(encoder);
                put_in_place(&file, &partial_path(path), path).map_err(|e| io_failed(path, e))
            }
            FilmWriter::Mp4(child) => {
                let output = child.wait_with_output().map_err(|e| io_failed(path, e))?;
                if !output.status.success() {
                    let says = String::from_utf8_lossy(&output.stderr).trim().to_owned();
                    return Err(VideoError::Ffmpeg { path: path.into(), says });
                }
                let whole = File::open(partial_path(path));
                whole
                    .and_then(|file| put_in_place(&file, &partial_path(path), path))
                    .map_err(|e| io_failed(path, e))
            }
        }
    }
}

/// Starts an ffmpeg process that reads raw frames and writes a video that every player supports.
fn ffmpeg([width, height]: [u32; 2], rate_hz: f64, path: &Path) -> Result<Child, VideoError> {
    let (size, rate) = (format!("{width}x{height}"), rate_hz.to_string());
    let takes = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", &size, "-r", &rate, "-i", "-"];
    // Players need an even width and height, and the index at the beginning of the file.
    let even = "pad=ceil(iw/2)*2:ceil(ih/2)*2";
    let writes = ["-vf", even, "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"];
    let ffmpeg = Command::new("ffmpeg")
        .args(["-loglevel", "error", "-y"])
        .args(takes)
        .args(writes)
        .arg(partial_path(path))
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn();
    ffmpeg.map_err(|source| VideoError::NoFfmpeg { path: path.into(), source })
}

fn time_ms(picture: usize, rate_hz: f64) -> i32 {
    (picture as f64 * 1000.0 / rate_hz).round() as i32
}

fn webp_failed(path: &Path, source: webp_animation::Error) -> VideoError {
    VideoError::Webp { path: path.into(), source }
}

fn io_failed(path: &Path, source: io::Error) -> VideoError {
    OutputError::Io { path: path.into(), source }.into()
}
