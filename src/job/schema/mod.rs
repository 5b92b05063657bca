//! The job file as it is written: types that parse it, and what is made from them.
//!
//! | file or folder | what it holds |
//! |---|---|
//! | [`job_file`] | the file and its tables |
//! | [`conditions`] | tables of what acts on the material |
//! | [`adaptivity`], [`equilibrium`], [`output`], [`probes`], [`stages`] | tables of other parts |
//! | [`common`] | what several tables have |
//! | `json` | the JSON schema |
//! | [`reference`](mod@reference) | the reference in Markdown |
pub mod adaptivity;
pub mod common;
pub mod conditions;
pub mod equilibrium;
pub mod job_file;
pub(super) mod json;
pub mod output;
pub mod probes;
pub mod reference;
pub mod stages;
