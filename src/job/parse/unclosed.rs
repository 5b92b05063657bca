//! Search for a brace, a bracket or a string that is never closed.
//!
//! A parser detects late that a sign is not closed: tables and arrays may span lines. So after its error the
//! text is scanned once more, line by line, with a stack of open signs. A line that begins a table of the
//! file, or a key inside an array, shows that the open sign should have been closed before.
use std::ops::Range;

/// Opening sign that is not closed: its first byte, and a message.
pub(super) type Unclosed = (Range<usize>, String);

/// The sign that opens ahead of a parser's error (a byte of the text) and is never closed, if that explains
/// the error.
pub(super) fn find(text: &str, error: usize) -> Option<Unclosed> {
    Scan { text, error, open: Vec::new(), string: 0..0 }.run()
}

struct Scan<'t> {
    text: &'t str,
    /// Where the parser has stopped.
    error: usize,
    /// Bytes of the brackets that are open.
    open: Vec<usize>,
    /// The string that ended last.
    string: Range<usize>,
}

impl Scan<'_> {
    fn run(&mut self) -> Option<Unclosed> {
        let mut start = 0;
        while start < self.text.len() {
            if self.open.is_empty() && start > self.error {
                return None;
            }
            let end = self.end_of_line(start);
            let is_header = self.open.is_empty() && self.text[start..end].trim_start().starts_with('[');
            start = match is_header {
                true => end + 1,
                false if self.is_too_late(start, end) => return self.bracket(start),
                false => match self.line(start, end) {
                    Ok(next) => next,
                    Err(found) => return found,
                },
            };
        }
        self.bracket(self.text.len())
    }

    fn end_of_line(&self, at: usize) -> usize {
        self.text[at..].find('\n').map_or(self.text.len(), |length| at + length)
    }

    /// Whether a line cannot stand within the open signs.
    fn is_too_late(&self, start: usize, end: usize) -> bool {
        let Some(&opener) = self.open.last() else { return false };
        let line = self.text[start..end].split('#').next().unwrap_or_default().trim();
        if let Some(name) = inside(line, '[', ']') {
            let name = inside(name, '[', ']').unwrap_or(name).trim();
            return is_key(name) && !["true", "false", "inf", "nan"].contains(&name);
        }
        let names_key = line.split_once('=').is_some_and(|(key, _)| is_key(key.trim()));
        let goes_on = self.text[..start].trim_end().ends_with([',', '{']);
        names_key && !(goes_on && self.text[opener..].starts_with('{'))
    }

    /// Scans a line. Returns the place to continue.
    fn line(&mut self, start: usize, end: usize) -> Result<usize, Option<Unclosed>> {
        let bytes = self.text.as_bytes();
        let mut at = start;
        while at < end {
            match bytes[at] {
                b'#' => break,
                b'"' | b'\'' => {
                    let close = self.end_of_string(at, end).ok_or_else(|| self.quote(at))?;
                    self.string = at..close;
                    if close > end {
                        return Ok(close);
                    }
                    at = close;
                    continue;
                }
                b'[' | b'{' => self.open.push(at),
                closer @ (b']' | b'}') => match self.open.pop().map(|opener| (opener, bytes[opener])) {
                    Some((_, b'[')) if closer == b']' => {}
                    Some((_, b'{')) if closer == b'}' => {}
                    Some((opener, _)) => {
                        self.open.push(opener);
                        return Err(self.bracket(at));
                    }
                    // One too many: the parser says so.
                    None => return Err(None),
                },
                _ => {}
            }
            at += 1;
        }
        Ok(end + 1)
    }

    /// The byte behind a string that opens at `at`; one line ends at `end`.
    fn end_of_string(&self, at: usize, end: usize) -> Option<usize> {
        let bytes = self.text.as_bytes();
        let triple = [bytes[at]; 3];
        let (quotes, last) =
            if bytes[at..].starts_with(&triple) { (&triple[..], bytes.len()) } else { (&triple[..1], end) };
        let mut byte = at + quotes.len();
        while byte < last {
            if bytes[byte] == b'\\' && bytes[at] == b'"' {
                byte += 1;
            } else if bytes[byte..].starts_with(quotes) {
                return Some(byte + quotes.len());
            }
            byte += 1;
        }
        None
    }

    /// The innermost bracket that is open where this is noticed.
    fn bracket(&self, noticed: usize) -> Option<Unclosed> {
        let opener = *self.open.last().filter(|opener| **opener < self.error)?;
        let (open, close) = if self.text[opener..].starts_with('[') { ('[', ']') } else { ('{', '}') };
        let line = self.text[..opener].matches('\n').count() + 1;
        let noticed = self.text[..noticed].matches('\n').count() + 1;
        let place = if noticed > line { format!("ahead of line {noticed}") } else { "in this line".into() };
        let message = format!("found a `{open}` that is not closed; expected its `{close}` {place}");
        Some((opener..opener + 1, message))
    }

    /// A string without end. Where another one ends just ahead of the parser's error, it is that one which
    /// lacks its quote, and the rest of the line is read the wrong way round.
    fn quote(&self, at: usize) -> Option<Unclosed> {
        let is_other =
            self.text.get(self.string.end..self.error).is_some_and(|between| between.trim().is_empty());
        let start = match self.error < at {
            true if is_other => self.string.start,
            true => return None,
            false => at,
        };
        let quote = &self.text[start..=start];
        let message = format!("found a string that is not closed; expected its `{quote}` in this line");
        Some((start..start + 1, message))
    }
}

