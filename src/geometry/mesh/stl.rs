//! STL, text and binary.
//!
//! A file is binary if its length matches the number of triangles in its header, whatever the header begins
//! with; else, if its first word is `solid`, it is text: words in letters of either case, one after another
//! as many solids as there are.
use super::triangles::{ReadError, Triangles};
use crate::text::excerpt;

/// Bytes ahead of the number of triangles of a binary file.
const HEADER: usize = 80;

/// Bytes of a triangle: normal and corners in single precision, and two more.
const TRIANGLE: usize = 50;

/// Longest word of a file in a message.
const QUOTED: usize = 40;

pub(super) fn parse(bytes: &[u8]) -> Result<Triangles, ReadError> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let is_text = text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let parsed = match binary(bytes) {
        Err(_) if is_text => self::text(text),
        binary => binary,
    };
    parsed.map_err(|reason| ReadError::Damaged { kind: "STL", reason })
}

fn binary(bytes: &[u8]) -> Result<Triangles, String> {
    let (Some(count), all) = (bytes.get(HEADER..HEADER + 4), bytes.get(HEADER + 4..).unwrap_or_default())
    else {
        return Err(format!("it has {} bytes, and does not begin with \"solid\"", bytes.len()));
    };
    let count = u32::from_le_bytes([count[0], count[1], count[2], count[3]]);
    if all.len() as u64 != u64::from(count) * TRIANGLE as u64 {
        let there = all.len() / TRIANGLE;
        return Err(format!("its header announces {count} triangles, and there is room for {there}"));
    }
    let mut triangles = Triangles::default();
    for triangle in all.chunks_exact(TRIANGLE) {
        let numbers: [f64; 12] = std::array::from_fn(|k| {
            let [a, b, c, d] = std::array::from_fn(|byte| triangle[4 * k + byte]);
            f64::from(f32::from_le_bytes([a, b, c, d]))
        });
        let corners = numbers[3..].as_chunks::<3>().0;
        triangles.push(&[corners[0], corners[1], corners[2]]);
    }
    Ok(triangles)
}

fn text(bytes: &[u8]) -> Result<Triangles, String> {
    let (mut triangles, mut corners, mut solids) = (Triangles::default(), Vec::new(), 0_u64);
    for (number, line) in (1..).zip(bytes.split(|&byte| byte == b'\n')) {
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_whitespace();
        let Some(first) = words.next() else { continue };
        let fault = |reason: String| Err(format!("line {number} of it: {reason}"));
        match first.to_ascii_lowercase().as_str() {
            "solid" => solids += 1,
            "facet" => corners.clear(),
            "outer" | "endloop" => {}
            "vertex" => {
                let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
                match <[f64; 3]>::try_from(numbers.as_slice()) {
                    Ok(corner) => corners.push(corner),
                    Err(_) => {
                        return fault(format!(
                            "found \"{}\"; expected three numbers after vertex",
                            excerpt(&line, QUOTED)
                        ));
                    }
                }
            }
            "endfacet" => match <[[f64; 3]; 3]>::try_from(corners.as_slice()) {
                Ok(corners) => triangles.push(&corners),
                Err(_) => {
                    return fault(format!("found a facet of {} vertices; expected three", corners.len()));
                }
            },
            "endsolid" if solids > 0 => solids -= 1,
            _ => {
                let expected = "solid, facet, outer, vertex, endloop, endfacet or endsolid";
                return fault(format!("found \"{}\"; expected {expected}", excerpt(first, QUOTED)));
            }
        }
    }
    if solids > 0 { Err("it ends before endsolid".into()) } else { Ok(triangles) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "solid a part\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 0.1 1e-3\n  endloop\n \
                        endfacet\nendsolid a part\n";

    fn corners(bytes: &[u8]) -> Vec<[[f64; 3]; 3]> {
        let Triangles { vertices, indices } = parse(bytes).unwrap_or_else(|error| panic!("{error}"));
        indices.into_iter().map(|corners| corners.map(|corner| vertices[corner as usize])).collect()
    }

    /// In capitals, with a mark of the order of bytes, without a name, with several solids: all triangles are
    /// there.
    #[test]
    fn forms_of_text_give_the_same_triangles() {
        let expected = corners(TEXT.as_bytes());
        assert_eq!(expected, [[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.1, 1e-3]]]);
        let windows = TEXT.replace('\n', "\r\n");
        for text in [TEXT.to_uppercase(), format!("\u{feff}\n{TEXT}"), TEXT.replace(" a part", ""), windows] {
            assert_eq!(corners(text.as_bytes()), expected, "{text}");
        }
        assert_eq!(corners(format!("{TEXT}{TEXT}").as_bytes()).len(), 2);
    }

    /// A binary file whose header begins with the word of text files.
    #[test]
    fn a_binary_file_may_begin_with_solid() {
        let mut bytes = b"solid of some program".to_vec();
        bytes.resize(HEADER, b' ');
        bytes.extend(1_u32.to_le_bytes());
        for number in [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5, 0.0_f32] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend([0; 2]);
        assert_eq!(corners(&bytes), [[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.5, 0.0]]]);
        bytes.truncate(100);
        assert!(parse(&bytes).is_err());
    }

    #[test]
    fn faults_of_text_name_their_line() {
        let reason = |text: String| parse(text.as_bytes()).unwrap_err().to_string();
        assert!(reason(TEXT.replace("0.1", "x")).contains("line 6 of it: found \"   vertex 0 x 1e-3\""));
        assert!(reason(TEXT.replace("outer", "inner")).contains("line 3 of it: found \"inner\""));
        assert!(
            reason(TEXT.replace("   vertex 1 0 0\n", ""))
                .contains("line 7 of it: found a facet of 2 vertices")
        );
        assert!(reason(TEXT.replace("endsolid a part", "")).contains("ends before endsolid"));
    }
}
