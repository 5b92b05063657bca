//! Particles of a leaf that belong to one bin.
use crate::grid::plan::Bin;
use crate::grid::{GridPlan, Window};
use crate::kernel::SubBox;

/// Particles and parts of boxes in one bin, in canonical order.
#[derive(Clone, Debug)]
pub struct BinMembers<const D: usize> {
    /// Particles whose box is transferred whole.
    pub whole: Vec<u32>,
    /// Parts of boxes; their slots count the leaf's particles that are cut.
    pub parts: Vec<SubBox<D>>,
    /// Nodes that all these touch.
    pub window: Window<D>,
    /// Least and greatest lower face of the boxes along each axis, m.
    lower_faces: [[f64; D]; 2],
}

impl<const D: usize> Default for BinMembers<D> {
    fn default() -> Self {
        Self { whole: Vec::new(), parts: Vec::new(), window: Window::EMPTY, lower_faces: Self::NO_FACES }
    }
}

impl<const D: usize> BinMembers<D> {
    const NO_FACES: [[f64; D]; 2] = [[f64::INFINITY; D], [f64::NEG_INFINITY; D]];

    /// Whether there are no members.
    pub(in crate::solver) fn is_empty(&self) -> bool {
        self.whole.is_empty() && self.parts.is_empty()
    }

    /// Takes out all members.
    pub(in crate::solver) fn clear(&mut self) {
        self.whole.clear();
        self.parts.clear();
        self.window = Window::EMPTY;
        self.lower_faces = Self::NO_FACES;
    }

    /// Grows the window to a box, in cells of edge `cell`. The kernel limits half widths to half a cell.
    pub(super) fn include(&mut self, cell: f64, centre: [f64; D], half: [f64; D]) {
        let [least, greatest] = &mut self.lower_faces;
        for axis in 0..D {
            let face = centre[axis] - half[axis].min(0.5 * cell);
            least[axis] = least[axis].min(face);
            greatest[axis] = greatest[axis].max(face);
        }
    }

    /// Makes the window from all boxes that were included.
    pub(in crate::solver) fn close(&mut self, plan: &GridPlan<D>, bin: &Bin<D>) {
        if self.lower_faces[0][0] <= self.lower_faces[1][0] {
            let cell = plan.cell(bin.block.level);
            for faces in self.lower_faces {
                let corner = bin.block.coord.map(|c| f64::from(4 * c));
                self.window.include(std::array::from_fn(|axis| faces[axis] / cell - corner[axis]));
            }
        }
    }
}
