//! Balance of forces and moments at a path point: prescribed forces and moments, and loads of unconstrained bodies.

use nalgebra::Vector3;

use crate::contact::balance::LossOfEquilibrium;
use crate::contact::balance::{MOTION_COMPONENTS, RigidMotion, UnresistedLoad};
use crate::contact::{
    Balance, BalanceConstraint, NormalControl, PathPoint, SlipReference, TangentialControl,
};
use crate::error::{Error, Result, warning};
use crate::evolution::controls::PrescribedLoads;
use crate::evolution::given_warnings::StepWarning;
use crate::evolution::model::PreparedModel;
use crate::evolution::records::IncrementRecord;
use crate::evolution::run::Run;
use crate::evolution::step::Step;
use crate::geometry::{Side, format_short};

/// Smallest norm of the part of a unit direction that is orthogonal to all earlier directions. With a smaller norm, the
/// direction adds no constraint.
const MIN_DIRECTION_NORM: f64 = 1e-6;

/// Smallest ratio of translation to rotation, or of rotation to translation, for which a message names the smaller
/// motion.
const MIN_MOTION_SHARE: f64 = 0.01;

/// Smallest fraction of the tangential load that counts as carried by friction. Smaller fractions count as 0.
const MIN_CARRIED_FRACTION: f64 = 1e-9;

impl Run<'_> {
    pub(super) fn path_point(
        &mut self,
        loads: &PrescribedLoads,
        reference: SlipReference,
    ) -> Result<PathPoint> {
        let step = self.step();
        let mut end = PathPoint {
            normal: loads.normal,
            tangential: loads.tangential,
            balance: None,
            reference,
            load_phase: loads.phase,
        };
        let prepared = &self.prepared;
        let inclined = loads.any() && prepared.rigid_axes.is_some();
        // A plane of symmetry carries the force component along the normal of the plane.
        let at_plane = matches!(loads.tangential, TangentialControl::Force(_))
            && !prepared.model.frame.symmetry_normals().is_empty();
        if prepared.model.floating.is_empty() && !inclined && !loads.prescribes_moment() && !at_plane {
            return Ok(end);
        }
        let friction = if step.friction { prepared.ellipse } else { None };
        let wanted = prepared.balance_constraints(loads);
        let gap = |component: usize, cell: usize| prepared.unit_gap(component, cell);
        let areas = &prepared.model.frame.areas;
        let balance = Balance::for_frame(areas, friction.as_ref(), gap, &wanted)
            .map_err(|unresisted| prepared.unresisted_load_error(step, &unresisted))?;
        let motions = balance.unresisted_motions.iter().map(|motion| prepared.motion_name(motion));
        let notes: Vec<String> = motions
            .map(|motion| {
                format!(
                    "step \"{}\": nothing resists and no load drives the {motion} of {}: this motion is kept fixed",
                    step.name,
                    prepared.who()
                )
            })
            .collect();
        if !notes.is_empty() && self.is_first_in_step(StepWarning::UnresistedMotion) {
            self.result.warnings.extend(notes);
        }
        end.balance = Some(balance);
        Ok(end)
    }
}

