//! What operators on grids are made of, kept for others that need the same.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::bem::half_space::Side;
use crate::bem::half_space::green::SurfaceGreen;
use crate::bem::half_space::green::admittance::Admittance;
use crate::bem::half_space::grid::grid_symbol::GridSymbol;
use crate::bem::half_space::grid::kernel_table::KernelTable;
use crate::cancel;
use crate::error::Result;
use crate::material::Stiffness;

/// Most bytes of all that is kept.
const MOST_BYTES: usize = 64 << 20;

/// Most Green's functions that are kept.
const MOST_GREENS: usize = 64;

/// Green's functions of half-spaces, and tables and transforms of kernels on grids, for all runs that are given the same. The kernel that was used, and the
/// Green's function that was made, longest ago goes first.
#[derive(Default)]
pub struct KernelCache {
    greens: Mutex<Vec<(Stiffness, Side, SurfaceGreen)>>,
    kept: Mutex<Vec<Arc<CacheSlot>>>,
}

struct CacheSlot {
    green: SurfaceGreen,
    cells: [usize; 2],
    spacing: [f64; 2],
    coupled: bool,
    /// Made by the first that needs it.
    kernel: OnceLock<GridKernel>,
}

/// The kernel of an operator on a grid.
#[derive(Clone)]
pub(super) struct GridKernel {
    pub symbol: Arc<GridSymbol>,
    pub admittance: Arc<Admittance>,
}

impl std::fmt::Debug for KernelCache {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Kernels").finish_non_exhaustive()
    }
}

impl GridKernel {
    /// Tabulates it.
    ///
    /// # Errors
    /// If a stop is wished.
    pub fn new(green: &SurfaceGreen, cells: [usize; 2], spacing: [f64; 2], coupled: bool) -> Result<Self> {
        let table = Arc::new(KernelTable::new(cells, spacing, green));
        cancel::check()?;
        let symbol = Arc::new(GridSymbol::new(cells, (table, 1), coupled));
        Ok(Self { symbol, admittance: Arc::new(Admittance::new(green)) })
    }

    /// Bytes of its table and transforms on so many cells.
    fn bytes(cells: [usize; 2]) -> usize {
        // As `fft::check` counts them.
        cells.iter().map(|n| 2 * n).product::<usize>().saturating_mul(8 * (5 + 5))
    }
}

impl KernelCache {
    /// The kernel on a grid of `cells` with sides `spacing`, kept or made.
    ///
    /// # Errors
    /// If a stop is wished: the table is not complete then.
    pub(super) fn kernel(
        &self,
        green: &SurfaceGreen,
        (cells, spacing): ([usize; 2], [f64; 2]),
        coupled: bool,
    ) -> Result<GridKernel> {
        if GridKernel::bytes(cells) > MOST_BYTES {
            return GridKernel::new(green, cells, spacing, coupled);
        }
        let slot = {
            let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            let is_it = |slot: &Arc<CacheSlot>| {
                (slot.cells, slot.spacing, slot.coupled) == (cells, spacing, coupled) && slot.green == *green
            };
            let slot = match kept.iter().position(is_it) {
                Some(found) => kept.remove(found),
                None => {
                    let (green, kernel) = (green.clone(), OnceLock::new());
                    Arc::new(CacheSlot { green, cells, spacing, coupled, kernel })
                }
            };
            kept.push(slot.clone());
            let mut bytes: usize = kept.iter().map(|slot| GridKernel::bytes(slot.cells)).sum();
            while bytes > MOST_BYTES {
                bytes -= GridKernel::bytes(kept.remove(0).cells);
            }
            slot
        };
        if let Some(kernel) = slot.kernel.get() {
            return Ok(kernel.clone());
        }
        // Not inside the lock: a thread that waits in it could be the one whose work it waits for. Runs that need the same at once make it twice.
        let kernel = GridKernel::new(green, cells, spacing, coupled)?;
        Ok(slot.kernel.get_or_init(|| kernel).clone())
    }

    /// The Green's function of a half-space, kept or made.
    ///
    /// # Errors
    /// As [`SurfaceGreen::new`].
    pub fn green(&self, stiffness: &Stiffness, side: Side) -> Result<SurfaceGreen> {
        let is_it = |(known, of, _): &&(Stiffness, Side, SurfaceGreen)| known == stiffness && *of == side;
        let lock = || self.greens.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, _, green)) = lock().iter().find(is_it) {
            return Ok(green.clone());
        }
        let green = SurfaceGreen::new(stiffness, side)?;
        let mut greens = lock();
        greens.push((stiffness.clone(), side, green.clone()));
        if greens.len() > MOST_GREENS {
            greens.remove(0);
        }
        Ok(green)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bem::half_space::{CrossBlocks, FftFlexibility};
    use crate::flexibility::Flexibility;

    fn green(e: f64) -> SurfaceGreen {
        let stiffness = Stiffness::isotropic(e, 0.3).expect("a stiffness");
        SurfaceGreen::new(&stiffness, Side::Lower).expect("a Green's function")
    }

    /// Truth: operators made alone: products are the same to the last bit, whichever came first; other grids and other bodies are others.
    #[test]
    fn shared_kernels_are_those_of_one_operator() {
        let kernels = KernelCache::default();
        let tractions: Vec<f64> = (0..3 * 48).map(|i| f64::from(i % 17) - 5.0).collect();
        let product = |operator: &FftFlexibility| {
            let mut gap = vec![0.0; tractions.len()];
            operator.apply(&tractions, &mut gap);
            gap
        };
        for (e, cells, h) in [
            (1e5, [8, 6], 0.1),
            (2e5, [8, 6], 0.1),
            (1e5, [6, 8], 0.1),
            (1e5, [8, 6], 0.2),
            (1e5, [8, 6], 0.1),
        ] {
            let green = green(e);
            let alone = FftFlexibility::new(cells, [h; 2], &green, CrossBlocks::Keep).expect("an operator");
            let shared =
                FftFlexibility::with_kernel_cache(cells, [h; 2], &green, CrossBlocks::Keep, Some(&kernels));
            assert_eq!(product(&shared.expect("an operator")), product(&alone), "{e} {cells:?} {h}");
        }
        assert_eq!(kernels.kept.lock().expect("no panic").len(), 4);
    }

    /// Truth: the limit: what was used longest ago goes.
    #[test]
    fn little_is_kept() {
        let (kernels, green) = (KernelCache::default(), green(1e5));
        for n in [256, 240, 224, 208] {
            kernels.kernel(&green, ([n, n], [0.1; 2]), false).expect("a kernel");
        }
        let kept = kernels.kept.lock().expect("no panic");
        let bytes: usize = kept.iter().map(|slot| GridKernel::bytes(slot.cells)).sum();
        assert!(bytes <= MOST_BYTES && kept.last().is_some_and(|slot| slot.cells == [208; 2]), "{bytes}");
        assert!(kept.iter().all(|slot| slot.cells != [256; 2]));
    }
}
