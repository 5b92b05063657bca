//! The widest instruction set of the processor, chosen when the program runs.
//!
//! The whole program is compiled for AVX2 and FMA. What is most of a step is compiled once more for AVX-512, of which
//! it uses the 32 registers and the masks, still four numbers at a time: batches need more than 16 registers. Each operation
//! is rounded as before, so results do not depend on the choice.
#[cfg(target_arch = "x86_64")]
use std::sync::LazyLock;

/// Work that is worth being compiled for several instruction sets.
pub trait Kernel {
    /// What it gives.
    type Output;

    /// Does the work. To be marked `inline(always)`, and so is what it calls: functions of their own are compiled once.
    fn run(self) -> Self::Output;
}

/// Runs a kernel with the widest instruction set that the processor has.
#[inline(always)]
pub fn widest<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        /// Whether the processor has all that [`wide`] is compiled for.
        static HAS_AVX512: LazyLock<bool> = LazyLock::new(|| {
            is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512cd")
        });
        if *HAS_AVX512 {
            // SAFETY: the processor has the features, as was just asked.
            return unsafe { wide(kernel) };
        }
    }
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx512cd")]
fn wide<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}
