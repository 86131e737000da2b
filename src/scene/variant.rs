//! Models of the bodies in the variants of a scene, and meshes for these models.

use std::fmt;
use std::sync::Arc;

use super::spec::body::{Element, NearField};
use super::suggest::closest;
use crate::bem::finite::Interpolation;
use crate::mesh::Mesh;

/// Model of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Discretisation {
    /// Finite elements.
    FiniteElements,
    /// Finite body of boundary elements.
    BoundaryElements,
    /// Half-space.
    HalfSpace,
    /// Half-space whose surface is meshed only around the frame.
    TruncatedHalfSpace,
    /// Rigid body.
    Rigid,
}

impl Discretisation {
    const ALL: [Self; 5] = [
        Self::FiniteElements,
        Self::BoundaryElements,
        Self::HalfSpace,
        Self::TruncatedHalfSpace,
        Self::Rigid,
    ];

    /// Abbreviation in the names of variants.
    pub fn name(self) -> &'static str {
        match self {
            Self::FiniteElements => "FE",
            Self::BoundaryElements => "BE",
            Self::HalfSpace => "HS",
            Self::TruncatedHalfSpace => "THS",
            Self::Rigid => "rigid",
        }
    }
}

/// Models of body 1 and body 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DiscretisationPair(pub [Discretisation; 2]);

impl fmt::Display for DiscretisationPair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{}", self.0[0].name(), self.0[1].name())
    }
}

impl std::str::FromStr for DiscretisationPair {
    type Err = String;

    /// Parses "FE-BE", in upper or lower case.
    fn from_str(text: &str) -> Result<Self, String> {
        let names = Discretisation::ALL.map(Discretisation::name);
        let wanted = format!("two of {} joined by a hyphen, e.g. \"FE-BE\"", names.join(", "));
        let of = |word: &str| {
            let found = Discretisation::ALL.into_iter().find(|kind| kind.name().eq_ignore_ascii_case(word));
            found.ok_or_else(|| {
                let near = closest(&word.to_uppercase(), &names);
                let near = near.map_or(String::new(), |near| format!(" (did you mean {near}?)"));
                format!("\"{word}\" is not a body model{near}; a variant is {wanted}")
            })
        };
        match text.trim().split('-').map(str::trim).collect::<Vec<_>>()[..] {
            [first, second] => Ok(Self([of(first)?, of(second)?])),
            _ => Err(format!("\"{text}\" is not a variant; a variant is {wanted}")),
        }
    }
}

/// Meshes and elements of a body for variants that replace its model.
#[derive(Debug, Clone)]
pub struct AlternativeMeshes {
    /// Closed surface mesh; `None` for the boundary surface of the body's own mesh.
    pub surface: Option<Arc<Mesh>>,
    /// Interpolation of displacement and traction over the boundary elements.
    pub interpolation: Interpolation,
    /// Volume mesh; `None` for the body's own mesh.
    pub solids: Option<Arc<Mesh>>,
    /// Formulation of the finite elements.
    pub element: Option<Element>,
    /// Model of the near field of the finite-element body.
    pub near_field: NearField,
}

/// Settings of a comparison.
#[derive(Debug, Clone)]
pub struct ComparePlan {
    /// Variants to compute; `None` for the scene as written, FE-FE, BE-BE, FE-BE and HS-HS.
    pub variants: Option<Vec<DiscretisationPair>>,
    /// Alternative meshes of bodies 1 and 2.
    pub alternatives: [AlternativeMeshes; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: names are read in upper and lower case; other names are refused.
    #[test]
    fn variants_are_read_as_they_are_written() {
        for text in ["FE-FE", "BE-rigid", "FE-BE", "HS-HS"] {
            assert_eq!(text.parse::<DiscretisationPair>().unwrap().to_string(), text);
            assert_eq!(text.to_lowercase().parse::<DiscretisationPair>().unwrap().to_string(), text);
        }
        for (text, named) in [
            ("FE", "not a variant"),
            ("FE-BE-HS", "not a variant"),
            ("FEM-BE", "did you mean FE"),
            ("half-space", "\"half\" is not a body model; a variant is two of"),
            ("", "not a variant"),
        ] {
            let error = text.parse::<DiscretisationPair>().unwrap_err();
            assert!(error.contains(named), "{text}: {error}");
        }
    }
}
