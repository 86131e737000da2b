//! Work that a scene may not need, and the record of omitted work.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Kind of work that can be omitted if the result does not need it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OmittableWork {
    /// Tangential tractions as unknowns, in steps without friction and wear.
    TangentialUnknowns,
    /// Pressures as unknowns of the friction iterations: without coupling of normal and tangential directions, the pressures are
    /// solved first.
    NormalComponents,
    /// Tangential gap after a solve, in scenes without friction that write no fields.
    TangentialGap,
    /// The second of two half-space operators: one operator with the sum of both Green's functions suffices.
    SecondHalfSpace,
    /// Blocks of half-space operators between normal and tangential directions, if they vanish for the materials.
    VanishingBlocks,
    /// Entries of half-space operators between distant cells of mesh frames: they are compressed.
    DistantEntries,
    /// Cells of a grid away from the contact, and fine cells in the first iterations.
    DistantCells,
    /// Columns of the flexibility of meshed bodies for cells that cannot touch.
    OpenCells,
    /// Iterations from zero: an increment starts from the tractions of the previous one.
    ColdStarts,
}

impl OmittableWork {
    /// All kinds of omittable work.
    pub const ALL: [Self; 9] = [
        Self::TangentialUnknowns,
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

/// Set of kinds of work that may be omitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AllowedOmissions(u16);

impl AllowedOmissions {
    /// All kinds of work.
    pub const ALL: Self = Self((1 << OmittableWork::ALL.len()) - 1);

    /// No kind of work.
    pub const NONE: Self = Self(0);

    /// Whether `skip` may be omitted.
    pub const fn allows(self, skip: OmittableWork) -> bool {
        self.0 & (1 << skip as u16) != 0
    }

    /// This set without `skip`.
    pub const fn without(self, skip: OmittableWork) -> Self {
        Self(self.0 & !(1 << skip as u16))
    }
}

impl FromIterator<OmittableWork> for AllowedOmissions {
    fn from_iter<I: IntoIterator<Item = OmittableWork>>(skips: I) -> Self {
        Self(skips.into_iter().fold(0, |set, skip| set | 1 << skip as u16))
    }
}

/// Work that was omitted because the scene did not need it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OmittedWork {
    /// Name in `solver.skip`; `None` if other keys or the cache determine whether the work is omitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skip: Option<OmittableWork>,
    /// Description of the omitted work.
    pub what: String,
    /// Reason why the work is not needed.
    pub why: String,
}

impl OmittedWork {
    /// Creates a record from the name in `solver.skip` (if the work has one), the description and the reason.
    pub fn new(
        skip: impl Into<Option<OmittableWork>>,
        what: impl Into<String>,
        why: impl Into<String>,
    ) -> Self {
        Self { skip: skip.into(), what: what.into(), why: why.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: a set contains exactly the kinds from which it was built, and `ALL` contains all kinds.
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
