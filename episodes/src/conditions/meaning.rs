//! Checked expressions. Their evaluation cannot fail, and its cost is bounded.

use std::sync::Arc;

use tandem_sim::Side;

use super::syntax::{Arithmetic, Relation};
use crate::scoring::{Facts, Predicate, nearness};

/// Meaning of an expression of either type.
#[derive(Clone, Debug)]
pub enum Meaning {
    Truth(Arc<Truth>),
    Number(Arc<Number>),
}

/// A Boolean expression.
#[derive(Debug)]
pub enum Truth {
    Always(bool),
    Not(Arc<Truth>),
    /// Conjunction; evaluation stops at the first part that does not hold.
    All(Vec<Arc<Truth>>),
    Any(Vec<Arc<Truth>>),
    Compared {
        relation: Relation,
        sides: [Arc<Number>; 2],
    },
    /// Equality: both hold, or neither does.
    Same([Arc<Truth>; 2]),
    Choice([Arc<Truth>; 3]),
    Fact {
        statement: &'static Statement,
        arguments: Vec<Argument>,
    },
}

#[derive(Debug)]
pub enum Number {
    Value(f64),
    Minus(Arc<Number>),
    Combined { arithmetic: Arithmetic, sides: [Arc<Number>; 2] },
    Choice(Arc<Truth>, [Arc<Number>; 2]),
    Fact { measure: &'static Measure, arguments: Vec<Argument> },
}

/// A fact with a Boolean value.
#[derive(Debug)]
pub struct Statement {
    pub holds: fn(&Fact) -> bool,
    /// Nearness to holding, from 0 to 1, for a fact that is reached gradually.
    pub near: Option<fn(&Fact) -> f32>,
    /// Explanation of why it does not hold, in sentences; `None` if its text is explanation enough.
    pub lacks: Option<fn(&Fact) -> Vec<String>>,
}

#[derive(Debug)]
pub struct Measure {
    pub value: fn(&Fact) -> f64,
    /// Minimum and maximum of its value.
    pub values: [f64; 2],
}

/// Inputs of a fact: the world at one control step, and the arguments.
pub struct Fact<'a> {
    pub facts: &'a Facts,
    pub arguments: &'a [Argument],
}

/// Argument of a fact.
#[derive(Debug)]
pub enum Argument {
    Robot(usize),
    Robots(Vec<usize>),
    Side(Side),
    Object(String),
    Site(String),
    Number(Arc<Number>),
    Numbers(Vec<Arc<Number>>),
    Truth(Arc<Truth>),
}

impl Predicate for Truth {
    fn holds(&self, facts: &Facts) -> bool {
        match self {
            Truth::Always(holds) => *holds,
            Truth::Not(inner) => !inner.holds(facts),
            Truth::All(parts) => parts.iter().all(|part| part.holds(facts)),
            Truth::Any(parts) => parts.iter().any(|part| part.holds(facts)),
            Truth::Compared { relation, sides } => {
                compare(*relation, sides[0].value(facts), sides[1].value(facts))
            }
            Truth::Same([one, other]) => one.holds(facts) == other.holds(facts),
            Truth::Choice([asked, yes, no]) => if asked.holds(facts) { yes } else { no }.holds(facts),
            Truth::Fact { statement, arguments } => (statement.holds)(&Fact { facts, arguments }),
        }
    }
}

impl Truth {
    /// Returns the nearness to holding, from 0 to 1. The nearness of a conjunction is the mean of its
    /// parts; a hand that approaches an object counts gradually.
    pub fn nearness(&self, facts: &Facts) -> f32 {
        match self {
            Truth::All(parts) => {
                let parts: Vec<f32> = parts.iter().map(|part| part.nearness(facts)).collect();
                nearness::all(&parts)
            }
            Truth::Fact { statement: Statement { near: Some(near), .. }, arguments } => {
                near(&Fact { facts, arguments })
            }
            _ => nearness::is(self.holds(facts)),
        }
    }

    /// Returns both values of a comparison; `None` for anything else.
    pub fn sides(&self, facts: &Facts) -> Option<[f64; 2]> {
        match self {
            Truth::Compared { sides, .. } => Some(sides.each_ref().map(|side| side.value(facts))),
            _ => None,
        }
    }

    /// Returns true if nearness grows gradually, for example while a hand approaches its object.
    pub fn grows(&self) -> bool {
        matches!(self, Truth::Fact { statement: Statement { near: Some(_), .. }, .. })
    }

    /// Returns the constant result of an expression, if it can be shown not to depend on the world.
    pub fn always(&self) -> Option<bool> {
        match self {
            Truth::Always(holds) => Some(*holds),
            Truth::Not(inner) => inner.always().map(|holds| !holds),
            Truth::All(parts) => settled(parts, false),
            Truth::Any(parts) => settled(parts, true),
            Truth::Compared { relation, sides } => {
                always_compared(*relation, sides[0].range(), sides[1].range())
            }
            Truth::Same([one, other]) => Some(one.always()? == other.always()?),
            Truth::Choice([asked, yes, no]) => match asked.always() {
                Some(asked) => if asked { yes } else { no }.always(),
                None => yes.always().filter(|yes| no.always() == Some(*yes)),
            },
            Truth::Fact { .. } => None,
        }
    }

