/// Component of the kernel: entry of the part that is even in the offset (symmetric matrix) or odd (antisymmetric matrix).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::bem::half_space) enum KernelComponent {
    /// Entry xx, yy, nn, xy, xn, yn of the symmetric part.
    Even(usize),
    /// Entry xy, xn, yn of the antisymmetric part.
    Odd(usize),
}

impl KernelComponent {
    pub fn index(self) -> usize {
        match self {
            Self::Even(k) => k,
            Self::Odd(k) => 6 + k,
        }
    }
}
