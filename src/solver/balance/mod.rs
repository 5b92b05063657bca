//! Load balance.
pub mod cost;
pub mod rebalance;
