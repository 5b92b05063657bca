//! Problems that the binary solves from job files, one file each.
use crate::page::Page;
use crate::runs::Runs;

pub(crate) mod bar;
pub(crate) mod cantilever;
pub(crate) mod collapse;
pub(crate) mod column;
pub(crate) mod contact;
pub(crate) mod cost;
pub(crate) mod dam_break;
pub(crate) mod disks;
pub(crate) mod drivers;
pub(crate) mod footing;
pub(crate) mod incline;
pub(crate) mod manufactured;
pub(crate) mod plates;
pub(crate) mod rest;
pub(crate) mod rings;
pub(crate) mod taylor;
pub(crate) mod water;
pub(crate) mod weights;

/// Runs a problem and writes its section.
pub(crate) type Problem = fn(&Runs, &mut Page);

/// All of them, in the order of the page.
pub(crate) const ALL: [(&str, Problem); 21] = [
    ("bar", bar::section),
    ("in_time", bar::in_time),
    ("manufactured", manufactured::square),
    ("manufactured_3d", manufactured::cube),
    ("rings", manufactured::rings),
    ("column", column::section),
    ("cantilever", cantilever::section),
    ("disks", disks::section),
    ("collapse", collapse::section),
    ("taylor", taylor::section),
    ("drivers", drivers::section),
    ("dam_break", dam_break::section),
    ("water", water::section),
    ("weights", weights::section),
    ("rest", rest::section),
    ("plates", plates::section),
    ("incline", incline::section),
    ("contact", contact::section),
    ("footing", footing::section),
    ("cost", cost::section),
    ("cost_of_rings", rings::section),
];

/// Order of convergence of errors from one number of cells to another.
pub(crate) fn order(coarse: (f64, f64), fine: (f64, f64)) -> f64 {
    (coarse.1 / fine.1).ln() / (fine.0 / coarse.0).ln()
}
