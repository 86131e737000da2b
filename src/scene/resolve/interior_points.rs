//! Resolves `[[output.inside]]`: points inside bodies.

use super::resolver::Resolver;
use crate::geometry::{Point, Side};
use crate::output::interior_points::InteriorPointRequest;
use crate::scene::plan::{BodyPlan, FramePlan};
use crate::scene::spec::solver::{InteriorPoints, Output, PointCounts};

const MAX_POINTS: usize = 200_000;

const MIN_SINE_BETWEEN_SIDES: f64 = 1e-9;

pub(super) fn resolve(
    r: &mut Resolver,
    output: Option<&Output>,
    bodies: &[Option<BodyPlan>; 2],
    frame: Option<&FramePlan>,
) -> Vec<InteriorPointRequest> {
    let mut found: Vec<InteriorPointRequest> = Vec::new();
    for (i, inside) in output.map_or(&[][..], |output| &output.inside).iter().enumerate() {
        let key = format!("output.inside.{i}");
        check_name(r, &key, &inside.name, &found);
        // The schema check reports other body numbers.
        let index = usize::from(inside.body != 1);
        if let (Some(body), 1 | 2) = (&bodies[index], inside.body) {
            check_body(r, &key, inside.body, body, frame);
        }
        let Some(counts) = point_counts(r, &key, inside) else { continue };
        found.push(InteriorPointRequest {
            name: inside.name.clone(),
            side: [Side::Lower, Side::Upper][index],
            from: inside.from.into(),
            to: inside.to.into(),
            across: inside.across.map(Point::from),
            counts,
        });
    }
    found
}

fn check_name(r: &mut Resolver, key: &str, name: &str, before: &[InteriorPointRequest]) {
    let key = format!("{key}.name");
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || !name.chars().all(fits) {
        let mend = "use letters a to z, digits, \"-\" and \"_\": the name becomes part of file names";
        return r.report(
            &key,
            format!("`name` = \"{name}\" cannot be used in a file name"),
            "this name",
            mend,
        );
    }
    if before.iter().any(|other| other.name.eq_ignore_ascii_case(name)) {
        let message = format!("`name` = \"{name}\" is already used by an earlier entry of output.inside");
        r.report(
            &key,
            message,
            "the same name",
            "give each entry its own name; upper and lower case count as the same",
        );
    }
}

fn check_body(r: &mut Resolver, key: &str, number: usize, body: &BodyPlan, frame: Option<&FramePlan>) {
    let key = format!("{key}.body");
    let (message, mend) = match body {
        BodyPlan::Be(_) => return,
        BodyPlan::HalfSpace(_) => match frame {
            Some(FramePlan::Grid { periodic, .. }) if *periodic != [false; 2] => (
                format!(
                    "body {number} is a half-space under a periodic frame, where interior points are not available"
                ),
                "remove output.inside or frame.periodic".to_owned(),
            ),
            _ => return,
        },
        BodyPlan::Fe(_) => (
            format!(
                "body {number} is a finite-element body; output.inside is for half-spaces and boundary-element bodies"
            ),
            format!(
                "use output.fields = [\"volume\"]: body{number}_volume_0001.vtu contains displacement and stress, and \
                 ParaView's filter \"Plot Over Line\" samples them along a line"
            ),
        ),
        BodyPlan::TruncatedHalfSpace(_) => (
            format!("body {number} is a truncated half-space, in which interior points are not available"),
            format!("remove body{number}.truncated: the exact half-space supports interior points"),
        ),
        BodyPlan::Rigid => (
            format!("body {number} is rigid and has no stresses inside"),
            "name a body that deforms".to_owned(),
        ),
    };
    r.report(&key, message, "this body", mend);
}

/// Numbers of points along the two sides of a rectangle; [n, 1] for a line with n points.
fn point_counts(r: &mut Resolver, key: &str, inside: &InteriorPoints) -> Option<[usize; 2]> {
    let before = r.diagnostics.len();
    let along = Point::from(inside.to) - Point::from(inside.from);
    if along == Point::zeros() {
        r.report(
            &format!("{key}.to"),
            "`to` is the same point as `from`",
            "the same point",
            "give the other end point",
        );
    }
    let counts = match (inside.points, inside.across) {
        (PointCounts::Line(n), None) => [n, 1],
        (PointCounts::Rectangle(counts), Some(across)) => {
            let across = Point::from(across) - Point::from(inside.from);
            if along.cross(&across).norm() <= MIN_SINE_BETWEEN_SIDES * along.norm() * across.norm() {
                let message = "`across` lies on the line through `from` and `to`";
                r.report(
                    &format!("{key}.across"),
                    message,
                    "not a rectangle",
                    "give a corner that is not on that line",
                );
            }
            counts
        }
        (PointCounts::Line(_), Some(_)) => {
            let message = "`points` is one number, but a rectangle needs two";
            let mend = "points = [along, across], or leave out `across` for a line";
            return r.refuse(&format!("{key}.points"), message, "one number", mend);
        }
        (PointCounts::Rectangle(_), None) => {
            let message = "`points` has two numbers, but `across` is missing";
            let mend = "give the third corner, `across`, or one number of points for a line";
            return r.refuse(&format!("{key}.points"), message, "two numbers", mend);
        }
    };
    let least = if inside.across.is_some() { counts[0].min(counts[1]) } else { counts[0] };
    if least < 2 || counts[0].saturating_mul(counts[1]) > MAX_POINTS {
        let message =
            format!("`points` must be at least 2 along each side, and at most {MAX_POINTS} together");
        r.report(
            &format!("{key}.points"),
            message,
            "too few or too many",
            if least < 2 {
                "give more points"
            } else {
                "give fewer points, or several elements of output.inside"
            },
        );
    }
    (r.diagnostics.len() == before).then_some(counts)
}
