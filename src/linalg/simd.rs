//! Wider registers where the processor has them.

/// Calls a function that is always inlined, with wider registers where the processor has them; the bits are the same. A length may be
/// a generic parameter of the function.
macro_rules! wide {
    ($body:ident$(<$n:ident>)?($($value:expr => $name:ident: $kind:ty),*)) => {{
        #[cfg(target_arch = "x86_64")]
        {
            #[target_feature(enable = "avx2")]
            fn wider$(<const $n: usize>)?($($name: $kind),*) {
                $body($($name),*);
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has the instructions.
                return unsafe { wider($($value),*) };
            }
        }
        $body($($value),*);
    }};
}
pub(crate) use wide;
