//! Gather for the particles of a leaf, without an advance.
use crate::grid::arenas::Arenas;
use crate::grid::sums::node_fields::VelocityArena;
use crate::grid::{GridPlan, NodeFields};
use crate::kernel::Scheme;
use crate::kernel::g2p::{self, Fields, Gathered, Moments};
use crate::particle::Chunk;
use crate::solver::sorting::bin_view::BinView;
use crate::solver::sorting::leaf_bins::LeafBins;

/// Input of the gather, the same for all leaves.
pub(in crate::solver) struct Look<'a, const D: usize> {
    pub plan: &'a GridPlan<D>,
    /// Velocities of the nodes.
    pub fields: &'a NodeFields<D>,
    pub arenas: &'a Arenas<D>,
    pub scheme: &'a Scheme<'a>,
}

impl<const D: usize> Look<'_, D> {
    /// Calls `each` with the particles of an own leaf and their gathered values: bin by bin those whose boxes
    /// are whole, then those whose boxes are cut. `kernel`, `arena` and `gathered` are memory of the thread.
    pub(in crate::solver) fn at_leaf(
        &self,
        (kernel, arena, gathered): (&mut g2p::Scratch<D>, &mut VelocityArena<D>, &mut Vec<Gathered<D>>),
        lists: Option<&LeafBins<D>>,
        leaf: usize,
        chunk: &Chunk<D>,
        mut each: impl FnMut(usize, &Gathered<D>),
    ) {
        let cut: &[u32] = lists.map_or(&[], |bins| &bins.cut);
        gathered.clear();
        gathered.resize(cut.len(), Gathered::default());
        for bin in BinView::of_leaf(self.plan, lists, leaf, chunk.len()) {
            self.fields.load(self.plan, self.arenas, bin.number, &bin.window, arena);
            let moments = bin.constrained.map(|nodes| Moments { nodes, first: &arena.moments });
            let nodes = Fields { velocity: &arena.rows, increment: None, fill: None, moments };
            g2p::gather_sub_boxes(
                kernel,
                chunk,
                bin.parts,
                &bin.frame,
                self.scheme.coordinates,
                &nodes,
                gathered,
            );
            if let Some(whole) = bin.whole {
                g2p::look(kernel, chunk, whole, &bin.frame, self.scheme, &nodes, |p, gathered| {
                    each(p, &gathered);
                });
            }
        }
        cut.iter().zip(&*gathered).for_each(|(&p, gathered)| each(p as usize, gathered));
    }
}
