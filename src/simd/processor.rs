//! Whether this processor has the instructions that the whole program is compiled for.

/// Instructions that the program uses and this processor lacks, by name; none if it can run here.
///
/// Asks the processor itself: where the build has a feature, the standard library takes it to be there. Uses
/// none of these instructions, so it can be called first of all.
#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
#[inline(never)]
pub fn missing() -> &'static str {
    use std::arch::x86_64::{__cpuid, __cpuid_count};
    const OSXSAVE: u32 = 1 << 27;
    const AVX: u32 = 1 << 28;
    const FMA: u32 = 1 << 12;
    const AVX2: u32 = 1 << 5;
    const BMI: u32 = (1 << 3) | (1 << 8);
    let has = |register: u32, bits: u32| register & bits == bits;
    if __cpuid(0).eax < 7 || !has(__cpuid(1).ecx, OSXSAVE | AVX) {
        return "AVX";
    }
    let (first, seventh) = (__cpuid(1).ecx, __cpuid_count(7, 0).ebx);
    match (has(seventh, AVX2), has(first, FMA), has(seventh, BMI)) {
        (false, ..) => "AVX2",
        (_, false, _) => "FMA",
        (.., false) => "BMI2",
        _ => "",
    }
}

/// Instructions that the program uses and this processor lacks: none, since the build asks for none.
#[cfg(not(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma")))]
pub fn missing() -> &'static str {
    ""
}
