//! Image strips: one column per key moment, with the third-person view above and the robots' views below. A
//! strip contains its texts twice: drawn into the image, and as metadata for pages made from the file.

use std::fs::File;
use std::io::{self, BufReader};
use std::path::Path;

use font8x8::legacy::BASIC_LEGACY;
use image::RgbImage;
use image::imageops::{self, FilterType};
use serde::{Deserialize, Serialize};
use tandem_sim::render::PictureError;

use super::moments::{KeyMoment, LabelledPicture};
use crate::output::webp;

/// The strip's name in a run folder.
pub const STRIP_FILE: &str = "strip.png";

/// The keyword of the strip's texts in its file.
const TEXTS: &str = "tandem.moments";

/// Size of an image in the strip, in pixels.
pub const CELL_WIDTH: usize = 400;
pub const CELL_HEIGHT: usize = 300;
const GAP: usize = 6;
const CAPTION_HEIGHT: usize = 48;
/// The distance from the top of one line of text to the next.
const LINE_HEIGHT: usize = 21;
/// Height of a row: the label, and the image below it.
const ROW_HEIGHT: usize = LINE_HEIGHT + CELL_HEIGHT + GAP;
const TEXT_TOP: usize = 4;
const GLYPH: usize = 8;
const TEXT_SCALE: usize = 2;
const BACKGROUND: u8 = 250;
const INK: [u8; 3] = [25; 3];
const FAINT_INK: [u8; 3] = [105; 3];

/// The texts of one column.
#[derive(Serialize, Deserialize)]
struct ColumnTexts {
    caption: [String; 2],
    labels: Vec<String>,
}

/// Encodes the strip as a PNG file.
pub fn png(moments: &[KeyMoment]) -> Result<Vec<u8>, PictureError> {
    let canvas = compose(moments)?;
    let column = |moment: &KeyMoment| ColumnTexts {
        caption: moment.caption.clone(),
        labels: moment.views.iter().map(|view| view.label.clone()).collect(),
    };
    let texts = serde_json::to_string(&moments.iter().map(column).collect::<Vec<_>>());
    encode(&canvas, &texts.map_err(io::Error::from)?).map_err(|error| io::Error::from(error).into())
}

fn encode(canvas: &Canvas, texts: &str) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, canvas.width as u32, canvas.height() as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Adaptive);
    encoder.add_itxt_chunk(TEXTS.into(), texts.into())?;
    encoder.write_header()?.write_image_data(&canvas.rgb)?;
    Ok(bytes)
}

/// Reads the moments of an earlier strip as small images, scaled by `scale_ratio`. An image without texts,
/// such as a strip of an earlier build, is one moment without a caption. Returns `None` if there is no
/// image.
pub fn read(path: &Path, scale_ratio: f64) -> Option<Vec<KeyMoment>> {
    let strip = image::open(path).ok()?.into_rgb8();
    let Some(columns) = texts(path).filter(|columns| fits(&strip, columns)) else {
        let views = vec![LabelledPicture { label: String::new(), file: small(&strip, scale_ratio)? }];
        return Some(vec![KeyMoment { caption: Default::default(), views }]);
    };
    let moment = |(column, ColumnTexts { caption, labels }): (usize, ColumnTexts)| {
        let view = |(row, label): (usize, String)| {
            let [x, y] = [column_x(column), picture_y(row)].map(|px| px as u32);
            let cell = imageops::crop_imm(&strip, x, y, CELL_WIDTH as u32, CELL_HEIGHT as u32);
            Some(LabelledPicture { label, file: small(&cell.to_image(), scale_ratio)? })
        };
        let views = labels.into_iter().enumerate().map(view).collect::<Option<_>>()?;
        Some(KeyMoment { caption, views })
    };
    columns.into_iter().enumerate().map(moment).collect()
}

/// Reads the texts in a strip's file; `None` if there are none.
fn texts(path: &Path) -> Option<Vec<ColumnTexts>> {
    let reader = png::Decoder::new(BufReader::new(File::open(path).ok()?)).read_info().ok()?;
    let found = reader.info().utf8_text.iter().find(|text| text.keyword == TEXTS)?;
    serde_json::from_str(&found.get_text().ok()?).ok()
}

/// Returns `true` if the image has exactly the size for these texts.
fn fits(strip: &RgbImage, columns: &[ColumnTexts]) -> bool {
    let rows = columns.iter().map(|column| column.labels.len()).max().unwrap_or(0);
    (strip.width() as usize, strip.height() as usize) == size(columns.len(), rows)
}

/// Scales an image down and encodes it as WebP.
fn small(picture: &RgbImage, scale_ratio: f64) -> Option<Vec<u8>> {
    let [width, height] =
        [picture.width(), picture.height()].map(|px| (f64::from(px) * scale_ratio).round().max(1.0) as u32);
    let small = imageops::resize(picture, width, height, FilterType::Triangle);
    webp::picture(width, height, small.as_raw()).ok()
}

/// Returns width and height of a strip with these numbers of columns and rows.
fn size(columns: usize, rows: usize) -> (usize, usize) {
    (column_x(columns), CAPTION_HEIGHT + rows * ROW_HEIGHT)
}

fn column_x(column: usize) -> usize {
    GAP + column * (CELL_WIDTH + GAP)
}

/// Returns the top of a row's images.
fn picture_y(row: usize) -> usize {
    CAPTION_HEIGHT + row * ROW_HEIGHT + LINE_HEIGHT
}

