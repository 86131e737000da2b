//! Checks that supports leave the contact nodes free along the normal.

use std::collections::HashMap;

use crate::error::Error;
use crate::frame::{ContactFrame, FaceMap};
use crate::geometry::Point;
use crate::scene::plan::{MeshedBodyPlan, Plan};
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::plan_bodies::BODY_KEYS;

/// A node counts as fixed along the normal if the fixed components of the unit normal have at least this length
/// together.
const FIXED_NORMAL_SHARE: f64 = 0.999;

pub(super) fn refuse_fixed_contact_nodes(
    plan: &Plan,
    fe: &MeshedBodyPlan,
    index: usize,
    map: &FaceMap,
    frame: &ContactFrame,
) -> Result<(), SceneError> {
    let local: HashMap<usize, usize> = map.nodes().iter().enumerate().map(|(i, &node)| (node, i)).collect();
    for support in &fe.supports {
        let held = |node: &usize| {
            let normal: Point = map.column(local[node]).map(|(cell, _)| frame.triads[cell].normal()).sum();
            let part = Point::from_fn(|c, _| if support.values[c].is_some() { normal[c] } else { 0.0 });
            part.norm() >= FIXED_NORMAL_SHARE * normal.norm()
        };
        let nodes = fe.mesh.group_nodes(&support.group).at(BODY_KEYS[index])?;
        let count = nodes.iter().filter(|node| local.contains_key(node) && held(node)).count();
        if count > 0 {
            let level = frame.has_uniform_axes();
            let along = if level { "z" } else { "the normal of the surface" };
            let all = map.nodes().len();
            let smaller = if count < all && frame.grid.is_some() { ", or use a smaller frame" } else { "" };
            let nodes = if count == all { format!("all {all}") } else { format!("{count} of the {all}") };
            let components = plan.document.get(&format!("{}.components", support.key)).is_some();
            let normal_is_z = level && frame.axes.normal().z.abs() > FIXED_NORMAL_SHARE;
            let free = match (components, normal_is_z && support.key.contains(".fixed.")) {
                (true, _) => ", or remove this direction from `components`",
                (false, true) => ", or add components = [\"x\", \"y\"]",
                (false, false) => "",
            };
            let error = Error::input(format!(
                "the support on group `{}` fixes {nodes} contact nodes under the frame along {along}, where they must be free: support another group{smaller}{free}",
                support.group,
            ));
            return Err(SceneError { error, key: support.key.clone() });
        }
    }
    Ok(())
}