/// Text between two signs.
fn inside(text: &str, open: char, close: char) -> Option<&str> {
    text.strip_prefix(open)?.strip_suffix(close)
}

/// Whether a word is a key without quotes, perhaps of several parts.
pub(super) fn is_key(word: &str) -> bool {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') && word.chars().all(is_bare)
}

#[cfg(test)]
mod tests {
    use super::super::source::Node;

    const JOB: &str = "version = 1 # [one\n\n[domain]\nsize = [8, 6]\n[tree]\nregions = [{ level = 2, shape = { kind = \"box\", min = [0, 2] } }]\n[[bodies]]\nname = \"ground\"\nshape = {\n  kind = \"box\", # {\n  max = [8, 4],\n}\ntext = '''\n[a\n'''\n[[colliders]]\nname = \"footing\"\n";

    /// Each closing sign left out, one after the other: the message names its partner.
    #[test]
    fn what_is_not_closed_is_reported_where_it_opened() {
        assert!(Node::parse(JOB).is_ok());
        // The text up to the closer, the place of its opener, and what the message says.
        let cases = [
            (
                "size = [8, 6",
                "]",
                "[8, 6",
                "found a `[` that is not closed; expected its `]` ahead of line 5",
            ),
            ("min = [0, 2", "]", "[0, 2", "found a `[` that is not closed; expected its `]` in this line"),
            // One of two that close together: the outer one is left over.
            ("[0, 2] ", "}", "{ level", "found a `{` that is not closed; expected its `}` in this line"),
            ("[0, 2] } ", "}", "{ level", "found a `{` that is not closed; expected its `}` in this line"),
            (
                "[0, 2] } }",
                "]",
                "[{ level",
                "found a `[` that is not closed; expected its `]` ahead of line 7",
            ),
            (
                "\"ground",
                "\"",
                "\"ground",
                "found a string that is not closed; expected its `\"` in this line",
            ),
            ("\"footing", "\"", "\"footing", "found a string that is not closed"),
            ("\"box", "\"", "\"box", "found a string that is not closed"),
            ("[8, 4],\n", "}", "{\n  kind", "found a `{` that is not closed; expected its `}` ahead of line"),
            ("max = [8, 4", "]", "[8, 4", "found a `[` that is not closed; expected its `]` ahead of line"),
        ];
        for (before, closer, opener, words) in cases {
            let start = JOB.find(before).expect(before);
            let at = start + before.len();
            assert!(JOB[at..].starts_with(closer), "{before}");
            let text = format!("{}{}", &JOB[..at], &JOB[at + 1..]);
            let expected = JOB[..at].rfind(opener).expect(opener);
            let (span, message) = Node::parse(&text).expect_err(before);
            assert!(message.starts_with(words), "{before}: {message}");
            assert_eq!(span.start, expected, "{before}: {message} at {:?}", &text[span.start..]);
        }
    }

    /// Other faults keep the parser's words.
    #[test]
    fn other_faults_are_not_taken_for_it() {
        for (text, at) in [
            ("a = [1, 2]]\n", 10),
            ("a = { b = 1 } }\n", 14),
            ("a = 1 2\nb = [1]\n", 4),
            ("[time\nend = 1\n", 5),
            ("a = b\nc = \"d\n", 4),
        ] {
            let (span, message) = Node::parse(text).expect_err(text);
            assert!(!message.contains("not closed"), "{text}: {message}");
            assert_eq!(span.start, at, "{text}: {message}");
        }
    }
}
