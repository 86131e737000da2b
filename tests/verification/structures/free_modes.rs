//! Eigenvalues of the stiffness of unconstrained bodies.

use nalgebra::{DMatrix, SymmetricEigen};
use orthowear::element::ElementKind;
use orthowear::fem::{FeModel, HexFormulation};
use orthowear::mesh::Mesh;

use crate::fem_bodies::{ELEMENTS, clamp, rotated_orthotropic, spec};
use crate::fem_meshes::{block, rough};

fn free_stiffness(mesh: Mesh, formulation: HexFormulation) -> DMatrix<f64> {
    let n = mesh.n_points();
    let model = FeModel::new(spec(mesh, rotated_orthotropic(), formulation, vec![clamp("x0")])).unwrap();
    let mut k = DMatrix::zeros(3 * n, 3 * n);
    for column in 0..3 * n {
        let mut u = vec![[0.0; 3]; n];
        u[column / 3][column % 3] = 1.0;
        let forces = model.internal_forces(&u).unwrap();
        for (row, force) in forces.iter().flatten().enumerate() {
            k[(row, column)] = *force;
        }
    }
    k
}

fn assert_six_free_modes(name: &str, k: DMatrix<f64>) {
    let asymmetry = (&k - k.transpose()).amax() / k.amax();
    assert!(asymmetry < 1e-14, "{name}: asymmetry {asymmetry:e}");
    let mut values: Vec<f64> = SymmetricEigen::new(k).eigenvalues.iter().copied().collect();
    values.sort_by(f64::total_cmp);
    let (free, stiff) = values.split_at(6);
    assert!(stiff[0] > 0.0, "{name}: {:e}", stiff[0]);
    assert!(free.iter().all(|l| l.abs() < 1e-9 * stiff[0]), "{name}: {free:?} {:e}", stiff[0]);
}

/// Truth: an unconstrained body has six rigid-body modes and no other mode without energy. This also holds for a single cell,
/// where hourglass modes could appear. The stiffness is symmetric to 1e-14. Its zero eigenvalues are below 1e-9 of the smallest
/// other one.
#[test]
fn free_bodies_have_six_modes_without_energy() {
    for (kind, formulation) in ELEMENTS {
        let name = format!("{} {}", kind.name(), formulation.name());
        assert_six_free_modes(&name, free_stiffness(block(kind, [1, 1, 1], [1.0; 3], rough), formulation));
        let cells = if kind == ElementKind::Hex27 { [2, 1, 1] } else { [2, 2, 1] };
        assert_six_free_modes(&name, free_stiffness(block(kind, cells, [1.0; 3], rough), formulation));
    }
}
