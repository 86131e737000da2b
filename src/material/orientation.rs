use std::sync::Arc;

use nalgebra::Matrix3;

use super::element_axes::ElementAxes;
use super::winding::Winding;
use crate::error::Result;
use crate::geometry::Point;

/// Material axes of the elements of a region, as columns of a rotation in global axes (1 = fibre, 3 = 1 x 2).
#[derive(Debug, Clone)]
pub enum Orientation {
    /// Uniform in all elements.
    Uniform(Matrix3<f64>),
    /// Given per element number.
    PerElement(Arc<ElementAxes>),
    /// Wound around an axis.
    Winding(Winding),
}

impl Orientation {
    /// Material axes of an element, by its number in the mesh file or its corners (mm).
    ///
    /// # Errors
    /// If the axes of the element are not defined.
    pub fn axes(&self, element: u64, corners: &[Point]) -> Result<Matrix3<f64>> {
        match self {
            Self::Uniform(axes) => Ok(*axes),
            Self::PerElement(elements) => elements.axes(element),
            Self::Winding(winding) => winding.axes(corners),
        }
    }
}
