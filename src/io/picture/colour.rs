//! Colours of values.

/// Red, green, blue.
pub(super) type Rgb = [u8; 3];

/// Dark violet over green to yellow: even steps of lightness, readable in grey and by the colour-blind.
const SEQUENCE: [Rgb; 6] =
    [[68, 1, 84], [65, 68, 135], [42, 120, 142], [34, 168, 132], [122, 209, 81], [253, 231, 37]];

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

/// Colour of a value between 0 and 1.
pub(super) fn sequential(value: f64) -> Rgb {
    let place = value.clamp(0.0, 1.0) * (SEQUENCE.len() - 1) as f64;
    let low = (place as usize).min(SEQUENCE.len() - 2);
    let part = place - low as f64;
    std::array::from_fn(|i| {
        let (a, b) = (f64::from(SEQUENCE[low][i]), f64::from(SEQUENCE[low + 1][i]));
        (a + part * (b - a)).round() as u8
    })
}

/// Colour of a whole number.
pub(super) fn class(number: usize) -> Rgb {
    CLASSES[number % CLASSES.len()]
}

/// A colour made lighter or darker.
pub(super) fn scaled(colour: Rgb, factor: f64) -> Rgb {
    colour.map(|channel| (f64::from(channel) * factor).clamp(0.0, 255.0) as u8)
}
