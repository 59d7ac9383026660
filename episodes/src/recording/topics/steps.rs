//! Encoding of recorded steps, bit for bit. Each number is written as its difference from a prediction by
//! earlier steps. The bytes of all differences are sorted by significance, so that bytes that are mostly zero
//! are together.

use std::collections::VecDeque;

use foxglove::{Encode, Schema, bytes::BufMut};
use postcard::{de_flavors, ser_flavors};
use serde::Deserialize;
use tandem_sim::{Pose, Step};

use super::messages::{StepError, StepMessage, state_hash_text};
use crate::output::OutputError;

/// First byte of a message with differences. Messages of earlier versions are JSON, which begins with a
/// brace.
const DIFFERENCES: u8 = 1;
const PLAIN: u8 = 2;
const JSON: u8 = b'{';
/// Length of kind, number of the step, and hash of the state.
const HEADER_BYTES: usize = 1 + 2 * size_of::<u64>();
/// Number of earlier steps that predict the next.
const REMEMBERED: usize = 3;
/// Step number from which steps are written plainly. As a number of variable length, it could be mistaken for
/// a word of four bytes.
const MAX_STEPS: u64 = 1 << 21;

/// Description of these messages for readers that do not know Tandem.
const DESCRIPTION: &str = "A control step of Tandem. Little endian: u8 kind (1: differences, 2: plain), u64 control_step, u64 state_hash; \
    then the step in postcard's encoding. Of kind 1 all its words of four bytes stand apart: u32 count, then count bytes of bits \
    24-31 of each word's difference, of 16-23, of 8-15, of 0-7; then all other bytes.";

/// One message.
pub struct StepRow(Vec<u8>);

impl Encode for StepRow {
    type Error = std::convert::Infallible;

    fn get_schema() -> Option<Schema> {
        Some(Schema::new("tandem.Step", "text", DESCRIPTION.as_bytes().to_vec()))
    }

    fn get_message_encoding() -> String {
        "tandem".into()
    }

    fn encode(&self, buffer: &mut impl BufMut) -> Result<(), Self::Error> {
        buffer.put_slice(&self.0);
        Ok(())
    }
}

/// The words of the steps before, the latest first. Each is an unsigned number that grows with the float.
#[derive(Default)]
struct StepMemory {
    before: VecDeque<Vec<u32>>,
}

impl StepMemory {
    /// Predicts word number `index`: either unchanged, or continued at its last rate. The choice is the one
    /// that was better the last time.
    fn expected(&self, index: usize) -> u32 {
        let at = |back: usize| self.before.get(back).and_then(|words| words.get(index)).copied();
        match (at(0), at(1), at(2)) {
            (None, ..) => ordered(0.0f32.to_bits()),
            (Some(last), Some(second), Some(third)) => {
                let (moved, moved_before) = (last.wrapping_sub(second), second.wrapping_sub(third));
                let size = |difference: u32| difference.cast_signed().unsigned_abs();
                let goes_on = size(moved.wrapping_sub(moved_before)) < size(moved);
                if goes_on { last.wrapping_add(moved) } else { last }
            }
            (Some(last), ..) => last,
        }
    }

    fn remember(&mut self, words: Vec<u32>) {
        self.before.push_front(words);
        self.before.truncate(REMEMBERED);
    }
}

