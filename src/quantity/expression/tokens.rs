//! Cuts the text of an expression into numbers, names and signs.
use super::words::{FUNCTIONS, Meaning, VARIABLES, meaning};

/// Where something is wrong (byte), and what was found and is expected.
pub(super) type Fault = (usize, String);

/// A piece of an expression.
#[derive(Clone, Copy, Debug)]
pub(super) enum Token<'a> {
    Number(f64),
    Name(&'a str, Meaning),
    Sign(&'a str),
}

/// The tokens of a text with the bytes where they begin. Refuses unknown names, parentheses without their
/// counterparts and strange characters.
pub(super) fn tokens(text: &str) -> Result<Vec<(usize, Token<'_>)>, Fault> {
    let bytes = text.as_bytes();
    let (mut found, mut at, mut open) = (Vec::new(), 0, Vec::new());
    while at < bytes.len() {
        let from = at;
        let run = |mut at: usize, ok: &dyn Fn(u8) -> bool| {
            while at < bytes.len() && ok(bytes[at]) {
                at += 1;
            }
            at
        };
        match bytes[at] {
            b' ' | b'\t' | b'\n' | b'\r' => {
                at += 1;
                continue;
            }
            b'0'..=b'9' | b'.' => {
                at = run(at, &|b| b.is_ascii_digit() || b == b'.');
                if at < bytes.len() && matches!(bytes[at], b'e' | b'E') {
                    let signed = at + 1 + usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
                    let end = run(signed, &|b| b.is_ascii_digit());
                    if end > signed {
                        at = end;
                    }
                }
                let number = text[from..at].parse();
                let number = number
                    .map_err(|_| (from, format!("found \"{}\"; expected a number", &text[from..at])))?;
                found.push((from, Token::Number(number)));
            }
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
                at = run(at, &|b| b.is_ascii_alphanumeric() || b == b'_');
                let name = &text[from..at];
                let meaning = meaning(name).ok_or_else(|| {
                    let expected = format!("variables {} and {FUNCTIONS}", VARIABLES.join(", "));
                    (from, format!("found the name \"{name}\"; expected {expected}"))
                })?;
                found.push((from, Token::Name(name, meaning)));
            }
            b'<' | b'>' if bytes.get(at + 1) == Some(&b'=') => {
                at += 2;
                found.push((from, Token::Sign(&text[from..at])));
            }
            b'+' | b'-' | b'*' | b'/' | b'^' | b'(' | b')' | b',' | b'<' | b'>' => {
                at += 1;
                match bytes[from] {
                    b'(' => open.push(from),
                    b')' if open.pop().is_none() => {
                        return Err((from, "found \")\" without its \"(\"".into()));
                    }
                    _ => {}
                }
                found.push((from, Token::Sign(&text[from..at])));
            }
            _ => {
                let odd = text[from..].chars().next().unwrap_or(' ');
                let expected = "numbers, names, + - * / ^ < > <= >= ( ) and commas";
                return Err((from, format!("found {odd:?}; expected {expected}")));
            }
        }
    }
    match open.pop() {
        Some(from) => Err((from, "found \"(\" without its \")\"".into())),
        None if found.is_empty() => Err((0, "found no expression; expected one such as 2 * x + t".into())),
        None => Ok(found),
    }
}
