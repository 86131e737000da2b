//! A material in its place: the stiffness and the axes of the elements of a region.

use nalgebra::Matrix3;

use super::Stiffness;
use super::orientation::Orientation;
use crate::geometry::Point;

/// A material with the direction of its axes.
#[derive(Debug, Clone)]
pub struct Placed {
    /// Its name, for messages and tables; empty if it has none.
    pub name: String,
    /// Stiffness in material axes.
    pub stiffness: Stiffness,
    /// Where the material axes point.
    pub orientation: Orientation,
}

/// A ply of a laminate.
#[derive(Debug, Clone)]
pub struct Ply {
    /// Heights of its lower and upper face, mm.
    pub z: [f64; 2],
    /// What it is made of.
    pub placed: Placed,
}

/// What fills a region of a body.
#[derive(Debug, Clone)]
pub enum Placement {
    /// One material.
    Single(Box<Placed>),
    /// Plies stacked along z, from the lowest to the highest: an element belongs to the ply of its centroid.
    Layup(Vec<Ply>),
}

impl Placement {
    /// The materials in it, `[1]` or `[n_plies]`.
    pub fn materials(&self) -> Vec<&Placed> {
        match self {
            Self::Single(placed) => vec![placed],
            Self::Layup(plies) => plies.iter().map(|ply| &ply.placed).collect(),
        }
    }

    /// Index into [`Self::materials`] of what is at a point; `None` outside all plies.
    pub fn material_at(&self, point: &Point) -> Option<usize> {
        match self {
            Self::Single(_) => Some(0),
            Self::Layup(plies) => plies.iter().position(|ply| ply.z[0] <= point.z && point.z <= ply.z[1]),
        }
    }
}

/// A stiffness in global axes.
impl From<Stiffness> for Placement {
    fn from(stiffness: Stiffness) -> Self {
        let orientation = Orientation::Uniform(Matrix3::identity());
        Self::Single(Box::new(Placed { name: String::new(), stiffness, orientation }))
    }
}
