//! Type checking of expressions: resolves names, and checks that each part has the type that its position
//! requires. Mistakes include a hint at a valid form.

use std::ops::Range;
use std::sync::Arc;

use tandem_sim::{ObjectModel, OpeningKind, Side};

use super::functions::{FUNCTIONS, Function, Gives, Parameter};
use super::meaning::{Argument, Meaning, Number, Truth};
use super::syntax::{Node, NodeKind, Operator, Relation};
use super::{Mistake, Names};

/// Maximum number of parts evaluated in a control step; the parts of a term count at each use.
const MAX_PARTS: usize = 5000;

pub fn truth(node: &Node, names: &Names) -> Result<Arc<Truth>, Mistake> {
    let truth = Checker { names }.truth(node)?;
    small(truth.size(), &node.at)?;
    Ok(truth)
}

pub fn number(node: &Node, names: &Names) -> Result<Arc<Number>, Mistake> {
    let number = Checker { names }.number(node)?;
    small(number.size(), &node.at)?;
    Ok(number)
}

pub fn meaning(node: &Node, names: &Names) -> Result<Meaning, Mistake> {
    let meaning = Checker { names }.meaning(node)?;
    let size = match &meaning {
        Meaning::Truth(truth) => truth.size(),
        Meaning::Number(number) => number.size(),
    };
    small(size, &node.at)?;
    Ok(meaning)
}

/// Returns the operands of a chain of `&&`, or the node itself if it is no such chain.
pub fn joined(node: &Node) -> Vec<&Node> {
    match &node.kind {
        NodeKind::Pair { operator: Operator::And, parts } => parts.iter().flat_map(joined).collect(),
        _ => vec![node],
    }
}

fn small(size: usize, at: &Range<usize>) -> Result<(), Mistake> {
    match size <= MAX_PARTS {
        true => Ok(()),
        false => Err(Mistake::new(
            at.clone(),
            format!("this has {size} parts, terms counted wherever they stand; {MAX_PARTS} are the most"),
        )),
    }
}

struct Checker<'a> {
    names: &'a Names,
}

