//! Integration rules of the solid elements, and dispatch of generic code to an element kind.

use super::integration_points::{ReferencePoint, reference_points};
use crate::element::{
    ElementKind, Hex8, Hex20, Hex27, Pyramid5, Pyramid13, Pyramid14, ShapeFunctions, Tet4, Tet10, Wedge6,
    Wedge15, Wedge18,
};
use crate::quadrature::{RulePoint, gauss_legendre, hexahedron, pyramid, tetrahedron, wedge};

#[derive(Debug, Clone)]
pub(super) struct IntegrationRules<const N: usize> {
    pub stiffness: Vec<ReferencePoint<N>>,
    /// Points for loads that vary in space.
    pub loads: Vec<ReferencePoint<N>>,
}

pub(super) trait SolidElement<const N: usize>: ShapeFunctions<N, 3> {
    fn rules(all: &RuleSet) -> &IntegrationRules<N>;
}

/// Generic computation that runs for one element kind (visitor).
pub(super) trait ElementVisitor {
    type Output;

    fn visit_element<S: SolidElement<N>, const N: usize>(self) -> Self::Output;
}

macro_rules! solids {
    ($($element:ident, $n:literal, $field:ident: $stiffness:expr, $loads:expr;)*) => {
        #[cfg(test)]
        pub(super) const ALL: &[ElementKind] = &[$(ElementKind::$element),*];

        #[derive(Debug, Clone)]
        pub(super) struct RuleSet {
            $($field: IntegrationRules<$n>,)*
        }

        impl RuleSet {
            pub fn new() -> Self {
                Self { $($field: IntegrationRules::new::<$element>($stiffness, $loads),)* }
            }
        }

        $(impl SolidElement<$n> for $element {
            fn rules(all: &RuleSet) -> &IntegrationRules<$n> {
                &all.$field
            }
        })*

        /// Runs `visitor` for the element type of `kind`.
        ///
        /// # Panics
        /// If the kind is not a solid.
        pub(super) fn visit_element<V: ElementVisitor>(kind: ElementKind, visitor: V) -> V::Output {
            match kind {
                $(ElementKind::$element => visitor.visit_element::<$element, $n>(),)*
                other => unreachable!("{} was refused", other.name()),
            }
        }
    };
}

// The stiffness rules are exact for elements with a constant Jacobian. On other elements, the stiffness has full rank
// and ∫ B dV is exact. The nodal forces of a constant stress are therefore exact, too.
solids! {
    Hex8, 8, hex8: corners(), hexahedron(4);
    Hex20, 20, hex20: hexahedron(3), hexahedron(4);
    Hex27, 27, hex27: hexahedron(3), hexahedron(4);
    Tet4, 4, tet4: tetrahedron(1), tetrahedron(5);
    Tet10, 10, tet10: tetrahedron(3), tetrahedron(5);
    Wedge6, 6, wedge6: wedge(2, 2), wedge(5, 4);
    Wedge15, 15, wedge15: wedge(4, 3), wedge(5, 4);
    Wedge18, 18, wedge18: wedge(4, 3), wedge(5, 4);
    Pyramid5, 5, pyramid5: pyramid(2), pyramid(4);
    Pyramid13, 13, pyramid13: pyramid(3), pyramid(4);
    Pyramid14, 14, pyramid14: pyramid(3), pyramid(4);
}

/// 2 x 2 x 2 Gauss points in the node order of the hexahedron.
fn corners() -> Vec<RulePoint<3>> {
    let gauss = gauss_legendre(2)[1].0;
    Hex8::NODES.map(|node| (node.map(|x| x * gauss), 1.0)).to_vec()
}

impl<const N: usize> IntegrationRules<N> {
    fn new<S: ShapeFunctions<N, 3>>(stiffness: Vec<RulePoint<3>>, loads: Vec<RulePoint<3>>) -> Self {
        Self { stiffness: reference_points::<S, N>(stiffness), loads: reference_points::<S, N>(loads) }
    }
}
