//! Numbers and foreign text as people read them: the one place where quantities become words.
//!
//! Files for machines (history, telemetry, CSV) keep every digit and do not go through here.
use std::borrow::Cow;
use std::path::Path;

/// Significant digits of a measured or computed quantity by default.
const DIGITS: usize = 4;

/// Significant digits of a coordinate.
const PLACE_DIGITS: usize = 7;

/// Metric prefixes with their powers of ten.
const PREFIXES: [(i32, &str); 7] = [(-9, "n"), (-6, "µ"), (-3, "m"), (0, ""), (3, "k"), (6, "M"), (9, "G")];

/// A quantity with four significant digits and a metric prefix: `12.5 µs`, `3.2 MPa`, `1.5 m`.
pub fn quantity(value: f64, unit: &str) -> String {
    quantity_to(value, unit, DIGITS)
}

/// A quantity with this number of significant digits, without zeros at the end, and a metric prefix where
/// people put one before the unit.
pub fn quantity_to(value: f64, unit: &str, digits: usize) -> String {
    let (power, prefix) = prefix(value, unit, digits);
    // Dividing by a whole power is exact to one rounding, multiplying by its inverse is not.
    let scaled = if power < 0 { value * 10_f64.powi(-power) } else { value / 10_f64.powi(power) };
    let number = number(scaled, digits);
    if unit.is_empty() { number } else { format!("{number} {prefix}{unit}") }
}

/// The unit with its prefix in which numbers up to `greatest` are short, and by what they are divided:
/// `(1e3, "kJ")`.
pub fn scale(greatest: f64, unit: &str) -> (f64, String) {
    let (power, prefix) = prefix(greatest, unit, DIGITS);
    (10_f64.powi(power), format!("{prefix}{unit}"))
}

/// The power of ten and the prefix that people put before the unit of a value.
fn prefix(value: f64, unit: &str, digits: usize) -> (i32, &'static str) {
    let (least, greatest) = match unit {
        // No kiloseconds; hours and days are for `clock`.
        "s" => (-9, 0),
        "m" => (-6, 3),
        "m/s" => (-6, 3),
        "Pa" | "J" | "N" | "W" | "J/m³" | "N m" | "J/kg" => (-6, 9),
        _ => (0, 0),
    };
    let wanted = decimal_exponent(value, digits).div_euclid(3) * 3;
    let usable =
        |&(power, _): &(i32, &str)| (least..=greatest).contains(&power) && power <= wanted.max(least);
    PREFIXES.into_iter().rfind(|entry| usable(entry)).unwrap_or((0, ""))
}

/// Text without markup of HTML and SVG. Characters that XML does not have, or that change the order of
/// others, become visible; ends of lines and tabs stay.
pub fn html(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' => out.push(c),
            '\r' => {}
            _ if is_hidden(c) => out.extend(c.escape_unicode()),
            _ => out.push(c),
        }
    }
    out
}

/// A number with this many significant digits, without zeros at the end.
pub fn number(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    let exponent = decimal_exponent(value, digits);
    if (-4..7).contains(&exponent) {
        return without_zeros(&format!("{value:.*}", (digits as i32 - 1 - exponent).max(0) as usize))
            .to_owned();
    }
    let text = format!("{value:.*e}", digits.saturating_sub(1));
    match text.split_once('e') {
        Some((mantissa, exponent)) => format!("{}e{exponent}", without_zeros(mantissa)),
        None => text,
    }
}

