//! Triangles of a file, or why it gives none.

/// Triangles with the places of their corners; the corners are checked to be there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triangles {
    /// Places, in the units of the file.
    pub vertices: Vec<[f64; 3]>,
    /// Corners of each triangle, counter-clockwise seen from outside.
    pub indices: Vec<[u32; 3]>,
}

impl Triangles {
    /// Appends a triangle with corners of its own.
    pub(super) fn push(&mut self, corners: &[[f64; 3]; 3]) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(corners);
        self.indices.push([first, first + 1, first + 2]);
    }
}

/// Why a file gives no triangles.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// It cannot be read.
    #[error("it cannot be read: {0}")]
    System(#[from] std::io::Error),
    /// It has another ending.
    #[error("its name does not end with .stl, .obj or .ply")]
    Kind,
    /// It is damaged.
    #[error("it is not a valid {kind} file: {reason}")]
    Damaged {
        /// The expected format.
        kind: &'static str,
        /// The message of the reader.
        reason: String,
    },
}
