//! QR codes of links, for phones and headsets: as an image on a page, and as characters in a terminal.

use qrcode::{QrCode, render::svg, render::unicode, types::QrError};

/// Renders a QR code as SVG.
pub fn qr_svg(text: &str) -> Result<String, QrError> {
    let code = QrCode::new(text)?;
    // Readers need a light margin around dark modules on any background.
    let colours = (svg::Color("#000"), svg::Color("#fff"));
    Ok(code.render().min_dimensions(240, 240).dark_color(colours.0).light_color(colours.1).build())
}

/// Renders a QR code in half-line characters for a terminal with a dark background.
pub fn qr_text(text: &str) -> Result<String, QrError> {
    let code = QrCode::new(text)?;
    let (dark, light) = (unicode::Dense1x2::Light, unicode::Dense1x2::Dark);
    Ok(code.render::<unicode::Dense1x2>().dark_color(dark).light_color(light).build())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINK: &str = "http://192.168.100.100:18700/operate#collection=1&robot=A&token=0123456789abcdef0123456789abcdef01234567";

    /// Parses the modules of a QR code from its characters; true is dark.
    fn modules(text: &str) -> Vec<Vec<bool>> {
        let halves = |line: &str| {
            let upper = line.chars().map(|char| !matches!(char, '█' | '▀')).collect::<Vec<_>>();
            let lower = line.chars().map(|char| !matches!(char, '█' | '▄')).collect::<Vec<_>>();
            [upper, lower]
        };
        text.lines().flat_map(halves).collect()
    }

    #[test]
    fn a_code_in_characters_has_the_modules_of_the_code() {
        let code = QrCode::new(LINK).unwrap();
        let drawn = modules(&qr_text(LINK).unwrap());
        let width = code.width();
        let quiet = (drawn[0].len() - width) / 2;
        assert_eq!(quiet, 4, "readers want four modules of light around");
        for y in 0..width {
            for x in 0..width {
                let dark = code[(x, y)] == qrcode::Color::Dark;
                assert_eq!(drawn[y + quiet][x + quiet], dark, "{x}, {y}");
            }
        }
        assert!(qr_text(LINK).unwrap().lines().count() <= 30, "it fits a terminal");
    }

    #[test]
    fn a_picture_holds_no_link() {
        let picture = qr_svg(LINK).unwrap();
        assert!(picture.contains("<svg") && !picture.contains("token"), "{picture}");
        assert!(qr_svg(&"x".repeat(5000)).is_err());
    }
}