/// The power of ten of the first digit, after rounding to `digits`; 0 for zero and for what is not finite.
fn decimal_exponent(value: f64, digits: usize) -> i32 {
    let text = format!("{value:.*e}", digits.saturating_sub(1));
    text.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

/// A decimal number without zeros at its end.
pub fn without_zeros(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

/// A number as a person writes it: the shortest text that reads back the same.
pub fn written(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

/// A place in space: `(0.25, 1.5) m`.
pub fn place(coordinates: &[f64]) -> String {
    let numbers: Vec<String> = coordinates.iter().map(|&x| number(x, PLACE_DIGITS)).collect();
    format!("({}) m", numbers.join(", "))
}

/// A count with separated thousands: `1 234 567`.
pub fn count(count: u64) -> String {
    let digits = count.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}

/// A count of things: `1 row`, `2 rows`.
pub fn counted(number: u64, thing: &str) -> String {
    format!("{} {thing}{}", count(number), if number == 1 { "" } else { "s" })
}

/// A path quoted such that a shell takes it for one word, and no program for an option.
pub fn shell_word(path: &Path) -> String {
    let text = path.to_string_lossy();
    let text = if text.starts_with('-') { format!("./{text}").into() } else { text };
    let is_plain = |c: char| c.is_alphanumeric() || "_./+-,=:@%".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        return text.into_owned();
    }
    format!("'{}'", text.replace('\'', "'\\''"))
}

/// The number of one of a row, from 1: `1st`, `2nd`, `3rd`, `4th`, `11th`, `23rd`.
pub fn ordinal(number: usize) -> String {
    let ending = match (number % 10, number % 100) {
        (_, 11..=13) => "th",
        (1, _) => "st",
        (2, _) => "nd",
        (3, _) => "rd",
        _ => "th",
    };
    format!("{number}{ending}")
}

/// Bytes in the largest unit that leaves a number of at least 1.
pub fn bytes(count: f64) -> String {
    let units = ["B", "kB", "MB", "GB", "TB", "PB"];
    let power = (0..units.len() - 1).find(|&power| count < 1000_f64.powi(power as i32 + 1));
    let power = power.unwrap_or(units.len() - 1);
    let value = count / 1000_f64.powi(power as i32);
    if power == 0 { format!("{value:.0} B") } else { format!("{value:.1} {}", units[power]) }
}

/// A span of wall time: `35 s`, `12 min`, `3 h 20 min`, `4 d 2 h`.
pub fn wall_time(seconds: f64) -> String {
    let whole = seconds.max(0.0);
    if whole < 99.5 {
        return if whole < 1.0 { "less than 1 s".into() } else { format!("{whole:.0} s") };
    }
    let minutes = (whole / 60.0).round();
    if minutes < 100.0 {
        return format!("{minutes:.0} min");
    }
    let (large, small, names) = if minutes < 48.0 * 60.0 {
        ((minutes / 60.0).floor(), minutes % 60.0, ["h", "min"])
    } else {
        let hours = (minutes / 60.0).round();
        ((hours / 24.0).floor(), hours % 24.0, ["d", "h"])
    };
    match large {
        years if names[0] == "d" && years >= 3650.0 => format!("{} years", number(years / 365.25, 2)),
        _ if small == 0.0 || large >= 100.0 => format!("{large:.0} {}", names[0]),
        _ => format!("{large:.0} {} {small:.0} {}", names[0], names[1]),
    }
}

/// Text from a file, a job or a command line, on its way to a terminal: characters that control it, or the
/// order in which it shows others, become visible.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.chars().any(controls) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        match c {
            _ if !controls(c) => out.push(c),
            '\n' | '\t' | '\r' => out.extend(c.escape_default()),
            _ => out.extend(c.escape_unicode()),
        }
    }
    Cow::Owned(out)
}

/// As [`printable`], of at most about `most` characters: the end is left out.
pub fn excerpt(text: &str, most: usize) -> Cow<'_, str> {
    match text.char_indices().nth(most) {
        None => printable(text),
        Some((end, _)) => Cow::Owned(format!("{}…", printable(&text[..end]))),
    }
}

/// Longest word for which a similar one is searched, in characters.
const LONGEST_WORD: usize = 100;
/// Most words that are compared with it.
const MOST_WORDS: usize = 1000;

/// The known word nearest to `word`, if it is near enough to be meant.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = word.chars().take(LONGEST_WORD + 1).count();
    if length > LONGEST_WORD {
        return None;
    }
    // A third of the letters may differ; shorter words than three letters have to be right.
    let allowed = |candidate: &str| word.len().max(candidate.len()).div_ceil(3);
    known
        .into_iter()
        .take(MOST_WORDS)
        .filter(|candidate| word.len().abs_diff(candidate.len()) <= allowed(candidate))
        .map(|candidate| (strsim::damerau_levenshtein(word, candidate), candidate))
        .min_by_key(|&(distance, _)| distance)
        .filter(|&(distance, candidate)| distance <= allowed(candidate))
        .map(|(_, candidate)| candidate)
}

/// Whether a character [`controls`] or is none at all: XML has no U+FFFE and U+FFFF.
fn is_hidden(c: char) -> bool {
    controls(c) || matches!(c, '\u{fffe}' | '\u{ffff}')
}

