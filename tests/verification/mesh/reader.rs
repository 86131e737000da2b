//! The reader against hand-written files.
