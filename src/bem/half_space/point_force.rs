//! Field of a point force on the surface of a half-space, fast enough for millions of points.

use nalgebra::Vector3;

use super::boussinesq::Boussinesq;
use super::green::SurfaceGreen;
use super::interior::InteriorField;
use super::point_field::PointField;
use super::point_force_table::PointForceTable;
use super::surface_field::SurfaceField;
use crate::error::Result;
use crate::geometry::Side;
use crate::material::Stiffness;

/// Points nearer to the surface, over their distance from the force, count as on it.
const ON_SURFACE: f64 = 1e-9;

/// Field of a unit force at the origin of the surface of the half-space z <= 0, whose outward normal is +z.
///
/// Isotropic materials have closed forms; others a table, made of integrals over directions, and on the surface the series of
/// its Green's function.
#[derive(Debug, Clone)]
pub struct PointForceField(Form);

#[derive(Debug, Clone)]
enum Form {
    Closed(Boussinesq),
    Tabulated { table: PointForceTable, surface: SurfaceField },
}

impl PointForceField {
    /// The field in a material, in the axes of the surface.
    ///
    /// # Errors
    /// As [`SurfaceGreen::new`].
    pub fn new(stiffness: &Stiffness) -> Result<Self> {
        if let Some(closed) = Boussinesq::of(stiffness) {
            return Ok(Self(Form::Closed(closed)));
        }
        let green = SurfaceGreen::new(stiffness, Side::Lower)?;
        let surface = SurfaceField::new(stiffness, &green);
        let table = PointForceTable::new(&InteriorField::new(stiffness, &green), &surface);
        Ok(Self(Form::Tabulated { table, surface }))
    }

    /// The field at `x` (mm) with z <= 0, not the origin. A point within 1e-9 of its distance from the surface, below or above, counts as on it:
    /// its derivatives are those from within the body.
    #[inline]
    pub fn at(&self, x: &Vector3<f64>) -> PointField {
        let on_surface = x.z >= -ON_SURFACE * x.norm();
        debug_assert!(!on_surface || x.z <= ON_SURFACE * x.norm(), "{x} lies above the surface");
        match &self.0 {
            Form::Closed(closed) if on_surface => closed.at(&Vector3::new(x.x, x.y, 0.0)),
            Form::Closed(closed) => closed.at(x),
            Form::Tabulated { surface, .. } if on_surface => surface.at(x.x, x.y),
            Form::Tabulated { table, .. } => table.at(x),
        }
    }

    /// Largest difference of the gradient from the direct integral that was found when the table was made, over its largest
    /// entry at that distance; 0 for closed forms.
    pub fn error(&self) -> f64 {
        match &self.0 {
            Form::Closed(_) => 0.0,
            Form::Tabulated { table, .. } => table.error(),
        }
    }
}
