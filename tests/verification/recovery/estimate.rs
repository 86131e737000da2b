//! Compares the error estimate of finite elements with exact errors.

use orthowear::element::ElementKind::{Hex8, Hex20, Hex27, Pyramid5, Tet4, Wedge6};
use orthowear::fem::{HexFormulation, StressRecovery};

use super::manufactured::{ENERGY, body};
use crate::fem_meshes::wavy;

/// Truth: Galerkin orthogonality gives the exact error of conforming elements. The squared error in the energy norm is the
/// difference of the squared norms of exact and computed solution. The effectivity index, the ratio of estimated to exact error,
/// tends to 1 (Zienkiewicz and Zhu 1992). On the finer mesh the index differs from 1 by less than 0.2. This difference is also
/// below 0.05, or below 0.6 times the difference on the coarser mesh.
#[test]
fn effectivity_tends_to_one() {
    let maps: [fn([f64; 3]) -> [f64; 3]; 2] = [|x| x, wavy];
    for (kind, meshes, maps) in [
        (Hex8, [8, 16], &maps[..]),
        (Tet4, [6, 12], &maps),
        (Wedge6, [6, 12], &maps[..1]),
        (Pyramid5, [5, 10], &maps[..1]),
        (Hex20, [3, 6], &maps[..1]),
        (Hex27, [3, 6], &maps[..1]),
    ] {
        for (index, map) in maps.iter().copied().enumerate() {
            let effectivity = meshes.map(|n| {
                let body = body(kind, HexFormulation::Standard, n, map);
                let (model, u) = (body.model(), body.contact_free_displacement());
                let recovery = StressRecovery::new(model).unwrap();
                let stress = recovery.stress(model, u).unwrap();
                let estimate = recovery.estimate_error(model, u, &stress).unwrap();
                let energy = model.strain_energy(u).unwrap();
                assert!((estimate.stress_norm.powi(2) / (2.0 * energy) - 1.0).abs() < 1e-12);
                assert!((estimate.cell_volumes.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                estimate.error_norm() / (2.0 * (ENERGY - energy)).sqrt()
            });
            let what = format!("{} map {index}: effectivity {effectivity:.4?}", kind.name());
            println!("{what}");
            let [coarse, fine] = effectivity.map(|e| (e - 1.0).abs());
            assert!(fine < 0.2 && (fine < 0.6 * coarse || fine < 0.05), "{what}");
        }
    }
}
