//! Lookup of attributes that `mjcf-rs` does not read, on an element or inherited from classes.

use std::collections::BTreeMap;

use roxmltree::{Document, Node};

/// Default classes of a file by name.
pub(in crate::mjcf) struct Classes<'a, 'i> {
    /// A class may be defined in several places.
    named: BTreeMap<&'a str, Vec<Node<'a, 'i>>>,
}

impl<'a, 'i: 'a> Classes<'a, 'i> {
    pub fn of(xml: &'a Document<'i>) -> Classes<'a, 'i> {
        let mut named: BTreeMap<&str, Vec<Node>> = BTreeMap::new();
        for class in xml.descendants().filter(|node| node.has_tag_name("default")) {
            named.entry(class.attribute("class").unwrap_or("main")).or_default().push(class);
        }
        Classes { named }
    }

    /// Returns the classes of an element, the nearest first; each is nested in the next.
    pub fn of_element(&self, node: &Node<'a, 'i>) -> Vec<Node<'a, 'i>> {
        let around = node.ancestors().skip(1).find_map(|one| one.attribute("childclass"));
        let name = node.attribute("class").or(around).unwrap_or("main");
        let places = self.named.get(name).into_iter().flatten();
        places.flat_map(|class| class.ancestors().take_while(|one| one.has_tag_name("default"))).collect()
    }

    /// Returns an attribute of an element: its own value, or that of the nearest class that has it.
    pub fn stated(&self, node: &Node<'a, 'i>, attribute: &str) -> Option<&'a str> {
        node.attribute(attribute).or_else(|| {
            let elements = self.of_element(node).into_iter().filter_map(|class| {
                class
                    .children()
                    .find(|child| child.tag_name() == node.tag_name() && child.has_attribute(attribute))
            });
            elements.filter_map(|element| element.attribute(attribute)).next()
        })
    }
}
