//! Conditions on combinations of values: `tilt + 'sliding angle' <= 120`.

use crate::scene::suggest::{closest, quoted_list};
use crate::sweep::axes::Axis;

/// Tolerance for equality, relative to the magnitude of the terms: 0.1 + 0.2 equals 0.3.
const SAME: f64 = 1e-12;
const LONGEST: usize = 500;
/// Comparison operators. `<=` comes before `<`, so that the parser recognises the longer operator.
const COMPARISONS: [&str; 6] = ["<=", ">=", "==", "!=", "<", ">"];

const EXAMPLE: &str = "write a comparison of axis names and numbers, as in \"tilt + angle <= 120\"";

type MessageAndHelp = (String, String);

/// A comparison or a chain of comparisons: `0 <= tilt - angle <= 30`.
#[derive(Debug)]
pub(super) struct Requirement {
    sides: Vec<Expression>,
    signs: Vec<&'static str>,
}

#[derive(Debug)]
enum Expression {
    Number(f64),
    AxisValue(usize, usize),
    Negative(Box<Expression>),
    Binary(Box<[Expression; 2]>, char),
}

/// The combinations that meet all requirements, with the last axis varying fastest.
pub(super) fn combinations(axes: &[Axis], requirements: &[Requirement]) -> Vec<Vec<usize>> {
    let count: usize = axes.iter().map(|axis| axis.values.len()).product();
    let choice = |mut rest: usize| {
        let mut choice = vec![0; axes.len()];
        for (i, axis) in axes.iter().enumerate().rev() {
            (choice[i], rest) = (rest % axis.values.len(), rest / axis.values.len());
        }
        choice
    };
    let fits = |choice: &Vec<usize>| requirements.iter().all(|one| one.is_met(axes, choice));
    (0..count).map(choice).filter(fits).collect()
}

impl Requirement {
    /// Parses a requirement, or returns message and help of the first error.
    pub fn parse(text: &str, axes: &[Axis]) -> Result<Self, MessageAndHelp> {
        if text.len() > LONGEST {
            let message =
                format!("a condition of `require` has {} bytes; at most {LONGEST} are allowed", text.len());
            return Err((message, "split it into several conditions".to_owned()));
        }
        let mut parser = Parser { text, rest: text, axes, named: false };
        let (mut sides, mut signs) = (vec![parser.sum(0)?], Vec::new());
        while let Some(sign) = COMPARISONS.into_iter().find(|sign| parser.takes(sign)) {
            signs.push(sign);
            sides.push(parser.sum(0)?);
        }
        if !parser.rest.trim().is_empty() || signs.is_empty() {
            return Err(parser.unexpected("a comparison (<=, <, ==, !=, >, >=)"));
        }
        if !parser.named {
            return Err((
                format!("`{text}` does not contain the name of an axis"),
                format!("axes: {}", parser.names()),
            ));
        }
        Ok(Self { sides, signs })
    }

    fn is_met(&self, axes: &[Axis], choice: &[usize]) -> bool {
        let values: Vec<[f64; 2]> = self.sides.iter().map(|side| side.value(axes, choice)).collect();
        values.windows(2).zip(&self.signs).all(|(pair, sign)| {
            let [[a, size_a], [b, size_b]] = [pair[0], pair[1]];
            let same = (a - b).abs() <= SAME * size_a.max(size_b);
            let is_less = a < b && !same;
            let is_more = a > b && !same;
            match *sign {
                "<=" => is_less || same,
                ">=" => is_more || same,
                "<" => is_less,
                ">" => is_more,
                "==" => same,
                _ => is_less || is_more,
            }
        })
    }
}

impl Expression {
    /// Value of the expression, and the magnitude of its terms, to which the rounding error is proportional.
    fn value(&self, axes: &[Axis], choice: &[usize]) -> [f64; 2] {
        match self {
            Self::Number(number) => [*number, number.abs()],
            Self::AxisValue(axis, key) => {
                let number = axes[*axis].value_of_key(choice[*axis], *key).unwrap_or(f64::NAN);
                [number, number.abs()]
            }
            Self::Negative(of) => {
                let [number, size] = of.value(axes, choice);
                [-number, size]
            }
            Self::Binary(pair, sign) => {
                let [[a, size_a], [b, size_b]] = [&pair[0], &pair[1]].map(|one| one.value(axes, choice));
                match sign {
                    '+' => [a + b, size_a.max(size_b)],
                    '-' => [a - b, size_a.max(size_b)],
                    '*' => [a * b, size_a * size_b],
                    _ => [a / b, size_a * size_b / (b * b)],
                }
            }
        }
    }
}

