//! Mean material of a meshed body at its contact surface or in the whole body, with the deviation of fibres from the
//! mean.

use nalgebra::{Matrix3, SymmetricEigen};

use super::plan::{BodyMaterial, FibreAngles, FramePlan, MeshedBodyPlan};
use crate::error::{Error, Result};
use crate::fem::ElementMaterials;
use crate::geometry::{Point, fibre_axes};
use crate::mesh::faces::{SurfaceFace, group_faces};

/// Mean material of a part of a body.
#[derive(Debug, Clone)]
pub struct MeanMaterial {
    /// Material of the first averaged element. Its fibre direction is the mean direction if the body has fibres.
    pub material: BodyMaterial,
    /// Largest angle between a fibre and the mean direction, radians.
    pub fibre_spread: f64,
    /// Largest angle between a material axis of an element and the same axis of the mean material, radians; 0 for
    /// isotropic material.
    pub axes_spread: f64,
    /// Names of all materials in this part of the body, without duplicates.
    pub materials: Vec<String>,
}

/// Mean material of `fe` at the faces of its contact group under the frame. On a mesh frame, or if no face lies under
/// the frame, all faces of the group count.
///
/// A fibre axis a (unit vector) has no sign: a and -a are the same fibre. The mean axis is the first principal axis of
/// ∑ A a aᵀ over the faces with areas A.
///
/// # Errors
/// If the contact group is not a group of outer surfaces, a volume group is missing, or a contact face belongs to no solid element.
/// If an element has several materials, none, or no axes.
pub fn mean_material_under_frame(fe: &MeshedBodyPlan, frame: &FramePlan) -> Result<MeanMaterial> {
    let mesh = &fe.mesh;
    let regions = ElementMaterials::new(&fe.fem_spec("body"))?;
    let faces = group_faces(mesh, &fe.contact)?;
    let centre = |face: &SurfaceFace| {
        let corners = &face.nodes[..face.kind.n_corners()];
        corners.iter().map(|&node| Point::from(mesh.points[node])).sum::<Point>() / corners.len() as f64
    };
    let under: Vec<&SurfaceFace> = faces.iter().filter(|face| lies_under(frame, &centre(face))).collect();
    let under = if under.is_empty() { faces.iter().collect() } else { under };
    let element = |face: &&SurfaceFace| {
        let element = regions.element(face.owner);
        element
            .map(|element| (element, face.area(mesh)))
            .ok_or_else(|| Error::input("a contact face does not belong to a solid element"))
    };
    let elements: Vec<(usize, f64)> = under.iter().map(element).collect::<Result<_>>()?;
    Ok(weighted_mean_material(fe, &regions, &elements))
}

/// Mean material of the whole body `fe`. All elements have equal weights.
///
/// # Errors
/// If the mesh has no solid elements, or a volume group is missing. If an element has several materials, none, or no axes.
pub fn mean_material_of_body(fe: &MeshedBodyPlan) -> Result<MeanMaterial> {
    let regions = ElementMaterials::new(&fe.fem_spec("body"))?;
    let elements: Vec<(usize, f64)> = (0..regions.n_elements()).map(|element| (element, 1.0)).collect();
    Ok(weighted_mean_material(fe, &regions, &elements))
}

fn weighted_mean_material(
    fe: &MeshedBodyPlan,
    regions: &ElementMaterials,
    elements: &[(usize, f64)],
) -> MeanMaterial {
    let fibres: Vec<(Point, f64)> =
        elements.iter().map(|&(element, weight)| (regions.axes(element).column(0).into(), weight)).collect();
    let mean = mean_axis(&fibres);
    let fibre_spread = fibres.iter().map(|(fibre, _)| angle_between_axes(fibre, &mean)).fold(0.0, f64::max);
    let fibre = FibreAngles { tilt: mean.z.clamp(-1.0, 1.0).asin(), azimuth: mean.y.atan2(mean.x) };
    let axes = fibre_axes(fibre.tilt, fibre.azimuth);
    let first = regions.material(elements[0].0);
    let mut materials: Vec<String> = Vec::new();
    let mut axes_spread = 0.0_f64;
    for &(element, _) in elements {
        let own = regions.axes(element);
        let turned = (0..3).map(|k| angle_between_axes(&own.column(k).into(), &axes.column(k).into()));
        axes_spread = turned.fold(axes_spread, f64::max);
        let name = &regions.material(element).name;
        if !materials.contains(name) {
            materials.push(name.clone());
        }
    }
    let isotropic = first.name == fe.material.name && fe.material.isotropic;
    let material = BodyMaterial {
        name: first.name.clone(),
        stiffness: first.stiffness.clone(),
        expansion: first.expansion,
        isotropic,
        fibre: fe.has_fibre.then_some(fibre),
    };
    let axes_spread = if isotropic { 0.0 } else { axes_spread };
    MeanMaterial { material, fibre_spread, axes_spread, materials }
}

fn lies_under(frame: &FramePlan, point: &Point) -> bool {
    match frame {
        FramePlan::Mesh { .. } => true,
        FramePlan::Grid { half_width, center, azimuth, .. } => {
            let (x, y) = (point.x - center[0], point.y - center[1]);
            let (s, c) = azimuth.sin_cos();
            (c * x + s * y).abs() <= half_width[0] && (c * y - s * x).abs() <= half_width[1]
        }
    }
}

/// Mean direction of weighted axes, whose signs have no meaning. The mean is at most 90 degrees from the first axis.
fn mean_axis(lines: &[(Point, f64)]) -> Point {
    let first = lines[0].0;
    if lines.iter().all(|(line, _)| *line == first) {
        return first;
    }
    let sum: Matrix3<f64> = lines.iter().map(|(line, weight)| line * line.transpose() * *weight).sum();
    let eigen = SymmetricEigen::new(sum);
    let mean: Point = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into();
    if mean.dot(&first) < 0.0 { -mean } else { mean }
}

/// Angle between two axes whose signs have no meaning, radians: 0 to π/2.
fn angle_between_axes(a: &Point, b: &Point) -> f64 {
    a.cross(b).norm().atan2(a.dot(b).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the sign of an axis has no meaning. The mean of two axes with equal weights bisects their angle.
    #[test]
    fn the_mean_of_lines_is_between_them() {
        let at = |degrees: f64| Point::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0);
        let mean = mean_axis(&[(at(10.0), 1.0), (-at(30.0), 1.0)]);
        assert!(angle_between_axes(&mean, &at(20.0)) < 1e-12, "{mean}");
        assert!((angle_between_axes(&at(10.0), &-at(30.0)) - 20.0_f64.to_radians()).abs() < 1e-12);
    }
}
