//! Where the strip puts its pictures and its words.

use super::*;

fn moment(caption: &str, colours: &[[u8; 3]]) -> Moment {
    let (width, height) = (CELL_WIDTH as u32, CELL_HEIGHT as u32);
    let pixels = CELL_WIDTH * CELL_HEIGHT;
    let view = |colour: &[u8; 3]| View {
        label: "view".into(),
        frame: Frame { width, height, rgb: colour.repeat(pixels), depth_m: vec![], ids: vec![] },
    };
    Moment { caption: [caption.into(), "1.0 s".into()], views: colours.iter().map(view).collect() }
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
