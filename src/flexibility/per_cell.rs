//! Values per cell, stored once if all cells have the same value, as on grids.

use std::ops::Index;

/// One value for each of N cells, stored once if all cells have the same value.
#[derive(Debug, Clone, PartialEq)]
pub enum PerCell<T> {
    /// The common value, and N.
    Same(T, usize),
    /// One value per cell, `[N]`.
    Each(Vec<T>),
}

impl<T> PerCell<T> {
    /// Number of cells N.
    pub fn len(&self) -> usize {
        match self {
            Self::Same(_, n) => *n,
            Self::Each(values) => values.len(),
        }
    }

    /// Whether N is 0.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Value of the first cell; `None` if N is 0.
    pub fn first(&self) -> Option<&T> {
        (!self.is_empty()).then(|| &self[0])
    }

    /// Stored values: one for [`Self::Same`], N for [`Self::Each`]; none if N is 0.
    pub fn distinct(&self) -> &[T] {
        match self {
            Self::Same(_, 0) => &[],
            Self::Same(value, _) => std::slice::from_ref(value),
            Self::Each(values) => values,
        }
    }

    /// Removes the values of cells that are not `kept`, `[N]`.
    pub fn keep(&mut self, kept: &[bool]) {
        let mut flags = kept.iter();
        match self {
            Self::Same(_, n) => *n = flags.filter(|&&keep| keep).count(),
            Self::Each(values) => values.retain(|_| flags.next().is_some_and(|&keep| keep)),
        }
    }

    /// The values, cell by cell.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        (0..self.len()).map(|cell| &self[cell])
    }

    /// Applies `of` to each stored value.
    pub fn map<U>(&self, of: impl FnMut(&T) -> U) -> PerCell<U> {
        let mut of = of;
        match self {
            Self::Same(value, n) => PerCell::Same(of(value), *n),
            Self::Each(values) => PerCell::Each(values.iter().map(of).collect()),
        }
    }
}

impl<T: Clone> PerCell<T> {
    /// Values as a list, `[N]`.
    pub fn into_vec(self) -> Vec<T> {
        match self {
            Self::Same(value, n) => vec![value; n],
            Self::Each(values) => values,
        }
    }
}

impl<T> Index<usize> for PerCell<T> {
    type Output = T;

    fn index(&self, cell: usize) -> &T {
        match self {
            Self::Same(value, _) => value,
            Self::Each(values) => &values[cell],
        }
    }
}

impl<T> FromIterator<T> for PerCell<T> {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
        Self::Each(values.into_iter().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: both variants represent the same list.
    #[test]
    fn one_value_stands_for_all() {
        let (same, each) = (PerCell::Same(2, 3), PerCell::Each(vec![2, 2, 2]));
        for values in [&same, &each] {
            assert_eq!((values.len(), values.first(), values[1]), (3, Some(&2), 2));
            assert_eq!(values.iter().copied().collect::<Vec<_>>(), [2, 2, 2]);
            assert_eq!(values.map(|v| 2 * v).into_vec(), [4, 4, 4]);
            let mut two = values.clone();
            two.keep(&[true, false, true]);
            assert_eq!(two.into_vec(), [2, 2]);
        }
        assert_eq!([same.distinct().len(), each.distinct().len()], [1, 3]);
        assert!(PerCell::Same(1, 0).first().is_none() && PerCell::Same(1, 0).distinct().is_empty());
    }
}
