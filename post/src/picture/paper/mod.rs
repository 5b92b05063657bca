//! Paper of a picture: an image, colours and letters.
//!
//! | file | concern |
//! |---|---|
//! | `canvas.rs` | an image and its file |
//! | `colour.rs` | colours and their maps |
//! | `font.rs`, `heading.rs` | letters; title and caption |
pub(super) mod canvas;
pub(super) mod colour;
pub(super) mod font;
pub(super) mod heading;
