//! Colours of values.

/// Red, green, blue.
pub(in crate::picture) type Rgb = [u8; 3];

/// A colour map for amounts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Map {
    /// Dark violet over green to yellow: even steps of lightness, readable in grey and by the colour-blind.
    #[default]
    Viridis,
    /// Black over red to light yellow; the same holds.
    Magma,
    /// Blue over grey to red, for values of both signs (Moreland 2009).
    Coolwarm,
    /// Dark to light grey.
    Grey,
}

impl Map {
    /// All maps with their names.
    pub const ALL: [(&'static str, Self); 4] = [
        ("viridis", Self::Viridis),
        ("magma", Self::Magma),
        ("coolwarm", Self::Coolwarm),
        ("grey", Self::Grey),
    ];

    /// Even steps from the first to the last colour.
    fn steps(self) -> &'static [Rgb] {
        match self {
            Self::Viridis => &[
                [68, 1, 84],
                [72, 40, 120],
                [62, 73, 137],
                [49, 104, 142],
                [38, 130, 142],
                [31, 158, 137],
                [53, 183, 121],
                [109, 205, 89],
                [180, 222, 44],
                [253, 231, 37],
            ],
            Self::Magma => &[
                [0, 0, 4],
                [28, 16, 68],
                [79, 18, 123],
                [129, 37, 129],
                [181, 54, 122],
                [229, 80, 100],
                [251, 135, 97],
                [254, 194, 135],
                [252, 253, 191],
            ],
            Self::Coolwarm => &[
                [59, 76, 192],
                [98, 130, 234],
                [141, 176, 254],
                [184, 208, 249],
                [221, 221, 221],
                [245, 196, 173],
                [244, 154, 123],
                [222, 96, 77],
                [180, 4, 38],
            ],
            Self::Grey => &[[40, 40, 40], [235, 235, 235]],
        }
    }

    /// Colour of a value between 0 and 1.
    pub(in crate::picture) fn colour(self, value: f64) -> Rgb {
        let steps = self.steps();
        let place = value.clamp(0.0, 1.0) * (steps.len() - 1) as f64;
        let low = (place as usize).min(steps.len() - 2);
        mixed(steps[low], steps[low + 1], place - low as f64)
    }
}

/// Colours that distinguish small whole numbers.
const CLASSES: [Rgb; 8] = [
    [94, 110, 160],
    [226, 152, 58],
    [70, 150, 110],
    [200, 84, 80],
    [140, 110, 180],
    [150, 120, 90],
    [220, 140, 190],
    [120, 120, 120],
];

/// Colour of a whole number.
pub(in crate::picture) fn class(number: usize) -> Rgb {
    CLASSES.get(number).copied().unwrap_or_else(|| further(number - CLASSES.len()))
}

/// Colours for more classes or curves than a list has: hues go round by the golden ratio, which keeps them
/// apart, on rings of five lightnesses and saturations.
pub(crate) fn further(number: usize) -> Rgb {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    const RINGS: [(f64, f64); 5] = [(0.55, 0.82), (0.45, 0.56), (0.27, 0.89), (0.43, 0.77), (0.6, 0.56)];
    let (lightness, saturation) = RINGS[number % RINGS.len()];
    hsl((0.38 + GOLDEN * number as f64).fract(), saturation, lightness)
}

/// The colour of a hue (0 to 1), saturation and lightness.
fn hsl(hue: f64, saturation: f64, lightness: f64) -> Rgb {
    let reach = saturation * lightness.min(1.0 - lightness);
    [0.0, 8.0, 4.0].map(|shift| {
        let k = (shift + 12.0 * hue) % 12.0;
        (255.0 * (lightness - reach * (k - 3.0).min(9.0 - k).clamp(-1.0, 1.0))).round() as u8
    })
}

/// A colour made lighter or darker.
pub(in crate::picture) fn scaled(colour: Rgb, factor: f64) -> Rgb {
    colour.map(|channel| (f64::from(channel) * factor).clamp(0.0, 255.0) as u8)
}

/// A share of the second colour in the first.
pub(in crate::picture) fn mixed(first: Rgb, second: Rgb, share: f64) -> Rgb {
    std::array::from_fn(|i| {
        let (a, b) = (f64::from(first[i]), f64::from(second[i]));
        (a + share * (b - a)).round() as u8
    })
}

/// Colours of all but the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::picture) struct Paper {
    pub paper: Rgb,
    pub ink: Rgb,
    pub floor: Rgb,
    pub floor_line: Rgb,
    pub solid: Rgb,
    pub tree: Rgb,
}

/// Of light and of dark pictures.
pub(in crate::picture) const LIGHT: Paper = Paper {
    paper: [250, 250, 248],
    ink: [40, 40, 44],
    floor: [232, 232, 228],
    floor_line: [200, 200, 196],
    solid: [186, 190, 198],
    tree: [110, 110, 116],
};
pub(in crate::picture) const DARK: Paper = Paper {
    paper: [20, 22, 26],
    ink: [228, 228, 226],
    floor: [38, 41, 47],
    floor_line: [66, 70, 78],
    solid: [120, 126, 138],
    tree: [150, 152, 158],
};

#[cfg(test)]
mod tests {
    use super::*;

    /// Forty bodies: no two have nearly the same colour, and none that of paper or colliders.
    #[test]
    fn classes_differ() {
        let colours: Vec<Rgb> = (0..40).map(class).chain([LIGHT.paper, LIGHT.solid, DARK.paper]).collect();
        for (i, a) in colours.iter().enumerate() {
            for (j, b) in colours[..i].iter().enumerate() {
                let distance: i32 = (0..3).map(|c| (i32::from(a[c]) - i32::from(b[c])).pow(2)).sum();
                assert!(distance > 30 * 30, "{i} {a:?}, {j} {b:?}");
            }
        }
    }

    #[test]
    fn maps_are_even_in_lightness_but_for_the_one_with_two_sides() {
        let lightness = |c: Rgb| 0.299 * f64::from(c[0]) + 0.587 * f64::from(c[1]) + 0.114 * f64::from(c[2]);
        for (name, map) in Map::ALL {
            let steps: Vec<f64> = (0..=20).map(|i| lightness(map.colour(f64::from(i) / 20.0))).collect();
            let middle = steps[10];
            match map {
                Map::Coolwarm => assert!(middle > steps[0] && middle > steps[20], "{name}"),
                _ => assert!(steps.is_sorted(), "{name}: {steps:?}"),
            }
        }
    }
}
