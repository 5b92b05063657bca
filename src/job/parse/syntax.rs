//! Words for what TOML cannot read, with what stands there and what would do.
//!
//! The parser names the rule that a text breaks ("invalid mantissa"), not what a person has to change. Here
//! the line on which it stopped is looked at once more for what people write by habit: `.5`, `1/3`,
//! `1000 kg`, `True`, a word without quotes, `key: value`.
use super::unclosed::is_key;
use std::ops::Range;

/// Longest line that is looked at, bytes; people do not write longer ones.
const LONGEST: usize = 200;

/// The place and the words for a parser's error at a byte of the text, if the habit is known.
pub(super) fn explain(text: &str, error: usize) -> Option<(Range<usize>, String)> {
    let start = text.get(..error)?.rfind('\n').map_or(0, |newline| newline + 1);
    let end = text[error..].find('\n').map_or(text.len(), |newline| error + newline);
    let line = &text[start..end];
    let line = &line[..unquoted(line, '#').unwrap_or(line.len())];
    let at = (error - start).min(line.len());
    if line.len() > LONGEST {
        return None;
    }
    let equals = line.find('=').filter(|equals| *equals < at);
    let from = equals.map_or(0, |equals| equals + 1);
    // The element is one of a list or a table, or of a list that began on a line before.
    let (value, element) = (line[from..].trim(), element(line, at));
    let (shown, words) = if equals.is_some() && !value.starts_with(['[', '{']) {
        (value, of_value(value, &line[..from]))
    } else if let Some(words) = of_number(element) {
        (element, Some(words))
    } else if equals.is_some() {
        (element, of_word(element))
    } else {
        (line.trim(), of_key(line.trim()))
    };
    let offset = if shown.is_empty() { at } else { shown.as_ptr() as usize - line.as_ptr() as usize };
    words.map(|words| (start + offset..start + offset + shown.len(), words))
}

/// Where a sign stands first that is not quoted.
pub(super) fn unquoted(text: &str, sign: char) -> Option<usize> {
    let mut quote = None;
    for (at, c) in text.char_indices() {
        match (quote, c) {
            (None, c) if c == sign => return Some(at),
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), c) if c == open => quote = None,
            _ => {}
        }
    }
    None
}

/// The element of a list or table of one line in which a byte lies.
fn element(line: &str, at: usize) -> &str {
    let start = line[..at].rfind(['=', ',', '[', '{', ']', '}']).map_or(0, |sign| sign + 1);
    let end = line[at..].find([',', ']', '}']).map_or(line.len(), |sign| at + sign);
    line[start..end].trim()
}

/// Words for a value of its own; `before` is the line up to it.
fn of_value(value: &str, before: &str) -> Option<String> {
    let grouped: Vec<&str> = value.split(',').collect();
    let parts: Vec<&str> = value.split([',', ' ']).filter(|part| !part.is_empty()).collect();
    let is_grouped =
        grouped.len() > 1 && grouped[1..].iter().all(|group| group.get(..3).is_some_and(is_digit));
    if value.is_empty() {
        Some(format!("found no value behind `{}`; expected one", before.trim()))
    } else if let Some(value) = value.strip_prefix('=') {
        Some(format!("found `==`; expected one sign: = {}", value.trim()))
    } else if let Some((value, _)) = value.split_once("//").filter(|(value, _)| is_closed(value)) {
        Some(format!("found `//`; expected comments to begin with #: {} # …", value.trim()))
    } else if let Some(value) = value.strip_suffix(';') {
        Some(format!("found a `;`; expected nothing behind the value: {}", value.trim()))
    } else if is_grouped && number(&value.replace(',', "")).is_some() {
        Some(format!("found `{value}`; expected a number without commas: {}", value.replace(',', "")))
    } else if let Some(list) = value.strip_prefix('(').and_then(|list| list.strip_suffix(')')) {
        Some(format!("found `{value}`; expected a list in brackets: [{list}]"))
    } else if number(value).is_none() && parts.len() > 1 && parts.iter().all(|part| number(part).is_some()) {
        Some(format!("found `{value}`; expected a list in brackets: [{}]", parts.join(", ")))
    } else {
        of_number(value).or_else(|| of_word(value))
    }
}

/// Whether no string is open at the end of a text.
fn is_closed(text: &str) -> bool {
    text.matches(['"', '\'']).count().is_multiple_of(2)
}

fn is_digit(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_digit())
}

/// A number as people write it, as TOML does: digits on both sides of the point, none that are not needed.
fn number(text: &str) -> Option<String> {
    let (sign, digits) = text.split_at(text.len() - text.trim_start_matches(['+', '-']).len());
    if sign.len() > 1 || !digits.bytes().all(|byte| b"0123456789.eEdD+- ".contains(&byte)) {
        return None;
    }
    // Groups of three digits with blanks between them.
    let groups: Vec<&str> = digits.split(' ').collect();
    if groups[1..].iter().any(|group| group.len() != 3) {
        return None;
    }
    let digits = groups.concat().replace(['d', 'D', 'E'], "e");
    let (mantissa, exponent) = digits.split_once('e').map_or((&*digits, None), |(m, e)| (m, Some(e)));
    let (whole, fraction) = mantissa.split_once('.').map_or((mantissa, None), |(w, f)| (w, Some(f)));
    let whole = whole.trim_start_matches('0');
    let mut written = format!("{sign}{}", if whole.is_empty() { "0" } else { whole });
    fraction.into_iter().for_each(|f| written += &format!(".{}", if f.is_empty() { "0" } else { f }));
    exponent.into_iter().for_each(|e| written += &format!("e{e}"));
    let has_digits = mantissa.contains(|c: char| c.is_ascii_digit());
    (has_digits && written.parse::<f64>().is_ok()).then_some(written)
}

