//! Parser of expressions. The grammar is CEL's without maps, messages, selectors and macros.

use std::ops::Range;

use super::Mistake;

/// Maximum length of an expression; longer ones should be split into terms.
const LONGEST_BYTES: usize = 4000;
/// Maximum nesting depth of brackets, signs and choices.
const DEEPEST: usize = 40;

/// A node of the syntax tree.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    pub at: Range<usize>,
    pub kind: NodeKind,
}

#[derive(Clone, Debug, PartialEq)]
pub enum NodeKind {
    Truth(bool),
    Number(f64),
    Text(String),
    List(Vec<Node>),
    Name(String),
    Call { name: String, name_at: Range<usize>, arguments: Vec<Node> },
    Not(Box<Node>),
    Minus(Box<Node>),
    Pair { operator: Operator, parts: Box<[Node; 2]> },
    Choice(Box<[Node; 3]>),
}

/// A binary operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    Or,
    And,
    Compares(Relation),
    Combines(Arithmetic),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    Equal,
    Unequal,
    Less,
    AtMost,
    Greater,
    AtLeast,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arithmetic {
    Plus,
    Minus,
    Times,
    Over,
}

/// Operators by precedence, the weakest first; all are left-associative. A longer token precedes its prefix.
const LEVELS: [&[(&str, Operator)]; 5] = [
    &[("||", Operator::Or)],
    &[("&&", Operator::And)],
    &[
        ("==", Operator::Compares(Relation::Equal)),
        ("!=", Operator::Compares(Relation::Unequal)),
        ("<=", Operator::Compares(Relation::AtMost)),
        (">=", Operator::Compares(Relation::AtLeast)),
        ("<", Operator::Compares(Relation::Less)),
        (">", Operator::Compares(Relation::Greater)),
    ],
    &[("+", Operator::Combines(Arithmetic::Plus)), ("-", Operator::Combines(Arithmetic::Minus))],
    &[("*", Operator::Combines(Arithmetic::Times)), ("/", Operator::Combines(Arithmetic::Over))],
];

/// Parses a whole text.
pub fn read(text: &str) -> Result<Node, Mistake> {
    if text.len() > LONGEST_BYTES {
        let what =
            format!("an expression has at most {LONGEST_BYTES} bytes; give parts of it names in [terms]");
        return Err(Mistake::new(0..1, what));
    }
    let mut reader = Reader { text, at: 0, depth: 0 };
    let node = reader.choice()?;
    reader.skip_space();
    match reader.rest().is_empty() {
        true => Ok(node),
        false => Err(reader.unexpected("an operator, for example && or >=, or the end")),
    }
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
}

