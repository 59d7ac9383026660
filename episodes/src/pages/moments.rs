//! Key moments of an episode: events, their times, and camera images of them.

use base64::{Engine, prelude::BASE64_STANDARD};

use crate::html::escape;

/// One moment.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyMoment {
    /// The event, and its time.
    pub caption: [String; 2],
    /// Third-person view, then each robot's view.
    pub views: Vec<LabelledPicture>,
}

/// An image and its label.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelledPicture {
    pub label: String,
    /// The image as a PNG or WebP file: many times smaller than its pixels, which would take memory until
    /// the episode's end.
    pub file: Vec<u8>,
}

/// Renders as many moments side by side as fit, each with its texts and images. The images are embedded in
/// the page.
pub fn html(moments: &[KeyMoment], class: &str) -> String {
    let mut figures = String::new();
    for KeyMoment { caption: [what, when], views } in moments {
        figures += &format!("<div><p>{} <span class=\"soft\">{}</span></p>", escape(what), escape(when));
        for LabelledPicture { label, file } in views {
            let label = escape(label);
            figures += &format!(
                r#"<figure>{}<figcaption>{label}</figcaption></figure>"#,
                picture(file, &format!("{label}, {} {}", escape(what), escape(when))),
            );
        }
        figures += "</div>\n";
    }
    format!(r#"<div class="{class}">{figures}</div>"#)
}

/// Returns an embedded image; `alt` is HTML.
pub fn picture(file: &[u8], alt: &str) -> String {
    let kind = if file.starts_with(b"RIFF") { "webp" } else { "png" };
    format!(
        r#"<img loading="lazy" alt="{alt}" src="data:image/{kind};base64,{}">"#,
        BASE64_STANDARD.encode(file)
    )
}