/// Words for a number, for one with a unit, and for an expression.
fn of_number(value: &str) -> Option<String> {
    if let Some(written) = number(value).filter(|written| written != value) {
        return Some(format!("found `{value}`; expected a number as TOML writes it: {written}"));
    }
    // The longest number ahead of the rest: the `e` of `1e3 eV` belongs to it.
    let ends = (1..=value.len()).rev().filter(|&end| value.is_char_boundary(end));
    let (end, written) = ends.into_iter().find_map(|end| Some((end, number(value[..end].trim_end())?)))?;
    let rest = value[end..].trim();
    let is_unit = rest.starts_with(|c: char| c.is_alphabetic() || c == '%' || c == '°');
    is_unit.then(|| {
        format!("found `{value}`; expected a number without its unit, in units of the SI: {written}")
    })
}

/// Words for text without quotes.
fn of_word(value: &str) -> Option<String> {
    let words: Vec<&str> = value.split_whitespace().collect();
    let quoted = value.trim_matches(['“', '”', '„', '‘', '’', '`']);
    match &*value.to_lowercase() {
        "" => None,
        "true" | "yes" | "on" => Some(format!("found `{value}`; expected true, in lower case")),
        "false" | "no" | "off" => Some(format!("found `{value}`; expected false, in lower case")),
        _ if value.starts_with(['"', '\'']) => None,
        _ if words.len() > 1 && words.iter().all(|word| number(word).is_some()) => {
            Some(format!("found `{value}`; expected commas between numbers: {}", words.join(", ")))
        }
        _ => Some(format!(
            "found `{value}`; expected a number, true or false, or text in straight quotes: \"{quoted}\""
        )),
    }
}

/// Words for a line in which a key has no value.
fn of_key(line: &str) -> Option<String> {
    let (key, value) = line.split_once('=').unwrap_or((line, ""));
    if !value.is_empty() {
        let words: Vec<&str> = key.split_whitespace().collect();
        return (words.len() > 1 && words.iter().all(|word| is_key(word)))
            .then(|| format!("found the key `{}`; expected one word: {}", key.trim(), words.join("_")));
    }
    let (key, value) = line.split_once(':').or_else(|| line.split_once(char::is_whitespace))?;
    (is_key(key.trim()) && !value.trim().is_empty())
        .then(|| format!("found `{line}`; expected `{} = {}`", key.trim(), value.trim()))
}

#[cfg(test)]
mod tests {
    use super::super::source::Node;

    #[test]
    fn habits_are_named_with_what_would_do() {
        let cases = [
            ("a = .5", ".5", "found `.5`; expected a number as TOML writes it: 0.5"),
            ("a = -.5e3", "-.5e3", "0.5e3"),
            ("a = 5.", "5.", "5.0"),
            ("a = 1.e3", "1.e3", "1.0e3"),
            ("a = 01000", "01000", "1000"),
            ("a = 1d-3", "1d-3", "1e-3"),
            ("a = 10 000", "10 000", "10000"),
            ("a = 1,000", "1,000", "a number without commas: 1000"),
            ("a = [1, .5] # [", ".5", "0.5"),
            ("a = { b = 1., c = 2 }", "1.", "1.0"),
            ("a = [\n  1,\n  5., 6.0,\n]", "5.", "5.0"),
            ("a = 1000 kg/m3", "1000 kg/m3", "without its unit, in units of the SI: 1000"),
            ("a = 1e3eV", "1e3eV", "SI: 1e3"),
            ("a = 35°", "35°", "SI: 35"),
            ("a = 1/3", "1/3", "text in straight quotes: \"1/3\""),
            ("a = True", "True", "expected true, in lower case"),
            ("a = no", "no", "expected false, in lower case"),
            ("a = fluid # .5", "fluid", "text in straight quotes: \"fluid\""),
            ("a = “fluid”", "“fluid”", "text in straight quotes: \"fluid\""),
            ("a = { kind = box }", "box", "text in straight quotes: \"box\""),
            ("a =", "", "found no value behind `a =`"),
            ("a == 1", "= 1", "expected one sign: = 1"),
            ("a = 1 // one", "1 // one", "comments to begin with #: 1 # …"),
            ("a = \"x\" // one", "\"x\" // one", "comments to begin with #: \"x\" # …"),
            ("a = 1;", "1;", "nothing behind the value: 1"),
            ("a = (0, 1)", "(0, 1)", "a list in brackets: [0, 1]"),
            ("a = 0, 1", "0, 1", "a list in brackets: [0, 1]"),
            ("a = 0 1", "0 1", "a list in brackets: [0, 1]"),
            ("a = [0 -1e3]", "0 -1e3", "commas between numbers: 0, -1e3"),
            ("a: 1", "a: 1", "expected `a = 1`"),
            ("a 1", "a 1", "expected `a = 1`"),
            ("my a = 1", "my a = 1", "found the key `my a`; expected one word: my_a"),
        ];
        for (line, shown, words) in cases {
            let text = format!("version = 1\n{line}\nend = 2\n");
            let (span, message) = Node::parse(&text).expect_err(line);
            assert_eq!(&text[span], shown, "{line}: {message}");
            assert!(message.contains(words), "{line}: {message}");
        }
    }

    /// Others keep the words of the parser.
    #[test]
    fn what_is_no_habit_has_the_words_of_the_parser() {
        for line in [
            "a = \"http://x\" 1",
            "a = \"\\q\"",
            "[a]]",
            "a = 1\na.b = 2",
            "=",
            "a = \"x\" \"y\"",
            "[",
            "\u{1}",
            "ä = 1",
        ] {
            let (_, message) = Node::parse(line).expect_err(line);
            assert!(!message.starts_with("found"), "{line}: {message}");
        }
    }
}