const DEEPEST: usize = 40;

struct Parser<'a> {
    text: &'a str,
    rest: &'a str,
    axes: &'a [Axis],
    /// Whether the text has named an axis so far.
    named: bool,
}

impl<'a> Parser<'a> {
    fn takes(&mut self, word: &str) -> bool {
        let after = self.rest.trim_start().strip_prefix(word);
        self.rest = after.unwrap_or(self.rest);
        after.is_some()
    }

    fn unexpected(&self, wanted: &str) -> MessageAndHelp {
        let found = match self.rest.trim() {
            "" => "the end".to_owned(),
            rest => format!("`{rest}`"),
        };
        (format!("`{}` has {found} where {wanted} is expected", self.text), EXAMPLE.to_owned())
    }

    fn sum(&mut self, depth: usize) -> Result<Expression, MessageAndHelp> {
        let mut sum = self.product(depth)?;
        while let Some(sign) = ['+', '-'].into_iter().find(|sign| self.takes(&sign.to_string())) {
            sum = Expression::Binary(Box::new([sum, self.product(depth)?]), sign);
        }
        Ok(sum)
    }

    fn product(&mut self, depth: usize) -> Result<Expression, MessageAndHelp> {
        let mut product = self.factor(depth)?;
        while let Some(sign) = ['*', '/'].into_iter().find(|sign| self.takes(&sign.to_string())) {
            product = Expression::Binary(Box::new([product, self.factor(depth)?]), sign);
        }
        Ok(product)
    }

