//! Prescribed displacements of a body, split into a rigid motion and a deformation.

use nalgebra::{DMatrix, SVector, Vector3};

use super::loads::AppliedLoads;
use super::model::FeModel;
use crate::geometry::Point;
use crate::linalg::pseudo_inverse::pseudo_inverse;

/// Relative singular value below which a component of the rigid-motion fit is dropped.
const SINGULAR_VALUE_TOLERANCE: f64 = 1e-9;

/// Prescribed displacements of a body, split into a rigid motion and a deformation.
pub(crate) struct PrescribedMotion {
    origin: Point,
    translation: Point,
    rotation: Point,
    /// Remaining displacement of each prescribed dof, mm.
    pub deformation: Vec<f64>,
}

impl PrescribedMotion {
    /// Fits a rigid motion to the displacements that `loads` prescribe at the dofs `prescribed`, and subtracts this
    /// motion. With elastic foundations nothing is subtracted, because they resist rigid motions.
    pub fn new(model: &FeModel, loads: &AppliedLoads, prescribed: &[usize]) -> Self {
        let mesh = model.mesh();
        let value = |&dof: &usize| loads.prescribed_displacement(dof);
        let mut supports = Self {
            origin: Point::zeros(),
            translation: Point::zeros(),
            rotation: Point::zeros(),
            deformation: prescribed.iter().map(value).collect(),
        };
        let moved = supports.deformation.iter().any(|u| *u != 0.0);
        if !moved || model.faces_on_foundations().next().is_some() {
            return supports;
        }
        let at = |dof: usize| Point::from(mesh.points[dof / 3]);
        supports.origin = prescribed.iter().map(|&dof| at(dof)).sum::<Point>() / prescribed.len() as f64;
        let size = prescribed.iter().map(|&dof| (at(dof) - supports.origin).norm()).fold(0.0, f64::max);
        let size = if size > 0.0 { size } else { 1.0 };
        let (mut matrix, mut rhs) = (DMatrix::zeros(6, 6), SVector::<f64, 6>::zeros());
        for (&dof, u) in prescribed.iter().zip(&supports.deformation) {
            let arm = (at(dof) - supports.origin) / size;
            let along = Vector3::ith(dof % 3, 1.0);
            // (ω x r)·e = ω·(r x e)
            let turn = arm.cross(&along);
            let row = SVector::<f64, 6>::from_fn(|k, _| if k < 3 { along[k] } else { turn[k - 3] });
            matrix += row * row.transpose();
            rhs += row * *u;
        }
        let Ok(inverse) = pseudo_inverse(&matrix, SINGULAR_VALUE_TOLERANCE) else { return supports };
        let motion = inverse * rhs;
        supports.translation = Point::new(motion[0], motion[1], motion[2]);
        supports.rotation = Point::new(motion[3], motion[4], motion[5]) / size;
        let rigid: Vec<f64> = prescribed.iter().map(|&dof| supports.rigid(&at(dof))[dof % 3]).collect();
        supports.deformation.iter_mut().zip(rigid).for_each(|(u, rigid)| *u -= rigid);
        supports
    }

    /// Displacement of the rigid motion at `x`, mm.
    pub fn rigid(&self, x: &Point) -> Point {
        self.translation + self.rotation.cross(&(x - self.origin))
    }
}