impl Checker<'_> {
    fn meaning(&self, node: &Node) -> Result<Meaning, Mistake> {
        match &node.kind {
            NodeKind::Truth(holds) => Ok(Truth::Always(*holds).into()),
            NodeKind::Number(value) => Ok(Number::Value(*value).into()),
            NodeKind::Text(text) => {
                let what = format!(
                    "{text:?} is a text; texts stand in the brackets of facts, as in lift_m({text:?}) >= 0.03, or are compared with \
                     texts, as what a seed has chosen: \"{{wanted}}\" == \"red\""
                );
                Err(Mistake::new(node.at.clone(), what))
            }
            NodeKind::List(_) => {
                let what =
                    "a list stands only in the brackets of facts, as in held_by_all([\"A\", \"B\"], ...)";
                Err(Mistake::new(node.at.clone(), what))
            }
            NodeKind::Name(name) => self.term(name, &node.at),
            NodeKind::Call { name, name_at, arguments } => self.call(name, name_at, &node.at, arguments),
            NodeKind::Not(inner) => Ok(Truth::Not(self.truth(inner)?).into()),
            NodeKind::Minus(inner) => Ok(Number::Minus(self.number(inner)?).into()),
            NodeKind::Pair { operator, parts } => self.pair(*operator, parts),
            NodeKind::Choice(parts) => self.choice(parts),
        }
    }

    fn truth(&self, node: &Node) -> Result<Arc<Truth>, Mistake> {
        match self.meaning(node)? {
            Meaning::Truth(truth) => Ok(truth),
            Meaning::Number(_) => Err(Mistake::new(
                node.at.clone(),
                "this is a number, and something that holds or not is wanted; compare it, as with >= 0.03",
            )),
        }
    }

    fn number(&self, node: &Node) -> Result<Arc<Number>, Mistake> {
        match self.meaning(node)? {
            Meaning::Number(number) => Ok(number),
            Meaning::Truth(_) => Err(Mistake::new(
                node.at.clone(),
                "this holds or does not, and a number is wanted; several relations are joined by &&",
            )),
        }
    }

    fn pair(&self, operator: Operator, parts: &[Node; 2]) -> Result<Meaning, Mistake> {
        let [left, right] = parts;
        match operator {
            Operator::And => Ok(Truth::All(self.joined(operator, parts)?).into()),
            Operator::Or => Ok(Truth::Any(self.joined(operator, parts)?).into()),
            Operator::Combines(arithmetic) => {
                let sides = [self.number(left)?, self.number(right)?];
                Ok(Number::Combined { arithmetic, sides }.into())
            }
            Operator::Compares(relation) => self.compared(relation, left, right),
        }
    }

    /// Returns the operands of a chain of `&&` or `||`, with the left one flattened if it is a chain of
    /// the same operator.
    fn joined(&self, operator: Operator, [left, right]: &[Node; 2]) -> Result<Vec<Arc<Truth>>, Mistake> {
        let mut found = match &left.kind {
            NodeKind::Pair { operator: same, parts } if *same == operator => self.joined(operator, parts)?,
            _ => vec![self.truth(left)?],
        };
        found.push(self.truth(right)?);
        Ok(found)
    }

    fn compared(&self, relation: Relation, left: &Node, right: &Node) -> Result<Meaning, Mistake> {
        // Options chosen by a seed have become plain texts by now.
        if let (NodeKind::Text(one), NodeKind::Text(other)) = (&left.kind, &right.kind) {
            match relation {
                Relation::Equal => return Ok(Truth::Always(one == other).into()),
                Relation::Unequal => return Ok(Truth::Always(one != other).into()),
                _ => {}
            }
        }
        match (self.meaning(left)?, relation) {
            (Meaning::Number(number), _) => {
                Ok(Truth::Compared { relation, sides: [number, self.number(right)?] }.into())
            }
            (Meaning::Truth(truth), Relation::Equal) => Ok(Truth::Same([truth, self.truth(right)?]).into()),
            (Meaning::Truth(truth), Relation::Unequal) => {
                Ok(Truth::Not(Truth::Same([truth, self.truth(right)?]).into()).into())
            }
            (Meaning::Truth(_), _) => Err(Mistake::new(
                left.at.clone(),
                "this holds or does not, and cannot be more or less than something; write a < b && b < c for both",
            )),
        }
    }

    fn choice(&self, [asked, yes, no]: &[Node; 3]) -> Result<Meaning, Mistake> {
        let asked = self.truth(asked)?;
        match self.meaning(yes)? {
            Meaning::Truth(yes) => Ok(Truth::Choice([asked, yes, self.truth(no)?]).into()),
            Meaning::Number(yes) => Ok(Number::Choice(asked, [yes, self.number(no)?]).into()),
        }
    }

    /// Returns the meaning of one of the file's terms.
    fn term(&self, name: &str, at: &Range<usize>) -> Result<Meaning, Mistake> {
        if let Some(meaning) = self.names.terms.get(name) {
            return Ok(meaning.clone());
        }
        if self.names.mistaken_terms.contains(name) {
            return Err(Mistake::following(at.clone()));
        }
        let what = match FUNCTIONS.iter().find(|function| function.name == name) {
            Some(function) => {
                format!("{name} is asked for with brackets, for example {}", function.signature())
            }
            None if self.names.objects.contains_key(name)
                || self.names.robots.iter().any(|one| one == name) =>
            {
                format!(
                    "{name} is a name; it stands in quotes, and in the brackets of a fact, as in lift_m(\"bottle\")"
                )
            }
            None => {
                let terms: Vec<&str> = self.names.terms.keys().map(String::as_str).collect();
                let have = if terms.is_empty() { "none yet".to_owned() } else { terms.join(", ") };
                let facts = FUNCTIONS.iter().map(|function| function.name);
                format!("no term {name:?} above this in [terms]; have: {have}{}", nearest(name, facts))
            }
        };
        Err(Mistake::new(at.clone(), what))
    }

    fn call(
        &self,
        name: &str,
        name_at: &Range<usize>,
        at: &Range<usize>,
        nodes: &[Node],
    ) -> Result<Meaning, Mistake> {
        let Some(function) = FUNCTIONS.iter().find(|function| function.name == name) else {
            let known: Vec<&str> = FUNCTIONS.iter().map(|function| function.name).collect();
            let text = format!(
                "no fact {name:?}{}; have: {}",
                nearest(name, known.iter().copied()),
                known.join(", ")
            );
            return Err(Mistake::new(name_at.clone(), text));
        };
        if nodes.len() != function.parameters.len() {
            let text = format!(
                "{} things stand in the brackets of {name}, and {} are wanted: {}",
                nodes.len(),
                function.parameters.len(),
                function.signature()
            );
            return Err(Mistake::new(at.clone(), text));
        }
        let mut arguments = Vec::with_capacity(nodes.len());
        for (node, parameter) in nodes.iter().zip(function.parameters) {
            arguments.push(self.argument(function, *parameter, node, &arguments)?);
        }
        Ok(match &function.gives {
            Gives::Truth(statement) => Truth::Fact { statement, arguments }.into(),
            Gives::Number(measure) => Number::Fact { measure, arguments }.into(),
        })
    }

    /// Checks the argument of a call that follows `before`.
    fn argument(
        &self,
        function: &Function,
        parameter: Parameter,
        node: &Node,
        before: &[Argument],
    ) -> Result<Argument, Mistake> {
        let objects = || self.names.objects.keys().map(String::as_str);
        match parameter {
            Parameter::Robot => self.robot(function, node).map(Argument::Robot),
            Parameter::Robots => {
                let robots = listed(function, node, "[\"A\", \"B\"]")?;
                let robots = robots.iter().map(|robot| self.robot(function, robot));
                robots.collect::<Result<_, _>>().map(Argument::Robots)
            }
            Parameter::Side => match text(function, node, "\"left\" or \"right\"")? {
                "left" => Ok(Argument::Side(Side::Left)),
                "right" => Ok(Argument::Side(Side::Right)),
                other => Err(unknown(node, "hand", other, ["left", "right"].into_iter())),
            },
            Parameter::Object => {
                let name = text(function, node, "an object's name in quotes")?;
                match self.names.objects.contains_key(name) {
                    true => Ok(Argument::Object(name.into())),
                    false if self.names.mistaken_objects.contains(name) => {
                        Err(Mistake::following(node.at.clone()))
                    }
                    false => Err(unknown(node, "object", name, objects())),
                }
            }
            Parameter::Opening(kind) => self.opening(function, node, kind),
            Parameter::Site { of } => self.site(function, node, before.get(of)),
            Parameter::Number(_) => self.number(node).map(Argument::Number),
            Parameter::Numbers => {
                let numbers = listed(function, node, "[0.5, 1]")?;
                let numbers = numbers.iter().map(|number| self.number(number));
                numbers.collect::<Result<_, _>>().map(Argument::Numbers)
            }
            Parameter::Truth => self.truth(node).map(Argument::Truth),
        }
    }

    fn robot(&self, function: &Function, node: &Node) -> Result<usize, Mistake> {
        let name = text(function, node, "a robot's name in quotes")?;
        let found = self.names.robots.iter().position(|robot| robot == name);
        found.ok_or_else(|| unknown(node, "robot", name, self.names.robots.iter().map(String::as_str)))
    }

    /// Returns the object that a node names. Its joint must be of this kind.
    fn opening(&self, function: &Function, node: &Node, kind: OpeningKind) -> Result<Argument, Mistake> {
        let name = self.argument(function, Parameter::Object, node, &[])?;
        let opens = |object: &Arc<ObjectModel>| object.opening.as_ref().is_some_and(|one| one.kind == kind);
        match &name {
            Argument::Object(object) if !self.names.objects.get(object).is_some_and(opens) => {
                let openings = self.names.objects.iter().filter(|(_, object)| opens(object));
                let what = match kind {
                    OpeningKind::Hinge => "object with a hinge",
                    OpeningKind::Slide => "object with a slide",
                };
                Err(unknown(node, what, object, openings.map(|(name, _)| name.as_str())))
            }
            _ => Ok(name),
        }
    }

    fn site(&self, function: &Function, node: &Node, of: Option<&Argument>) -> Result<Argument, Mistake> {
        let name = text(function, node, "the name of a site of the object, in quotes")?;
        let object = match of {
            Some(Argument::Object(object)) => self.names.objects.get(object),
            _ => None,
        };
        let sites = || object.iter().flat_map(|object| &object.sites).map(|site| site.name.as_str());
        match sites().any(|site| site == name) {
            true => Ok(Argument::Site(name.into())),
            false => Err(unknown(node, "site of that object", name, sites())),
        }
    }
}

