//! Laws of matter that yields under pressure alone.
//!
//! | file | model |
//! |---|---|
//! | `cam_clay.rs` | clay: modified Cam-clay in finite strain |
//! | `non_associated_cam_clay.rs` | matter that fractures (Wolper et al. 2019) |
//! | `snow.rs` | snow (Stomakhin et al. 2013) |
pub mod cam_clay;
pub mod non_associated_cam_clay;
pub mod snow;
