use nalgebra::Matrix3;

use super::Stiffness;
use super::orientation::Orientation;
use crate::geometry::Point;

/// Material with the orientation of its axes.
#[derive(Debug, Clone)]
pub struct PlacedMaterial {
    /// Name for messages and tables; may be empty.
    pub name: String,
    /// Stiffness in material axes.
    pub stiffness: Stiffness,
    /// Coefficients of thermal expansion along the material axes, 1/K; `None` if they are unknown.
    pub expansion: Option<[f64; 3]>,
    /// Orientation of the material axes.
    pub orientation: Orientation,
}

/// Ply of a laminate.
#[derive(Debug, Clone)]
pub struct Ply {
    /// Heights of the lower and the upper face, mm.
    pub z_range: [f64; 2],
    /// Material of the ply.
    pub material: PlacedMaterial,
}

/// Material of a region of a body.
#[derive(Debug, Clone)]
pub enum RegionMaterial {
    /// One material.
    Single(Box<PlacedMaterial>),
    /// Plies stacked along z, from the lowest to the highest. An element belongs to the ply that contains its centroid.
    Layup(Vec<Ply>),
}

impl RegionMaterial {
    /// Materials of the region, `[1]` or `[n_plies]`.
    pub fn materials(&self) -> Vec<&PlacedMaterial> {
        match self {
            Self::Single(placed) => vec![placed],
            Self::Layup(plies) => plies.iter().map(|ply| &ply.material).collect(),
        }
    }

    /// Index into [`Self::materials`] of the material at a point; `None` outside all plies.
    pub fn material_at(&self, point: &Point) -> Option<usize> {
        match self {
            Self::Single(_) => Some(0),
            Self::Layup(plies) => {
                plies.iter().position(|ply| ply.z_range[0] <= point.z && point.z <= ply.z_range[1])
            }
        }
    }
}

/// Fraction of an element's thickness outside its ply that still counts as rounding.
const STRADDLE_TOLERANCE: f64 = 1e-6;

impl RegionMaterial {
    /// Ranges of the plies in z, or of the wound layers in radius. The returned function gives the z or the radius of a
    /// point. `None` for a single material with fewer than two wound layers.
    #[allow(clippy::type_complexity)]
    fn stacking_coordinate(&self) -> Option<(Vec<[f64; 2]>, Box<dyn Fn(&Point) -> f64 + '_>)> {
        match self {
            Self::Layup(plies) => Some((plies.iter().map(|ply| ply.z_range).collect(), Box::new(|x| x.z))),
            Self::Single(placed) => match &placed.orientation {
                Orientation::Winding(winding) if winding.layers().len() > 1 => {
                    let layers = winding.layers().iter().map(|layer| layer.radii).collect();
                    Some((layers, Box::new(|x| winding.radius(x))))
                }
                _ => None,
            },
        }
    }

    /// Whether the region has plies or several wound layers.
    pub fn is_stacked(&self) -> bool {
        self.stacking_coordinate().is_some()
    }

    /// Error messages about empty plies and wound layers. A ply is empty if it contains no element centroid. A wound
    /// layer is empty if it contains no mean corner radius of an element. `elements` holds the corners of each element.
    pub fn empty_ply_errors(&self, elements: &[Vec<Point>]) -> Vec<String> {
        let Some((plies, along)) = self.stacking_coordinate() else { return Vec::new() };
        let mut held = vec![false; plies.len()];
        for corners in elements {
            let middle = corners.iter().map(&along).sum::<f64>() / corners.len() as f64;
            plies
                .iter()
                .position(|p| p[0] <= middle && middle <= p[1])
                .into_iter()
                .for_each(|i| held[i] = true);
        }
        let empty = plies.iter().zip(held).enumerate().filter(|(_, (_, held))| !held);
        empty
            .map(|(i, ([low, high], _))| {
                format!(
                    "ply {} of {}, from {low:.6} to {high:.6}, contains no element centroid; mesh at least one layer of elements per ply",
                    i + 1,
                    plies.len()
                )
            })
            .collect()
    }

    /// Warning about the elements that extend beyond their own ply or wound layer. `elements` holds the corners of each element.
    pub fn straddling_warning(&self, elements: &[Vec<Point>]) -> Option<String> {
        let (plies, along) = self.stacking_coordinate()?;
        let (mut n, mut worst) = (0, 0.0_f64);
        for corners in elements {
            let heights: Vec<f64> = corners.iter().map(&along).collect();
            let middle = heights.iter().sum::<f64>() / heights.len() as f64;
            let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
            let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let Some(ply) = plies.iter().find(|ply| ply[0] <= middle && middle <= ply[1]) else { continue };
            let beyond = ((ply[0] - low).max(0.0) + (high - ply[1]).max(0.0)) / (high - low);
            if beyond > STRADDLE_TOLERANCE {
                n += 1;
                worst = worst.max(beyond);
            }
        }
        (n > 0).then(|| {
            format!(
                "{n} of {} elements extend beyond the ply that contains their centroid, by up to {:.1} % of the element thickness. These elements have the material of that ply only; let element faces coincide with the borders of the plies",
                elements.len(),
                100.0 * worst
            )
        })
    }
}

/// Material with a stiffness in global axes.
impl From<Stiffness> for RegionMaterial {
    fn from(stiffness: Stiffness) -> Self {
        let orientation = Orientation::Uniform(Matrix3::identity());
        Self::Single(Box::new(PlacedMaterial {
            name: String::new(),
            stiffness,
            expansion: None,
            orientation,
        }))
    }
}
