//! What all robots see and feel at one moment, read once for every request.

use image::RgbImage;
use tandem_episodes::players::{PlayerError, ThirdPersonEpisode};
use tandem_tools_spec::{LookReply, Observe, ToolCall, ToolReply};

use super::{columns, error::RemoteError};

/// One moment.
pub struct PolicyObservation {
    /// By robot, in the task's order.
    pub robots: Vec<RobotObservation>,
    /// The room, where the policy is shown it.
    pub third_person: Option<RgbImage>,
}

/// What one robot sees and feels.
pub struct RobotObservation {
    pub picture: RgbImage,
    /// Numbers in the order of [`columns::state_values`].
    pub state_values: Vec<f64>,
}

/// Size of pictures that nobody has taken.
const WIDTH_PX: u32 = 320;
const HEIGHT_PX: u32 = 240;

impl PolicyObservation {
    /// What there is to see now.
    pub fn take(episode: &mut dyn ThirdPersonEpisode, third_person: bool) -> Result<PolicyObservation, PlayerError> {
        let call: ToolCall = Observe { robots: None, short: Some(true) }.into();
        let tool = call.name();
        let failed = |reason: String| PlayerError::Call { tool, reason };
        let ToolReply::Look(LookReply::Observe(observation)) = episode.call(call)? else {
            return Err(failed("the reply is no observation".into()));
        };
        let decoded = observation.images.iter().map(|image| decode(&image.png_base64.0));
        let pictures: Vec<RgbImage> =
            decoded.collect::<Result<_, _>>().map_err(|error| failed(error.to_string()))?;
        let felt = observation.states.iter().map(columns::state_values);
        let robots = pictures.into_iter().zip(felt);
        let robots =
            robots.map(|(picture, state_values)| RobotObservation { picture, state_values }).collect();
        let third_person = match third_person {
            true => {
                let png = episode.third_person()?;
                Some(decode(&png.0).map_err(|error| failed(error.to_string()))?)
            }
            false => None,
        };
        Ok(PolicyObservation { robots, third_person })
    }

    /// Black pictures and zeros, of the right sizes, to try a policy with before an episode begins.
    pub fn blank(robots: usize) -> PolicyObservation {
        let black = || RgbImage::new(WIDTH_PX, HEIGHT_PX);
        let seen = || RobotObservation { picture: black(), state_values: columns::blank_state_values() };
        PolicyObservation { robots: (0..robots).map(|_| seen()).collect(), third_person: Some(black()) }
    }
}

fn decode(png: &[u8]) -> Result<RgbImage, RemoteError> {
    Ok(image::load_from_memory_with_format(png, image::ImageFormat::Png)?.into_rgb8())
}
