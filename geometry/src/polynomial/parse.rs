//! From a formula to a polynomial.
//!
//! ```text
//! sum     = product (("+" | "-") product)*
//! product = factor ("*" factor)*
//! factor  = "-" factor | atom ["^" whole number]
//! atom    = number | "x" | "y" | "z" | "(" sum ")"
//! ```
//! So `-x^2` is `-(x^2)`, and a product needs its `*`. Nothing a formula says can make this take much memory
//! or time: its length, its depth, its degree and the work are limited.

use super::{Polynomial, Term};
use std::collections::BTreeMap;

/// The largest degree: with it there are at most 969 terms.
pub const DEGREE_MAX: usize = 16;
/// The longest formula, in bytes.
const LENGTH_MAX: usize = 4096;
/// The deepest nesting of parentheses and signs.
const DEPTH_MAX: u32 = 64;
/// Products of two terms in all.
const WORK_MAX: usize = 4_000_000;

/// A formula that cannot be read; the message shows the place.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error("{message}, at character {place} of the formula: {before}>>>{after}")]
pub struct FormulaError {
    /// What is wrong, and what was expected.
    pub message: String,
    /// Number of the character, from 1.
    pub place: usize,
    /// The formula up to the place, or the end of that.
    pub before: String,
    /// The formula from the place, or the beginning of that.
    pub after: String,
}

type Terms = BTreeMap<[u8; 3], f64>;

struct Parser<'a> {
    text: &'a [u8],
    place: usize,
    depth: u32,
    work: usize,
}

type Parsed<T> = Result<T, (String, usize)>;

impl Polynomial {
    /// Reads a formula in `x`, `y` and `z`: sums, products, whole powers, parentheses and decimal numbers.
    ///
    /// # Errors
    ///
    /// [`FormulaError`] shows the character where the formula cannot be understood or goes beyond a limit.
    pub fn parse(formula: &str) -> Result<Polynomial, FormulaError> {
        let mut parser = Parser { text: formula.as_bytes(), place: 0, depth: 0, work: 0 };
        parser.whole().map_err(|(message, place)| {
            let shown = |text: &[u8]| String::from_utf8_lossy(text).into_owned();
            let (before, after) = formula.as_bytes().split_at(place.min(formula.len()));
            let (start, end) = (before.len().saturating_sub(24), after.len().min(24));
            FormulaError {
                message,
                place: place + 1,
                before: shown(&before[start..]),
                after: shown(&after[..end]),
            }
        })
    }
}