impl PreparedModel<'_> {
    /// Change of the local gap (x, y, n) in a cell per unit of a component of the rigid motion.
    fn unit_gap(&self, component: usize, cell: usize) -> [f64; 3] {
        if component >= 3 {
            let gap = &self.mode_gaps[component - 3];
            return [0, 1, 2].map(|plane| gap[plane * self.n() + cell]);
        }
        let mut unit = Vector3::zeros();
        unit[component] = 1.0;
        self.rigid_axes.as_ref().map_or(unit, |axes| axes[cell] * unit).into()
    }

    /// Constraints for the unknown rigid motions. Each constraint states the work that the tractions on body 2 must do
    /// on one motion.
    fn balance_constraints(&self, loads: &PrescribedLoads) -> Vec<BalanceConstraint> {
        let mut force = Vector3::zeros();
        let mut forced = Vec::new();
        if let NormalControl::Force(p) = loads.normal {
            force.z = p;
            forced.push(Vector3::z());
        }
        if let TangentialControl::Force([x, y]) = loads.tangential {
            (force.x, force.y) = (x, y);
            forced.extend([Vector3::x(), Vector3::y()]);
        }
        let free = self.mode_loads.iter().zip(&self.cyclic_mode_loads).zip(&self.mode_motions).enumerate();
        let floating = free.map(|(j, ((load, cyclic), m))| {
            let mut motion = [0.0; MOTION_COMPONENTS];
            motion[3 + j] = 1.0;
            let load = load + loads.phase * cyclic;
            // The contact carries the prescribed force and supports the body against the body's own loads.
            BalanceConstraint { motion, work: force.dot(&Vector3::new(m[0], m[1], m[2])) - load }
        });
        let mut wanted: Vec<BalanceConstraint> = floating.collect();
        // Bodies cannot move across planes of symmetry, which carry the forces along their normals.
        let normals = self.model.frame.symmetry_normals();
        let mut taken = [&self.free_translations[..], &normals].concat();
        for direction in forced {
            let mut rest = direction;
            taken.iter().for_each(|free| rest -= free * free.dot(&direction));
            if rest.norm() > MIN_DIRECTION_NORM {
                let rest = rest.normalize();
                taken.push(rest);
                let mut motion = [0.0; MOTION_COMPONENTS];
                motion[..3].copy_from_slice(rest.as_slice());
                wanted.push(BalanceConstraint { motion, work: force.dot(&rest) });
            }
        }
        let mut turned: Vec<Vector3<f64>> = Vec::new();
        let moment = Vector3::from(loads.moment.map(|moment| moment.unwrap_or(0.0)));
        for axis in (0..3).filter(|&axis| loads.moment[axis].is_some()) {
            let unit = Vector3::ith(axis, 1.0);
            if normals.is_empty() {
                wanted.push(rotation_constraint(&unit, moment[axis]));
                continue;
            }
            // A plane of symmetry allows rotations about its normal only.
            let mut rest = allowed_rotation(&normals, &unit);
            turned.iter().for_each(|other| rest -= other * other.dot(&rest));
            if let Some(rest) = rest.try_normalize(MIN_DIRECTION_NORM) {
                wanted.push(rotation_constraint(&rest, moment.dot(&rest)));
                turned.push(rest);
            }
        }
        wanted
    }

    fn unresisted_load_error(&self, step: &Step, unresisted: &UnresistedLoad) -> Error {
        let mend = if step.friction && self.ellipse.is_some() {
            "support the body against this motion, or remove the load"
        } else {
            "without friction only pressures act; add a [friction] law, support the body against this motion, or remove the load"
        };
        Error::input(format!(
            "step \"{}\": a load drives the {} of {}, but nothing resists this motion: {mend}",
            step.name,
            self.motion_name(&unresisted.motion),
            self.who()
        ))
    }

    /// Names the unconstrained bodies; "body 2" if there are none.
    fn who(&self) -> &'static str {
        match self.model.floating.iter().map(|body| body.side).collect::<Vec<_>>()[..] {
            [Side::Lower] => "body 1",
            [Side::Lower, Side::Upper] | [Side::Upper, Side::Lower] => "the bodies",
            _ => "body 2",
        }
    }

    /// Translation and rotation of body 2 relative to body 1 in the rigid motion `motion`.
    fn six(&self, motion: &RigidMotion) -> [f64; 6] {
        let mut six = [0.0; 6];
        six[..3].copy_from_slice(&motion[..3]);
        for (floating, amount) in self.mode_motions.iter().zip(&motion[3..]) {
            six.iter_mut().zip(floating).for_each(|(sum, c)| *sum += amount * c);
        }
        six
    }

    fn motion_name(&self, motion: &RigidMotion) -> String {
        let six = self.six(motion);
        let (shift, turn) = (Vector3::new(six[0], six[1], six[2]), Vector3::new(six[3], six[4], six[5]));
        if turn.norm() * self.model.frame.size() > 1e-6 * shift.norm() {
            format!("rotation about {}", direction_name(turn * sign_of_largest(turn)))
        } else {
            format!("translation along {}", direction_name(shift * sign_of_largest(shift)))
        }
    }

    /// Warning that a body rotates by `degrees`, which is more than linearised rotations allow.
    pub(super) fn large_rotation_message(&self, record: &IncrementRecord, degrees: f64) -> String {
        let apart = if record.contact_area == 0.0 { ", and no cell remains in contact" } else { "" };
        let remedy = if self.controls_rotation {
            "Pressures balance a moment only if the contact lies around frame.center: set frame.center to the middle of the contact, change the moment, or prescribe `rotation` or `twist`"
        } else {
            "Check the loads and supports of the bodies"
        };
        warning(&format!(
            "step \"{}\" ({}): {} is rotated by {} degrees{apart}. Rotations are linearised, so that more than 0.1 radians (5.7 degrees) are not reliable. {remedy}",
            record.name,
            record.increment,
            self.who(),
            format_short(degrees)
        ))
    }

    /// Describes a rigid motion that nothing resists.
    ///
    /// For a separation, only the larger of rotation and translation is named. For sliding, rotation and translation
    /// are named, with the translation at `frame.center`. A part below [`MIN_MOTION_SHARE`] of the larger part is left
    /// out.
    fn loss_motion(&self, shift: Vector3<f64>, turn: Vector3<f64>, separates: bool) -> String {
        let (by_shift, by_turn) = (shift.norm(), turn.norm() * self.model.frame.size());
        if separates {
            return if by_turn > by_shift {
                format!("tips about {}", direction_name(turn))
            } else {
                format!("moves away along {}", direction_name(shift))
            };
        }
        let slides = (by_shift > MIN_MOTION_SHARE * by_turn)
            .then(|| format!("slides along {}", direction_name(shift)));
        let spins =
            (by_turn > MIN_MOTION_SHARE * by_shift).then(|| format!("spins about {}", direction_name(turn)));
        match (slides, spins) {
            (Some(slides), Some(spins)) => format!("{slides} (at frame.center) and {spins}"),
            (slides, spins) => slides.or(spins).unwrap_or_default(),
        }
    }

    pub(super) fn loss_of_equilibrium_message(
        &self,
        step: &str,
        number: usize,
        sliding: &LossOfEquilibrium,
    ) -> String {
        let six = self.six(&sliding.motion);
        let (shift, turn) = (Vector3::new(six[0], six[1], six[2]), Vector3::new(six[3], six[4], six[5]));
        let body1 = self.who() == "body 1";
        let sign = if body1 { -1.0 } else { 1.0 };
        let who = if body1 { "body 1" } else { "body 2" };
        let how = self.loss_motion(shift * sign, turn * sign, sliding.separates_bodies);
        if sliding.separates_bodies {
            return format!(
                "step \"{step}\" ({number}): no equilibrium, because the loads separate the bodies: {who} {how} (axes of the frame)"
            );
        }
        if sliding.carried_load_fraction.abs() < MIN_CARRIED_FRACTION {
            return format!(
                "step \"{step}\" ({number}): no equilibrium, because friction carries none of the tangential load (no pressure acts where the bodies slide): {who} {how} (axes of the frame)"
            );
        }
        let share = if sliding.carried_load_fraction > 0.0 && sliding.carried_load_fraction < 1.0 {
            let percent = match 100.0 * sliding.carried_load_fraction {
                percent if percent < 1.0 => format_short(percent),
                percent if percent < 99.99 => format!("{percent:.2}"),
                _ => "99.99".to_owned(),
            };
            format!(
                "; under the normal load of this increment, friction transmits at most {percent} % of the tangential load"
            )
        } else {
            String::new()
        };
        format!(
            "step \"{step}\" ({number}): the tangential load exceeds the friction limit (gross sliding): {who} {how} (axes of the frame){share}"
        )
    }
}