impl From<Truth> for Meaning {
    fn from(truth: Truth) -> Meaning {
        Meaning::Truth(truth.into())
    }
}

impl From<Number> for Meaning {
    fn from(number: Number) -> Meaning {
        Meaning::Number(number.into())
    }
}

/// Returns the text at a position that requires one.
fn text<'a>(function: &Function, node: &'a Node, wanted: &str) -> Result<&'a str, Mistake> {
    match &node.kind {
        NodeKind::Text(text) => Ok(text),
        _ => Err(Mistake::new(node.at.clone(), format!("{wanted} is wanted here: {}", function.signature()))),
    }
}

/// Returns the elements of the list at a position that requires one.
fn listed<'a>(function: &Function, node: &'a Node, example: &str) -> Result<&'a [Node], Mistake> {
    match &node.kind {
        NodeKind::List(parts) if !parts.is_empty() => Ok(parts),
        _ => {
            let what = format!("a list as {example} is wanted here: {}", function.signature());
            Err(Mistake::new(node.at.clone(), what))
        }
    }
}

fn unknown<'a>(node: &Node, kind: &str, name: &str, have: impl Iterator<Item = &'a str> + Clone) -> Mistake {
    let known: Vec<&str> = have.clone().collect();
    let known = if known.is_empty() { "none".into() } else { known.join(", ") };
    Mistake::new(node.at.clone(), format!("no {kind} {name:?}{}; have: {known}", nearest(name, have)))
}

/// Returns a suggestion such as "; is it lift_m?" if a known name is similar to this one, and an empty
/// text otherwise.
pub fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> String {
    let changes = known.map(|known| (changes(name, known), known)).min();
    match changes {
        Some((changes, known)) if changes > 0 && changes <= 1 + name.len() / 4 => format!("; is it {known}?"),
        _ => String::new(),
    }
}

/// Returns the Levenshtein distance of two words.
fn changes(one: &str, other: &str) -> usize {
    let other: Vec<char> = other.chars().collect();
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (index, letter) in one.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = index + 1;
        for (column, beside) in other.iter().enumerate() {
            let exchanged = diagonal + usize::from(letter != *beside);
            diagonal = row[column + 1];
            row[column + 1] = exchanged.min(row[column] + 1).min(diagonal + 1);
        }
    }
    row[other.len()]
}
