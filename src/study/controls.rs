//! What the steps may prescribe on the frame they act on.

use super::failure::Failure;
use crate::error::Error;
use crate::frame::ContactFrame;
use crate::history::step::{Normal, Tangential};
use crate::scene::plan::Plan;

/// Refuses prescribed forces on a curved frame: its cells do not share the axes a force is balanced along.
///
/// Forces held into later steps need no check of their own, since the step that prescribes them is refused.
///
/// # Errors
/// At the key of the first such force.
pub(super) fn refuse_forces_on_curved_frames(plan: &Plan, frame: &ContactFrame) -> Result<(), Failure> {
    if frame.is_level() {
        return Ok(());
    }
    for (index, step) in plan.steps.iter().enumerate() {
        let (name, displacement) = match (step.normal, step.tangential) {
            (Some(Normal::Force(_)), _) => ("normal_force", "approach"),
            (_, Some(Tangential::Force(_))) => ("tangential_force", "shift"),
            _ => continue,
        };
        let error = Error::input(format!(
            "step \"{}\" prescribes a force, but the contact frame is curved: prescribe `{displacement}`, or use \
             frame.kind = \"grid\"",
            step.name
        ));
        return Err(Failure { error, key: format!("steps.{index}.{name}") });
    }
    Ok(())
}
