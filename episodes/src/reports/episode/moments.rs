//! Key moments of an episode: what happened when, and what cameras saw of it.

use base64::{Engine, prelude::BASE64_STANDARD};

use crate::html::escape;

/// One moment.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyMoment {
    /// What happened, and when.
    pub caption: [String; 2],
    /// Third person, then each robot's view.
    pub views: Vec<LabelledPicture>,
}

/// One picture and whose it is.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelledPicture {
    pub label: String,
    /// The picture as a file, PNG or WebP: many times smaller than its pixels, which would wait until the episode's end.
    pub file: Vec<u8>,
}

/// Moments side by side as far as there is room, each with its texts and its pictures; the pictures are part of the page.
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

/// A picture that is part of the page; `alt` is HTML.
pub fn picture(file: &[u8], alt: &str) -> String {
    let kind = if file.starts_with(b"RIFF") { "webp" } else { "png" };
    format!(
        r#"<img loading="lazy" alt="{alt}" src="data:image/{kind};base64,{}">"#,
        BASE64_STANDARD.encode(file)
    )
}
