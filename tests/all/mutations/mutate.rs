//! Mutations of texts and files, each decided by its seed alone.

/// Numbers that follow from a seed (splitmix64).
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `limit`; 0 if that is 0.
    pub(crate) fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }

    fn choose<'a, T: ?Sized>(&mut self, from: &[&'a T]) -> &'a T {
        from[self.below(from.len())]
    }
}

const NUMBERS: [&str; 40] = [
    "nan",
    "inf",
    "-inf",
    "0",
    "-0.0",
    "1e308",
    "-1e308",
    "1e309",
    "5e-324",
    "1e-300",
    "1e-12",
    "1e-9",
    "1e7",
    "1e12",
    "-1",
    "15",
    "16",
    "255",
    "256",
    "65536",
    "4294967296",
    "9223372036854775807",
    "-9223372036854775808",
    "9223372036854775808",
    "0x7fff",
    "0b101",
    "1_000",
    "1__0",
    "0.5",
    "2",
    "3",
    "1979-05-27",
    "07:32:00",
    "true",
    "\"\"",
    "[]",
    "{}",
    "[[[[]]]]",
    "\"\\u0000\"",
    "\"sin(t)^x\"",
];
const WORDS: [&str; 36] = [
    "box",
    "sphere",
    "circle",
    "union",
    "difference",
    "rotated",
    "half_space",
    "polygon",
    "cone",
    "cylinder",
    "intersection",
    "apic",
    "flip",
    "tpic",
    "xpic",
    "volume",
    "fixed",
    "cell",
    "free",
    "steady",
    "table",
    "delete",
    "clamp",
    "error",
    "sticky",
    "slip",
    "separating",
    "symmetric",
    "x",
    "y",
    "z",
    "é",
    "\u{202e}",
    "\u{1f4a3}",
    "material",
    "region",
];
const PIECES: [&str; 24] = [
    "\0",
    "\u{1b}",
    "\u{feff}",
    "\u{202e}",
    "é",
    "\u{1f4a3}",
    "\u{7f}",
    "\t",
    "\r",
    "'",
    "\"",
    "\"\"\"",
    "#",
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    ",",
    ".",
    "\\",
    "\\u",
];

/// The places of numbers, words in quotes or keys.
fn spans(text: &str, is_part: impl Fn(char) -> bool, starts: impl Fn(char) -> bool) -> Vec<(usize, usize)> {
    let mut all = Vec::new();
    let mut begin = None;
    for (at, c) in text.char_indices().chain([(text.len(), '\n')]) {
        match begin {
            None if starts(c) => begin = Some(at),
            Some(start) if !is_part(c) => {
                all.push((start, at));
                begin = None;
            }
            _ => {}
        }
    }
    all
}

fn numbers(text: &str) -> Vec<(usize, usize)> {
    spans(text, |c| c.is_ascii_digit() || "._eE+-".contains(c), |c| c.is_ascii_digit() || c == '-')
}

fn keys(text: &str) -> Vec<(usize, usize)> {
    spans(text, |c| c.is_ascii_lowercase() || c == '_', |c| c.is_ascii_lowercase())
}

fn quoted(text: &str) -> Vec<(usize, usize)> {
    let marks: Vec<usize> = text.match_indices('"').map(|(at, _)| at).collect();
    marks.chunks_exact(2).map(|pair| (pair[0], pair[1] + 1)).collect()
}

fn replaced(text: &str, (from, to): (usize, usize), new: &str) -> String {
    format!("{}{new}{}", &text[..from], &text[to..])
}

/// One of the jobs with up to three mutations.
pub(crate) fn mutated_text(random: &mut Random, jobs: &[String]) -> Vec<u8> {
    let mut text = jobs[random.below(jobs.len())].clone();
    for _ in 0..=random.below(3) {
        text = once(random, text, jobs);
    }
    // Bytes that are not UTF-8 come last.
    match random.below(12) {
        0 => bytes(random, text.into_bytes()),
        _ => text.into_bytes(),
    }
}

