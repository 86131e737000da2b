use std::collections::HashMap;
use std::collections::hash_map::Entry;

use nalgebra::Matrix3;

use super::directions::axes_from_directions;
use crate::error::{Error, Result};
use crate::geometry::Point;

/// Material axes of elements, by the element numbers of the mesh file.
#[derive(Debug, Clone, Default)]
pub struct ElementAxes {
    source: String,
    axes: HashMap<u64, Matrix3<f64>>,
}

impl ElementAxes {
    /// Creates an empty set. `source` names the place that gives the axes in messages, such as "the field \"fibre\" of
    /// block.msh".
    pub fn new(source: &str) -> Self {
        Self { source: source.to_owned(), axes: HashMap::new() }
    }

    /// Adds the fibre direction of an element (any length, global axes), with an optional second direction towards axis 2.
    ///
    /// # Errors
    /// If a vector is zero or not finite, if the two vectors are parallel, or if the element already has axes (kind `Input`).
    pub fn add(&mut self, element: u64, first: [f64; 3], second: Option<[f64; 3]>) -> Result<()> {
        let Some(axes) = axes_from_directions(first.into(), second.map(Point::from)) else {
            let second = second.map_or(String::new(), |second| format!(", second {second:?}"));
            return Err(Error::input(format!(
                "the fibre {first:?}{second} of element {element} has no direction: it must be finite and not zero, and a second direction must not be parallel to it"
            )));
        };
        match self.axes.entry(element) {
            Entry::Occupied(_) => Err(Error::input(format!("element {element} appears twice"))),
            Entry::Vacant(free) => {
                free.insert(axes);
                Ok(())
            }
        }
    }

    /// Numbers of the elements with axes, ascending.
    pub fn elements(&self) -> Vec<u64> {
        let mut elements: Vec<u64> = self.axes.keys().copied().collect();
        elements.sort_unstable();
        elements
    }

    /// Axes of the element with the number `element`.
    ///
    /// # Errors
    /// If the element has no axes.
    pub fn axes(&self, element: u64) -> Result<Matrix3<f64>> {
        self.axes.get(&element).copied().ok_or_else(|| {
            Error::input(format!("it has no fibre in {}; each element needs one", self.source))
        })
    }
}
