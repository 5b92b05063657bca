//! The widest registers of the processor, chosen when the program runs.
//!
//! The whole program is compiled for AVX2 and FMA. The kernels that take most of a step are compiled once
//! more for AVX-512: a [`Vector`] is then one register instead of two, and there are 32 of them, which
//! batches need. Each operation is rounded as before, so results do not depend on the choice.
use super::Vector;
use super::lanes::Lanes;
#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
use super::registers::avx512::Wide;

/// Work that is worth being compiled for several instruction sets.
pub trait Kernel {
    /// The result.
    type Output;

    /// Does the work. To be marked `inline(always)`, and so is all that it calls with vectors: separate
    /// functions, such as mappings of arrays and closures that are called twice may become, are compiled
    /// without AVX-512, and then make a call for each operation.
    fn run<V: Vector>(self) -> Self::Output;
}

/// Runs a kernel with the widest registers that the processor has.
#[inline(always)]
pub fn widest<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
    {
        /// Whether the processor has all that [`wide`] is compiled for.
        static HAS_AVX512: std::sync::LazyLock<bool> = std::sync::LazyLock::new(|| {
            is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512cd")
        });
        if *HAS_AVX512 {
            // SAFETY: the processor has the features, as was just tested.
            return unsafe { wide(kernel) };
        }
    }
    kernel.run::<Lanes>()
}

#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx512cd")]
fn wide<K: Kernel>(kernel: K) -> K::Output {
    // A variable of this alignment makes the compiler align its own data on the stack. Registers of 512 bits
    // would otherwise lie across two lines of the cache (a fourteenth of the time of G2P in 2D).
    let mut line = CacheLine(0);
    std::hint::black_box(&mut line);
    kernel.run::<Wide>()
}

/// A byte, aligned with a line of the cache.
#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
#[repr(align(64))]
struct CacheLine(#[expect(dead_code)] u8);
