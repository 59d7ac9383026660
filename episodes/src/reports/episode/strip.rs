//! A picture strip: one column per key moment, third person above, the robots' own views below.

use font8x8::legacy::BASIC_LEGACY;
use tandem_sim::render::{Frame, PictureError, encode_png};

/// The strip's name in a run folder.
pub const STRIP_FILE: &str = "strip.png";

/// One column.
#[derive(Clone)]
pub struct KeyMoment {
    /// What happened, and when.
    pub caption: [String; 2],
    /// Third person, then each robot's view.
    pub views: Vec<LabelledFrame>,
}

/// One picture and whose it is.
#[derive(Clone)]
pub struct LabelledFrame {
    pub label: String,
    pub frame: Frame,
}

pub const CELL_WIDTH: usize = 400;
pub const CELL_HEIGHT: usize = 300;
const GAP: usize = 6;
const CAPTION_HEIGHT: usize = 48;
/// The distance from the top of one line of text to the next.
const LINE_HEIGHT: usize = 21;
const TEXT_TOP: usize = 4;
const GLYPH: usize = 8;
const TEXT_SCALE: usize = 2;
const BACKGROUND: u8 = 250;
const INK: [u8; 3] = [25; 3];
const FAINT_INK: [u8; 3] = [105; 3];
const LABEL_INK: [u8; 3] = [250; 3];

/// The strip as a PNG file.
pub fn png(moments: &[KeyMoment]) -> Result<Vec<u8>, PictureError> {
    let canvas = compose(moments);
    encode_png(canvas.width as u32, canvas.height() as u32, &canvas.rgb)
}

fn compose(moments: &[KeyMoment]) -> Canvas {
    let rows = moments.iter().map(|moment| moment.views.len()).max().unwrap_or(0);
    let width = GAP + moments.len() * (CELL_WIDTH + GAP);
    let height = CAPTION_HEIGHT + rows * (CELL_HEIGHT + GAP);
    let mut canvas = Canvas { width, rgb: vec![BACKGROUND; width * height * 3] };
    for (column, moment) in moments.iter().enumerate() {
        let x = GAP + column * (CELL_WIDTH + GAP);
        for (line, (text, ink)) in moment.caption.iter().zip([INK, FAINT_INK]).enumerate() {
            canvas.write(x, TEXT_TOP + line * LINE_HEIGHT, text, ink);
        }
        for (row, view) in moment.views.iter().enumerate() {
            let y = CAPTION_HEIGHT + row * (CELL_HEIGHT + GAP);
            canvas.draw(x, y, &view.frame);
            // The labels of a row are all the same.
            if column == 0 {
                canvas.label(x, y, &view.label);
            }
        }
    }
    canvas
}

struct Canvas {
    width: usize,
    rgb: Vec<u8>,
}

impl Canvas {
    fn height(&self) -> usize {
        self.rgb.len() / (self.width * 3)
    }

    fn draw(&mut self, x: usize, y: usize, frame: &Frame) {
        let row_bytes = frame.width as usize * 3;
        for (row, pixels) in frame.rgb.chunks_exact(row_bytes).enumerate() {
            let start = ((y + row) * self.width + x) * 3;
            self.rgb[start..start + row_bytes].copy_from_slice(pixels);
        }
    }

    /// Writes light text on a darkened strip of the picture at (x, y).
    fn label(&mut self, x: usize, y: usize, text: &str) {
        let (width, height) = (text.len() * GLYPH * TEXT_SCALE + 2 * TEXT_TOP, LINE_HEIGHT + TEXT_TOP);
        for row in y..y + height {
            let start = (row * self.width + x) * 3;
            self.rgb[start..start + width * 3].iter_mut().for_each(|value| *value /= 3);
        }
        self.write(x + TEXT_TOP, y + TEXT_TOP, text, LABEL_INK);
    }

    /// Writes ASCII; other characters leave a gap, and what does not fit a cell is cut off.
    fn write(&mut self, x: usize, y: usize, text: &str, ink: [u8; 3]) {
        const GLYPH_WIDTH: usize = GLYPH * TEXT_SCALE;
        for (index, character) in text.chars().take(CELL_WIDTH / GLYPH_WIDTH).enumerate() {
            let glyph = BASIC_LEGACY.get(character as usize).copied().unwrap_or_default();
            for (row, column) in (0..GLYPH_WIDTH * GLYPH_WIDTH).map(|i| (i / GLYPH_WIDTH, i % GLYPH_WIDTH)) {
                if glyph[row / TEXT_SCALE] & (1 << (column / TEXT_SCALE)) != 0 {
                    let start = ((y + row) * self.width + x + index * GLYPH_WIDTH + column) * 3;
                    self.rgb[start..start + 3].copy_from_slice(&ink);
                }
            }
        }
    }
}

/// Where the strip puts its pictures and its words.
#[cfg(test)]
mod tests {
    use super::*;

    fn moment(caption: &str, colours: &[[u8; 3]]) -> KeyMoment {
        let (width, height) = (CELL_WIDTH as u32, CELL_HEIGHT as u32);
        let pixels = CELL_WIDTH * CELL_HEIGHT;
        let view = |colour: &[u8; 3]| LabelledFrame {
            label: "view".into(),
            frame: Frame { width, height, rgb: colour.repeat(pixels), depth_m: vec![], ids: vec![] },
        };
        KeyMoment { caption: [caption.into(), "1.0 s".into()], views: colours.iter().map(view).collect() }
    }

    #[test]
    fn every_moment_is_a_column_and_every_view_a_row() {
        let long = "a caption that is longer than its column and says \u{e4}";
        let columns = [[[9, 0, 0], [0, 9, 0]], [[0, 0, 9], [9, 9, 0]], [[0, 9, 9], [9, 0, 9]]];
        let canvas = compose(&columns.map(|colours| moment(long, &colours)));
        let last = (canvas.width - 1, canvas.height() - 1);
        assert_eq!(last, (GAP + 3 * (CELL_WIDTH + GAP) - 1, CAPTION_HEIGHT + 2 * (CELL_HEIGHT + GAP) - 1));
        let pixel = |x: usize, y: usize| &canvas.rgb[(y * canvas.width + x) * 3..][..3];
        for (column, colours) in columns.iter().enumerate() {
            for (row, colour) in colours.iter().enumerate() {
                let x = GAP + column * (CELL_WIDTH + GAP) + CELL_WIDTH / 2;
                assert_eq!(pixel(x, CAPTION_HEIGHT + row * (CELL_HEIGHT + GAP) + CELL_HEIGHT / 2), colour);
            }
            // A caption stays within its column, so the gap before the next one is blank.
            for y in 0..CAPTION_HEIGHT {
                assert_eq!(pixel(column * (CELL_WIDTH + GAP), y), [BACKGROUND; 3]);
            }
        }
        let inked = |from_y: usize, to_y: usize, ink: [u8; 3]| {
            (from_y..to_y)
                .flat_map(|y| (0..canvas.width).map(move |x| (x, y)))
                .filter(|(x, y)| pixel(*x, *y) == ink)
                .count()
        };
        assert!(inked(0, LINE_HEIGHT, INK) > 1000 && inked(LINE_HEIGHT, CAPTION_HEIGHT, FAINT_INK) > 100);
        assert!(inked(CAPTION_HEIGHT, canvas.height(), LABEL_INK) > 100);
    }
}