/// Converts the bits of a float to a number that grows with the float; `from_ordered` is the inverse.
fn ordered(bits: u32) -> u32 {
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

fn from_ordered(number: u32) -> u32 {
    if number >> 31 == 1 { number & !(1 << 31) } else { !number }
}

/// Maps small differences of either sign to small numbers; `from_zigzag` is the inverse.
fn zigzag(difference: u32) -> u32 {
    (difference << 1) ^ (difference.cast_signed() >> 31).cast_unsigned()
}

fn from_zigzag(number: u32) -> u32 {
    (number >> 1) ^ (number & 1).wrapping_neg()
}

/// Encoder of steps, one after the other.
#[derive(Default)]
pub struct StepEncoder {
    memory: StepMemory,
}

impl StepEncoder {
    /// Encodes the step that follows those before.
    pub fn encode(&mut self, step: &Step, state_hash: u64) -> Result<StepRow, OutputError> {
        let failed = |source: postcard::Error| OutputError::Encode(source.into());
        let plain = step.control_step >= MAX_STEPS;
        let mut row = vec![if plain { PLAIN } else { DIFFERENCES }];
        row.extend(step.control_step.to_le_bytes());
        row.extend(state_hash.to_le_bytes());
        if plain {
            row.extend(postcard::to_stdvec(step).map_err(failed)?);
            return Ok(StepRow(row));
        }
        let Split { words, rest } =
            postcard::serialize_with_flavor(step, Split::default()).map_err(failed)?;
        let words: Vec<u32> = words.into_iter().map(ordered).collect();
        let differs = |(index, word): (usize, &u32)| zigzag(word.wrapping_sub(self.memory.expected(index)));
        let differences: Vec<u32> = words.iter().enumerate().map(differs).collect();
        row.extend((words.len() as u32).to_le_bytes());
        for place in 0..size_of::<u32>() {
            row.extend(differences.iter().map(|difference| difference.to_be_bytes()[place]));
        }
        row.extend(rest);
        self.memory.remember(words);
        Ok(StepRow(row))
    }
}

/// Decoder of steps, one after the other, from the first on.
#[derive(Default)]
pub struct StepDecoder {
    memory: StepMemory,
    /// Number of the last step, and the pose of each robot's camera after it.
    cameras: Option<(u64, Vec<Pose>)>,
    /// Set once a step could not be read; no later step can be decoded without it.
    lost: bool,
}

impl StepDecoder {
    /// Decodes the step of the next message.
    pub fn decode(&mut self, row: &[u8]) -> Result<Step, StepError> {
        if self.lost {
            return Err(StepError::Lost);
        }
        let step = self.next(row);
        self.lost = step.is_err();
        step.map(|step| self.with_cameras_before(step))
    }

    /// Completes a step with parts of the step before.
    fn with_cameras_before(&mut self, mut step: Step) -> Step {
        let poses = step.robots.iter().map(|robot| robot.truth.world_from_camera).collect();
        let before = self.cameras.replace((step.control_step, poses));
        if let Some((_, poses)) = before.filter(|(number, _)| number + 1 == step.control_step) {
            for (robot, pose) in step.robots.iter_mut().zip(poses) {
                robot.truth.world_from_camera_before = Some(pose);
            }
        }
        step
    }

    fn next(&mut self, row: &[u8]) -> Result<Step, StepError> {
        let content = row.get(HEADER_BYTES..).unwrap_or_default();
        match row.first() {
            Some(&JSON) => serde_json::from_slice::<StepMessage>(row)?.step(),
            Some(&PLAIN) => Ok(postcard::from_bytes(content)?),
            Some(&DIFFERENCES) => {
                let (count, content) = content.split_first_chunk().ok_or(StepError::Cut)?;
                let count = u32::from_le_bytes(*count) as usize;
                let planes_bytes = count.checked_mul(size_of::<u32>()).ok_or(StepError::Cut)?;
                let (planes, rest) = content.split_at_checked(planes_bytes).ok_or(StepError::Cut)?;
                let difference = |index: usize| {
                    u32::from_be_bytes(std::array::from_fn(|place| planes[place * count + index]))
                };
                let word =
                    |index: usize| self.memory.expected(index).wrapping_add(from_zigzag(difference(index)));
                let words: Vec<u32> = (0..count).map(word).collect();
                let bytes: Vec<u8> =
                    words.iter().flat_map(|word| from_ordered(*word).to_le_bytes()).collect();
                let joined = Joined { words: &bytes, rest };
                let step = Step::deserialize(&mut postcard::Deserializer::from_flavor(joined))?;
                self.memory.remember(words);
                Ok(step)
            }
            Some(_) | None => Err(StepError::Cut),
        }
    }
}

/// Returns the number of a step and the hash of the state after it, as text.
pub fn state_of(row: &[u8]) -> Result<(u64, String), StepError> {
    if row.first() == Some(&JSON) {
        return Ok(serde_json::from_slice::<StepMessage>(row)?.state());
    }
    let number = |from: usize| row.get(from..).and_then(<[u8]>::first_chunk).copied().map(u64::from_le_bytes);
    let (step, hash) = number(1).zip(number(1 + size_of::<u64>())).ok_or(StepError::Cut)?;
    Ok((step, state_hash_text(hash)))
}

/// Postcard's bytes, with words of four bytes separated from all others.
#[derive(Default)]
struct Split {
    words: Vec<u32>,
    rest: Vec<u8>,
}

impl ser_flavors::Flavor for Split {
    type Output = Split;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.rest.push(byte);
        Ok(())
    }

    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        match bytes.try_into() {
            Ok(word) => self.words.push(u32::from_le_bytes(word)),
            Err(_) => self.rest.extend(bytes),
        }
        Ok(())
    }

    fn finalize(self) -> postcard::Result<Split> {
        Ok(self)
    }
}

/// The same as [`Split`], for reading.
struct Joined<'a> {
    words: &'a [u8],
    rest: &'a [u8],
}

