//! Macro that compiles a function twice, once for wider vector registers (AVX2), and chooses the version at run time.

/// Calls an `#[inline(always)]` function. If the processor supports AVX2, the version for AVX2 is called. The bits of
/// the results are the same for both versions.
///
/// The function may have one const generic parameter.
macro_rules! wide {
    ($body:ident$(<$n:ident>)?($($value:expr => $name:ident: $kind:ty),*)) => {{
        #[cfg(target_arch = "x86_64")]
        {
            #[target_feature(enable = "avx2")]
            fn wider$(<const $n: usize>)?($($name: $kind),*) {
                $body($($name),*);
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                // SAFETY: the processor supports AVX2.
                return unsafe { wider($($value),*) };
            }
        }
        $body($($value),*);
    }};
}
pub(crate) use wide;
