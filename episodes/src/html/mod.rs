//! HTML pages: their common frame, and the escaping of text.

/// Style of all pages, for light and dark modes and for screens from a phone's width. It loads no other
/// files.
const STYLE: &str = include_str!("page.css");

/// Returns a self-contained page: no script, no font, no image from elsewhere. `title` is text, `body` is
/// HTML.
pub fn page(title: &str, body: &str) -> String {
    let title = escape(title);
    format!(
        r#"<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
{STYLE}</style>
</head>
<body>
<main>
{body}
</main>
</body>
</html>
"#
    )
}

/// Escapes text for HTML, including attributes.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\'' => escaped += "&#39;",
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_means_something_in_html_is_escaped() {
        assert_eq!(escape(r#"a<b>&"c"'d'"#), "a&lt;b&gt;&amp;&quot;c&quot;&#39;d&#39;");
        assert!(page("a<b>", "").contains("<title>a&lt;b&gt;</title>"));
    }

    /// On a screen of 400 pixels, which are 25 rem, no element may be wider than the page unless it scrolls.
    #[test]
    fn nothing_has_a_width_that_a_telephone_has_not() {
        let narrow_rem = 25.0;
        let mut found = 0;
        for (property, value) in declarations() {
            if !matches!(property, "width" | "min-width" | "grid-template-columns" | "flex-basis") {
                continue;
            }
            for length in value.split([' ', ',', '(', ')']).filter_map(|word| word.strip_suffix("rem")) {
                let length_rem: f64 = length.parse().unwrap();
                let gives_way = value.contains("min(100%") || value.contains("min(46%");
                assert!(gives_way || length_rem <= narrow_rem - 7.0, "{property}: {value}");
                found += 1;
            }
            assert!(!value.contains("px") && !value.contains("vw"), "{property}: {value}");
        }
        assert!(found > 5, "the style has {found} widths");
    }

    #[test]
    fn the_style_loads_nothing_and_knows_the_dark() {
        for foreign in ["url(", "@import", "http", "@font-face"] {
            assert!(!STYLE.contains(foreign), "{foreign}");
        }
        let [light, dark] = [":root {", "(prefers-color-scheme: dark) {\n  :root {"].map(|begin| {
            let (_, rest) = STYLE.split_once(begin).unwrap();
            rest.split_once('}').unwrap().0
        });
        let colours = light.split(';').filter_map(|line| line.split_once("--")?.1.split_once(": #"));
        for (name, _) in colours {
            assert!(dark.contains(&format!("--{name}:")), "{name} is missing in the dark");
        }
    }

    /// Returns the properties of the style sheet and their values.
    fn declarations() -> impl Iterator<Item = (&'static str, &'static str)> {
        let lines = STYLE.split(['{', '}', ';']);
        lines
            .filter_map(|line| line.split_once(": "))
            .map(|(property, value)| (property.trim(), value.trim()))
    }
}
