use crate::body::half_space::first_point_above_surface;
use crate::error::Error;
use crate::frame::ContactFrame;
use crate::geometry::{Point, format_number, format_point};
use crate::output::interior_points::InteriorPointRequest;
use crate::scene::plan::{BodyPlan, Plan};
use crate::simulation::build::memory;
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::plan_bodies::{BODY_KEYS, SIDES};

/// Refuses points of `output.inside` outside their bodies.
pub(super) fn check(plan: &Plan, frame: &ContactFrame) -> Result<(), SceneError> {
    memory::ensure_points_fit(plan, frame).at("output.inside")?;
    plan.interior_requests.iter().enumerate().try_for_each(|(i, request)| {
        let key = format!("output.inside.{i}");
        let index = usize::from(request.side == SIDES[1]);
        match &plan.bodies[index] {
            BodyPlan::HalfSpace(_) => below(plan, frame, &key, request),
            BodyPlan::Be(be) => {
                let points = request.points();
                let outside = be.bem_spec(BODY_KEYS[index]).first_point_outside(&points).at(&key)?;
                outside.map_or(Ok(()), |first| refuse_outside_point(plan, &key, request, &points[first]))
            }
            // The scene reader refuses interior points of these bodies.
            BodyPlan::Fe(_) | BodyPlan::TruncatedHalfSpace(_) | BodyPlan::Rigid => Ok(()),
        }
    })
}

/// Refuses points outside a half-space. The check of the corners suffices, because all points lie between the corners.
fn below(
    plan: &Plan,
    frame: &ContactFrame,
    key: &str,
    request: &InteriorPointRequest,
) -> Result<(), SceneError> {
    for (name, corner) in request.corners() {
        if let Some((_, height)) = first_point_above_surface(request.side, frame, &[corner]).at(key)? {
            let error = Error::input(format!(
                "the corner {} of \"{}\" lies {} {} outside of {}, a half-space bounded by the plane of the frame: the points of this half-space are {} the plane",
                format_point(&corner.into()),
                request.name,
                format_number(height),
                plan.units.length,
                request.side.name(),
                if request.side == SIDES[0] { "below" } else { "above" },
            ));
            return Err(SceneError { error, key: format!("{key}.{name}") });
        }
    }
    Ok(())
}

fn refuse_outside_point(
    plan: &Plan,
    key: &str,
    request: &InteriorPointRequest,
    point: &Point,
) -> Result<(), SceneError> {
    let corners = request.corners();
    let corner = corners.iter().find(|(_, corner)| corner == point);
    let error = Error::input(format!(
        "the point {} ({}) of \"{}\" lies outside of {}: move `from`, `to` or `across` inside or onto the surface",
        format_point(&<[f64; 3]>::from(*point)),
        plan.units.length,
        request.name,
        request.side.name(),
    ));
    // If the point is not a corner, no single key is wrong.
    Err(SceneError { error, key: corner.map_or_else(|| key.to_owned(), |(name, _)| format!("{key}.{name}")) })
}