fn once(random: &mut Random, text: String, jobs: &[String]) -> String {
    let other = &jobs[random.below(jobs.len())];
    let mut lines: Vec<&str> = text.split('\n').collect();
    let line = random.below(lines.len());
    let span = |random: &mut Random, all: Vec<(usize, usize)>| {
        (!all.is_empty()).then(|| all[random.below(all.len())])
    };
    match random.below(14) {
        0..=4 => match span(random, numbers(&text)) {
            Some(at) => replaced(&text, at, random.choose(&NUMBERS)),
            None => text,
        },
        5 => match span(random, quoted(&text)) {
            Some(at) => replaced(&text, at, &format!("\"{}\"", random.choose(&WORDS))),
            None => text,
        },
        6 => match span(random, keys(&text)) {
            Some((from, to)) => {
                let key = text[from..to].to_owned();
                let new = match random.below(5) {
                    0 => format!("{key}x"),
                    1 => key.chars().rev().collect(),
                    2 => format!("{key}.{key}"),
                    3 => "a".repeat(500),
                    _ => random.choose(&WORDS).to_owned(),
                };
                replaced(&text, (from, to), &new)
            }
            None => text,
        },
        7 => {
            lines.remove(line);
            lines.join("\n")
        }
        8 => {
            lines.insert(random.below(lines.len() + 1), lines[line]);
            lines.join("\n")
        }
        9 => {
            let from: Vec<&str> = other.split('\n').collect();
            lines.truncate(line);
            lines.extend(&from[random.below(from.len())..]);
            lines.join("\n")
        }
        10 => {
            let blocks: Vec<&str> = other.split("\n[").collect();
            format!("{text}\n[{}", blocks[random.below(blocks.len())])
        }
        11 => {
            let mut at = random.below(text.len() + 1);
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            replaced(&text, (at, at), random.choose(&PIECES))
        }
        12 => {
            let depth = [10, 60, 79, 81, 130, 1000][random.below(6)];
            let nested = match random.below(3) {
                0 => format!("{}1{}", "[".repeat(depth), "]".repeat(depth)),
                1 => format!("{}1{}", "{ a = ".repeat(depth), " }".repeat(depth)),
                _ => format!(
                    "{}{{ kind = \"box\", min = [0, 0], max = [1, 1] }}{}",
                    "{ kind = \"union\", parts = [".repeat(depth),
                    "] }".repeat(depth)
                ),
            };
            span(random, numbers(&text)).map_or(text.clone(), |at| replaced(&text, at, &nested))
        }
        _ => {
            let number = random.choose(&NUMBERS);
            let count = [3, 100, 2000][random.below(3)];
            let array = format!("[{}]", vec![number; count].join(","));
            span(random, numbers(&text)).map_or(text.clone(), |at| replaced(&text, at, &array))
        }
    }
}

/// Changed, missing or cut bytes.
fn bytes(random: &mut Random, mut bytes: Vec<u8>) -> Vec<u8> {
    if bytes.is_empty() {
        return bytes;
    }
    match random.below(4) {
        0 => bytes.truncate(random.below(bytes.len())),
        1 => {
            let (at, bit) = (random.below(bytes.len()), random.below(8));
            bytes[at] ^= 1 << bit;
        }
        _ => {
            for _ in 0..=random.below(30) {
                let at = random.below(bytes.len());
                bytes[at] = random.below(256) as u8;
            }
        }
    }
    bytes
}

/// One of the files with changed bytes: half of the time near `mark`, where the header is.
pub(crate) fn mutated_bytes(random: &mut Random, files: &[Vec<u8>], mark: &[u8]) -> Vec<u8> {
    let mut file = files[random.below(files.len())].clone();
    let near = file.windows(mark.len()).position(|window| window == mark).filter(|_| random.below(2) == 0);
    let range = near.map_or(0..file.len(), |at| at.saturating_sub(4000)..(at + 8000).min(file.len()));
    if random.below(20) == 0 {
        file.truncate(random.below(file.len()));
        return file;
    }
    for _ in 0..=random.below(8) {
        let at = range.start + random.below(range.len());
        match random.below(4) {
            0 => file[at] ^= 1 << random.below(8),
            1 => file[at] = random.below(256) as u8,
            2 => file[at] = 0xff,
            _ => {
                // Lengths and addresses are numbers of eight bytes.
                let value = [0, u64::MAX, 1 << 31, 1 << 60, random.next()][random.below(5)];
                let end = (at + 8).min(file.len());
                file[at..end].copy_from_slice(&value.to_le_bytes()[..end - at]);
            }
        }
    }
    file
}
