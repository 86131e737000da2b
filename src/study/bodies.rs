//! Bodies and frame of a plan.

use super::failure::{AtKey, Failure};
use crate::body::{ElasticBody, FeBody, HalfSpaceBody, RigidBody};
use crate::error::Error;
use crate::fem::{self, HexFormulation};
use crate::frame::{ContactFrame, Side};
use crate::scene::keys::body::Element;
use crate::scene::plan::{BodySpec, FeSpec, FrameSpec, Plan};

/// Keys of the two bodies in the scene.
pub(super) const KEYS: [&str; 2] = ["body1", "body2"];

/// The two sides of the frame.
pub(super) const SIDES: [Side; 2] = [Side::Lower, Side::Upper];

/// The contact frame of a plan.
pub(super) fn frame(plan: &Plan) -> Result<ContactFrame, Failure> {
    match plan.frame {
        FrameSpec::Grid { half_width, cells, center, azimuth } => {
            ContactFrame::grid(half_width, cells, center, azimuth).at("frame")
        }
        FrameSpec::Mesh { body, center, azimuth } => {
            let fe = plan.bodies[body].fe().ok_or_else(|| Failure {
                error: Error::input("the frame takes the faces of a body that has no mesh"),
                key: "frame.body",
            })?;
            ContactFrame::from_faces(&fe.mesh, &fe.contact, SIDES[body], center, azimuth).at(KEYS[body])
        }
    }
}

/// Body `index` (0 or 1) of a plan, ready to give its flexibility on the frame.
pub(super) fn body(plan: &Plan, index: usize, frame: &ContactFrame) -> Result<Box<dyn ElasticBody>, Failure> {
    let key = KEYS[index];
    Ok(match &plan.bodies[index] {
        BodySpec::Rigid => Box::new(RigidBody),
        BodySpec::HalfSpace(elastic) => {
            Box::new(HalfSpaceBody::new(&elastic.in_axes(0.0), SIDES[index], frame).at(key)?)
        }
        BodySpec::Fe(fe) => {
            Box::new(FeBody::new(fe_inputs(fe, key), &fe.contact, SIDES[index], frame).at(key)?)
        }
    })
}

/// What the finite-element module takes.
pub(super) fn fe_inputs(fe: &FeSpec, name: &str) -> fem::FeSpec {
    let mut regions = vec![(None, fe.elastic.in_axes(0.0))];
    regions.extend(fe.regions.iter().map(|(group, elastic)| (Some(group.clone()), elastic.in_axes(0.0))));
    let supports = fe.supports.iter().map(|support| fem::Support {
        group: support.group.clone(),
        components: support.values.map(|value| value.is_some()),
        value: support.values.map(|value| value.unwrap_or(0.0)),
    });
    fem::FeSpec {
        name: name.to_owned(),
        mesh: fe.mesh.clone(),
        regions,
        formulation: match fe.element {
            Some(Element::Hex8) => HexFormulation::Standard,
            _ => HexFormulation::Enhanced,
        },
        supports: supports.collect(),
        pressures: fe.pressures.clone(),
        tractions: fe.tractions.clone(),
        body_force: fe.body_force,
    }
}
