//! Work that a scene may not need, by name, and the ledger of what was left out.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Work that can be left out where the answer does not need it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OmittableWork {
    /// Unknowns in the surface of steps in which nothing rubs or wears.
    TangentialUnknowns,
    /// Unknowns in the surface where all of the contact slips.
    SlidingFriction,
    /// Normal components in products for tractions in the surface, of bodies in which neither moves the gap of the other.
    NormalComponents,
    /// The tangential gap of increments in which nothing rubs or wears, where nobody looks at it.
    TangentialGap,
    /// The operator of one of two half-spaces: their Green's functions are summed.
    SecondHalfSpace,
    /// Blocks of half-space operators that vanish for the two materials.
    VanishingBlocks,
    /// Entries of half-space operators between distant cells of frames that are no grid: they are compressed.
    DistantEntries,
    /// Cells of a grid away from the contact.
    DistantCells,
    /// Columns of the flexibility of meshed bodies for cells that cannot touch.
    OpenCells,
    /// Starts from nothing of increments that follow another.
    ColdStarts,
}

impl OmittableWork {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::TangentialUnknowns,
        Self::SlidingFriction,
        Self::NormalComponents,
        Self::TangentialGap,
        Self::SecondHalfSpace,
        Self::VanishingBlocks,
        Self::DistantEntries,
        Self::DistantCells,
        Self::OpenCells,
        Self::ColdStarts,
    ];
}

/// Which work may be left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AllowedOmissions(u16);

impl AllowedOmissions {
    /// All that can be.
    pub const ALL: Self = Self((1 << OmittableWork::ALL.len()) - 1);

    /// Nothing.
    pub const NONE: Self = Self(0);

    /// Whether `skip` may be left out.
    pub const fn allows(self, skip: OmittableWork) -> bool {
        self.0 & (1 << skip as u16) != 0
    }

    /// Without leaving out `skip`.
    pub const fn without(self, skip: OmittableWork) -> Self {
        Self(self.0 & !(1 << skip as u16))
    }
}

impl FromIterator<OmittableWork> for AllowedOmissions {
    fn from_iter<I: IntoIterator<Item = OmittableWork>>(skips: I) -> Self {
        Self(skips.into_iter().fold(0, |set, skip| set | 1 << skip as u16))
    }
}

/// What an entry of the ledger is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum OmissionKind {
    /// Work that `solver.skip` may name.
    Named(OmittableWork),
    /// Fretting cycles between those that are solved.
    Cycles,
    /// Meshes that could follow the worn surfaces.
    MovingMeshes,
    /// Steps that another run has done.
    CommonSteps,
    /// What other keys, or the cache, decide.
    Other,
}

impl OmissionKind {
    /// Whether `solver.skip` does not know it.
    pub fn has_no_key(&self) -> bool {
        !matches!(self, Self::Named(_))
    }
}

impl From<OmittableWork> for OmissionKind {
    fn from(skip: OmittableWork) -> Self {
        Self::Named(skip)
    }
}

/// How the time that was saved is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Basis {
    /// The work was done before and timed.
    Measured,
    /// From the time of what was done and the ratio that this work usually has to it (docs/skips.md).
    Estimated,
}

/// Time that was saved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Saved {
    /// Seconds.
    pub seconds: f64,
    /// How they are known.
    pub basis: Basis,
}

/// Work that a scene did not need and that was therefore not done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OmittedWork {
    /// What kind of work; written as its name in `solver.skip`.
    #[serde(rename = "skip", skip_serializing_if = "OmissionKind::has_no_key")]
    pub kind: OmissionKind,
    /// What was skipped.
    pub what: String,
    /// Why it could be.
    pub why: String,
    /// What that saved; `None` where nobody knows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saved: Option<Saved>,
}

impl OmittedWork {
    /// An entry whose time is not known yet.
    pub fn new(work: impl Into<OmissionKind>, what: impl Into<String>, why: impl Into<String>) -> Self {
        Self { kind: work.into(), what: what.into(), why: why.into(), saved: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: a set holds what was put into it, and all holds everything.
    #[test]
    fn sets() {
        for (place, skip) in OmittableWork::ALL.into_iter().enumerate() {
            assert_eq!(skip as usize, place);
            assert!(AllowedOmissions::ALL.allows(skip) && !AllowedOmissions::NONE.allows(skip));
            let only: AllowedOmissions = [skip].into_iter().collect();
            let holds: Vec<OmittableWork> =
                OmittableWork::ALL.into_iter().filter(|&other| only.allows(other)).collect();
            assert_eq!(holds, [skip]);
            assert!(
                !AllowedOmissions::ALL.without(skip).allows(skip)
                    && only.without(skip) == AllowedOmissions::NONE
            );
        }
        assert_eq!(OmittableWork::ALL.into_iter().collect::<AllowedOmissions>(), AllowedOmissions::ALL);
    }
}