    /// Parses a number, a name, or an expression in parentheses, with or without a minus sign.
    fn factor(&mut self, depth: usize) -> Result<Expression, MessageAndHelp> {
        if depth > DEEPEST {
            return Err((format!("`{}` is nested too deeply", self.text), EXAMPLE.to_owned()));
        }
        if self.takes("-") {
            return Ok(Expression::Negative(Box::new(self.factor(depth + 1)?)));
        }
        if self.takes("(") {
            let inner = self.sum(depth + 1)?;
            return if self.takes(")") { Ok(inner) } else { Err(self.unexpected("`)`")) };
        }
        self.rest = self.rest.trim_start();
        if let Some(quoted) = self.rest.strip_prefix('\'') {
            let Some((name, after)) = quoted.split_once('\'') else { return Err(self.unexpected("`'`")) };
            self.rest = after;
            return self.axis(name);
        }
        if self.rest.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
            return self.number();
        }
        let end = self.rest.find(|c: char| !(c.is_alphanumeric() || "_.".contains(c)));
        let (name, after) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        if name.is_empty() {
            return Err(self.unexpected("a number or the name of an axis"));
        }
        self.rest = after;
        self.axis(name)
    }

    fn number(&mut self) -> Result<Expression, MessageAndHelp> {
        let digits =
            |text: &str| text.len() - text.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.').len();
        let mut end = digits(self.rest);
        let power = self.rest[end..].strip_prefix(['e', 'E']);
        if let Some(power) = power.map(|text| text.strip_prefix(['+', '-']).unwrap_or(text)) {
            let start = self.rest.len() - power.len();
            end = if digits(power) > 0 { start + digits(power) } else { end };
        }
        match self.rest[..end].parse::<f64>() {
            Ok(number) if number.is_finite() => {
                self.rest = &self.rest[end..];
                Ok(Expression::Number(number))
            }
            _ => Err(self.unexpected("a number")),
        }
    }

    /// Names and keys that a requirement may contain, with the indices of their axis and key.
    fn known(&self) -> Vec<(&'a str, usize, usize)> {
        let mut known = Vec::new();
        for (i, axis) in self.axes.iter().enumerate() {
            for (k, (key, written)) in axis.keys.iter().zip(&axis.locations).enumerate() {
                if written.of == 1 {
                    known.push((written.name.as_str(), i, k));
                }
                known.push((key.as_str(), i, k));
            }
        }
        known
    }

    fn names(&self) -> String {
        let mut names: Vec<&str> = self.known().iter().map(|(name, ..)| *name).collect();
        let mut seen = std::collections::BTreeSet::new();
        names.retain(|name| seen.insert(*name));
        quoted_list(&names, "`")
    }

    fn axis(&mut self, name: &str) -> Result<Expression, MessageAndHelp> {
        let known = self.known();
        let Some(&(_, i, k)) = known.iter().find(|(known, ..)| *known == name) else {
            let names: Vec<&str> = known.iter().map(|(name, ..)| *name).collect();
            let near = closest(name, &names).map_or(String::new(), |near| format!("did you mean `{near}`? "));
            let mend = format!("{near}Axes: {}; put names with spaces in single quotes", self.names());
            return Err((format!("no axis is named `{name}`"), mend));
        };
        if (0..self.axes[i].values.len()).any(|value| self.axes[i].value_of_key(value, k).is_none()) {
            let mend = "use axes whose values are all numbers".to_owned();
            return Err((format!("`{name}` has values that are not numbers"), mend));
        }
        self.named = true;
        Ok(Expression::AxisValue(i, k))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes() -> [Axis; 2] {
        [
            Axis::of_numbers("tilt", "body1.fibre.tilt", &[0.0, 0.1, 0.2, 0.3]),
            Axis::of_numbers("the angle", "steps.shift.angle", &[-1.0, 0.0, 2.0]),
        ]
    }

    fn kept(text: &str) -> Vec<[f64; 2]> {
        let axes = axes();
        let requirement = Requirement::parse(text, &axes).expect(text);
        let number =
            |choice: &Vec<usize>| [0, 1].map(|k| axes[k].value_of_key(choice[k], 0).expect("a number"));
        combinations(&axes, &[requirement]).iter().map(number).collect()
    }

    /// Truth: combinations found by hand. Decimals that differ only by rounding are equal.
    #[test]
    fn requirements_are_arithmetic() {
        assert_eq!(kept("tilt + 'the angle' == 2.3"), [[0.3, 2.0]]);
        assert_eq!(kept("tilt == 0.1 + 0.2"), [[0.3, -1.0], [0.3, 0.0], [0.3, 2.0]]);
        assert_eq!(kept("0.1 < tilt <= 0.2 * (1 + 0.5) - 0.1"), [[0.2, -1.0], [0.2, 0.0], [0.2, 2.0]]);
        assert_eq!(kept("10 * tilt - steps.shift.angle / 2 <= -1"), [[0.0, 2.0]]);
        assert_eq!(kept("-body1.fibre.tilt >= -1e-1 - -'the angle'").len(), 4 + 2);
        assert_eq!(kept("tilt != 0.1").len(), 9);
        assert!(kept("1 / tilt < 0").is_empty(), "nothing is below 0, a division by 0 is not either");
    }

    /// Truth: each kind of error has its own message and help (docs/study.md).
    #[test]
    fn mistakes_are_named() {
        for (text, words) in [
            ("tilt", "a comparison"),
            ("tilt <", "a number or the name of an axis"),
            ("tilt < 1 2", "`2`"),
            ("(tilt < 1", "`)`"),
            ("'the angle < 1", "`'`"),
            ("tilt < 1.2.3", "a number"),
            ("1 < 2", "does not contain the name of an axis"),
        ] {
            let (message, mend) = Requirement::parse(text, &axes()).expect_err(text);
            assert!(message.contains(words) && !mend.is_empty(), "{text}: {message}: {mend}");
        }
        let (_, mend) = Requirement::parse("tlit < 1", &axes()).expect_err("no axis");
        assert!(mend.contains("did you mean `tilt`"), "{mend}");
        let deep = format!("{}tilt{} < 1", "(".repeat(60), ")".repeat(60));
        assert!(Requirement::parse(&deep, &axes()).is_err_and(|(message, _)| message.contains("too deeply")));
        assert!(
            Requirement::parse(&"1+".repeat(400), &axes())
                .is_err_and(|(message, _)| message.contains("at most 500"))
        );
    }
}
