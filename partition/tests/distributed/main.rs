//! Tests on several ranks, against a serial oracle that knows the whole tree.
//!
//! Each `#[test]` launches this very binary under `mpirun`, once per number of ranks; there the
//! hidden test `worker` runs the scenario that an environment variable names.

mod comm;
#[path = "../../../tests/common/mpirun.rs"]
mod mpirun;
mod oracle;
mod random;
#[path = "../../../tests/common/scenarios.rs"]
mod scenarios;
mod search;
mod tree;

use scenarios::{Scenario, agrees_for, fails};

/// Everything that can be run on several ranks, by name.
const SCENARIOS: &[(&str, Scenario)] = &[
    ("reductions", comm::reductions),
    ("agree", comm::agree),
    ("sparse", comm::sparse),
    ("neighbours", comm::neighbours),
    ("panic", comm::panic_on_last),
    ("panic_in_a_step", comm::panic_in_a_step),
    ("panic_everywhere", comm::panic_everywhere),
    ("tree_2d", tree::random_trees::<2>),
    ("tree_3d", tree::random_trees::<3>),
    ("uniform", tree::uniform),
    ("given_leaves", tree::given_leaves),
    ("bad_leaves", tree::bad_leaves),
    ("search_2d", search::random_queries::<2>),
    ("search_3d", search::random_queries::<3>),
];

/// Entry of the launched processes.
#[test]
#[ignore = "started by the other tests under mpirun"]
fn worker() {
    scenarios::work(&[SCENARIOS]);
}

#[test]
fn one_rank_without_mpirun() {
    scenarios::alone("tree_2d");
}

#[test]
fn reductions() {
    agrees_for("reductions", &[1, 2, 3, 4]);
}

#[test]
fn agree() {
    agrees_for("agree", &[1, 2, 4]);
}

#[test]
fn sparse_exchange() {
    agrees_for("sparse", &[1, 2, 3, 4]);
}

#[test]
fn neighbour_exchange() {
    agrees_for("neighbours", &[1, 2, 3, 4]);
}

#[test]
fn a_panic_ends_all_ranks() {
    fails("panic", 1, "rank 0: deliberate");
    fails("panic", 3, "rank 2: deliberate");
    fails("panic_in_a_step", 3, "rank 2, step 17: deliberate");
    fails("panic_everywhere", 3, "rank 0: deliberate");
}

#[test]
fn random_trees_2d() {
    agrees_for("tree_2d", &[1, 2, 3, 4]);
}

#[test]
fn random_trees_3d() {
    agrees_for("tree_3d", &[1, 2, 3, 4]);
}

#[test]
fn uniform_trees() {
    agrees_for("uniform", &[1, 2, 3, 4]);
}

#[test]
fn given_leaves() {
    agrees_for("given_leaves", &[1, 2, 3, 4]);
}

#[test]
fn bad_leaves() {
    agrees_for("bad_leaves", &[1, 3]);
}

#[test]
fn search_2d() {
    agrees_for("search_2d", &[1, 2, 3, 4]);
}

#[test]
fn search_3d() {
    agrees_for("search_3d", &[1, 2, 3, 4]);
}