    /// Returns the number of parts evaluated. The parts of a term count at each use.
    pub fn size(&self) -> usize {
        let of = |parts: &[Arc<Truth>]| parts.iter().map(|part| part.size()).sum::<usize>();
        let own = match self {
            Truth::Always(_) => 0,
            Truth::Not(inner) => inner.size(),
            Truth::All(parts) | Truth::Any(parts) => of(parts),
            Truth::Compared { sides, .. } => sides.iter().map(|side| side.size()).sum(),
            Truth::Same(parts) => of(parts),
            Truth::Choice(parts) => of(parts),
            Truth::Fact { arguments, .. } => arguments.iter().map(Argument::size).sum(),
        };
        own.saturating_add(1)
    }
}

impl Number {
    pub fn value(&self, facts: &Facts) -> f64 {
        match self {
            Number::Value(value) => *value,
            Number::Minus(inner) => -inner.value(facts),
            Number::Combined { arithmetic, sides } => {
                combine(*arithmetic, sides[0].value(facts), sides[1].value(facts))
            }
            Number::Choice(asked, [yes, no]) => if asked.holds(facts) { yes } else { no }.value(facts),
            Number::Fact { measure, arguments } => (measure.value)(&Fact { facts, arguments }),
        }
    }

    /// Returns the minimum and maximum of its value.
    pub fn range(&self) -> [f64; 2] {
        match self {
            Number::Value(value) => [*value; 2],
            Number::Minus(inner) => {
                let [low_value, high_value] = inner.range();
                [-high_value, -low_value]
            }
            Number::Combined { arithmetic, sides: [one, other] } => {
                let ends = one.range().map(|one| other.range().map(|other| combine(*arithmetic, one, other)));
                let ends = ends.as_flattened();
                let crosses =
                    *arithmetic == Arithmetic::Over && other.range()[0] <= 0.0 && other.range()[1] >= 0.0;
                if crosses || ends.iter().any(|end| end.is_nan()) {
                    return [f64::NEG_INFINITY, f64::INFINITY];
                }
                ends.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], end| {
                    [low.min(*end), high.max(*end)]
                })
            }
            Number::Choice(_, parts) => {
                let [[low, high], [other_low, other_high]] = [parts[0].range(), parts[1].range()];
                [low.min(other_low), high.max(other_high)]
            }
            Number::Fact { measure, .. } => measure.values,
        }
    }

    pub fn size(&self) -> usize {
        let own = match self {
            Number::Value(_) => 0,
            Number::Minus(inner) => inner.size(),
            Number::Combined { sides, .. } => sides.iter().map(|side| side.size()).sum(),
            Number::Choice(asked, sides) => {
                asked.size() + sides.iter().map(|side| side.size()).sum::<usize>()
            }
            Number::Fact { arguments, .. } => arguments.iter().map(Argument::size).sum(),
        };
        own.saturating_add(1)
    }
}

impl Argument {
    fn size(&self) -> usize {
        match self {
            Argument::Number(inner) => inner.size(),
            Argument::Numbers(inner) => inner.iter().map(|part| part.size()).sum(),
            Argument::Truth(inner) => inner.size(),
            Argument::Robot(_)
            | Argument::Robots(_)
            | Argument::Side(_)
            | Argument::Object(_)
            | Argument::Site(_) => 1,
        }
    }
}

/// Returns the constant result of a conjunction (`by` false) or disjunction (`by` true), if there is one.
/// One part that is always `by` decides it, and so do parts that are all the opposite.
fn settled(parts: &[Arc<Truth>], by: bool) -> Option<bool> {
    let always: Vec<Option<bool>> = parts.iter().map(|part| part.always()).collect();
    if always.contains(&Some(by)) {
        return Some(by);
    }
    always.iter().all(|always| *always == Some(!by)).then_some(!by)
}

fn compare(relation: Relation, left_value: f64, right_value: f64) -> bool {
    match relation {
        Relation::Equal => left_value == right_value,
        Relation::Unequal => left_value != right_value,
        Relation::Less => left_value < right_value,
        Relation::AtMost => left_value <= right_value,
        Relation::Greater => left_value > right_value,
        Relation::AtLeast => left_value >= right_value,
    }
}

/// Returns the result of a comparison if it is the same for all values in these ranges.
fn always_compared(relation: Relation, left_values: [f64; 2], right_values: [f64; 2]) -> Option<bool> {
    let ([low, high], [right_low, right_high]) = (left_values, right_values);
    let (below, above) = (high < right_low, low > right_high);
    let (at_most, at_least) = (high <= right_low, low >= right_high);
    let same = low == high && left_values == right_values;
    let known = |yes: bool, no: bool| if yes { Some(true) } else { no.then_some(false) };
    match relation {
        Relation::Equal => known(same, below || above),
        Relation::Unequal => known(below || above, same),
        Relation::Less => known(below, at_least),
        Relation::AtMost => known(at_most, above),
        Relation::Greater => known(above, at_most),
        Relation::AtLeast => known(at_least, below),
    }
}

fn combine(arithmetic: Arithmetic, left_value: f64, right_value: f64) -> f64 {
    match arithmetic {
        Arithmetic::Plus => left_value + right_value,
        Arithmetic::Minus => left_value - right_value,
        Arithmetic::Times => left_value * right_value,
        Arithmetic::Over => left_value / right_value,
    }
}
