//! Lookup of attributes, own or inherited from classes, that `mjcf-rs` does not read.

use roxmltree::Node;

/// Returns an attribute of an element: its own, or that of the nearest class that has it.
pub(super) fn stated<'a>(node: &Node<'a, '_>, attribute: &str) -> Option<&'a str> {
    node.attribute(attribute).or_else(|| {
        let around = node.ancestors().skip(1).find_map(|one| one.attribute("childclass"));
        let name = node.attribute("class").or(around).unwrap_or("main");
        let is_class =
            |one: &Node| one.has_tag_name("default") && one.attribute("class").unwrap_or("main") == name;
        let classes = node.document().descendants().filter(is_class);
        let within =
            classes.flat_map(|class| class.ancestors().take_while(|one| one.has_tag_name("default")));
        let elements = within.filter_map(|class| {
            class
                .children()
                .find(|child| child.tag_name() == node.tag_name() && child.has_attribute(attribute))
        });
        elements.filter_map(|element| element.attribute(attribute)).next()
    })
}
