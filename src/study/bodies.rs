//! Bodies and frame of a plan.

use super::failure::{AtKey, Failure};
use crate::body::{ElasticBody, HalfSpaceBody, RigidBody};
use crate::error::Error;
use crate::frame::{ContactFrame, Side};
use crate::scene::plan::{BodySpec, FrameSpec, Plan};

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
    Ok(match &plan.bodies[index] {
        BodySpec::Rigid => Box::new(RigidBody),
        BodySpec::HalfSpace(elastic) => {
            Box::new(HalfSpaceBody::new(&elastic.in_axes(0.0), SIDES[index], frame).at(KEYS[index])?)
        }
        BodySpec::Fe(_) => {
            return Err(Failure {
                error: Error::input("finite-element bodies are not there yet"),
                key: KEYS[index],
            });
        }
    })
}
