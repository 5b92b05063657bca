//! One bin with its members, as the kernels take them.
use super::leaf_bins::LeafBins;
use crate::grid::{GridPlan, Window};
use crate::kernel::constrained_nodes::ConstrainedNodes;
use crate::kernel::{Frame, Select, SubBox};

/// A bin and its members in this step.
pub(in crate::solver) struct BinView<'a, const D: usize> {
    /// Number of the bin.
    pub number: usize,
    /// Own leaf whose particles it takes.
    pub leaf: usize,
    /// Its cells.
    pub frame: Frame<D>,
    /// Constrained nodes in its arena, if there are any.
    pub constrained: Option<&'a ConstrainedNodes>,
    /// Members whose boxes are whole.
    pub whole: Option<Select<'a>>,
    /// Parts of boxes.
    pub parts: &'a [SubBox<D>],
    /// Nodes that the members touch.
    pub window: Window<D>,
}

impl<'a, const D: usize> BinView<'a, D> {
    /// A bin of a plan, whose leaf has `lists` and so many particles.
    pub(crate) fn new(
        plan: &'a GridPlan<D>,
        lists: Option<&'a LeafBins<D>>,
        number: usize,
        particles: usize,
    ) -> Self {
        let bin = &plan.bins[number];
        let leaf = bin.leaf as usize;
        let in_leaf = number - plan.leaf_bins(leaf).start;
        let members = lists.map(|lists| &lists.members[in_leaf]);
        let is_all = in_leaf == 0 && particles > 0 && members.is_none_or(|own| own.whole.len() == particles);
        let whole = match members {
            _ if is_all => Some(Select::All),
            Some(members) if !members.whole.is_empty() => Some(Select::List(&members.whole)),
            _ => None,
        };
        Self {
            number,
            leaf,
            frame: plan.frame(bin),
            constrained: plan.constrained(bin),
            whole,
            parts: members.filter(|_| !is_all).map_or(&[], |members| &members.parts),
            window: members.map_or(Window::FULL, |members| members.window),
        }
    }

    /// The bins of an own leaf that have members.
    pub(crate) fn of_leaf(
        plan: &'a GridPlan<D>,
        lists: Option<&'a LeafBins<D>>,
        leaf: usize,
        particles: usize,
    ) -> impl Iterator<Item = Self> {
        let bins = plan.leaf_bins(leaf).map(move |number| Self::new(plan, lists, number, particles));
        bins.filter(|bin| bin.whole.is_some() || !bin.parts.is_empty())
    }
}
