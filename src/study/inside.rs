//! Whether the points that `output.inside` asks for lie in their bodies.

use super::bodies::{KEYS, SIDES};
use super::failure::{AtKey, Failure};
use super::memory;
use crate::body::half_space::first_above;
use crate::error::Error;
use crate::frame::ContactFrame;
use crate::geometry::{Point, number, place};
use crate::results::inside::InsideRequest;
use crate::scene::plan::{BodySpec, Plan};

/// Refuses points outside of their bodies.
///
/// # Errors
/// If there is one, or there is no memory for them.
pub(super) fn check(plan: &Plan, frame: &ContactFrame) -> Result<(), Failure> {
    memory::ensure_inside(plan, frame).at("output.inside")?;
    plan.inside.iter().enumerate().try_for_each(|(i, request)| {
        let key = format!("output.inside.{i}");
        let index = usize::from(request.side == SIDES[1]);
        match &plan.bodies[index] {
            BodySpec::HalfSpace(_) => below(plan, frame, (&key, request)),
            BodySpec::Be(be) => {
                let points = request.points();
                let outside = be.inputs(KEYS[index]).outside(&points).at(&key)?;
                outside.map_or(Ok(()), |first| beyond(plan, (&key, request), &points[first]))
            }
            // Refused when the scene is read.
            BodySpec::Fe(_) | BodySpec::Truncated(_) | BodySpec::Rigid => Ok(()),
        }
    })
}

/// All points of a rectangle lie on a side of a plane if its corners do.
fn below(plan: &Plan, frame: &ContactFrame, (key, request): (&str, &InsideRequest)) -> Result<(), Failure> {
    for (name, corner) in request.corners() {
        if let Some((_, height)) = first_above(request.side, frame, &[corner]).at(key)? {
            let error = Error::input(format!(
                "the corner {} of \"{}\" lies {} {} outside of {}, a half-space whose surface is the plane of the frame: its points are {} \
                 that plane",
                place(&corner.into()),
                request.name,
                number(height),
                plan.units.length,
                request.side.name(),
                if request.side == SIDES[0] { "below" } else { "above" },
            ));
            return Err(Failure { error, key: format!("{key}.{name}") });
        }
    }
    Ok(())
}

fn beyond(plan: &Plan, (key, request): (&str, &InsideRequest), point: &Point) -> Result<(), Failure> {
    let corners = request.corners();
    let corner = corners.iter().find(|(_, corner)| corner == point);
    let error = Error::input(format!(
        "the point {} ({}) of \"{}\" lies outside of the surface of {}: move `from`, `to` or `across`, or end them on the surface",
        place(&<[f64; 3]>::from(*point)),
        plan.units.length,
        request.name,
        request.side.name(),
    ));
    // Of a point between the corners no key is at fault.
    Err(Failure { error, key: corner.map_or_else(|| key.to_owned(), |(name, _)| format!("{key}.{name}")) })
}
