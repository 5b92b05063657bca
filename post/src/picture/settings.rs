//! Options of a picture.
use super::camera::{View as Direction, numbers};
use super::paper::colour::{DARK, LIGHT, Map, Paper};
use crate::revolve::Revolve;

/// Options of a picture.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// First line.
    pub title: String,
    /// Values of the first and the last colour; `None`: as found, without the outermost half percents.
    pub range: Option<[f64; 2]>,
    /// Lower and upper corner of the frame, m; `None`: the particles with some room.
    pub frame: Option<[[f64; 3]; 2]>,
    /// Direction of view; along z in plane pictures.
    pub view: Direction,
    /// Magnification over the picture that just fits.
    pub zoom: f64,
    /// Place in the middle, m.
    pub focus: Option<[f64; 3]>,
    /// Colours of amounts.
    pub map: Map,
    /// Whether the paper is dark.
    pub dark: bool,
    /// Part of space that is left out.
    pub clip: Option<Clip>,
    /// Axes whose lower face of the domain is a plane of symmetry, at which all is mirrored.
    pub mirror: [bool; 3],
    /// Whether bodies of revolution are drawn in space, and how far they are turned.
    pub revolve: Option<Revolve>,
    /// Whether leaves of the tree are drawn: in the plane, at the clip, or at the floor.
    pub tree: bool,
    /// Vectors that are drawn as arrows, by the name of their quantity.
    pub vectors: Option<String>,
    /// Length of the longest vector, in its unit; `None`: as found.
    pub longest: Option<f64>,
    /// Whether a clip may leave nothing of the particles; else that is refused.
    pub may_be_empty: bool,
    /// Whether frame, axes, texts and arrows are kept apart from pixels, for SVG.
    pub collect: bool,
}

/// A cut across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clip {
    /// The axis.
    pub axis: usize,
    /// Where it is, m.
    pub at: f64,
    /// Whether the part above it is removed; else the part below.
    pub above: bool,
}

impl std::str::FromStr for Clip {
    type Err = String;

    /// `x<0.5` keeps the part below 0.5 m, `z>1` the part above 1 m.
    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || "expected the half space to keep, such as x<0.5 or z>1".to_owned();
        let place = text.find(['<', '>']).ok_or_else(expected)?;
        let (name, at) = (text[..place].trim(), text[place + 1..].trim());
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == name).ok_or_else(expected)?;
        let at = at.parse().ok().filter(|at: &f64| at.is_finite()).ok_or_else(expected)?;
        Ok(Self { axis, at, above: text.as_bytes()[place] == b'<' })
    }
}

impl std::fmt::Display for Clip {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (axis, side) = (["x", "y", "z"][self.axis], if self.above { '<' } else { '>' });
        write!(f, "{axis}{side}{}", agimp::text::written(self.at))
    }
}

impl Clip {
    pub(super) fn keeps(&self, place: f64) -> bool {
        if self.above { place <= self.at } else { place >= self.at }
    }
}

/// A place in space, from two or three numbers separated by commas.
///
/// # Errors
/// The text is no position; the message names the expected form.
pub fn place(text: &str) -> Result<[f64; 3], String> {
    let two = || numbers::<2>(text).map(|[x, y]| [x, y, 0.0]);
    numbers::<3>(text).or_else(two).ok_or_else(|| "expected a position in m, such as 0.5,0,0.2".into())
}

/// Options that the pictures of a series share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Values of the first and the last colour.
    pub range: [f64; 2],
    /// Lower and upper corner of the frame, m.
    pub frame: [[f64; 3]; 2],
    /// Length of the longest vector, in its unit; 0 if there are none.
    pub longest: f64,
}

impl Settings {
    /// A picture of usual size.
    pub fn new(title: &str) -> Self {
        Self {
            width: 1280,
            height: 800,
            title: title.into(),
            range: None,
            frame: None,
            view: Direction::Iso,
            zoom: 1.0,
            focus: None,
            map: Map::Viridis,
            dark: false,
            clip: None,
            mirror: [false; 3],
            revolve: None,
            tree: false,
            vectors: None,
            longest: None,
            may_be_empty: false,
            collect: false,
        }
    }

    /// Takes the options that a series shares, where no other was chosen.
    pub fn share(&mut self, look: &Look) {
        self.frame = Some(look.frame);
        self.longest = Some(look.longest);
        self.range = self.range.or(Some(look.range));
    }

    /// Pixels of a unit of the layout: letters and margins keep their size in pictures of usual sizes, and
    /// scale with smaller and larger ones.
    pub(super) fn unit(&self) -> f64 {
        let share = (self.width as f64 / 1280.0).min(self.height as f64 / 800.0);
        match share {
            ..0.75 => (share / 0.75).max(0.5),
            1.5.. => share / 1.5,
            _ => 1.0,
        }
    }

    pub(super) fn paper(&self) -> &'static Paper {
        if self.dark { &DARK } else { &LIGHT }
    }
}
