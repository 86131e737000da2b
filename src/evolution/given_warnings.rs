//! Warnings that a run gives at most once per step.

use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum StepWarning {
    NoContact,
    /// The bodies are not in contact, although body 2 has moved past the first touch.
    NoContactPastFirstTouch,
    /// Contact reaches an edge of the frame beyond which the bodies continue.
    FrameEdge,
    LargeSliding,
    /// Nothing resists a rigid motion of an unconstrained body, and no load drives this motion.
    UnresistedMotion,
    /// The estimated error of a wear jump exceeds the allowed error, although no more trials are allowed.
    JumpError,
    UnstableJump,
    /// The position of body 2 changes from cycle to cycle (ratcheting).
    Drift,
}

/// Warnings given so far, each with the index of its step.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct GivenWarnings(Vec<(usize, StepWarning)>);

impl GivenWarnings {
    /// Records the warning. Returns whether it is the first warning of its kind in this step.
    pub fn is_first(&mut self, step: usize, kind: StepWarning) -> bool {
        let first = !self.0.contains(&(step, kind));
        if first {
            self.0.push((step, kind));
        }
        first
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    pub fn first(&self, n: usize) -> Self {
        Self(self.0[..n].to_vec())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: only the first warning of a kind in a step counts as first. After a return to an earlier list of
    /// warnings, a warning outside this list counts as first again.
    #[test]
    fn once_per_step_and_kind() {
        let mut given = GivenWarnings::default();
        assert!(given.is_first(0, StepWarning::FrameEdge) && !given.is_first(0, StepWarning::FrameEdge));
        assert!(given.is_first(0, StepWarning::NoContact) && given.is_first(1, StepWarning::FrameEdge));
        let mut before = given.first(2);
        assert_eq!((given.len(), before.len()), (3, 2));
        assert!(!before.is_first(0, StepWarning::NoContact) && before.is_first(1, StepWarning::FrameEdge));
    }
}
