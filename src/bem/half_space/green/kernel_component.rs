/// One of the nine components of a kernel matrix. The symmetric part of the matrix is an even function of the offset
/// from source to target. The antisymmetric part is an odd function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::bem::half_space) enum KernelComponent {
    /// Index of an entry of the symmetric part in the order xx, yy, nn, xy, xn, yn.
    Even(usize),
    /// Index of an entry of the antisymmetric part in the order xy, xn, yn.
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
