//! The `agimp` program.
fn main() {}