fn rotation_constraint(axis: &Vector3<f64>, work: f64) -> BalanceConstraint {
    let mut motion = [0.0; MOTION_COMPONENTS];
    motion[3..6].copy_from_slice(axis.as_slice());
    BalanceConstraint { motion, work }
}

/// Part of a rotation vector that planes of symmetry with the given normals allow.
fn allowed_rotation(normals: &[Vector3<f64>], rotation: &Vector3<f64>) -> Vector3<f64> {
    match normals {
        [] => *rotation,
        [normal] => normal * normal.dot(rotation),
        _ => Vector3::zeros(),
    }
}

/// Sign that makes the largest component positive, because the sense of an unresisted motion is arbitrary.
fn sign_of_largest(direction: Vector3<f64>) -> f64 {
    direction[direction.iamax()].signum()
}

fn direction_name(direction: Vector3<f64>) -> String {
    let unit = direction.normalize().map(|c| if c.abs() < 1e-9 { 0.0 } else { c });
    for (axis, name) in ["x", "y", "n"].into_iter().enumerate() {
        if unit[axis].abs() > 1.0 - 1e-9 {
            return if unit[axis] > 0.0 { name.to_owned() } else { format!("-{name}") };
        }
    }
    format!("({:.3}, {:.3}, {:.3})", unit.x, unit.y, unit.z)
}
