//! Field of a point force on the surface of a half-space, at other points of this surface.

use nalgebra::Matrix3;

use crate::bem::green_tensor::GreenTensor;
use crate::bem::half_space::green::SurfaceGreen;
use crate::bem::half_space::green::angular_table::AngularTable;
use crate::material::Stiffness;

/// Surface Green's function Γ(φ) / r and its derivatives. The normal derivative follows from the condition that the
/// surface is free of traction.
#[derive(Debug, Clone)]
pub(super) struct SurfacePointForce {
    /// Γ and its derivative Γ' with respect to φ, row by row.
    table: AngularTable,
    /// Matrices −T⁻¹ C(e3, e_a) for a = x, y, with T = C(e3, e3) and C(u, v)_ik = C_ijkl u_j v_l. They map the
    /// derivatives along x and y to the derivative along z.
    normal: [Matrix3<f64>; 2],
}

impl SurfacePointForce {
    pub(super) fn new(stiffness: &Stiffness, green: &SurfaceGreen) -> Self {
        let contract = |l: usize| Matrix3::from_fn(|i, k| stiffness.component(i, 2, k, l));
        let factor = contract(2).cholesky().expect("C(e3, e3) is positive definite with the stiffness");
        Self {
            table: AngularTable::from_green_with_derivative(green),
            normal: [0, 1].map(|a| -factor.solve(&contract(a))),
        }
    }

    pub(in crate::bem::half_space) fn at(&self, x: f64, y: f64) -> GreenTensor {
        let mut functions = [0.0; 18];
        self.table.add(x, y, 1.0, &mut functions);
        let gamma = Matrix3::from_row_slice(&functions[..9]);
        let slope = Matrix3::from_row_slice(&functions[9..]);
        let r = x.hypot(y);
        let (cos, sin) = (x / r, y / r);
        let along = -gamma * cos - slope * sin;
        let across = slope * cos - gamma * sin;
        let normal = self.normal[0] * along + self.normal[1] * across;
        GreenTensor { value: gamma, gradient: [along, across, normal] }.at_distance(r)
    }
}