fn compose(moments: &[KeyMoment]) -> Result<Canvas, PictureError> {
    let rows = moments.iter().map(|moment| moment.views.len()).max().unwrap_or(0);
    let (width, height) = size(moments.len(), rows);
    let mut canvas = Canvas { width, rgb: vec![BACKGROUND; width * height * 3] };
    for (column, moment) in moments.iter().enumerate() {
        let x = column_x(column);
        for (line, (text, ink)) in moment.caption.iter().zip([INK, FAINT_INK]).enumerate() {
            canvas.write(x, TEXT_TOP + line * LINE_HEIGHT, text, ink);
        }
        for (row, view) in moment.views.iter().enumerate() {
            let y = picture_y(row);
            canvas.draw(x, y, &image::load_from_memory(&view.file)?.into_rgb8());
            // The labels of a row are all the same.
            if column == 0 {
                canvas.write(x, y - LINE_HEIGHT + TEXT_TOP / 2, &view.label, FAINT_INK);
            }
        }
    }
    Ok(canvas)
}

struct Canvas {
    width: usize,
    rgb: Vec<u8>,
}

impl Canvas {
    fn height(&self) -> usize {
        self.rgb.len() / (self.width * 3)
    }

    /// Draws an image of the size of a cell.
    fn draw(&mut self, x: usize, y: usize, picture: &RgbImage) {
        let row_bytes = picture.width() as usize * 3;
        for (row, pixels) in picture.as_raw().chunks_exact(row_bytes).enumerate() {
            let start = ((y + row) * self.width + x) * 3;
            self.rgb[start..start + row_bytes].copy_from_slice(pixels);
        }
    }

    /// Writes ASCII. Other characters leave a gap, and text beyond the width of a cell is cut off.
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

/// Placement of images and texts in the strip, and reading them back.
#[cfg(test)]
mod tests {
    use super::*;

    fn moment(caption: &str, colours: &[[u8; 3]]) -> KeyMoment {
        let view = |colour: &[u8; 3]| {
            let picture = RgbImage::from_pixel(CELL_WIDTH as u32, CELL_HEIGHT as u32, image::Rgb(*colour));
            let mut file = io::Cursor::new(Vec::new());
            picture.write_to(&mut file, image::ImageFormat::Png).unwrap();
            LabelledPicture { label: "what \u{c4} sees".into(), file: file.into_inner() }
        };
        KeyMoment { caption: [caption.into(), "1.0 s".into()], views: colours.iter().map(view).collect() }
    }

    const LONG: &str = "a caption that is longer than its column and says \u{e4}";
    const COLUMNS: [[[u8; 3]; 2]; 3] =
        [[[9, 0, 0], [0, 90, 0]], [[0, 0, 200], [90, 90, 0]], [[0, 90, 90], [200, 0, 90]]];

    #[test]
    fn every_moment_is_a_column_and_every_view_a_row() {
        let canvas = compose(&COLUMNS.map(|colours| moment(LONG, &colours))).unwrap();
        assert_eq!(
            (canvas.width, canvas.height()),
            (GAP + 3 * (CELL_WIDTH + GAP), CAPTION_HEIGHT + 2 * ROW_HEIGHT)
        );
        let pixel = |x: usize, y: usize| &canvas.rgb[(y * canvas.width + x) * 3..][..3];
        for (column, colours) in COLUMNS.iter().enumerate() {
            for (row, colour) in colours.iter().enumerate() {
                // No text is on an image.
                for (x, y) in [(0, 0), (CELL_WIDTH / 2, CELL_HEIGHT / 2), (CELL_WIDTH - 1, CELL_HEIGHT - 1)] {
                    assert_eq!(pixel(column_x(column) + x, picture_y(row) + y), colour);
                }
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
        for row in 0..2 {
            assert!(
                inked(picture_y(row) - LINE_HEIGHT, picture_y(row), FAINT_INK) > 100,
                "label of row {row}"
            );
        }
    }

    #[test]
    fn what_a_strip_shows_and_says_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(STRIP_FILE);
        std::fs::write(&path, png(&COLUMNS.map(|colours| moment(LONG, &colours))).unwrap()).unwrap();
        let moments = read(&path, 0.25).unwrap();
        assert_eq!(moments.len(), 3);
        for (moment, colours) in moments.iter().zip(COLUMNS) {
            assert_eq!(moment.caption, [LONG, "1.0 s"]);
            for (view, colour) in moment.views.iter().zip(colours) {
                assert_eq!(view.label, "what \u{c4} sees");
                let decoder = webp_animation::Decoder::new(&view.file).unwrap();
                let frame = decoder.into_iter().next().unwrap();
                assert_eq!(frame.dimensions(), (100, 75));
                let middle = &frame.data()[(37 * 100 + 50) * 4..][..3];
                let near = middle.iter().zip(colour).all(|(seen, drawn)| seen.abs_diff(drawn) < 12);
                assert!(near, "{middle:?} for {colour:?}");
            }
        }
        // An image without texts is shown unchanged.
        RgbImage::new(80, 40).save(&path).unwrap();
        let moments = read(&path, 0.25).unwrap();
        assert_eq!((moments.len(), moments[0].views.len(), &*moments[0].caption[0]), (1, 1, ""));
        std::fs::write(&path, "no picture").unwrap();
        assert_eq!(read(&path, 0.25), None);
    }
}
