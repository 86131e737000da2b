//! Maps between frame and faces, patch test, Schur complement against the assembled block system.

mod bricks;
mod maps;
