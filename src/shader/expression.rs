//! Values of the simple expressions that constants of GLSL are made of: literals, earlier constants, arithmetic. What
//! GLSL would convert or wrap around in silence is an error here.

use std::collections::BTreeMap;

/// Value of a constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    Uint(u32),
    Int(i32),
    Float(f32),
}

impl Value {
    /// Name of the type in Rust.
    pub fn ty(self) -> &'static str {
        match self {
            Self::Uint(_) => "u32",
            Self::Int(_) => "i32",
            Self::Float(_) => "f32",
        }
    }

    /// The value as a literal of Rust, exact.
    pub fn rust(self) -> String {
        match self {
            Self::Uint(x) if x > 0xffff => format!("{x:#x}"),
            Self::Uint(x) => x.to_string(),
            Self::Int(x) => x.to_string(),
            Self::Float(x) => format!("{x:?}"),
        }
    }
}

/// The value of `text` as a constant of a type of GLSL, given what is known of earlier constants.
pub fn evaluate(ty: &str, text: &str, known: &BTreeMap<String, Value>) -> Result<Value, String> {
    let mut parser = Parser { tokens: tokens(text)?, at: 0, known };
    let value = parser.binary(0)?;
    if let Some(rest) = parser.tokens.get(parser.at) {
        return Err(format!("`{rest}` is not expected"));
    }
    match (ty, value) {
        ("uint", Value::Uint(_)) | ("int", Value::Int(_)) => Ok(value),
        ("float", Value::Float(x)) if x.is_finite() => Ok(value),
        ("uint" | "int" | "float", _) => Err(format!("{value:?} is no {ty}")),
        _ => Err(format!("the host gets no constants of type {ty}")),
    }
}

/// Operators of two operands from the weakest to the strongest.
const LEVELS: [&[&str]; 6] = [&["|"], &["^"], &["&"], &["<<", ">>"], &["+", "-"], &["*", "/"]];

struct Parser<'a> {
    tokens: Vec<String>,
    at: usize,
    known: &'a BTreeMap<String, Value>,
}

impl Parser<'_> {
    fn take(&mut self, wanted: &[&str]) -> Option<String> {
        let token = self.tokens.get(self.at).filter(|token| wanted.contains(&token.as_str()))?.clone();
        self.at += 1;
        Some(token)
    }

    fn binary(&mut self, level: usize) -> Result<Value, String> {
        let Some(operators) = LEVELS.get(level) else { return self.unary() };
        let mut left = self.binary(level + 1)?;
        while let Some(operator) = self.take(operators) {
            let right = self.binary(level + 1)?;
            left = combine(left, &operator, right)
                .ok_or_else(|| format!("`{left:?} {operator} {right:?}` has mixed types or leaves their range"))?;
        }
        Ok(left)
    }

    fn unary(&mut self) -> Result<Value, String> {
        let Some(operator) = self.take(&["-", "~", "("]) else { return self.operand() };
        if operator == "(" {
            let value = self.binary(0)?;
            return self.take(&[")"]).map(|_| value).ok_or_else(|| "a `(` is not closed".into());
        }
        match (operator.as_str(), self.unary()?) {
            ("-", Value::Float(x)) => Ok(Value::Float(-x)),
            ("-", Value::Int(x)) if x != i32::MIN => Ok(Value::Int(-x)),
            ("~", Value::Uint(x)) => Ok(Value::Uint(!x)),
            (_, value) => Err(format!("`{operator}` of {value:?}")),
        }
    }

    fn operand(&mut self) -> Result<Value, String> {
        let token = self.tokens.get(self.at).ok_or("the expression ends too early")?;
        self.at += 1;
        if token.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
            return literal(token).ok_or_else(|| format!("`{token}` is no number"));
        }
        self.known.get(token).copied().ok_or_else(|| format!("`{token}` is not a known constant"))
    }
}

fn literal(token: &str) -> Option<Value> {
    if let Some(hex) = token.strip_prefix("0x") {
        return u32::from_str_radix(hex.strip_suffix('u')?, 16).ok().map(Value::Uint);
    }
    if let Some(number) = token.strip_suffix('u') {
        return number.parse().ok().map(Value::Uint);
    }
    if token.contains(['.', 'e']) { token.parse().ok().map(Value::Float) } else { token.parse().ok().map(Value::Int) }
}

fn combine(left: Value, operator: &str, right: Value) -> Option<Value> {
    use Value::{Float, Int, Uint};
    Some(match (left, operator, right) {
        (Uint(a), "<<", Uint(b)) => Uint(a.checked_shl(b).filter(|x| x >> b == a)?),
        (Uint(a), "<<", Int(b)) => return combine(Uint(a), "<<", Uint(u32::try_from(b).ok()?)),
        (Uint(a), ">>", Uint(b)) => Uint(a.checked_shr(b)?),
        (Uint(a), ">>", Int(b)) => return combine(Uint(a), ">>", Uint(u32::try_from(b).ok()?)),
        (Uint(a), "|", Uint(b)) => Uint(a | b),
        (Uint(a), "^", Uint(b)) => Uint(a ^ b),
        (Uint(a), "&", Uint(b)) => Uint(a & b),
        (Uint(a), "+", Uint(b)) => Uint(a.checked_add(b)?),
        (Uint(a), "-", Uint(b)) => Uint(a.checked_sub(b)?),
        (Uint(a), "*", Uint(b)) => Uint(a.checked_mul(b)?),
        (Uint(a), "/", Uint(b)) => Uint(a.checked_div(b)?),
        (Int(a), "+", Int(b)) => Int(a.checked_add(b)?),
        (Int(a), "-", Int(b)) => Int(a.checked_sub(b)?),
        (Int(a), "*", Int(b)) => Int(a.checked_mul(b)?),
        (Int(a), "/", Int(b)) => Int(a.checked_div(b)?),
        (Float(a), "+", Float(b)) => Float(a + b),
        (Float(a), "-", Float(b)) => Float(a - b),
        (Float(a), "*", Float(b)) => Float(a * b),
        (Float(a), "/", Float(b)) => Float(a / b),
        _ => return None,
    })
}

/// Numbers, names and operators.
fn tokens(text: &str) -> Result<Vec<String>, String> {
    let mut tokens = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let length = match first {
            '0'..='9' | '.' => number_length(rest),
            'a'..='z' | 'A'..='Z' | '_' => {
                rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len())
            }
            '<' | '>' if rest[1..].starts_with(first) => 2,
            '+' | '-' | '*' | '/' | '|' | '&' | '^' | '~' | '(' | ')' => 1,
            _ => return Err(format!("`{first}` is not expected")),
        };
        tokens.push(rest[..length].to_owned());
        rest = rest[length..].trim_start();
    }
    Ok(tokens)
}

/// Length of the number that `text` begins with; the sign of an exponent belongs to it.
fn number_length(text: &str) -> usize {
    let hex = text.starts_with("0x");
    let mut before = ' ';
    let part = |c: &char| {
        let exponent_sign = !hex && matches!(c, '+' | '-') && before == 'e';
        before = *c;
        c.is_ascii_alphanumeric() || *c == '.' || exponent_sign
    };
    text.chars().take_while(part).count()
}
