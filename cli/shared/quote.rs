//! The lines of a job around a fault, cut and cleaned for a terminal.
use std::ops::Range;

use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};

use agimp::job::{Fault, FaultList};
use agimp::text::controls;

/// Most characters of a line that are shown.
const WIDTH: usize = 200;

/// The line of a fault with its neighbours. Characters that control a terminal are replaced by one visible
/// character each.
#[derive(Debug)]
pub(super) struct Quote {
    name: String,
    text: String,
    /// Number of the first line, from 0.
    line: usize,
    /// The fault, in bytes of `text`.
    pub(super) label: Range<usize>,
}

impl Quote {
    pub(super) fn of(list: &FaultList, fault: &Fault) -> Self {
        let (line, column) = list.position(fault);
        let (path, whole) = list.source(fault);
        let (line, column) = (line - 1, column - 1);
        // The window slides along a long line; its neighbours are shown from their start.
        let from = column.saturating_sub(WIDTH / 2);
        let length = whole
            .get(fault.span.clone())
            .map_or(0, |text| text.lines().next().map_or(0, |l| l.chars().count()));
        let first = line.saturating_sub(1);
        let (mut text, mut label) = (String::new(), 0..0);
        for (number, content) in whole.split('\n').enumerate().skip(first).take(3) {
            let from = if number == line { from } else { 0 };
            if number == line {
                let start = text.len();
                let shown = cleaned(content, from, &mut text);
                let at = |column: usize| start + shown.get(column).copied().unwrap_or(text.len() - start);
                let begin = column - from + usize::from(from > 0);
                label = at(begin)..at(begin + length.max(1)).max(at(begin));
            } else {
                cleaned(content, from, &mut text);
            }
            text.push('\n');
        }
        Self {
            name: agimp::text::printable(&path.display().to_string()).into_owned(),
            text,
            line: first,
            label,
        }
    }
}

/// Appends at most [`WIDTH`] characters of a line from one on, with dots where it is cut. Returns the bytes
/// at which the characters begin, dots included, relative to the first.
fn cleaned(line: &str, from: usize, out: &mut String) -> Vec<usize> {
    let (start, mut places) = (out.len(), Vec::new());
    let mut push = |c: char| {
        places.push(out.len() - start);
        out.push(c);
    };
    if from > 0 {
        push('…');
    }
    let mut rest = line.trim_end_matches('\r').chars().skip(from);
    for c in rest.by_ref().take(WIDTH) {
        push(match c {
            '\t' => ' ',
            _ if controls(c) => char::REPLACEMENT_CHARACTER,
            _ => c,
        });
    }
    if rest.next().is_some() {
        push('…');
    }
    places
}

impl SourceCode for Quote {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let inner = self.text.read_span(span, before, after)?;
        Ok(Box::new(MietteSpanContents::new_named(
            self.name.clone(),
            inner.data(),
            *inner.span(),
            self.line + inner.line(),
            inner.column(),
            inner.line_count(),
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quote(text: &str, span: Range<usize>) -> Quote {
        let fault = Fault {
            key: String::new(),
            message: "wrong".into(),
            span,
            help: None,
            setting: None,
            included: None,
        };
        let list = FaultList { path: "job.toml".into(), text: text.into(), faults: vec![fault.clone()] };
        Quote::of(&list, &fault)
    }

    #[test]
    fn the_label_is_on_the_fault_and_escapes_are_seen() {
        let text = "a = 1\nb = \"\u{1b}[31m\u{202e}é\" # x\nc = 3\nd = 4\n";
        let start = text.find("# x").unwrap();
        let quote = quote(text, start..start + 3);
        assert_eq!(&quote.text[quote.label.clone()], "# x");
        assert_eq!(quote.text, "a = 1\nb = \"\u{fffd}[31m\u{fffd}é\" # x\nc = 3\n");
        assert_eq!(quote.line, 0);
    }

    #[test]
    fn long_lines_are_cut_around_the_fault() {
        let text = format!("x\n{}!{}\ny", "é".repeat(100_000), "ö".repeat(100_000));
        let start = text.find('!').unwrap();
        let quote = quote(&text, start..start + 1);
        assert_eq!(&quote.text[quote.label.clone()], "!");
        assert!(quote.text.chars().count() < 220);
        for span in [0..0, text.len()..text.len(), 0..text.len()] {
            let quote = self::quote(&text, span);
            assert!(quote.text.get(quote.label.clone()).is_some());
        }
    }
}
