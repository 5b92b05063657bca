//! Maps: the largest depth and the largest speed of the run over each cell of a raster in plan.

/// A raster in plan: over all axes but the last, along which depths are measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Name; part of the names of its files.
    pub name: String,
    /// Lower corner, m from that of the domain.
    pub corner: [f64; 2],
    /// Edge of a cell, m.
    pub cell: f64,
    /// Columns and rows; one row in plane strain.
    pub size: [usize; 2],
    /// Bodies that count, by index; all without.
    pub bodies: Option<Vec<u16>>,
}

/// The largest values so far, cell by cell in rows along x; the same on all ranks.
#[derive(Clone, Debug, PartialEq)]
pub struct Maxima {
    /// Largest depth, m.
    pub depth: Vec<f64>,
    /// Largest speed of a particle, m/s.
    pub speed: Vec<f64>,
}

impl Map {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// Whether it has no cell.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Area of a cell, m²; in plane strain of one metre of thickness.
    pub fn area(&self, dimension: usize) -> f64 {
        if dimension == 2 { self.cell } else { self.cell * self.cell }
    }

    /// The cell that holds a place, m from the lower corner of the domain.
    pub fn cell_of<const D: usize>(&self, x: &[f64; D]) -> Option<usize> {
        let mut at = [0; 2];
        for axis in 0..D - 1 {
            let cells = ((x[axis] - self.corner[axis]) / self.cell).floor();
            if !(cells >= 0.0 && cells < self.size[axis] as f64) {
                return None;
            }
            at[axis] = cells as usize;
        }
        Some(at[0] + self.size[0] * at[1])
    }

    /// Nothing yet.
    pub fn nothing(&self) -> Maxima {
        Maxima { depth: vec![0.0; self.len()], speed: vec![0.0; self.len()] }
    }
}
