//! Records of the PEER ground motion database (`.AT2`, `.VT2`, `.DT2`): four lines of header, of which the
//! last gives the number of values and their step, `NPTS= 7807, DT= .0050 SEC`, and then the values, several
//! in a line.
use super::rows::{RecordError, Rows, number_of, quoted};

/// Lines in which the step is searched.
const HEADER: usize = 6;

/// Times and values, if it is such a record.
pub(super) fn values(bytes: &[u8]) -> Option<Result<Rows, RecordError>> {
    let mut lines = (1..).zip(bytes.split(|&byte| byte == b'\n'));
    let step = lines.by_ref().take(HEADER).find_map(|(_, line)| step(&String::from_utf8_lossy(line)));
    let (count, step) = step?;
    let mut rows = Rows::default();
    for (line, text) in lines {
        let words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        for word in words {
            let Some(value) = std::str::from_utf8(word).ok().and_then(number_of) else {
                let reason = format!("found {}; expected a number", quoted(word));
                return Some(Err(RecordError::Line { line, reason }));
            };
            rows.numbers.push(vec![rows.numbers.len() as f64 * step, value]);
            rows.lines.push(line);
        }
    }
    let found = rows.numbers.len();
    Some(if found == count { Ok(rows) } else { Err(RecordError::Count { found, expected: count }) })
}

/// Number of values and their step, s, of the line that gives them: before or after the words.
fn step(line: &str) -> Option<(usize, f64)> {
    let upper = line.to_uppercase();
    let words =
        || upper.split(|c: char| c.is_whitespace() || c == ',' || c == '=').filter(|word| !word.is_empty());
    if !(words().any(|word| word == "NPTS") && words().any(|word| word == "DT")) {
        return None;
    }
    let mut numbers = words().filter_map(number_of);
    let (count, step) = (numbers.next()?, numbers.next()?);
    let is_sane = (1.0..=1e9).contains(&count) && count.fract() == 0.0 && step > 0.0 && step.is_finite();
    is_sane.then_some((count as usize, step))
}

#[cfg(test)]
mod tests {
    use super::super::{Column, parse};
    use crate::quantity::Table;

    #[test]
    fn a_record_of_peer_is_a_table() {
        let table = Table::new(&[(0.0, -2.0), (0.005, 4.0), (0.01, 0.5)]).unwrap();
        let read =
            |text: &str, value| parse(text.as_bytes(), &Column::Number(1), &Column::Number(value), 2.0);
        for step in ["NPTS=      3, DT=   .0050 SEC", "    3    0.0050    NPTS, DT"] {
            let head = format!(
                "PEER NGA STRONG MOTION DATABASE RECORD\nSomewhere, 1/1/1990\nACCELERATION IN UNITS OF G\n{step}\n"
            );
            assert_eq!(
                read(&format!("{head}  -.1000000E+01   .2000000E+01\r\n   .2500000E+00\r\n"), 2).unwrap(),
                table
            );
            let fault = |text: &str, value| read(text, value).unwrap_err().to_string();
            assert_eq!(fault(&format!("{head} 1 2\n"), 2), "it has 2 values; its header says NPTS = 3");
            assert_eq!(fault(&format!("{head} 1 2 x\n"), 2), "line 5: found \"x\"; expected a number");
            assert!(fault(&format!("{head} 1 2 3\n"), 3).contains("without columns"));
        }
    }
}
