use std::collections::HashSet;

use crate::error::Warning;
use crate::fem::ElementMaterials;
use crate::geometry::Point;
use crate::mesh::CellRef;
use crate::mesh::faces::SurfaceFace;
use crate::scene::plan::{MeshedBodyPlan, Plan};
use crate::simulation::plan_bodies::BODY_KEYS;

/// Note if the friction or wear law uses the fibre direction of the body, but anisotropic elements under the frame have
/// another fibre direction.
pub(super) fn region_fibre_warning(
    plan: &Plan,
    fe: &MeshedBodyPlan,
    index: usize,
    faces: &[&SurfaceFace],
) -> Option<Warning> {
    fe.material.fibre?;
    let named = ["friction", "wear"].into_iter().zip(plan.fibre_bodies);
    let laws: Vec<&str> = named.filter(|(_, body)| *body == Some(index)).map(|(law, _)| law).collect();
    if laws.is_empty() {
        return None;
    }
    let regions = ElementMaterials::new(&fe.fem_spec(BODY_KEYS[index])).ok()?;
    let fibre: Point = fe.material.material_axes(0.0).column(0).into();
    let turned = |group: &str| {
        let cells = fe.mesh.group_of_dim(group, 3).map(|group| group.cells.as_slice()).unwrap_or_default();
        let cells: HashSet<CellRef> = cells.iter().copied().collect();
        faces.iter().filter(|face| cells.contains(&face.owner)).any(|face| {
            let element = regions.element(face.owner);
            element.is_some_and(|i| {
                let turned = regions.axes(i).column(0).cross(&fibre).norm() > 1e-9;
                turned && regions.material(i).stiffness.isotropic_constants().is_none()
            })
        })
    };
    let group = fe.regions.iter().filter_map(|(group, _)| group.as_deref()).find(|group| turned(group))?;
    Some(Warning::note(format!(
        "region `{group}` of {} lies under the frame and has another fibre direction than the body; the laws of {} use the fibre of the body",
        BODY_KEYS[index],
        laws.join(" and ")
    )))
}
