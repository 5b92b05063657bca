//! The job file as it is written: types that parse it, and what is made from them.
//!
//! | file | what it holds |
//! |---|---|
//! | [`job_file`] | the file and its tables |
//! | [`adaptivity`], [`boundaries`], [`colliders`], [`contact`], [`equilibrium`], [`loads`], [`output`], [`probes`], [`sources`], [`stages`], [`stress`], [`water`] | tables of a part of the file |
//! | [`common`] | what several tables have |
//! | `json` | the JSON schema |
//! | [`reference`](mod@reference) | the reference in Markdown |
pub mod adaptivity;
pub mod boundaries;
pub mod colliders;
pub mod common;
pub mod contact;
pub mod equilibrium;
pub mod job_file;
pub(super) mod json;
pub mod loads;
pub mod output;
pub mod probes;
pub mod reference;
pub mod sources;
pub mod stages;
pub mod stress;
pub mod water;

/// Keys that files of earlier versions may have: path, and why the key is gone with what to do.
pub(super) const GONE: [(&str, &str); 1] = [(
    "adaptivity.travel",
    "the tree changes every adaptivity.every_steps steps; remove the key, and increase every_steps if regrids take too much time",
)];
