//! Jobs by load steps, without the keys that all of them in tests share.

/// A job by load steps to t = 1 with a row of the history for each: `job` from the key `dimension` on, and the
/// keys of `[quasi_static]`. Keys of `[history]` may follow.
pub(crate) fn load_steps(job: &str, keys: &str) -> String {
    format!(
        r#"version = 1
{job}
[quasi_static]
{keys}
[time]
end = 1
[output]
picture = false
[history]
every_steps = 1
"#
    )
}

/// Checkpoints after each step.
pub(crate) const CHECKPOINTS: &str = "[checkpoint]\nevery_steps = 1\nkeep = 99\n";
