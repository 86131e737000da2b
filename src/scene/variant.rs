//! What the bodies of a scene are in its variants, and how they are meshed there.

use std::fmt;
use std::sync::Arc;

use super::spec::body::{Element, NearField};
use super::suggest::closest;
use crate::bem::finite::Interpolation;
use crate::mesh::Mesh;

/// What stands for a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Discretisation {
    /// Finite elements.
    FiniteElements,
    /// A finite body of boundary elements.
    BoundaryElements,
    /// A half-space.
    HalfSpace,
    /// A half-space whose surface is meshed as far as it goes.
    TruncatedHalfSpace,
    /// Nothing: the body does not deform.
    Rigid,
}

impl Discretisation {
    /// All, in the order of messages.
    const ALL: [Self; 5] = [
        Self::FiniteElements,
        Self::BoundaryElements,
        Self::HalfSpace,
        Self::TruncatedHalfSpace,
        Self::Rigid,
    ];

    /// Its name in that of a variant.
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

/// What stands for body 1 and body 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DiscretisationPair(pub [Discretisation; 2]);

impl fmt::Display for DiscretisationPair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{}", self.0[0].name(), self.0[1].name())
    }
}

impl std::str::FromStr for DiscretisationPair {
    type Err = String;

    /// "FE-BE", in letters of any case; the error says what is allowed.
    fn from_str(text: &str) -> Result<Self, String> {
        let names = Discretisation::ALL.map(Discretisation::name);
        let wanted = format!("two of {} joined by a hyphen, e.g. \"FE-BE\"", names.join(", "));
        let of = |word: &str| {
            let found = Discretisation::ALL.into_iter().find(|kind| kind.name().eq_ignore_ascii_case(word));
            found.ok_or_else(|| {
                let near = closest(&word.to_uppercase(), &names);
                let near = near.map_or(String::new(), |near| format!(" (did you mean {near}?)"));
                format!("\"{word}\" is not a model of a body{near}; a variant is {wanted}")
            })
        };
        match text.trim().split('-').map(str::trim).collect::<Vec<_>>()[..] {
            [first, second] => Ok(Self([of(first)?, of(second)?])),
            _ => Err(format!("\"{text}\" is not a variant; a variant is {wanted}")),
        }
    }
}

/// How a body is meshed where something else stands for it than what it is.
#[derive(Debug, Clone)]
pub struct AlternativeMeshes {
    /// A closed surface; the skin of its own mesh if absent.
    pub surface: Option<Arc<Mesh>>,
    /// How displacement and traction vary over its elements.
    pub interpolation: Interpolation,
    /// Solids; those of its own mesh if absent.
    pub solids: Option<Arc<Mesh>>,
    /// Formulation of the finite elements.
    pub element: Option<Element>,
    /// Where their near field is computed.
    pub near_field: NearField,
}

/// What is compared.
#[derive(Debug, Clone)]
pub struct ComparePlan {
    /// The variants; the scene as it is and the usual ones if absent.
    pub variants: Option<Vec<DiscretisationPair>>,
    /// How bodies 1 and 2 are meshed.
    pub alternatives: [AlternativeMeshes; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the names of the documentation, and those it does not have.
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
            ("half-space", "\"half\" is not a model of a body; a variant is two of"),
            ("", "not a variant"),
        ] {
            let error = text.parse::<DiscretisationPair>().unwrap_err();
            assert!(error.contains(named), "{text}: {error}");
        }
    }
}