impl Reader<'_> {
    fn rest(&self) -> &str {
        &self.text[self.at..]
    }

    /// Skips white space and comments.
    fn skip_space(&mut self) {
        loop {
            let rest = self.rest();
            let space = rest.len() - rest.trim_start().len();
            let comment = if rest[space..].starts_with("//") {
                rest[space..].find('\n').unwrap_or(rest.len() - space)
            } else {
                0
            };
            self.at += space + comment;
            if comment == 0 {
                return;
            }
        }
    }

    /// Skips `sign` and returns true if it comes next.
    fn take(&mut self, sign: &str) -> bool {
        self.skip_space();
        let found = self.rest().starts_with(sign);
        self.at += if found { sign.len() } else { 0 };
        found
    }

    fn expect(&mut self, sign: &str, what: &str) -> Result<(), Mistake> {
        match self.take(sign) {
            true => Ok(()),
            false => Err(self.unexpected(what)),
        }
    }

    fn unexpected(&self, wanted: &str) -> Mistake {
        let found = self.rest().chars().next();
        let hint = match found {
            Some('&' | '|') => "; and is &&, or is ||",
            Some('=') => "; equal is ==, at least is >=",
            Some('.') => "; facts are functions, for example lift_m(\"bottle\")",
            _ => "",
        };
        match found {
            Some(found) => {
                let at = self.at..self.at + found.len_utf8();
                Mistake::new(at, format!("{found:?} stands where {wanted} is expected{hint}"))
            }
            None => Mistake::new(self.at..self.at, format!("the expression ends where {wanted} is expected")),
        }
    }

    /// Parses one nesting level deeper.
    fn deeper(&mut self, read: impl FnOnce(&mut Self) -> Result<Node, Mistake>) -> Result<Node, Mistake> {
        if self.depth == DEEPEST {
            let what =
                format!("more than {DEEPEST} brackets stand within each other; give parts names in [terms]");
            return Err(Mistake::new(self.at..self.at + 1, what));
        }
        self.depth += 1;
        let read = read(self);
        self.depth -= 1;
        read
    }

    fn choice(&mut self) -> Result<Node, Mistake> {
        self.deeper(|reader| {
            let asked = reader.pairs(0)?;
            if !reader.take("?") {
                return Ok(asked);
            }
            let yes = reader.choice()?;
            reader.expect(":", "the ':' of a choice, as in a ? b : c,")?;
            let no = reader.choice()?;
            let at = asked.at.start..no.at.end;
            Ok(Node { at, kind: NodeKind::Choice(Box::new([asked, yes, no])) })
        })
    }

    fn pairs(&mut self, level: usize) -> Result<Node, Mistake> {
        let Some(operators) = LEVELS.get(level) else { return self.sign() };
        let mut left = self.pairs(level + 1)?;
        while let Some((_, operator)) = operators.iter().find(|(sign, _)| self.take(sign)) {
            let right = self.pairs(level + 1)?;
            let at = left.at.start..right.at.end;
            left = Node { at, kind: NodeKind::Pair { operator: *operator, parts: Box::new([left, right]) } };
        }
        Ok(left)
    }

    fn sign(&mut self) -> Result<Node, Mistake> {
        self.skip_space();
        let start = self.at;
        let wrap: fn(Box<Node>) -> NodeKind = if self.rest().starts_with('!') {
            NodeKind::Not
        } else if self.rest().starts_with('-') {
            NodeKind::Minus
        } else {
            return self.atom();
        };
        self.at += 1;
        let inner = self.deeper(Reader::sign)?;
        Ok(Node { at: start..inner.at.end, kind: wrap(Box::new(inner)) })
    }

    fn atom(&mut self) -> Result<Node, Mistake> {
        self.skip_space();
        let start = self.at;
        let node = |reader: &Self, kind| Ok(Node { at: start..reader.at, kind });
        match self.rest().chars().next() {
            Some('(') => {
                self.at += 1;
                let inner = self.choice()?;
                self.expect(")", "a ')'")?;
                node(self, inner.kind)
            }
            Some('[') => {
                self.at += 1;
                let parts = self.list("]")?;
                node(self, NodeKind::List(parts))
            }
            Some(quote @ ('"' | '\'')) => {
                let text = self.quoted(quote)?;
                node(self, NodeKind::Text(text))
            }
            Some(digit) if digit.is_ascii_digit() => self.number(),
            Some(letter) if letter.is_ascii_alphabetic() || letter == '_' => self.named(),
            _ => Err(self.unexpected("a condition or a number")),
        }
    }

    /// Parses a comma-separated list up to `end`.
    fn list(&mut self, end: &str) -> Result<Vec<Node>, Mistake> {
        let mut parts = Vec::new();
        if self.take(end) {
            return Ok(parts);
        }
        loop {
            parts.push(self.choice()?);
            if self.take(end) {
                return Ok(parts);
            }
            self.expect(",", &format!("a ',' or {end:?}"))?;
        }
    }

    fn quoted(&mut self, quote: char) -> Result<String, Mistake> {
        let start = self.at;
        let inside = &self.rest()[1..];
        let Some(length) = inside.find(quote) else {
            return Err(Mistake::new(
                start..start + 1,
                format!("the text that begins here has no closing {quote}"),
            ));
        };
        let text = inside[..length].to_owned();
        self.at += length + 2;
        match text.contains(['\\', '\n']) {
            true => Err(Mistake::new(start..self.at, "a name is written without \\ and on one line")),
            false => Ok(text),
        }
    }

    fn number(&mut self) -> Result<Node, Mistake> {
        let start = self.at;
        let rest = self.rest();
        let digits = |from: usize| {
            from + rest[from..].find(|char: char| !char.is_ascii_digit()).unwrap_or(rest.len() - from)
        };
        let mut end = digits(0);
        if rest[end..].starts_with('.') {
            end = digits(end + 1);
        }
        if rest[end..].starts_with(['e', 'E']) {
            let signed = end + 1 + usize::from(rest[end + 1..].starts_with(['+', '-']));
            end = digits(signed);
        }
        let word = rest[end..].chars().take_while(|char| char.is_alphanumeric() || *char == '_').count();
        let text = &rest[..end];
        let parsed = text.parse().ok().filter(|value: &f64| value.is_finite() && word == 0);
        self.at += end;
        let at = start..self.at;
        match parsed {
            Some(value) => Ok(Node { at, kind: NodeKind::Number(value) }),
            None => Err(Mistake::new(
                at,
                "no number; write it as 3, 0.03 or 1e-3, and its unit into no place but names",
            )),
        }
    }

    fn named(&mut self) -> Result<Node, Mistake> {
        let start = self.at;
        let rest = self.rest();
        let end = rest.find(|char: char| !char.is_ascii_alphanumeric() && char != '_').unwrap_or(rest.len());
        let name = rest[..end].to_owned();
        self.at += end;
        let name_at = start..self.at;
        let kind = match name.as_str() {
            "true" => NodeKind::Truth(true),
            "false" => NodeKind::Truth(false),
            _ if self.take("(") => {
                let arguments = self.list(")")?;
                NodeKind::Call { name, name_at, arguments }
            }
            _ => return Ok(Node { at: name_at, kind: NodeKind::Name(name) }),
        };
        Ok(Node { at: start..self.at, kind })
    }
}
