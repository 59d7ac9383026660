//! Settings of a file that apply to all its bodies.

use std::ops::RangeInclusive;

use super::source::MjcfText;
use crate::SimError;

#[derive(Clone, Debug, PartialEq)]
pub(in crate::mjcf) struct FileSettings {
    /// Groups of the geoms that contribute to the masses of bodies.
    pub inertia_groups: RangeInclusive<i32>,
    /// True if the file enables contacts.
    pub touches: bool,
    /// True if the file enables gravity.
    pub falls: bool,
}

impl Default for FileSettings {
    fn default() -> FileSettings {
        FileSettings { inertia_groups: 0..=5, touches: true, falls: true }
    }
}

impl FileSettings {
    /// Reads the settings. The last element that states a setting counts.
    pub fn of(source: &MjcfText) -> Result<FileSettings, SimError> {
        let xml = source.xml()?;
        let stated = |tag: &str, attribute: &str| {
            let elements = xml.descendants().filter(|node| node.has_tag_name(tag));
            elements.filter_map(|node| node.attribute(attribute)).next_back()
        };
        let mut settings = FileSettings::default();
        let numbers = |text: &str| -> Vec<i32> {
            text.split_ascii_whitespace().filter_map(|word| word.parse().ok()).collect()
        };
        if let Some([low, high]) = stated("compiler", "inertiagrouprange").map(numbers).as_deref() {
            settings.inertia_groups = *low..=*high;
        }
        settings.touches = stated("flag", "contact") != Some("disable");
        settings.falls = stated("flag", "gravity") != Some("disable");
        Ok(settings)
    }
}