/// Whether a character changes what a terminal does or in which order it shows others.
pub fn controls(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_have_few_digits_and_a_prefix() {
        let cases = [
            (1.25e-5, "s", "12.5 µs"),
            (2.500547543213896, "s", "2.501 s"),
            (0.99999, "s", "1 s"),
            (0.000_999_99, "s", "1 ms"),
            (7200.0, "s", "7200 s"),
            (3e-13, "s", "0.0003 ns"),
            (0.0, "s", "0 s"),
            (1.2000000000000002, "m", "1.2 m"),
            (-0.0125, "m", "-12.5 mm"),
            (1.3067630073586898, "Pa", "1.307 Pa"),
            (4.0e8, "Pa", "400 MPa"),
            (1600.0, "kg/m³", "1600 kg/m³"),
            (2.5e12, "Pa", "2500 GPa"),
            (0.25, "", "0.25"),
            (f64::NAN, "s", "NaN s"),
        ];
        for (value, unit, expected) in cases {
            assert_eq!(quantity(value, unit), expected);
        }
    }

    #[test]
    fn titles_do_not_become_markup() {
        assert_eq!(html("<b>\"a\" & b</b>"), "&lt;b&gt;&quot;a&quot; &amp; b&lt;/b&gt;");
        assert_eq!(
            html("a\u{1}\u{1b}]0;x\u{7}\u{2028}\u{202e}\u{ffff}"),
            "a\\u{1}\\u{1b}]0;x\\u{7}\\u{2028}\\u{202e}\\u{ffff}"
        );
        assert_eq!(html("a = 1\r\n\tb"), "a = 1\n\tb");
    }

    #[test]
    fn scales_are_those_of_the_greatest_value() {
        assert_eq!(scale(0.25, "s"), (1e-3, "ms".into()));
        assert_eq!(scale(3.1e5, "J"), (1e3, "kJ".into()));
        assert_eq!(scale(3.1e5, "kg m/s"), (1.0, "kg m/s".into()));
        assert_eq!(scale(0.0, "Pa"), (1.0, "Pa".into()));
    }

    #[test]
    fn paths_are_one_word_for_a_shell() {
        for (path, word) in [
            ("out/a_b/µ-1.hdf", "out/a_b/µ-1.hdf"),
            ("my out/a.hdf", "'my out/a.hdf'"),
            ("it's", "'it'\\''s'"),
            ("-x", "./-x"),
            ("$HOME", "'$HOME'"),
        ] {
            assert_eq!(shell_word(Path::new(path)), word);
        }
    }

    #[test]
    fn ordinals_have_their_endings() {
        let all: Vec<String> = [1, 2, 3, 4, 11, 12, 13, 21, 22, 103, 111, 1012].map(ordinal).into();
        assert_eq!(all.join(" "), "1st 2nd 3rd 4th 11th 12th 13th 21st 22nd 103rd 111th 1012th");
    }

    #[test]
    fn numbers_have_the_digits_asked_for() {
        assert_eq!(number(1.2000000000000002, 12), "1.2");
        assert_eq!(number(0.1 + 0.2, 12), "0.3");
        assert_eq!(number(123_456.0, 3), "123456");
        assert_eq!(number(1.5e9, 4), "1.5e9");
        assert_eq!(number(2.5e-7, 4), "2.5e-7");
        assert_eq!(number(99_999.9, 3), "100000");
    }

    #[test]
    fn numbers_are_written_as_people_write_them() {
        let written = [5.0, 0.1, 1e308, 5e-324, -2.5e-7, 1e15].map(written);
        assert_eq!(written, ["5", "0.1", "1e308", "5e-324", "-2.5e-7", "1000000000000000"]);
    }

    #[test]
    fn places_are_short() {
        assert_eq!(place(&[0.1 + 0.2, -2.5, f64::NAN]), "(0.3, -2.5, NaN) m");
    }

    #[test]
    fn nearest_word_is_near() {
        let known = ["density", "name", "young"];
        assert_eq!(nearest("denisty", known), Some("density"));
        assert_eq!(nearest("Young", known), Some("young"));
        assert_eq!(nearest("wobble", known), None);
        assert_eq!(nearest(&"x".repeat(1_000_000), known), None);
    }

    #[test]
    fn counts_bytes_and_wall_times() {
        assert_eq!(count(0), "0");
        assert_eq!(count(1_234_567), "1 234 567");
        assert_eq!([0, 1, 1200].map(|n| counted(n, "row")), ["0 rows", "1 row", "1 200 rows"]);
        assert_eq!(bytes(999.0), "999 B");
        assert_eq!(bytes(54_400_000.0), "54.4 MB");
        assert_eq!(bytes(2e18), "2000.0 PB");
        let cases = [
            (0.2, "less than 1 s"),
            (35.4, "35 s"),
            (300.0, "5 min"),
            (12_000.0, "3 h 20 min"),
            (352_800.0, "4 d 2 h"),
            (1e10, "317 years"),
        ];
        for (seconds, expected) in cases {
            assert_eq!(wall_time(seconds), expected);
        }
    }

    #[test]
    fn foreign_text_controls_no_terminal() {
        assert_eq!(printable("Säule 3·10⁴ m³"), "Säule 3·10⁴ m³");
        assert_eq!(
            printable("\u{1b}]0;owned\u{7}\n\u{202e}\u{9b}x"),
            "\\u{1b}]0;owned\\u{7}\\n\\u{202e}\\u{9b}x"
        );
        assert_eq!(excerpt("abcdef", 3), "abc…");
        assert_eq!(excerpt("abc", 3), "abc");
    }
}
