//! Load balance.
mod leaf_costs;
pub mod rebalance;
