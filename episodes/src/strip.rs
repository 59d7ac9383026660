//! A picture strip: one column per key moment, third person above, the robots' own views below.

use font8x8::legacy::BASIC_LEGACY;
use tandem_sim::World;
use tandem_sim::render::{Camera, Frame, encode_png};

use crate::EpisodeError;
use crate::observe::Eyes;

/// One column.
#[derive(Clone)]
pub struct Moment {
    pub caption: String,
    /// Third person, then each robot's view.
    pub frames: Vec<Frame>,
}

const CELL_WIDTH: usize = 400;
const CELL_HEIGHT: usize = 300;
const GAP: usize = 6;
const CAPTION_HEIGHT: usize = 28;
const GLYPH: usize = 8;
const CAPTION_SCALE: usize = 2;
const BACKGROUND: u8 = 250;
const INK: u8 = 25;

impl Moment {
    pub fn capture(caption: &str, world: &World, eyes: &mut Eyes) -> Moment {
        let in_cell = |camera: Camera| Camera { width: CELL_WIDTH as u32, height: CELL_HEIGHT as u32, ..camera };
        let own = (0..world.robots().len()).map(|robot| world.egocentric_camera(robot));
        let cameras = std::iter::once(world.third_person_camera()).chain(own);
        let frames = cameras.map(|camera| eyes.render(world, &in_cell(camera))).collect();
        Moment { caption: format!("{caption} {:.1} s", world.time_s()), frames }
    }
}

/// The strip as a PNG file.
pub fn png(moments: &[Moment]) -> Result<Vec<u8>, EpisodeError> {
    let rows = moments.iter().map(|moment| moment.frames.len()).max().unwrap_or(0);
    let width = GAP + moments.len() * (CELL_WIDTH + GAP);
    let height = CAPTION_HEIGHT + rows * (CELL_HEIGHT + GAP);
    let mut canvas = Canvas { width, rgb: vec![BACKGROUND; width * height * 3] };
    for (column, moment) in moments.iter().enumerate() {
        let x = GAP + column * (CELL_WIDTH + GAP);
        canvas.write(x, (CAPTION_HEIGHT - GLYPH * CAPTION_SCALE) / 2, &moment.caption);
        for (row, frame) in moment.frames.iter().enumerate() {
            canvas.draw(x, CAPTION_HEIGHT + row * (CELL_HEIGHT + GAP), frame);
        }
    }
    Ok(encode_png(width as u32, height as u32, &canvas.rgb)?)
}

struct Canvas {
    width: usize,
    rgb: Vec<u8>,
}

impl Canvas {
    fn draw(&mut self, x: usize, y: usize, frame: &Frame) {
        let row_bytes = frame.width as usize * 3;
        for (row, pixels) in frame.rgb.chunks_exact(row_bytes).enumerate() {
            let start = ((y + row) * self.width + x) * 3;
            self.rgb[start..start + row_bytes].copy_from_slice(pixels);
        }
    }

    /// Writes ASCII; other characters leave a gap, and what does not fit a cell is cut off.
    fn write(&mut self, x: usize, y: usize, text: &str) {
        for (index, character) in text.chars().take(CELL_WIDTH / (GLYPH * CAPTION_SCALE)).enumerate() {
            let glyph = BASIC_LEGACY.get(character as usize).copied().unwrap_or_default();
            for (row, bits) in glyph.into_iter().enumerate() {
                for column in (0..GLYPH).filter(|column| bits & (1 << column) != 0) {
                    for i in 0..CAPTION_SCALE * CAPTION_SCALE {
                        let px = x + (index * GLYPH + column) * CAPTION_SCALE + i % CAPTION_SCALE;
                        let py = y + row * CAPTION_SCALE + i / CAPTION_SCALE;
                        self.put(px, py, [INK; 3]);
                    }
                }
            }
        }
    }

    fn put(&mut self, x: usize, y: usize, colour: [u8; 3]) {
        let start = (y * self.width + x) * 3;
        self.rgb[start..start + 3].copy_from_slice(&colour);
    }
}