impl Parser<'_> {
    fn whole(&mut self) -> Parsed<Polynomial> {
        if self.text.len() > LENGTH_MAX {
            return Err((format!("a formula of at most {LENGTH_MAX} bytes was expected"), LENGTH_MAX));
        }
        let terms = self.sum()?;
        if let Some(found) = self.peek() {
            let found = printable(found);
            return Err((format!("an operator (+ - * ^) was expected, not {found}"), self.place));
        }
        if terms.values().any(|value| !value.is_finite()) {
            return Err(("a coefficient is too large for a number".to_owned(), 0));
        }
        let mut degree = 0;
        let mut list = Vec::with_capacity(terms.len());
        for (powers, coefficient) in terms {
            if coefficient != 0.0 {
                degree = degree.max(total(&powers));
                list.push(Term { coefficient, powers });
            }
        }
        Ok(Polynomial { terms: list, degree })
    }

    fn peek(&mut self) -> Option<u8> {
        while self.text.get(self.place).is_some_and(u8::is_ascii_whitespace) {
            self.place += 1;
        }
        self.text.get(self.place).copied()
    }

    fn sum(&mut self) -> Parsed<Terms> {
        let mut sum = self.product()?;
        while let Some(sign @ (b'+' | b'-')) = self.peek() {
            self.place += 1;
            for (powers, value) in self.product()? {
                *sum.entry(powers).or_insert(0.0) += if sign == b'+' { value } else { -value };
            }
        }
        Ok(sum)
    }

    fn product(&mut self) -> Parsed<Terms> {
        let mut product = self.factor()?;
        while self.peek() == Some(b'*') {
            let place = self.place;
            self.place += 1;
            let factor = self.factor()?;
            product = self.multiplied(&product, &factor, place)?;
        }
        Ok(product)
    }

    fn factor(&mut self) -> Parsed<Terms> {
        self.depth += 1;
        if self.depth > DEPTH_MAX {
            return Err((format!("at most {DEPTH_MAX} parentheses and signs inside each other"), self.place));
        }
        let factor = if self.peek() == Some(b'-') {
            self.place += 1;
            let mut factor = self.factor()?;
            factor.values_mut().for_each(|value| *value = -*value);
            factor
        } else {
            let atom = self.atom()?;
            if self.peek() == Some(b'^') {
                self.place += 1;
                self.power(&atom)?
            } else {
                atom
            }
        };
        self.depth -= 1;
        Ok(factor)
    }

    fn power(&mut self, base: &Terms) -> Parsed<Terms> {
        self.peek();
        let place = self.place;
        let digits = self.take_while(|byte| byte.is_ascii_digit());
        let exponent = digits.parse::<usize>().ok().filter(|&exponent| exponent <= DEGREE_MAX);
        let Some(exponent) = exponent else {
            return Err((format!("a whole power from 0 to {DEGREE_MAX} was expected"), place));
        };
        let mut power = Terms::from([([0; 3], 1.0)]);
        for _ in 0..exponent {
            power = self.multiplied(&power, base, place)?;
        }
        Ok(power)
    }

    fn atom(&mut self) -> Parsed<Terms> {
        let variable = |axis: usize| {
            let mut powers = [0; 3];
            powers[axis] = 1;
            Terms::from([(powers, 1.0)])
        };
        let place = self.place;
        match self.peek() {
            Some(byte @ b'x'..=b'z') => {
                self.place += 1;
                Ok(variable(usize::from(byte - b'x')))
            }
            Some(b'(') => {
                self.place += 1;
                let sum = self.sum()?;
                if self.peek() != Some(b')') {
                    return Err(("a closing parenthesis was expected".to_owned(), self.place));
                }
                self.place += 1;
                Ok(sum)
            }
            Some(b'0'..=b'9' | b'.') => self.number(),
            Some(found) => {
                let found = printable(found);
                Err((format!("a number, x, y, z or ( was expected, not {found}"), self.place))
            }
            None => Err(("a number, x, y, z or ( was expected, not the end".to_owned(), place)),
        }
    }

    fn number(&mut self) -> Parsed<Terms> {
        let place = self.place;
        let mut number = self.take_while(|byte| byte.is_ascii_digit() || byte == b'.');
        if let Some(b'e' | b'E') = self.text.get(self.place) {
            self.place += 1;
            number.push('e');
            if let Some(&sign @ (b'+' | b'-')) = self.text.get(self.place) {
                self.place += 1;
                number.push(char::from(sign));
            }
            number += &self.take_while(|byte| byte.is_ascii_digit());
        }
        match number.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Terms::from([([0; 3], value)])),
            _ => Err((format!("a decimal number was expected, not '{number}'"), place)),
        }
    }

    fn take_while(&mut self, wanted: impl Fn(u8) -> bool) -> String {
        let start = self.place;
        while self.text.get(self.place).is_some_and(|&byte| wanted(byte)) {
            self.place += 1;
        }
        String::from_utf8_lossy(&self.text[start..self.place]).into_owned()
    }

    fn multiplied(&mut self, a: &Terms, b: &Terms, place: usize) -> Parsed<Terms> {
        let degree = |terms: &Terms| terms.keys().map(total).max().unwrap_or(0);
        if degree(a) + degree(b) > DEGREE_MAX {
            return Err((format!("a degree of at most {DEGREE_MAX} was expected"), place));
        }
        self.work += a.len() * b.len();
        if self.work > WORK_MAX {
            return Err(("a formula with fewer products was expected".to_owned(), place));
        }
        let mut product = Terms::new();
        for (p, x) in a {
            for (q, y) in b {
                *product.entry([p[0] + q[0], p[1] + q[1], p[2] + q[2]]).or_insert(0.0) += x * y;
            }
        }
        Ok(product)
    }
}

fn total(powers: &[u8; 3]) -> usize {
    powers.iter().map(|&power| usize::from(power)).sum()
}

fn printable(byte: u8) -> String {
    if byte.is_ascii_graphic() { format!("'{}'", char::from(byte)) } else { "a foreign character".to_owned() }
}