impl<'a> de_flavors::Flavor<'a> for Joined<'a> {
    type Remainder = ();
    type Source = &'a [u8];

    fn pop(&mut self) -> postcard::Result<u8> {
        let (byte, rest) = self.rest.split_first().ok_or(postcard::Error::DeserializeUnexpectedEnd)?;
        self.rest = rest;
        Ok(*byte)
    }

    fn try_take_n(&mut self, count: usize) -> postcard::Result<&'a [u8]> {
        let from = if count == size_of::<u32>() { &mut self.words } else { &mut self.rest };
        let (taken, left) = from.split_at_checked(count).ok_or(postcard::Error::DeserializeUnexpectedEnd)?;
        *from = left;
        Ok(taken)
    }

    fn finalize(self) -> postcard::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use tandem_sim::{HandContacts, Side, Touch};

    use super::*;

    #[test]
    fn floats_in_order_are_numbers_in_order_and_come_back() {
        let floats = [f32::NEG_INFINITY, -2.5, -1e-40, -0.0, 0.0, 1e-40, 2.5, f32::INFINITY];
        let numbers = floats.map(|float| ordered(float.to_bits()));
        assert!(numbers.is_sorted_by(|one, next| one < next));
        for bits in floats.map(f32::to_bits).into_iter().chain([f32::NAN.to_bits(), u32::MAX, 0x7fc0_0001]) {
            assert_eq!(from_ordered(ordered(bits)), bits);
        }
        for difference in [0, 1, 1u32.wrapping_neg(), 77, 77u32.wrapping_neg(), 1 << 31, u32::MAX >> 1] {
            assert_eq!(from_zigzag(zigzag(difference)), difference);
        }
        assert_eq!([0, 1, 1u32.wrapping_neg()].map(zigzag), [0, 2, 1]);
    }

    /// Returns steps of a world at rest. Their numbers and their counts of numbers vary.
    fn steps() -> Vec<Step> {
        let spec = crate::EpisodeSpec::new(
            &crate::tasks::find("pouring").unwrap(),
            2000,
            tandem_tools_spec::Protocol::Benchmark,
        );
        let start = crate::Session::start(&spec, None).unwrap().present().clone();
        let touch = |robot: usize| Touch {
            robot,
            side: Side::Left,
            object: 0,
            contacts: HandContacts {
                thumb_n: [1.5, -2.5, f32::NAN.copysign(-1.0)].into(),
                ..HandContacts::default()
            },
        };
        (0..9u64)
            .map(|number| {
                let mut step = Step { control_step: number, time_s: number as f64 * 0.02, ..start.clone() };
                for (index, angle_rad) in step.robots[0].sensed.joints.q_rad.iter_mut().enumerate() {
                    *angle_rad += (number as f32 * 0.1 + index as f32).sin() * 0.3;
                }
                // The number of touching hands varies, and so do the numbers.
                step.touches = (0..(number % 3) as usize).map(touch).collect();
                step.objects[0].name = if number == 5 { "four".into() } else { "fivea".into() };
                step
            })
            .collect()
    }

    #[test]
    fn steps_come_back_bit_for_bit_and_take_less() {
        let (mut encoder, mut decoder) = (StepEncoder::default(), StepDecoder::default());
        let mut rows = Vec::new();
        for (number, step) in steps().into_iter().enumerate() {
            let row = encoder.encode(&step, 7 * number as u64).unwrap().0;
            let again = decoder.decode(&row).unwrap();
            let bytes = |step: &Step| postcard::to_stdvec(step).unwrap();
            assert_eq!(bytes(&again), bytes(&step), "step {number}");
            assert_eq!(state_of(&row).unwrap(), (number as u64, state_hash_text(7 * number as u64)));
            rows.push(row);
        }
        let zeros = |row: &[u8]| row.iter().filter(|byte| **byte == 0).count() as f64 / row.len() as f64;
        assert!(zeros(&rows[8]) > 0.8, "what stays is zero: {}", zeros(&rows[8]));

        // A step whose number could be taken for a word.
        let late = Step { control_step: MAX_STEPS, ..steps().remove(3) };
        let row = encoder.encode(&late, 1).unwrap().0;
        let again = decoder.decode(&row).unwrap();
        assert_eq!((row[0], again.control_step), (PLAIN, MAX_STEPS));
    }

    #[test]
    fn what_is_cut_is_an_error_and_nothing_is_read_behind_it() {
        let mut encoder = StepEncoder::default();
        let rows: Vec<Vec<u8>> =
            steps().iter().take(3).map(|step| encoder.encode(step, 1).unwrap().0).collect();
        for length in 0..rows[0].len() {
            assert!(StepDecoder::default().decode(&rows[0][..length]).is_err(), "{length} bytes");
        }
        let mut decoder = StepDecoder::default();
        decoder.decode(&rows[0]).unwrap();
        assert!(decoder.decode(&rows[1][..100]).is_err());
        let text = decoder.decode(&rows[2]).unwrap_err().to_string();
        assert!(text.contains("a step before"), "{text}");
        let mut huge = rows[0].clone();
        huge[HEADER_BYTES..HEADER_BYTES + 4].fill(0xff);
        assert!(StepDecoder::default().decode(&huge).is_err());
    }
}
